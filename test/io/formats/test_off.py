# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Off files: polygons, colours, normals, and counts."""

from __future__ import annotations

from pathlib import Path

import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.formats.off import read_off

POINTS = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 2 0\n{POINTS}3 0 1 2\n4 0 1 2 3\n",
        f"OFF 4 2 0\n# points\n{POINTS}\n3 0 1 2 255 0 0\n4 0 1 2 3 0.5 0.5 0.5 1\n",
        f"\ufeffOFF\n4 2\n{POINTS}3 0 1 2\n4 0 1 2 3\n",
        "COFF\n4 2 0\n0 0 0 9 9 9\n1 0 0 9 9 9\n1 1 0 9 9 9\n0 1 0 9 9 9\n3 0 1 2\n4 0 1 2 3\n",
        "NOFF\n4 2 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n4 0 1 2 3\n",
    ],
)
def test_polygons_are_read(tmp_path: Path, text: str) -> None:
    contents = read_off(write(tmp_path / "a.off", text))
    assert contents.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert contents.triangles is not None
    assert contents.triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    assert (contents.normals is not None) == text.startswith("NOFF")
    assert contents.notes == ()


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        (f"OFF\n4 2 0\n{POINTS}3 0 1 2\n", "5 lines of the 6 announced"),
        (f"OFF\n4 1 0\n{POINTS}3 0 1 2\n3 0 1 2\n", "6 lines of the 5 announced"),
        (f"OFF\n4 1 0\n{POINTS}4 0 1 2\n", "3 corners of the 4 announced"),
        (f"OFF\n4 1 0\n{POINTS}3 0 1 x\n", "something else in place of a whole number"),
        (f"OFF\nfour 1 0\n{POINTS}3 0 1 2\n", "no counts of vertices and faces"),
        (f"4 1 0\n{POINTS}3 0 1 2\n", "no OFF at its beginning"),
        ("OFF BINARY\n4 1 0\n", "three coordinates per vertex, got 'OFF BINARY"),
        ("4OFF\n1 0 0\n0 0 0 1\n", "three coordinates per vertex, got '4OFF"),
    ],
)
def test_what_does_not_add_up_is_refused(tmp_path: Path, text: str, telling: str) -> None:
    with pytest.raises(InputError, match=telling):
        read_off(write(tmp_path / "a.off", text))
