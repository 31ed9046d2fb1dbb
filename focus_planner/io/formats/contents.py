# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a surface file holds, as it holds it; and what a reader may say about the file."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours, Texture
from focus_planner.core.validation import InputError
from focus_planner.io.files import unreadable


@dataclass(frozen=True, eq=False)
class SurfaceContents:
    """The arrays of a surface file, whole but not yet checked as a surface.

    Attributes
    ----------
    points : (N, 3) array
        Vertices of a mesh, or points of a cloud, metres.
    triangles : (T, 3) array of int, optional
        None for a cloud.
    normals : (N, 3) array, optional
        Outward; zero or NaN where there is none.
    numbers : mapping of str to (N,) arrays
        What else the file says of every vertex or point, by its name there.
    numbering : (N,) array of int, optional
        The file's own number of every vertex, counted from 0, if it is another than here.
    numbered : int, optional
        How many vertices the file has, where ``numbering`` is given.
    notes : tuple of Note
    colours : (N, 3) array of uint8, optional
        Of every vertex or point, as sRGB.
    texture : Texture, optional
        Its coordinates are those of ``triangles``.
    """

    points: NDArray[Any]
    triangles: NDArray[Any] | None = None
    normals: NDArray[Any] | None = None
    numbers: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    numbering: NDArray[np.int64] | None = None
    numbered: int | None = None
    notes: tuple[Note, ...] = ()
    colours: Colours | None = None
    texture: Texture | None = None

    @property
    def vertices_in_file(self) -> int:
        """How many vertices or points the file has."""
        return len(self.points) if self.numbered is None else self.numbered


def bytes_after_end(path: Path, kind: str, rest: bytes, record: int, what: str) -> tuple[Note, ...]:
    """Return a note about bytes after the last that a binary file announces.

    Parameters
    ----------
    path : Path
    kind : str
    rest : bytes
    record : int
        Bytes that one more ``what`` would take.
    what : str
        Of what the file announces a number: "triangles".

    Raises
    ------
    InputError
        If there is room for more surface than the file announces.
    """
    if not rest:
        return ()
    if len(rest) >= record and rest.strip(b"\0\r\n\t \x1a"):
        raise InputError(
            str(path),
            f"a complete {kind} file",
            f"one with {len(rest):,} bytes after the last of the {what} that it announces",
            f"its number of {what} is probably wrong, or two files were joined: save it again",
        )
    text = f"left out: {len(rest):,} bytes after the last of the {what} in {path}"
    return (Note("left_out", f"{text}; all that it announces was read"),)


def optional_library(path: Path, kind: str, *modules: str) -> Any:
    """Return the first of some modules of the extra ``formats``, called as their packages are.

    Raises
    ------
    InputError
        Names what to install.
    """
    try:
        first, *_ = [importlib.import_module(module) for module in modules]
    except ImportError as error:
        raise InputError(
            str(path),
            f"the Python package that reads {kind}",
            f"no module {error.name}",
            f"install it with: pip install {' '.join(modules)}",
        ) from None
    return first


def check_announced(path: Path, kind: str, what: str, count: int, wanted: int) -> None:
    """Raise unless as many of something came as the file announces.

    Raises
    ------
    InputError
        Tells both numbers.
    """
    if count != wanted:
        raise unreadable(path, kind, f"{count} {what} of the {wanted} announced")
