"""Point clouds from pcd, xyz, xyzn, pts and npy files."""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Callable, Sequence
from itertools import accumulate
from operator import mul
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.files import check_final_newline, read_array, unreadable
from focus_planner.io.importance import importance_column

CLOUDS = ("pcd", "xyz", "xyzn", "pts", "npy")

_PCD_KINDS = {"F": "f", "I": "i", "U": "u"}
_COORDINATES = ("x", "y", "z")
_NORMALS = ("normal_x", "normal_y", "normal_z")


class _Field(NamedTuple):
    """Where a pcd file stores a field: its column in text, its place in a binary record."""

    column: int
    offset: int
    kind: np.dtype[Any]
    stride: int


def load_cloud(path: Path, kind: str) -> tuple[PointCloud, FloatArray | None]:
    """Read a point cloud, and its points' importance if the file has it.

    Parameters
    ----------
    path : Path
    kind : {"pcd", "xyz", "xyzn", "pts", "npy"}
        ``xyz`` is text with x, y, z and possibly more per line; ``xyzn`` has the normal after
        them; ``pts`` starts with the number of points; ``npy`` is an array with 3 columns, or 6
        with normals.

    Raises
    ------
    InputError
        If the file is of another kind, truncated, or its points are invalid.
    """
    content = path.read_bytes()
    if kind == "pcd":
        return _pcd(path, content)
    if kind == "npy":
        return _npy(path), None
    check_final_newline(path, kind, content)
    lines = content.splitlines()
    if kind == "pts":
        return _pts(path, lines), None
    table = _table(path, kind, lines, range(6 if kind == "xyzn" else 3))
    return PointCloud(table[:, :3], table[:, 3:] if kind == "xyzn" else None), None


def _table(path: Path, kind: str, lines: list[bytes], columns: Sequence[int]) -> FloatArray:
    try:
        return _parse_numbers(lines, columns)
    except ValueError as error:
        raise unreadable(path, kind, str(error)) from None


def _parse_numbers(lines: list[bytes], columns: Sequence[int]) -> FloatArray:
    """Return the given columns of lines of numbers."""
    text = [line.decode("utf-8", "replace") for line in lines]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of empty input, which PointCloud reports better
        try:
            return np.loadtxt(text, comments=["#", "//"], usecols=columns, ndmin=2)
        except ValueError as error:
            raise ValueError(str(error).partition(";")[0]) from None


def _pts(path: Path, lines: list[bytes]) -> PointCloud:
    first = lines[0].split()
    if len(first) != 1 or not first[0].isdigit():
        raise unreadable(path, "pts", "no number of points on its first line")
    table = _table(path, "pts", lines[1:], range(3))
    if len(table) != int(first[0]):
        raise unreadable(path, "pts", f"{len(table)} points of the {int(first[0])} announced")
    return PointCloud(table)


def _npy(path: Path) -> PointCloud:
    array = read_array(path)
    if array.ndim != 2 or array.shape[1] not in (3, 6):
        raise InputError(
            str(path), "an array of shape (n, 3), or (n, 6) with normals", f"{array.shape}"
        )
    return PointCloud(array[:, :3], array[:, 3:] if array.shape[1] == 6 else None)


def _pcd(path: Path, content: bytes) -> tuple[PointCloud, FloatArray | None]:
    stream = io.BytesIO(content)
    try:
        header = _pcd_header(stream)
        fields, form, count = _pcd_fields(header), header["DATA"][0], int(header["POINTS"][0])
        wanted = [fields[name] for name in _COORDINATES]
        reader = _PCD_READERS[form]
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise unreadable(path, "pcd", f"a header without a usable {error}") from None
    with_normals, importance = set(_NORMALS) <= set(fields), importance_column(fields)
    wanted += [fields[name] for name in _NORMALS] if with_normals else []
    wanted += [fields[importance]] if importance else []
    try:
        table = reader(stream.read(), wanted, count)
    except (ValueError, IndexError, TypeError) as error:
        raise unreadable(path, "pcd", f"{count} points announced, and {error}") from None
    cloud = PointCloud(table[:, :3], table[:, 3:6] if with_normals else None)
    return cloud, table[:, -1] if importance else None


def _pcd_header(stream: io.BytesIO) -> dict[str, list[str]]:
    header: dict[str, list[str]] = {}
    for line in stream:
        key, *words = line.decode("ascii", "replace").split() or ["#"]
        if not key.startswith("#"):
            header[key] = words
        if key == "DATA":
            break
    return header


def _pcd_fields(header: dict[str, list[str]]) -> dict[str, _Field]:
    names = header["FIELDS"]
    sizes = [int(size) for size in header["SIZE"]]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    if min(sizes + counts) < 1:
        raise ValueError("SIZE and COUNT")
    kinds = [_PCD_KINDS[kind] for kind in header["TYPE"]]
    formats = [np.dtype(f"<{kind}{size}") for kind, size in zip(kinds, sizes, strict=True)]
    columns = list(accumulate(counts, initial=0))
    offsets = list(accumulate(map(mul, sizes, counts), initial=0))
    return {
        name: _Field(column, offset, kind, offsets[-1])
        for name, column, offset, kind in zip(names, columns, offsets, formats, strict=False)
    }


def _pcd_ascii(body: bytes, fields: list[_Field], count: int) -> FloatArray:
    if not body.endswith(b"\n"):
        raise ValueError("a last line without a newline")
    table = _parse_numbers(body.splitlines(), [field.column for field in fields])
    if len(table) != count:
        raise ValueError(f"{len(table)} there")
    return table


def _pcd_binary(body: bytes, fields: list[_Field], count: int) -> FloatArray:
    columns = [np.ndarray(count, f.kind, body, f.offset, f.stride) for f in fields]
    return np.stack(columns, axis=1).astype(np.float64)


def _pcd_compressed(body: bytes, fields: list[_Field], count: int) -> FloatArray:
    """Return the columns, which are stored one after another once decompressed."""
    packed, size = struct.unpack_from("<II", body) if len(body) >= 8 else (0, 0)
    if len(body) < 8 + packed or size != fields[0].stride * count:
        raise ValueError("fewer bytes there")
    raw = _unpack_lzf(memoryview(body)[8 : 8 + packed])
    columns = [np.frombuffer(raw, f.kind, count, f.offset * count) for f in fields]
    return np.stack(columns, axis=1).astype(np.float64)


def _unpack_lzf(packed: memoryview) -> bytearray:
    """Decompress LZF.

    A byte n below 32 is followed by n + 1 literal bytes. Any other starts a back-reference: three
    bits of length (7: add the next byte), plus 2; thirteen bits of distance, plus 1.
    """
    out = bytearray()
    at = 0
    while at < len(packed):
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


_PCD_READERS: dict[str, Callable[[bytes, list[_Field], int], FloatArray]] = {
    "ascii": _pcd_ascii,
    "binary": _pcd_binary,
    "binary_compressed": _pcd_compressed,
}
