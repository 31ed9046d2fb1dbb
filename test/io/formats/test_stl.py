# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Stl files: binary ones that look like text, several solids, and what is after the end."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from focus_planner.core.validation import InputError
from focus_planner.io.formats.stl import read_stl

Corners = NDArray[np.float32]
CORNERS = np.arange(18, dtype=np.float32).reshape(2, 3, 3) ** 2


def binary(header: bytes = b"", corners: Corners = CORNERS) -> bytes:
    data = header.ljust(80, b"\0") + struct.pack("<I", len(corners))
    for triangle in corners:
        data += bytes(12) + triangle.astype("<f4").tobytes() + bytes(2)
    return data


def facet(triangle: Corners) -> str:
    vertices = "".join(f"      vertex {' '.join(map(str, corner))}\n" for corner in triangle)
    return f"  facet normal 0 0 0\n    outer loop\n{vertices}    endloop\n  endfacet\n"


def text(*solids: Corners) -> str:
    parts = (
        f"solid vertex facet {i}\n{''.join(map(facet, solid))}endsolid vertex facet {i}\n"
        for i, solid in enumerate(solids)
    )
    return "".join(parts)


def corners(path: Path, content: bytes | str) -> Corners:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    contents = read_stl(path)
    assert contents.triangles is not None
    return np.asarray(contents.points[contents.triangles])


def test_one_that_begins_with_solid_may_be_binary(tmp_path: Path) -> None:
    for header in (b"", b"solid of a program that should know better", b"solid\n" + b" " * 74):
        np.testing.assert_array_equal(corners(tmp_path / "a.stl", binary(header)), CORNERS)


def test_all_solids_are_read(tmp_path: Path) -> None:
    two = text(CORNERS, CORNERS)
    others = two.replace("\n", "\r\n"), two.upper(), two.rstrip(), "\ufeff" + two
    for content in (two, *others):
        found = corners(tmp_path / "a.stl", content)
        np.testing.assert_array_equal(found, np.concatenate([CORNERS, CORNERS]))
        assert read_stl(tmp_path / "a.stl").notes == ()


def test_a_second_solid_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    content = text(CORNERS, CORNERS)
    whole = content.rindex("endsolid") + len("endsolid")
    for end in range(content.index("endsolid") + len("endsolid vertex facet 0\nsolid"), whole):
        with pytest.raises(InputError, match=r"a\.stl: expected a complete stl file"):
            corners(tmp_path / "a.stl", content[:end])
    assert len(corners(tmp_path / "a.stl", content[:whole])) == 4


@pytest.mark.parametrize(
    ("old", "new", "telling"),
    [
        ("endfacet", "", "2 facets that are not all of three vertices"),
        ("vertex 0.0", "vertex 0.0 1.0", "19 coordinates of the 18 of 2 facets"),
        ("vertex 0.0", "", "2 facets that are not all of three vertices"),
        ("vertex 0.0", "vertex zero", "something else in place of a number"),
    ],
)
def test_facets_are_triangles(tmp_path: Path, old: str, new: str, telling: str) -> None:
    with pytest.raises(InputError, match=telling):
        corners(tmp_path / "a.stl", text(CORNERS).replace(old, new, 1))


def test_a_binary_one_announces_its_triangles(tmp_path: Path) -> None:
    path, whole = tmp_path / "a.stl", binary()
    with pytest.raises(InputError, match="1 triangles of the 2 announced"):
        corners(path, whole[:-1])
    with pytest.raises(InputError, match="no triangle"):
        corners(path, binary(corners=CORNERS[:0]))
    np.testing.assert_array_equal(corners(path, whole + b"\r\n"), CORNERS)
    (note,) = read_stl(path).notes
    assert note.text.startswith("left out: 2 bytes after the last of the triangles in ")
    np.testing.assert_array_equal(corners(path, whole + bytes(512)), CORNERS)  # a whole sector
    for more in (whole, whole[84:134]):
        with pytest.raises(InputError, match="bytes after the last of the triangles that it ann"):
            corners(path, whole + more)
