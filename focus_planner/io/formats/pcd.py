"""Point clouds from pcd files, ascii, binary and compressed."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from itertools import accumulate
from operator import mul
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.io.files import (
    DIGITS,
    SURFACE,
    read_bytes,
    unfinished_line,
    unreadable,
    without_byte_order_mark,
)
from focus_planner.io.formats.contents import (
    SurfaceContents,
    bytes_after_end,
)
from focus_planner.io.formats.tables import columns_of_lines, numbers_of_text, words_per_line

_KINDS = {"F": "f", "I": "i", "U": "u"}
_POINT = ("x", "y", "z")
_NORMAL = ("normal_x", "normal_y", "normal_z")


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
    stream = io.BytesIO(without_byte_order_mark(content))
    try:
        header = _header(stream)
        fields, form, count = _fields(header), header["DATA"][0], _count(header)
        wanted = [name for name, field in fields.items() if field.single or name in _POINT]
        reader, _ = _READERS[form], [fields[name] for name in _POINT]
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise unreadable(path, "pcd", f"a header without a usable {error}") from None
    try:
        columns, rest = reader(stream.read(), [fields[name] for name in wanted], count)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise unreadable(path, "pcd", f"{count} points announced, and {error}") from None
    numbers = dict(zip(wanted, columns, strict=True))
    points = np.stack([numbers.pop(name) for name in _POINT], axis=1)
    normals = None
    if numbers.keys() >= set(_NORMAL):
        normals = np.stack([numbers.pop(name) for name in _NORMAL], axis=1)
    if form == "ascii":
        notes = unfinished_line(path, content, DIGITS)
    else:
        notes = bytes_after_end(path, "pcd", rest, fields["x"].stride, "points")
    return SurfaceContents(points, None, normals, numbers, notes=notes)


def _count(header: dict[str, list[str]]) -> int:
    """Return the number of points, which the header tells twice."""
    size = int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
    if size < 0 or size != int(header.get("POINTS", [str(size)])[0]):
        raise ValueError("WIDTH, HEIGHT and POINTS")
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
    names = header["FIELDS"]
    sizes = [int(size) for size in header["SIZE"]]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    if min(sizes + counts) < 1 or not len(names) == len(sizes) == len(counts):
        raise ValueError("FIELDS, SIZE and COUNT")
    kinds = [_KINDS[kind] for kind in header["TYPE"]]
    formats = [np.dtype(f"<{kind}{size}") for kind, size in zip(kinds, sizes, strict=True)]
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
        raise ValueError(f"{lines} there")
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
        raise ValueError(f"{len(body) // fields[0].stride} there")
    columns: list[Any] = [np.ndarray(count, f.kind, body, f.offset, f.stride) for f in fields]
    return columns, body[size:]


def _compressed(body: bytes, fields: list[_Field], count: int) -> tuple[list[NDArray[Any]], bytes]:
    """Return the columns, which are stored one after another once decompressed."""
    packed, size = struct.unpack_from("<II", body) if len(body) >= 8 else (0, 0)
    if len(body) < 8 + packed or size != fields[0].stride * count:
        raise ValueError("fewer bytes there")
    raw = _unpack_lzf(memoryview(body)[8 : 8 + packed], size)
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
            raise ValueError(f"more than the {size} bytes announced")
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
            raise ValueError("a reference before its start")
        repeated = bytes(out[-distance:][: length + 2])
        out += (repeated * ((length + 2) // len(repeated) + 1))[: length + 2]
    return out


_READERS: dict[str, Callable[[bytes, list[_Field], int], tuple[list[NDArray[Any]], bytes]]] = {
    "ascii": _ascii,
    "binary": _binary,
    "binary_compressed": _compressed,
}
