# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Meshes and point clouds from ply files, ascii and binary.

The header says which elements follow, how many of each, and of which properties they consist. All
of them are read, also those that do not matter here: a file that was cut off shows anywhere.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from focus_planner.io.formats.colours import colours_among
from focus_planner.io.formats.contents import (
    SurfaceContents,
    bytes_after_end,
)
from focus_planner.io.formats.polygons import triangulate, triangulate_corners
from focus_planner.io.formats.tables import numbers_of_text
from focus_planner.io.formats.textures import (
    Wrapped,
    image_beside,
    looks_or_note,
    texture_of,
    texture_of_faces,
)

_KINDS = {
    "i1": ("char", "int8"),
    "u1": ("uchar", "uint8"),
    "i2": ("short", "int16"),
    "u2": ("ushort", "uint16"),
    "i4": ("int", "int32"),
    "u4": ("uint", "uint32"),
    "f4": ("float", "float32"),
    "f8": ("double", "float64"),
}
_TYPES = {name: kind for kind, names in _KINDS.items() for name in names}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_POINT = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
# One more element would take at least as much: a point of three short numbers.
_SMALLEST_RECORD = 6
_CORNERS = ("vertex_indices", "vertex_index")
_TEXTURE = "texcoord"  # u and v of every corner of a face
# The same of every vertex, as different programs call them.
_TEXTURE_OF_VERTEX = (
    ("s", "t"),
    ("u", "v"),
    ("texture_u", "texture_v"),
    ("texture_s", "texture_t"),
)
_IMAGE = "texturefile"
_FIRST_LINE = re.compile(rb"ply[ \t]*(\r\n|\n|\r)")


@dataclass(frozen=True)
class _Property:
    """A number of an element, or with ``count_kind`` a list of numbers, by NumPy's types."""

    name: str
    kind: str
    count_kind: str = ""


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True)
class _Header:
    order: str
    elements: tuple[_Element, ...]
    images: tuple[str, ...] = ()

    def count(self, name: str) -> int:
        return sum(each.count for each in self.elements if each.name == name)


#: An element's numbers by property. Of a list: how long it is in each row, and all items together.
_Columns = dict[str, NDArray[Any]]
_Lists = dict[str, tuple[NDArray[np.int64], NDArray[Any]]]


def read_ply(path: Path) -> SurfaceContents:
    """Read a ply file.

    Raises
    ------
    InputError
        If it is truncated, no ply file, or its faces are not polygons.
    """
    content = read_bytes(path, SURFACE)
    with refusing(path, "ply"):
        header, body = _header(without_byte_order_mark(content))
        columns, lists, rest = _body(header, body)
    if header.order:
        notes = bytes_after_end(path, "ply", rest, _SMALLEST_RECORD, "elements")
    else:
        notes = unfinished_line(path, body, DIGITS)
    vertices = columns["vertex"]
    points = np.stack([vertices.pop(name) for name in _POINT], axis=1)
    normals = None
    if vertices.keys() >= set(_NORMAL):
        normals = np.stack([vertices.pop(name) for name in _NORMAL], axis=1)
    triangles = _triangles(path, header, lists, points)
    colours = colours_among(_as_declared(header, "vertex", vertices))
    found = list(notes)
    texture = looks_or_note(
        path,
        "the texture",
        lambda: _texture(path, header, columns, lists, points, has_colours=colours is not None),
        found,
    )
    notes = tuple(found)
    return SurfaceContents(
        points, triangles, normals, vertices, notes=notes, colours=colours, texture=texture
    )


# --- textures ----------------------------------------------------------------------------------


def _texture(
    path: Path,
    header: _Header,
    columns: dict[str, _Columns],
    lists: dict[str, _Lists],
    points: NDArray[Any],
    *,
    has_colours: bool,
) -> Texture | None:
    """Return the texture; or the colours of faces as one, if the vertices have none."""
    if not header.count("face"):
        return None
    lengths, corners = next(lists["face"][name] for name in _CORNERS if name in lists["face"])
    corners, filled = corners.astype(np.int64), np.flatnonzero(lengths)
    faces = _as_declared(header, "face", columns["face"])
    coordinates = of_faces = None
    if header.images:
        coordinates = _coordinates(columns["vertex"], lists["face"], corners)
    elif not has_colours:
        of_faces = colours_among(faces)
    if coordinates is None and of_faces is None:
        return None
    if corners.min(initial=0) < 0 or corners.max(initial=-1) >= len(points):
        return None  # which is refused as a mesh
    places, polygons = triangulate_corners(points, corners, lengths[filled])
    polygons = filled[polygons]
    if of_faces is not None:
        return texture_of_faces(of_faces[polygons])
    assert coordinates is not None
    images = [image_beside(path, name, len(header.images)) for name in header.images]
    which = np.zeros(len(places), dtype=np.int64)
    if "texnumber" in faces and len(images) > 1:
        which = np.clip(faces["texnumber"][polygons].astype(np.int64), 0, len(images) - 1)
    plain = np.zeros((len(places), 3), dtype=np.uint8)
    return texture_of(images, Wrapped(which, coordinates[places], plain))


def _as_declared(header: _Header, name: str, columns: _Columns) -> _Columns:
    """Return an element's columns of whole numbers as such, where text made doubles of them."""
    kinds = {
        each.name: each.kind
        for element in header.elements
        if element.name == name
        for each in element.properties
    }
    return {
        each: values.astype(kinds[each])
        if kinds[each] in ("u1", "u2") and values.dtype.kind == "f"
        else values
        for each, values in columns.items()
    }


def _coordinates(
    vertices: _Columns, faces: _Lists, corners: NDArray[np.int64]
) -> NDArray[Any] | None:
    """Return (c, 2) the place in the texture of every corner; None if the file does not tell."""
    if _TEXTURE in faces:
        _, values = faces[_TEXTURE]
        if len(values) != 2 * len(corners):
            raise BrokenFileError(f"{len(values)} numbers of {_TEXTURE} for {len(corners)} corners")
        return values.reshape(-1, 2)
    for names in _TEXTURE_OF_VERTEX:
        if vertices.keys() >= set(names):
            return np.stack([vertices[name] for name in names], axis=1)[corners]
    return None


# --- triangles ---------------------------------------------------------------------------------


def _triangles(
    path: Path, header: _Header, lists: dict[str, _Lists], points: NDArray[Any]
) -> NDArray[np.int64] | None:
    """Return the triangles of the faces; None for a cloud, which many write with no face."""
    if header.count("tristrips"):
        raise InputError(str(path), "triangles or points", "triangle strips", "convert the file")
    if not header.count("face"):
        return None
    found = next((lists["face"][name] for name in _CORNERS if name in lists["face"]), None)
    if found is None:
        raise InputError(
            str(path), "faces with a list vertex_indices", ", ".join(lists["face"]) or "no list"
        )
    counts, corners = found
    whole = corners.astype(np.int64)
    if corners.dtype.kind == "f" and not np.array_equal(whole, corners):
        raise unreadable(path, "ply", "faces with corners that are no whole numbers")
    filled = counts > 0
    return triangulate(points, whole, counts[filled])


# --- the header --------------------------------------------------------------------------------


def _header(content: bytes) -> tuple[_Header, bytes]:
    """Return the header and what follows it; raise BrokenFileError if it is none."""
    first = _FIRST_LINE.match(content)
    end = content.find(first[1] + b"end_header") if first else -1
    last = re.compile(rb"\s*end_header[ \t]*" + (first[1] if first else b"")).match(content, end)
    if first is None or end < 0 or last is None:
        raise BrokenFileError("no complete header")
    order, elements = "?", list[tuple[str, int, list[_Property]]]()
    images = list[str]()
    for line in content[first.end() : end].decode("utf-8", "replace").splitlines():
        match line.split():
            case ["comment", word, _, *_] if word.lower() == _IMAGE:
                images.append(line.split(None, 2)[2])
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, _] if name in _ORDERS:
                order = _ORDERS[name]
            case ["element", name, count] if count.isdecimal():
                elements.append((name, int(count), []))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1][2].append(_Property(name, _TYPES[kind]))
            case ["property", "list", count, kind, name] if (
                elements and kind in _TYPES and _TYPES.get(count, "f")[0] != "f"
            ):
                elements[-1][2].append(_Property(name, _TYPES[kind], _TYPES[count]))
            case _:
                raise BrokenFileError(f"a header with the line {line.strip()!r}")
    layouts = tuple(_Element(name, n, tuple(p)) for name, n, p in elements)
    header = _Header(order, layouts, tuple(images))
    _check_names(header)
    return header, content[last.end() :]


def _check_names(header: _Header) -> None:
    if header.order == "?":
        raise BrokenFileError("a header without a format")
    for names in [
        [element.name for element in header.elements],
        *([each.name for each in element.properties] for element in header.elements),
    ]:
        if len(set(names)) < len(names):
            raise BrokenFileError(f"a header with one name twice among {', '.join(names)}")
    vertex = [each.properties for each in header.elements if each.name == "vertex"]
    if not vertex or not {each.name for each in vertex[0] if not each.count_kind} >= set(_POINT):
        raise BrokenFileError("a header without x, y and z of vertices")


# --- the body ----------------------------------------------------------------------------------


def _body(header: _Header, body: bytes) -> tuple[dict[str, _Columns], dict[str, _Lists], bytes]:
    """Return every element's columns and lists, and what follows the last.

    Text becomes records of doubles, so that both are read by one way.
    """
    order = header.order or "="
    data = body if header.order else numbers_of_text(body).tobytes()
    columns, lists, at = {}, {}, 0
    for element in header.elements:
        layout = element if header.order else _of_doubles(element)
        columns[element.name], lists[element.name], at = _element(layout, order, data, at)
    if not header.order and at < len(data):
        raise BrokenFileError(f"{(len(data) - at) // 8} numbers more than announced")
    return columns, lists, data[at:]


def _of_doubles(element: _Element) -> _Element:
    properties = (_Property(p.name, "f8", p.count_kind and "f8") for p in element.properties)
    return _Element(element.name, element.count, tuple(properties))


def _element(element: _Element, order: str, data: bytes, at: int) -> tuple[_Columns, _Lists, int]:
    """Return an element's columns and lists, and where it ends."""
    found = _rows_like_first(element, order, data, at)
    return found or _rows_of_any_length(element, order, data, at)


def _rows_like_first(
    element: _Element, order: str, data: bytes, at: int
) -> tuple[_Columns, _Lists, int] | None:
    """Return what :func:`_element` does if all lists are as long as in the first row, else None.

    Nearly all meshes are of triangles only, and NumPy reads them at once.
    """
    lengths: dict[str, int] = {}
    fields: list[tuple[Any, ...]] = []
    offset = at
    for each in element.properties:
        if each.count_kind:
            count = np.dtype(order + each.count_kind)
            if element.count == 0 or offset + count.itemsize > len(data):
                lengths[each.name] = 0
            else:
                lengths[each.name] = _counts_in(data, count)(offset)
            if lengths[each.name] > len(data):
                raise BrokenFileError(_too_few(element, 0))
            fields.append((f"{each.name} count", count))
            fields.append((each.name, order + each.kind, (lengths[each.name],)))
        else:
            fields.append((each.name, order + each.kind))
        offset = at + np.dtype(fields).itemsize
    size = np.dtype(fields).itemsize
    if size == 0:
        raise BrokenFileError(f"an element {element.name} without properties")
    if len(data) - at < size * element.count:
        if lengths:
            return None
        raise BrokenFileError(_too_few(element, (len(data) - at) // size))
    rows = np.frombuffer(data, np.dtype(fields), element.count, at)
    if any((rows[f"{name} count"] != length).any() for name, length in lengths.items()):
        return None
    columns = {each.name: rows[each.name] for each in element.properties if not each.count_kind}
    lists = {
        name: (np.full(element.count, length, dtype=np.int64), rows[name].reshape(-1))
        for name, length in lengths.items()
    }
    return columns, lists, at + size * element.count


def _too_few(element: _Element, count: int) -> str:
    return f"{count} rows of {element.name} of the {element.count} announced"


def _rows_of_any_length(
    element: _Element, order: str, data: bytes, at: int
) -> tuple[_Columns, _Lists, int]:
    """Return what :func:`_element` does, row by row as far as must be; of lists what matters."""
    anchors, counts, end = _walk(element, order, data, at)
    columns, lists = dict[str, NDArray[Any]](), _Lists()
    anchor, gap = 0, 0
    for each in element.properties:
        kind = np.dtype(order + each.kind)
        if each.count_kind:
            lengths = counts[:, anchor]
            anchor, gap = anchor + 1, 0
            firsts = anchors[:, anchor] - lengths * kind.itemsize
            if each.name in (*_CORNERS, _TEXTURE):
                within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
                places = np.repeat(firsts, lengths) + within * kind.itemsize
                lists[each.name] = lengths, _numbers_at(data, places, kind)
        else:
            columns[each.name] = _numbers_at(data, anchors[:, anchor] + gap, kind)
            gap += kind.itemsize
    return columns, lists, end


def _numbers_at(data: bytes, places: NDArray[np.int64], kind: np.dtype[Any]) -> NDArray[Any]:
    each = np.frombuffer(data, np.uint8)[places[:, None] + np.arange(kind.itemsize)]
    return np.ascontiguousarray(each).view(kind)[:, 0]


def _walk(
    element: _Element, order: str, data: bytes, at: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Find the places of an element's rows, which differ in length.

    Returns
    -------
    anchors : (n, 1 + lists) array
        Where each row starts, and where each of its lists ends.
    counts : (n, lists) array
    end : int
    """
    steps, gap = list[tuple[int, Callable[[int], int], int, int]](), 0
    for each in element.properties:
        if each.count_kind:
            kind, item = np.dtype(order + each.count_kind), np.dtype(each.kind).itemsize
            steps.append((gap, _counts_in(data, kind), kind.itemsize, item))
            gap = 0
        else:
            gap += np.dtype(each.kind).itemsize
    anchors = list[int]()
    append = anchors.append
    try:
        for _ in range(element.count):
            append(at)
            for skipped, count_at, size, item in steps:
                at += skipped
                at += size + count_at(at) * item
                append(at)
            at += gap
    except (struct.error, IndexError):  # past the end
        at = len(data) + 1
    if at > len(data):
        complete = max(len(anchors) // (len(steps) + 1) - 1, 0)
        raise BrokenFileError(_too_few(element, complete))
    table = np.array(anchors, dtype=np.int64).reshape(-1, len(steps) + 1)
    heads = np.array([skipped + size for skipped, _, size, _ in steps])
    items = np.array([item for _, _, _, item in steps])
    counts = (np.diff(table, axis=1) - heads) // items
    return table, counts, at


def _counts_in(data: bytes, kind: np.dtype[Any]) -> Callable[[int], int]:
    """Return a function from a place to the count there."""
    if kind.itemsize == 1 and kind.kind == "u":
        return data.__getitem__
    read = struct.Struct(("<" if kind.str[0] in "<|" else ">") + kind.char).unpack_from

    def count_at(at: int) -> int:
        (count,) = read(data, at)
        if not count == count // 1 >= 0:  # in text they are read as doubles
            raise BrokenFileError(f"a list of {count:g} items")
        return int(count)

    return count_at
