# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What programs write as ply, and what is announced against what is there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.formats.contents import SurfaceContents
from focus_planner.io.formats.ply import read_ply
from testing.ply_files import Element
from testing.ply_files import write_ply as write

SQUARE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.1)]
ENCODINGS = ["ascii", "binary_little_endian", "binary_big_endian"]


POINTS: Element = ("vertex", ["double x", "double y", "double z"], SQUARE)


def faces(*rows: Sequence[int], kinds: str = "uchar int", name: str = "vertex_indices") -> Element:
    return ("face", [f"list {kinds} {name}"], [(list(row),) for row in rows])


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("kinds", ["uchar int", "int uint", "ushort uchar", "char int"])
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
def test_faces_of_several_sizes(tmp_path: Path, encoding: str, kinds: str, name: str) -> None:
    rows = faces([0, 1, 2], [0, 1, 2, 3], [1, 2, 3], kinds=kinds, name=name)
    contents = read_ply(write(tmp_path / "a.ply", encoding, POINTS, rows))
    np.testing.assert_array_equal(contents.points, SQUARE)
    assert contents.triangles is not None
    assert contents.triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [1, 2, 3]]
    assert contents.notes == ()


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_lists_before_between_and_after(tmp_path: Path, encoding: str) -> None:
    properties = ["uchar a", "list uchar uint views", "double x", "double y", "double z"]
    properties += ["list uchar double weights", "int b"]
    rows = [
        (i, list(range(i % 3)), *point, [0.5] * (i % 4), -i) for i, point in enumerate(SQUARE * 5)
    ]
    face = ("face", ["int part", "list uchar int vertex_indices", "list uchar double texcoord"], [
        (7, [0, 1, 2], [0.1] * 6), (8, [0, 1, 2, 3], []), (9, [3, 2, 1], [0.2] * 6),
    ])  # fmt: skip
    edge = ("edge", ["int one", "int other"], [(0, 1)])
    path = write(tmp_path / "a.ply", encoding, edge, ("vertex", properties, rows), face)
    contents = read_ply(path)
    np.testing.assert_array_equal(contents.points, SQUARE * 5)
    np.testing.assert_array_equal(contents.numbers["a"], np.arange(20))
    np.testing.assert_array_equal(contents.numbers["b"], -np.arange(20))
    assert contents.numbers.keys() == {"a", "b"}
    assert contents.triangles is not None
    assert contents.triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [3, 2, 1]]
    content = path.read_bytes()
    for end in range(content.index(b"end_header") + 11, len(content) - 1):
        path.write_bytes(content[:end])
        with suppress(InputError):
            notes = read_ply(path).notes
            assert encoding == "ascii"  # the last digit
            assert notes


def test_a_comment_decides_nothing(tmp_path: Path) -> None:
    said = ["comment format ascii 1.0", "obj_info element face 9", "comment end_header"]
    path = write(tmp_path / "a.ply", "binary_little_endian", POINTS, faces([0, 1, 2]), header=said)
    assert contents_equal(read_ply(path), [[0, 1, 2]])


def contents_equal(contents: SurfaceContents, triangles: list[list[int]]) -> bool:
    np.testing.assert_array_equal(contents.points, SQUARE)
    return contents.triangles is not None and contents.triangles.tolist() == triangles


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_cloud_may_announce_no_face(tmp_path: Path, encoding: str) -> None:
    contents = read_ply(write(tmp_path / "a.ply", encoding, POINTS, faces()))
    assert contents.triangles is None
    np.testing.assert_array_equal(contents.points, SQUARE)


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_lines_may_end_in_any_way(tmp_path: Path, encoding: str, newline: str) -> None:
    path = write(tmp_path / "a.ply", encoding, POINTS, faces([0, 1, 2]))
    head, mark, body = path.read_bytes().partition(b"end_header\n")
    if encoding == "ascii":
        body = body.replace(b"\n", newline.encode())
    path.write_bytes((head + mark).replace(b"\n", newline.encode()) + body)
    assert contents_equal(read_ply(path), [[0, 1, 2]])


def test_text_may_have_a_mark_tabs_and_microsofts_nan(tmp_path: Path) -> None:
    path = write(tmp_path / "a.ply", "ascii", POINTS, faces([0, 1, 2]))
    text = path.read_text().replace("0.1", "-1.#IND").replace("1.0 0.0", "1.0\t 0.0")
    path.write_text(text, encoding="utf-8-sig")
    contents = read_ply(path)
    assert np.isnan(contents.points[3, 2])
    np.testing.assert_array_equal(contents.points[:3], SQUARE[:3])


def test_numbers_keep_all_their_bits(tmp_path: Path) -> None:
    points = np.random.default_rng(1).normal(size=(50, 3))
    for encoding in ENCODINGS:
        element = ("vertex", ["double x", "double y", "double z"], points.tolist())
        contents = read_ply(write(tmp_path / "a.ply", encoding, element))
        np.testing.assert_array_equal(contents.points, points)


@pytest.mark.parametrize("encoding", ENCODINGS[1:])
def test_bytes_after_the_end(tmp_path: Path, encoding: str) -> None:
    path = write(tmp_path / "a.ply", encoding, POINTS, faces([0, 1, 2]))
    content = path.read_bytes()
    path.write_bytes(content + b"\r\n")
    (note,) = read_ply(path).notes
    assert note.text.startswith("left out: 2 bytes after the last of the elements in ")
    path.write_bytes(content + bytes(4096))
    assert read_ply(path).notes
    path.write_bytes(content + content)
    with pytest.raises(InputError, match=r"bytes after the last .* two files were joined"):
        read_ply(path)


@pytest.mark.parametrize(
    ("change", "telling"),
    [
        (("3 0 1 2", "3 0 1"), "0 rows of face of the 1 announced"),
        (("3 0 1 2\n", ""), "0 rows of face of the 1 announced"),
        (("3 0 1 2", "4 0 1 2"), "0 rows of face of the 1 announced"),
        (("3 0 1 2", "2 0 1 2"), "1 numbers more than announced"),
        (("3 0 1 2", "3 0 1.5 2"), "corners that are no whole numbers"),
        (("3 0 1 2", "-3 0 1 2"), "a list of -3 items"),
        (("3 0 1 2", "nan 0 1 2"), "a list of nan items"),
        (("3 0 1 2", "3 0 1 two"), "something else in place of a number"),
        (("0.1", "0.1 7"), "0 rows of face of the 1 announced"),
        (("0.1", "0.1 0.5"), "a list of 0.5 items"),
        (("vertex_indices", "vertices"), "faces with a list vertex_indices, got vertices"),
        (("element face 1", "element tristrips 1"), "got triangle strips; convert the file"),
        (("element face 1", "element face -1"), "a header with the line 'element face -1'"),
        (("element face 1", "element vertex 1"), "a header with one name twice"),
        (("format ascii 1.0\n", ""), "a header without a format"),
        (("format ascii", "format text"), "a header with the line 'format text 1.0'"),
        (("double z", "double w"), "a header without x, y and z"),
        (("double z", "real z"), "a header with the line 'property real z'"),
        (("double z", "double y"), "a header with one name twice"),
        (("list uchar", "list double"), "a header with the line 'property list double"),
        (("element vertex 4", "element point 4"), "a header without x, y and z"),
        (("end_header", "end"), "no complete header"),
    ],
)
def test_what_does_not_add_up_is_refused(
    tmp_path: Path, change: tuple[str, str], telling: str
) -> None:
    path = write(tmp_path / "a.ply", "ascii", POINTS, faces([0, 1, 2]))
    assert change[0] in path.read_text()
    path.write_text(path.read_text().replace(*change, 1))
    with pytest.raises(InputError, match=re.escape(str(path)) + f".*({telling})") as caught:
        read_ply(path)
    assert "\n" not in str(caught.value)
