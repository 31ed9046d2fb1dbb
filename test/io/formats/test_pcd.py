# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pcd files: counts told twice, empty depths, and what follows the end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.formats.pcd import read_pcd

POINTS = np.random.default_rng(3).normal(size=(20, 3)).astype(np.float32)


def header(form: str, width: int = 20, height: int = 1, points: int | None = 20) -> str:
    lines = ["VERSION .7", "FIELDS x y z weight", "SIZE 4 4 4 4", "TYPE F F F F", "COUNT 1 1 1 1"]
    lines += [f"WIDTH {width}", f"HEIGHT {height}", "VIEWPOINT 0 0 0 1 0 0 0"]
    return "\n".join(
        [*lines, *([f"POINTS {points}"] if points is not None else []), f"DATA {form}", ""]
    )


ROWS = np.column_stack([POINTS, np.arange(20)]).astype("<f4")
TEXT = "".join(" ".join(map(str, row)) + "\n" for row in ROWS)


def write(path: Path, form: str, head: str | None = None, body: bytes | None = None) -> Path:
    data = (TEXT.encode() if form == "ascii" else ROWS.tobytes()) if body is None else body
    path.write_bytes((head or header(form)).encode() + data)
    return path


@pytest.mark.parametrize("form", ["ascii", "binary"])
@pytest.mark.parametrize(
    "sizes", [{}, {"width": 5, "height": 4}, {"points": None}], ids=["row", "image", "no points"]
)
def test_points_and_numbers(tmp_path: Path, form: str, sizes: dict[str, int]) -> None:
    contents = read_pcd(write(tmp_path / "a.pcd", form, header(form, **sizes)))
    np.testing.assert_array_equal(contents.points.astype(np.float32), POINTS)
    np.testing.assert_array_equal(contents.numbers["weight"], np.arange(20))
    assert contents.triangles is contents.normals is None
    assert contents.notes == ()


def test_a_mark_does_not_matter(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pcd", "ascii", "\ufeff" + header("ascii"))
    np.testing.assert_array_equal(read_pcd(path).points.astype(np.float32), POINTS)


def test_depths_that_are_none(tmp_path: Path) -> None:
    lines = TEXT.splitlines()
    lines[4], lines[6] = "nan nan nan 4", "-nan inf 1 6"
    body = ("\n".join(lines) + "\n").encode()
    points = read_pcd(write(tmp_path / "a.pcd", "ascii", body=body)).points
    assert np.flatnonzero(~np.isfinite(points).all(axis=1)).tolist() == [4, 6]


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_the_pose_of_the_sensor_is_told_and_not_applied(tmp_path: Path, form: str) -> None:
    head = header(form).replace("0 0 0 1 0 0 0", "0 -1.5 0 0.7071 0.7071 0 0")
    contents = read_pcd(write(tmp_path / "a.pcd", form, head))
    np.testing.assert_array_equal(contents.points.astype(np.float32), POINTS)
    (note,) = contents.notes
    assert note.code == "left_out"
    assert (
        "its VIEWPOINT, a sensor at (0, -1.5, 0) turned by the quaternion (0.7071, 0.7071, 0, 0)"
    ) in note.text
    for nothing in ("-0 0 0 -1 0 0 -0", "0 0 0", "a b c d e f g"):
        head = header(form).replace("0 0 0 1 0 0 0", nothing)
        assert read_pcd(write(tmp_path / "b.pcd", form, head)).notes == ()
    head = header(form).replace("VIEWPOINT 0 0 0 1 0 0 0\n", "")
    assert read_pcd(write(tmp_path / "b.pcd", form, head)).notes == ()


def test_what_follows_the_end(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pcd", "binary", body=ROWS.tobytes() + b"\n")
    (note,) = read_pcd(path).notes
    assert note.text.startswith("left out: 1 bytes after the last of the points in ")
    with pytest.raises(InputError, match="bytes after the last of the points that it announces"):
        read_pcd(write(path, "binary", body=ROWS.tobytes() * 2))


@pytest.mark.parametrize(
    ("form", "head", "body", "telling"),
    [
        ("ascii", header("ascii", 21, points=21), None, "21 points announced, and 20 there"),
        ("binary", header("binary", 21, points=21), None, "21 points announced, and 20 there"),
        ("binary", header("binary", 21), None, "WIDTH, HEIGHT and POINTS"),
        ("ascii", header("ascii").replace("x y z", "a b c"), None, "usable x, y and z"),
        ("ascii", header("ascii").replace("SIZE 4", "SIZE"), None, "FIELDS, SIZE, TYPE and COUNT"),
        ("ascii", header("ascii"), TEXT.replace("\n", " 9\n", 1).rsplit(" ", 1)[0].encode(),
         "20 points announced, and"),
        ("ascii", header("ascii"), TEXT.replace(".", "x", 1).encode(), "in place of"),
    ],
)  # fmt: skip
def test_what_does_not_add_up_is_refused(
    tmp_path: Path, form: str, head: str, body: bytes | None, telling: str
) -> None:
    with pytest.raises(InputError, match=telling):
        read_pcd(write(tmp_path / "a.pcd", form, head, body))
