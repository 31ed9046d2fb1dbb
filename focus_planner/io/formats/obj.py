# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Meshes from obj files: their polygons; lines and points do not matter here.

A face names its corners by their numbers, counted from 1, or back from the last vertex so far.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    SURFACE,
    THE_REST,
    BrokenFileError,
    read_bytes,
    refusing,
    unfinished_line,
    without_byte_order_mark,
)
from focus_planner.io.formats.colours import guessed_colours
from focus_planner.io.formats.contents import (
    SurfaceContents,
)
from focus_planner.io.formats.obj_materials import FACE, read_texture, statement
from focus_planner.io.formats.polygons import triangulate
from focus_planner.io.formats.tables import columns_of_lines, numbers_of_text, words_per_line

_VERTEX, _NORMAL = statement(b"v"), statement(b"vn")
_KEYWORD = re.compile(rb"(?m)^[ \t]*(vn?|fo?)(?:[ \t]|$)")
# Surface that is not made of polygons, or is in another file.
_ELSEWHERE = re.compile(rb"(?m)^[ \t]*(surf|call)\b")
_NOT_READ = {b"surf": "free-form surfaces", b"call": "a call of another file"}
_CONTINUED = re.compile(rb"\\[ \t]*\n")
# A name that ends in a backslash, such as a folder of Windows, above a whole statement. A line of
# numbers, or of what has numbers, is continued there.
_NAME_ABOVE_STATEMENT = re.compile(
    rb"(?m)^([ \t]*(?!(?:v|vn|vt|vp|f|fo|l|p)[ \t]|[-+.\d])[^\s][^\n]*)\\[ \t]*\n"
    rb"(?=[ \t]*(?:vn?(?:[ \t]+[-+]?\.?\d[^\s\\]*){3}|fo?(?:[ \t]+-?\d[-\d/]*){3})(?:\s|\Z))"
)
_COMMENT = re.compile(rb"#[^\n]*")
# Comments that count all of a file, as MeshLab and ZBrush write above it, or an object that ends
# there, as MeshLab and 3ds Max write below it.
_COUNTED = tuple(
    (what, re.compile(rb"(?mi)^[ \t]*#[ \t]*" + phrase + rb"[ \t]*$"))
    for what, phrase in (
        ("vertices", rb"(?:vertices:|vertex count)[ \t]*(\d+)"),
        ("vertices", rb"(\d+) vertices(?:, *\d+ vertices normals)?"),
        ("faces", rb"(?:faces:|face count)[ \t]*(\d+)"),
        ("faces", rb"(\d+) faces(?:, *\d+ coords texture)?"),
    )
)
_AFTER_VERTEX = re.compile(rb"/[^\s]*")
_WITH_NORMAL = re.compile(rb"/[^\s/]*/[^\s/]")
_BEFORE_NORMAL = re.compile(rb"[^\s/]+/[^\s/]*/")


class _Statements(NamedTuple):
    """What follows the keywords, and the keywords in their order."""

    vertices: list[bytes]
    normals: list[bytes]
    faces: list[bytes]
    keywords: list[bytes]
    text: bytes


def read_obj(path: Path) -> SurfaceContents:
    """Read an obj file. A vertex that has several normals becomes several vertices.

    Raises
    ------
    InputError
        If it is truncated, no obj file, has no faces, or has surface that is not polygons.
    """
    with refusing(path, "obj"):
        content = without_byte_order_mark(read_bytes(path, SURFACE))
        finished = content.endswith((b"\n", b"\r"))
        statements = _statements(path, content)
        counts = _corner_counts(statements, finished)
        vertices = _vectors(statements.vertices)
        points, vectors = np.ascontiguousarray(vertices[:, :3]), _vectors(statements.normals)[:, :3]
        corners, of_normals = _corners(statements, counts)
    most = int(np.maximum(counts - 2, 1).sum())  # some count the triangles of polygons
    found = [
        *unfinished_line(path, content, THE_REST),
        *_compared(path, content, {"vertices": (len(points),) * 2, "faces": (len(counts), most)}),
    ]
    colours = guessed_colours(vertices[:, 3:6]) if vertices.shape[1] >= 6 else None
    texture = read_texture(path, statements.text, statements.faces, points, corners, counts, found)
    notes = tuple(found)
    if not (of_normals >= 0).any():
        triangles = triangulate(points, corners, counts)
        return SurfaceContents(points, triangles, notes=notes, colours=colours, texture=texture)
    numbering, corners, normals = _with_normals(corners, of_normals, vectors)
    return SurfaceContents(
        points[numbering],
        triangulate(points[numbering], corners, counts),
        normals,
        numbering=numbering,
        numbered=len(points),
        notes=notes,
        colours=None if colours is None else colours[numbering],
        texture=texture,
    )


def _compared(path: Path, content: bytes, came: Mapping[str, tuple[int, int]]) -> tuple[Note, ...]:
    """Compare what comments count with what came, from so many to so many by the way of counting.

    Returns
    -------
    tuple of Note
        If more came than the comments count: the last may be missing.

    Raises
    ------
    InputError
        If less came.
    """
    if b"#" not in content:
        return ()
    text = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    notes = {}
    for what, phrase in _COUNTED:
        found = [int(number[:18]) for number in phrase.findall(text)]
        fewest, most = came[what]
        if sum(found) > most:
            raise InputError(
                str(path),
                f"the {sum(found)} {what} that its comments count",
                f"{fewest}",
                "it is probably truncated; if it is whole, delete those comments",
            )
        if found and sum(found) < fewest:
            notes[what] = Note(
                "left_out",
                f"{path}: {fewest} {what} came, where its comments count {sum(found)}: if it was"
                " cut off, the rest is missing; if it is whole, delete those comments",
            )
    return tuple(notes.values())


def _statements(path: Path, content: bytes) -> _Statements:
    text = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"#" in text:
        text = _COMMENT.sub(b"", text)
    if b"\\" in text:
        text = _NAME_ABOVE_STATEMENT.sub(rb"\1\n", text)
        text = _CONTINUED.sub(b" ", text)
    elsewhere = _ELSEWHERE.search(text)
    if elsewhere:
        raise InputError(
            str(path), "a mesh of polygons", _NOT_READ[elsewhere[1]], "convert it to polygons first"
        )
    faces = FACE.findall(text)
    counted_back = b"-" in b" ".join(faces)
    keywords = _KEYWORD.findall(text) if counted_back else []
    return _Statements(_VERTEX.findall(text), _NORMAL.findall(text), faces, keywords, text)


def _vectors(lines: Sequence[bytes]) -> FloatArray:
    """Return the numbers of every line, of which colours may follow the first three.

    If not all lines have as many, only the first three.
    """
    text = b"\n".join(lines)
    counts = words_per_line(text)
    if len(counts) < len(lines) or counts.min(initial=3) < 3:
        raise BrokenFileError("a vertex of less than three numbers")
    if len(counts) and (counts == counts[0]).all():
        return numbers_of_text(text).reshape(len(lines), -1)
    return columns_of_lines(text.decode("utf-8", "replace").split("\n"), (0, 1, 2))


def _corner_counts(statements: _Statements, finished: bool) -> NDArray[np.int64]:
    """Return how many corners each face has."""
    if not statements.faces:
        raise BrokenFileError("no triangle")
    counts = words_per_line(b"\n".join(statements.faces))
    if len(counts) < len(statements.faces) or counts.min() < 1:
        raise BrokenFileError("a face without corners")
    if counts[-1] < 3 and not finished:
        raise BrokenFileError("a last face of less than three corners")
    return counts


def _corners(
    statements: _Statements, counts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices and the normals of all corners, counted from 0; no normal is -1."""
    text = b"\n".join(statements.faces)
    total = int(counts.sum())
    before = np.repeat(_count_before(statements, b"v"), counts)
    corners = _numbers(_AFTER_VERTEX.sub(b"", text) if b"/" in text else text, total)
    if (corners == 0).any():
        raise BrokenFileError("a corner 0, where vertices are counted from 1")
    corners = np.where(corners > 0, corners - 1, before + corners)
    beyond = np.flatnonzero((corners < 0) | (corners >= len(statements.vertices)))
    if len(beyond):
        wrong = corners[beyond[0]] + 1
        raise BrokenFileError(f"a corner at vertex {wrong} of {len(statements.vertices)}")
    with_normals = len(_WITH_NORMAL.findall(text)) if b"/" in text else 0
    if with_normals == 0:
        return corners, np.full(total, -1)
    if with_normals < total:
        words = (word.split(b"/") for word in text.split())
        text = b" ".join(word[2] or b"0" if len(word) == 3 else b"0" for word in words)
    normals = _numbers(_BEFORE_NORMAL.sub(b"", text), total)
    before = np.repeat(_count_before(statements, b"vn"), counts)
    counted_back = np.where(normals < 0, before + normals, -1)
    return corners, np.where(normals > 0, normals - 1, counted_back)


def _count_before(statements: _Statements, keyword: bytes) -> NDArray[np.int64]:
    """Return how many vertices or normals are above each face; 0 where no face counts back."""
    if not statements.keywords:
        return np.zeros(len(statements.faces), dtype=np.int64)
    words = np.array(statements.keywords)
    return np.cumsum(words == keyword)[np.char.startswith(words, b"f")]


def _numbers(text: bytes, count: int) -> NDArray[np.int64]:
    values = numbers_of_text(text)
    whole = values.astype(np.int64)
    if len(values) != count or not np.array_equal(whole, values):
        raise BrokenFileError("corners of faces that are no whole numbers")
    return whole


def _with_normals(
    corners: NDArray[np.int64], of_normals: NDArray[np.int64], vectors: FloatArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
    """Give every pair of a vertex and a normal a vertex of its own.

    Returns
    -------
    numbering : (n,) array of int
        The vertex of each pair.
    corners : (c,) array of int
        The pair of each corner.
    normals : (n, 3) array
        NaN where the file does not have the normal that it names.
    """
    vectors = np.concatenate([vectors, np.full((1, 3), np.nan)])
    known = (of_normals >= 0) & (of_normals < len(vectors) - 1)
    of_normals = np.where(known, of_normals, len(vectors) - 1)
    pairs, of_corners = np.unique(corners * len(vectors) + of_normals, return_inverse=True)
    return pairs // len(vectors), of_corners.ravel(), vectors[pairs % len(vectors)]
