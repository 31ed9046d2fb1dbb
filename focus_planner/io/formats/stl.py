# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Meshes from stl files, binary and ascii: triangles, each with corners of its own."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.io.files import (
    SURFACE,
    BrokenFileError,
    read_bytes,
    refusing,
    unreadable,
    without_byte_order_mark,
)
from focus_planner.io.formats.contents import (
    SurfaceContents,
    bytes_after_end,
    check_announced,
)
from focus_planner.io.formats.tables import numbers_of_text

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 80
_COUNT = 4
_KEYWORD = re.compile(rb"(?mi)^[ \t]*(solid|facet|vertex|endfacet|endsolid)\b([^\n]*)")
_FACET = [b"facet", b"vertex", b"vertex", b"vertex", b"endfacet"]


def read_stl(path: Path) -> SurfaceContents:
    """Read an stl file, all of its solids.

    Raises
    ------
    InputError
        If it is truncated, no stl file, or has no triangle.
    """
    content = read_bytes(path, SURFACE)
    notes: tuple[Note, ...] = ()
    if _is_text(content):
        with refusing(path, "stl"):
            corners = _ascii(without_byte_order_mark(content))
    else:
        corners, rest = _binary(path, content)
        notes = bytes_after_end(path, "stl", rest, _TRIANGLE.itemsize, "triangles")
    if not len(corners):
        raise unreadable(path, "stl", "no triangle")
    points = corners.reshape(-1, 3)
    return SurfaceContents(points, np.arange(len(points)).reshape(-1, 3), notes=notes)


def _is_text(content: bytes) -> bool:
    """Return whether a file is ascii; many that begin with ``solid`` are binary."""
    if without_byte_order_mark(content).lstrip()[:5].lower() != b"solid":
        return False
    announced = int.from_bytes(content[_HEADER : _HEADER + _COUNT], "little")
    exact = len(content) == _HEADER + _COUNT + announced * _TRIANGLE.itemsize
    return not exact and b"\0" not in content[:512]


def _binary(path: Path, content: bytes) -> tuple[NDArray[Any], bytes]:
    start = _HEADER + _COUNT
    if len(content) < start:
        raise unreadable(path, "stl", f"{len(content)} bytes")
    announced = int.from_bytes(content[_HEADER:start], "little")
    there = min((len(content) - start) // _TRIANGLE.itemsize, announced)
    check_announced(path, "stl", "triangles", there, announced)
    triangles = np.frombuffer(content, _TRIANGLE, announced, start)
    return triangles["corners"], content[start + triangles.nbytes :]


def _ascii(content: bytes) -> NDArray[Any]:
    """Return the (T, 3, 3) corners; raise BrokenFileError if a facet or a solid does not end."""
    text = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    found = _KEYWORD.findall(text)
    keywords = [keyword.lower() for keyword, _ in found]
    solids, ends = keywords.count(b"solid"), keywords.count(b"endsolid")
    if solids != ends:
        raise BrokenFileError(f"{ends} ends of {solids} solids")
    facets = [keyword for keyword in keywords if keyword not in {b"solid", b"endsolid"}]
    count = keywords.count(b"facet")
    if facets != _FACET * count:
        raise BrokenFileError(f"{count} facets that are not all of three vertices")
    numbers = numbers_of_text(
        b"\n".join(rest for (keyword, rest) in found if keyword.lower() == b"vertex")
    )
    if len(numbers) != 9 * count:
        raise BrokenFileError(f"{len(numbers)} coordinates of the {9 * count} of {count} facets")
    return numbers.reshape(-1, 3, 3)
