"""The importance of a surface's parts: from a column of its own file, or from a separate file."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.core.validation import InputError, check_array
from focus_planner.io.files import check_final_newline, read_array, read_text

#: Names of the importance in files and messages, in order of precedence.
IMPORTANCE_NAMES = ("importance", "weight")


def importance_column(names: Collection[str]) -> str | None:
    """Return the name of the column or message field that holds the importance, if there is one."""
    return next((name for name in IMPORTANCE_NAMES if name in names), None)


def load_importance(path: Path, surface: Surface) -> FloatArray:
    """Read one number per vertex or point of a surface.

    Parameters
    ----------
    path : Path
        A ``.npy`` file with one array, or a text file with one number per line.
    surface : Mesh or PointCloud

    Returns
    -------
    (V,) or (M,) array

    Raises
    ------
    InputError
        If the file is missing, or contains anything but one number per vertex or point.
    """
    if isinstance(surface, Mesh):
        count, what = len(surface.vertices), "vertex"
    else:
        count, what = len(surface.points), "point"
    expected = f"{count} numbers, one per {what}"
    if path.suffix.lower() == ".npy":
        values = check_array(str(path), read_array(path), (None,))
    else:
        values = _read_numbers(path, expected)
    if len(values) != count:
        raise InputError(str(path), expected, str(len(values)))
    return values


def _read_numbers(path: Path, expected: str) -> FloatArray:
    text = read_text(path, expected)
    check_final_newline(path, "text", text.encode())
    try:
        return np.array([float(word) for word in text.split()])
    except ValueError as error:
        raise InputError(str(path), expected, str(error)) from None


def with_importance(surface: Surface, importance: FloatArray) -> Surface:
    """Return the surface with this importance for its vertices or points.

    Raises
    ------
    InputError
        As :class:`~focus_planner.core.surface.surface.Mesh` and ``PointCloud`` do.
    """
    if isinstance(surface, Mesh):
        return replace(surface, vertex_importance=importance)
    return replace(surface, importance=importance)
