# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Point clouds from pcd files, ascii, binary and compressed."""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Callable
from itertools import accumulate
from operator import mul
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours
from focus_planner.io.files import (
    DIGITS,
    SURFACE,
    BrokenFileError,
    read_bytes,
    refusing,
    unfinished_line,
    without_byte_order_mark,
)
from focus_planner.io.formats.colours import colours_among, unpacked_colours
from focus_planner.io.formats.contents import (
    SurfaceContents,
    bytes_after_end,
)
from focus_planner.io.formats.tables import columns_of_lines, numbers_of_text, words_per_line

_WHOLE = re.compile(r"[0-9]{1,12}")
_KINDS = {"F": "f", "I": "i", "U": "u"}
_POINT = ("x", "y", "z")
_NORMAL = ("normal_x", "normal_y", "normal_z")
_NO_VIEWPOINT = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]  # a place, and a quaternion w, x, y, z


class _Field(NamedTuple):
    """Where a file stores a field: its column in text, its place in a binary record."""

    column: int
    offset: int
    kind: np.dtype[Any]
    stride: int
    single: bool


def read_pcd(path: Path) -> SurfaceContents:
    """Read a pcd file.

    Raises
    ------
    InputError
        If it is truncated, or no pcd file.
    """
    content = read_bytes(path, SURFACE)
    with refusing(path, "pcd"):
        stream = io.BytesIO(without_byte_order_mark(content))
        header = _header(stream)
        fields, form, count = _fields(header), _words(header, "DATA")[0], _count(header)
        if form not in _READERS or not fields.keys() >= set(_POINT):
            raise _UnusableError("DATA" if form not in _READERS else "x, y and z among its FIELDS")
        wanted = [name for name, field in fields.items() if field.single or name in _POINT]
        try:
            columns, rest = _READERS[form](stream.read(), [fields[n] for n in wanted], count)
        except BrokenFileError as error:
            raise BrokenFileError(f"{count} points announced, and {error}") from None
    numbers = dict(zip(wanted, columns, strict=True))
    points = np.stack([numbers.pop(name) for name in _POINT], axis=1)
    normals = None
    if numbers.keys() >= set(_NORMAL):
        normals = np.stack([numbers.pop(name) for name in _NORMAL], axis=1)
    if form == "ascii":
        notes = unfinished_line(path, content, DIGITS)
    else:
        notes = bytes_after_end(path, "pcd", rest, fields["x"].stride, "points")
    notes += _viewpoint(path, header.get("VIEWPOINT", []))
    colours = _colours(numbers, fields)
    return SurfaceContents(points, None, normals, numbers, notes=notes, colours=colours)


def _colours(numbers: dict[str, NDArray[Any]], fields: dict[str, _Field]) -> Colours | None:
    """Return the points' colours: of three fields, or packed in the bits of one, as PCL does."""
    name = next((name for name in ("rgb", "rgba") if name in numbers), None)
    if name is None:
        return colours_among(numbers)
    if fields[name].kind.itemsize != 4:
        return None
    # Text has the same numbers, as doubles.
    values = np.nan_to_num(numbers[name], nan=0.0, posinf=0.0, neginf=0.0)
    if fields[name].kind.kind == "f":
        return unpacked_colours(values.astype(np.float32).view(np.uint32))
    return unpacked_colours((values.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32))


def _viewpoint(path: Path, words: list[str]) -> tuple[Note, ...]:
    """Return a note on the pose of the sensor, if it tells one.

    To PCL it is where the points were seen from, and they stand in their common frame without it;
    CloudCompare and others store by it where a cloud was moved to, and leave the points alone.
    """
    try:
        pose = [float(word) for word in words]
    except ValueError:
        return ()
    if len(pose) != len(_NO_VIEWPOINT) or pose[:3] + [abs(w) for w in pose[3:]] == _NO_VIEWPOINT:
        return ()
    place, turn = (", ".join(f"{x:g}" for x in part) for part in (pose[:3], pose[3:]))
    return (
        Note(
            "left_out",
            f"{path}: its VIEWPOINT, a sensor at ({place}) turned by the quaternion ({turn}) in the"
            " order w, x, y, z, is not applied: points are taken as they stand, as PCL does; if a"
            " program moved the cloud by it alone, as CloudCompare does, save it there without its"
            " sensor, so that the points themselves are moved",
        ),
    )


class _UnusableError(BrokenFileError):
    """Something is missing in a header, or is something else."""

    def __init__(self, what: str) -> None:
        super().__init__(f"a header without a usable {what}")


def _words(header: dict[str, list[str]], key: str) -> list[str]:
    if not header.get(key):
        raise _UnusableError(key)
    return header[key]


def _wholes(header: dict[str, list[str]], key: str) -> list[int]:
    words = _words(header, key)
    if not all(_WHOLE.fullmatch(word) for word in words):
        raise _UnusableError(key)
    return [int(word) for word in words]


def _count(header: dict[str, list[str]]) -> int:
    """Return the number of points, which the header tells twice."""
    size = _wholes(header, "WIDTH")[0] * _wholes(header, "HEIGHT")[0]
    if "POINTS" in header and size != _wholes(header, "POINTS")[0]:
        raise _UnusableError("WIDTH, HEIGHT and POINTS")
    return size


def _header(stream: io.BytesIO) -> dict[str, list[str]]:
    header: dict[str, list[str]] = {}
    for line in stream:
        key, *words = line.decode("ascii", "replace").split() or ["#"]
        if not key.startswith("#"):
            header[key] = words
        if key == "DATA":
            break
    return header


def _fields(header: dict[str, list[str]]) -> dict[str, _Field]:
    names, sizes, types = _words(header, "FIELDS"), _wholes(header, "SIZE"), _words(header, "TYPE")
    counts = _wholes(header, "COUNT") if "COUNT" in header else [1] * len(names)
    if min(sizes + counts) < 1 or not len(names) == len(sizes) == len(counts) == len(types):
        raise _UnusableError("FIELDS, SIZE, TYPE and COUNT")
    try:
        kinds = [_KINDS[kind] for kind in types]
        formats = [np.dtype(f"<{kind}{size}") for kind, size in zip(kinds, sizes, strict=True)]
    except (KeyError, TypeError):
        raise _UnusableError("SIZE and TYPE") from None
    columns = list(accumulate(counts, initial=0))
    offsets = list(accumulate(map(mul, sizes, counts), initial=0))
    return {
        name: _Field(column, offset, kind, offsets[-1], count == 1)
        for name, column, offset, kind, count in zip(
            names, columns, offsets, formats, counts, strict=False
        )
    }


def _ascii(body: bytes, fields: list[_Field], count: int) -> tuple[list[NDArray[Any]], bytes]:
    words = words_per_line(body)
    lines = int((words > 0).sum())
    if lines != count:
        raise BrokenFileError(f"{lines} there")
    if count == 0:
        return [np.empty(0) for _ in fields], b""
    width = words.max()
    if (words[words > 0] == width).all() and width > max(field.column for field in fields):
        table = numbers_of_text(body).reshape(count, -1)
        return [table[:, field.column] for field in fields], b""
    text = [line for line in body.decode("utf-8", "replace").split("\n") if line.strip()]
    return list(columns_of_lines(text, [field.column for field in fields]).T), b""


def _binary(body: bytes, fields: list[_Field], count: int) -> tuple[list[NDArray[Any]], bytes]:
    size = fields[0].stride * count
    if len(body) < size:
        raise BrokenFileError(f"{len(body) // fields[0].stride} there")
    columns: list[Any] = [np.ndarray(count, f.kind, body, f.offset, f.stride) for f in fields]
    return columns, body[size:]


def _compressed(body: bytes, fields: list[_Field], count: int) -> tuple[list[NDArray[Any]], bytes]:
    """Return the columns, which are stored one after another once decompressed."""
    packed, size = struct.unpack_from("<II", body) if len(body) >= 8 else (0, 0)
    if len(body) < 8 + packed or size != fields[0].stride * count:
        raise BrokenFileError("fewer bytes there")
    try:
        raw = _unpack_lzf(memoryview(body)[8 : 8 + packed], size)
    except IndexError:
        raise BrokenFileError("compressed bytes that end too soon") from None
    if len(raw) < size:
        raise BrokenFileError(f"{len(raw)} bytes there of the {size} that they take")
    columns: list[Any] = [np.frombuffer(raw, f.kind, count, f.offset * count) for f in fields]
    return columns, body[8 + packed :]


def _unpack_lzf(packed: memoryview, size: int) -> bytearray:
    """Decompress LZF to ``size`` bytes.

    A byte n below 32 is followed by n + 1 literal bytes. Any other starts a back-reference: three
    bits of length (7: add the next byte), plus 2; thirteen bits of distance, plus 1.
    """
    out = bytearray()
    at = 0
    while at < len(packed):
        if len(out) > size:
            raise BrokenFileError(f"more than the {size} bytes announced")
        control = packed[at]
        at += 1
        if control < 32:
            out += packed[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += packed[at]
            at += 1
        distance = ((control & 31) << 8) + packed[at] + 1
        at += 1
        if distance > len(out):
            raise BrokenFileError("a reference before its start")
        repeated = bytes(out[-distance:][: length + 2])
        out += (repeated * ((length + 2) // len(repeated) + 1))[: length + 2]
    return out


_READERS: dict[str, Callable[[bytes, list[_Field], int], tuple[list[NDArray[Any]], bytes]]] = {
    "ascii": _ascii,
    "binary": _binary,
    "binary_compressed": _compressed,
}
