"""How much the parts of a surface count: from a column of its file, or from a file of its own."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.core.validation import InputError, check_array
from focus_planner.io.files import check_ended, read_array, read_text

#: What the importance is called in files and messages; the first that is there counts.
IMPORTANCE_NAMES = ("importance", "weight")


def importance_column(names: Collection[str]) -> str | None:
    """Return which column of a file, or field of a message, is the importance, if any is."""
    return next((name for name in IMPORTANCE_NAMES if name in names), None)


def load_importance(path: Path, surface: Surface) -> FloatArray:
    """Read one number per vertex, or per point, of a surface.

    Parameters
    ----------
    path : Path
        An array in a ``.npy`` file; else a text, one number a line.
    surface : Mesh or PointCloud

    Returns
    -------
    (V,) or (M,) array

    Raises
    ------
    InputError
        If the file is missing, holds anything else, or more or fewer numbers.
    """
    if isinstance(surface, Mesh):
        count, what = len(surface.vertices), "vertex"
    else:
        count, what = len(surface.points), "point"
    expected = f"{count} numbers, one per {what}"
    if path.suffix.lower() == ".npy":
        values = check_array(str(path), read_array(path), (None,))
    else:
        values = _numbers(path, expected)
    if len(values) != count:
        raise InputError(str(path), expected, str(len(values)))
    return values


def _numbers(path: Path, expected: str) -> FloatArray:
    text = read_text(path, expected)
    check_ended(path, "text", text.encode())
    try:
        return np.array([float(word) for word in text.split()])
    except ValueError as error:
        raise InputError(str(path), expected, str(error)) from None


def with_importance(surface: Surface, importance: FloatArray) -> Surface:
    """Return the surface with this importance of its vertices or points.

    Raises
    ------
    InputError
        As :class:`~focus_planner.core.types.Mesh` and its like do.
    """
    if isinstance(surface, Mesh):
        return replace(surface, vertex_importance=importance)
    return replace(surface, importance=importance)
