# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Point clouds from laser scanners: las, laz and e57 files, by libraries that are extras."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from focus_planner.core.surface.appearance import Colours
from focus_planner.core.validation import InputError
from focus_planner.io.files import SURFACE, read_bytes, unreadable
from focus_planner.io.formats.colours import colours_of
from focus_planner.io.formats.contents import SurfaceContents, check_announced, optional_library

_LAS_NORMALS = ("NormalX", "NormalY", "NormalZ")  # as CloudCompare calls them
_LAS_HEADER = 255  # bytes that matter, of version 1.4; a shorter header is followed by points
_RECORD = 54  # bytes of a variable-length record at least
# A chunk of laz has 50,000 points, the first of which is not compressed.
_MOST_PER_BYTE = 50_000 / 20


def read_las(path: Path) -> SurfaceContents:
    """Read a las file, or a laz file, which is compressed.

    Raises
    ------
    InputError
        If it is truncated, no such file, or the library is not installed.
    """
    kind = path.suffix.lower().removeprefix(".")
    laspy = optional_library(path, kind, "laspy", "lazrs")
    _check_header(path, kind)
    try:
        with laspy.open(path) as file:
            announced = file.header.point_count
            points = file.read()
        extra = list(points.point_format.extra_dimension_names)
        numbers = {name: np.asarray(points[name]) for name in extra}
        xyz = np.asarray(points.xyz)
        colours = None
        if {"red", "green", "blue"} <= set(points.point_format.dimension_names):
            colours = np.stack([points.red, points.green, points.blue], axis=1)
    except Exception:  # noqa: BLE001 - whatever the library raises for broken files
        raise unreadable(path, kind, "what laspy cannot read") from None
    check_announced(path, kind, "points", len(xyz), announced)
    normals = None
    if numbers.keys() >= set(_LAS_NORMALS):
        normals = np.stack([numbers.pop(name) for name in _LAS_NORMALS], axis=1)
    # Of 16 bits, though some write 8.
    if colours is not None:
        colours = colours_of(colours) if colours.any() else None
    return SurfaceContents(xyz, None, normals, numbers, colours=colours)


def _check_header(path: Path, kind: str) -> None:
    """Raise if a header announces more than the file can hold.

    The libraries would look for it long, or end the process for want of memory.
    """
    content = read_bytes(path, SURFACE)
    start, size = content[:_LAS_HEADER], len(content)
    if size < _LAS_HEADER:
        raise unreadable(path, kind, f"{size} bytes")
    first, records = struct.unpack_from("<II", start, 96)
    (points,) = struct.unpack_from("<I", start, 107)
    more = 0
    if start[24:26] >= b"\x01\x04":
        more, points = struct.unpack_from("<IQ", start, 243)
    if first > size or _RECORD * (records + more) > size or points > _MOST_PER_BYTE * size:
        raise unreadable(path, kind, f"{points} points announced in {size} bytes")
    if kind == "laz" and points:
        table = int.from_bytes(content[first : first + 8], "little", signed=True)
        if table == -1:  # it was written as a stream
            table = int.from_bytes(content[-8:], "little")
        chunks = int.from_bytes(content[table + 4 : table + 8], "little")
        if not first < table <= size - 8 or chunks > size:
            raise unreadable(path, kind, f"no table of chunks in {size} bytes")


def read_e57(path: Path) -> SurfaceContents:
    """Read all scans of an e57 file, each as it stands in the file's common frame.

    Raises
    ------
    InputError
        If it is truncated, no such file, or the library is not installed.
    """
    pye57 = optional_library(path, "e57", "pye57")
    try:
        file = pye57.E57(str(path))
        scans = [_scan(path, file, i) for i in range(file.scan_count)]
        file.close()
    except InputError:
        raise
    except Exception:  # noqa: BLE001 - whatever the library raises for broken files
        raise unreadable(path, "e57", "what pye57 cannot read") from None
    points = np.concatenate([np.empty((0, 3)), *(scan for scan, _ in scans)])
    colours = None
    if any(each is not None for _, each in scans):
        colours = np.concatenate(
            [np.zeros(scan.shape, np.uint8) if each is None else each for scan, each in scans]
        )
    return SurfaceContents(points, colours=colours)


def _scan(
    path: Path, file: Any, index: int
) -> tuple[np.ndarray[Any, np.dtype[np.float64]], Colours | None]:
    """Return (n, 3) points, NaN where the scanner says that it saw nothing, and their colours."""
    raw, header = file.read_scan_raw(index), file.get_header(index)
    check_announced(path, "e57", "points", len(next(iter(raw.values()))), header.point_count)
    if "cartesianX" in raw:
        points = np.stack([raw[f"cartesian{axis}"] for axis in "XYZ"], axis=1).astype(np.float64)
        invalid = raw.get("cartesianInvalidState")
    else:
        distance, azimuth, elevation = (
            raw[f"spherical{name}"].astype(np.float64) for name in ("Range", "Azimuth", "Elevation")
        )
        across = distance * np.cos(elevation)
        points = np.stack(
            [across * np.cos(azimuth), across * np.sin(azimuth), distance * np.sin(elevation)],
            axis=1,
        )
        invalid = raw.get("sphericalInvalidState")
    if invalid is not None:
        points[np.asarray(invalid) > 0] = np.nan
    if header.has_pose():
        points = points @ header.rotation_matrix.T + header.translation
    names = [f"color{name}" for name in ("Red", "Green", "Blue")]
    if not raw.keys() >= set(names):
        return points, None
    return points, colours_of(np.stack([raw[name] for name in names], axis=1))
