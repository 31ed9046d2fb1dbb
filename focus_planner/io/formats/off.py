# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Meshes from off files: their counts, then a line for every vertex and every polygon."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.appearance import Texture
from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    DIGITS,
    SURFACE,
    BrokenFileError,
    read_bytes,
    refusing,
    unfinished_line,
    unreadable,
    without_byte_order_mark,
)
from focus_planner.io.formats.colours import guessed_colours
from focus_planner.io.formats.contents import (
    SurfaceContents,
    check_announced,
)
from focus_planner.io.formats.polygons import triangulate, triangulate_corners
from focus_planner.io.formats.tables import columns_of_lines
from focus_planner.io.formats.textures import looks_or_note, texture_of_faces
from focus_planner.io.quoting import word as quoted

_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")
_NO_COLOUR = 170  # the format's own default is grey
_COMMENT = re.compile(r"#[^\n]*")
# Texture coordinates, colours and normals of vertices; four coordinates, or n of them.
_KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF\b")


def read_off(path: Path) -> SurfaceContents:
    """Read an off file.

    Raises
    ------
    InputError
        If it is truncated, no off file, or of another kind than polygons in space.
    """
    with refusing(path, "off"):
        return _read(path, without_byte_order_mark(read_bytes(path, SURFACE)))


def _read(path: Path, content: bytes) -> SurfaceContents:
    text = _COMMENT.sub("", content.decode("utf-8", "replace")).strip()
    keyword = _KEYWORD.match(text)
    if keyword is None:
        raise unreadable(path, "off", "no OFF at its beginning")
    lines = [line for line in text[keyword.end() :].splitlines() if line.strip()]
    if keyword[4] or keyword[5] or (lines and lines[0].split()[0] == "BINARY"):
        raise InputError(
            str(path), "text with three coordinates per vertex", f"{text[:20]!r}", "convert it"
        )
    try:
        vertices, faces, *_ = (int(count) for count in lines[0].split())
    except (IndexError, ValueError):
        raise unreadable(path, "off", "no counts of vertices and faces") from None
    check_announced(path, "off", "lines", len(lines) - 1, vertices + faces)
    first = 6 if keyword[3] else 3
    rows = lines[1 : vertices + 1]
    table = columns_of_lines(rows, range(first)) if vertices else np.empty((0, 3))
    corners, counts, after = _polygons(lines[vertices + 1 :])
    points = table[:, :3]
    notes = list(unfinished_line(path, content, DIGITS))
    colours = texture = None
    if keyword[2] and vertices:
        colours = looks_or_note(
            path,
            "the colours",
            lambda: guessed_colours(columns_of_lines(rows, range(first, first + 3))),
            notes,
        )
    elif after:
        texture = looks_or_note(
            path, "the colours", lambda: _texture(points, corners, counts, after), notes
        )
    return SurfaceContents(
        points,
        triangulate(points, corners, counts),
        table[:, 3:6] if keyword[3] else None,
        notes=tuple(notes),
        colours=colours,
        texture=texture,
    )


def _texture(
    points: FloatArray,
    corners: NDArray[np.int64],
    counts: NDArray[np.int64],
    after: dict[int, list[str]],
) -> Texture | None:
    """Return the colours of polygons, red, green, blue and maybe alpha; None if there are none.

    A single number would be one of a list of colours, which is elsewhere.
    """
    colours = {row: words[:3] for row, words in after.items() if len(words) in (3, 4)}
    if not colours:
        return None
    of_polygons = np.full((len(counts), 3), _NO_COLOUR, dtype=np.uint8)
    of_polygons[list(colours)] = guessed_colours(np.array([*colours.values()], dtype=np.float64))
    return texture_of_faces(of_polygons[triangulate_corners(points, corners, counts)[1]])


def _polygons(
    lines: list[str],
) -> tuple[NDArray[np.int64], NDArray[np.int64], dict[int, list[str]]]:
    """Return the corners of all polygons, how many each has, and what follows those of some."""
    corners, counts = list[int](), list[int]()
    after = dict[int, list[str]]()
    for line in lines:
        count, *words = line.split()
        counts.append(_whole(count))
        if not 0 < counts[-1] <= len(words):
            raise BrokenFileError(f"{len(words)} corners of the {count} announced")
        corners += map(_whole, words[: counts[-1]])
        if len(words) > counts[-1]:
            after[len(counts) - 1] = words[counts[-1] :]
    return np.array(corners, dtype=np.int64), np.array(counts, dtype=np.int64), after


def _whole(text: str) -> int:
    if not _WHOLE.fullmatch(text):
        raise BrokenFileError(f"{quoted(text)} in place of a whole number")
    return int(text)
