# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Text clouds as scanners, spreadsheets and scripts write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.formats.contents import SurfaceContents
from focus_planner.io.formats.text_clouds import read_text_cloud

POINTS = np.round(np.random.default_rng(2).normal(size=(30, 3)), 6)
ROWS = ["{:.6f} {:.6f} {:.6f}".format(*row) for row in POINTS.tolist()]
PLAIN = "\n".join(ROWS) + "\n"
FEW = [f"{row} 7 200 100 50" for row in ROWS]


def read(path: Path, text: str, encoding: str = "utf-8") -> SurfaceContents:
    path.write_bytes(text.encode(encoding))
    return read_text_cloud(path)


@pytest.mark.parametrize("ending", ["xyz", "txt", "asc", "csv", "pts"])
@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace(" ", ","),
        PLAIN.replace(" ", ", "),
        PLAIN.replace(" ", ";"),
        PLAIN.replace(" ", "\t"),
        PLAIN.replace(" ", ";").replace(".", ","),
        PLAIN.replace(".", ","),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.replace(" ", ",").replace("\n", ",\n"),
        "x y z\n" + PLAIN,
        "# made by hand\n\n" + PLAIN,
        "//X Y Z\n" + PLAIN + "\n\n",
        '"X","Y","Z"\n' + PLAIN.replace(" ", ","),
        "X [m];Y [m];Z [m]\n" + PLAIN.replace(" ", ";"),
        "A scan of today\nEasting,Northing,Height\n" + PLAIN.replace(" ", ","),
        f"{len(ROWS)}\n" + PLAIN,
        f"12\n{chr(10).join(ROWS[:12])}\n18\n{chr(10).join(FEW[12:])}\n",
        "x y z\n" + "\n".join(ROWS[:9]) + "\nx y z\n" + "\n".join(ROWS[9:]) + "\n",
        "\n".join(FEW) + "\n",
        "\n".join(f"{row} # {i}" for i, row in enumerate(ROWS)) + "\n",
        "\n".join(f"{row} wall" for row in ROWS) + "\n",
        "id,Z,Y,X,what\n" + "".join(f"{i},{z},{y},{x},wall\n"
                                    for i, (x, y, z) in enumerate(POINTS.tolist())),
        "Points:0,Points:1,Points:2\n" + PLAIN.replace(" ", ","),
    ],
)  # fmt: skip
def test_it_is_the_same_cloud(tmp_path: Path, ending: str, text: str) -> None:
    contents = read(tmp_path / f"a.{ending}", text)
    np.testing.assert_array_equal(contents.points, POINTS)
    assert contents.triangles is contents.normals is None
    assert contents.notes == ()


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le"])
def test_a_byte_order_mark_does_not_matter(tmp_path: Path, encoding: str) -> None:
    mark = "\ufeff" if encoding == "utf-16-le" else ""
    contents = read(tmp_path / "a.xyz", mark + PLAIN, encoding)
    np.testing.assert_array_equal(contents.points, POINTS)


def test_titles_tell_which_column_is_what(tmp_path: Path) -> None:
    text = "Nx Ny Nz weight Z Y X\n" + "".join(
        f"0 0 1 {i} {z} {y} {x}\n" for i, (x, y, z) in enumerate(POINTS.tolist())
    )
    contents = read(tmp_path / "a.txt", text)
    np.testing.assert_array_equal(contents.points, POINTS)
    assert contents.normals is not None
    np.testing.assert_array_equal(contents.normals, [[0, 0, 1]] * len(POINTS))
    np.testing.assert_array_equal(contents.numbers["weight"], np.arange(len(POINTS)))


def test_normals_follow_points_in_xyzn(tmp_path: Path) -> None:
    text = "# x y z nx ny nz\n" + "".join(f"{row} 0 0 1\n" for row in ROWS)
    contents = read(tmp_path / "a.xyzn", text)
    assert contents.normals is not None
    np.testing.assert_array_equal(contents.normals, [[0, 0, 1]] * len(POINTS))
    with pytest.raises(InputError, match="3 numbers per line, where the normal follows"):
        read(tmp_path / "a.xyzn", PLAIN)


def test_what_a_scanner_did_not_see(tmp_path: Path) -> None:
    text = PLAIN.replace(ROWS[3], "nan nan nan").replace(ROWS[5], "1.#QNAN -1.#IND 1.#INF")
    text = text.replace(ROWS[7], "-nan(ind) inf 0")
    contents = read(tmp_path / "a.xyz", text)
    finite = np.isfinite(contents.points).all(axis=1)
    assert np.flatnonzero(~finite).tolist() == [3, 5, 7]


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        (PLAIN.replace(ROWS[4], "1 2"), "2 numbers in line 5 of the points, 3 in the first"),
        (PLAIN.replace(ROWS[4], ROWS[4] + " 9"), "4 numbers in line 5 of the points, 3 in the"),
        (PLAIN.replace(ROWS[4], "1 2 z"), "something else in place of a number in row 5, column 3"),
        (PLAIN.replace(ROWS[4], "7"), "a single number in line 5, below points"),
        ("1 2\n" + PLAIN, "2 numbers in line 1 of the points"),
        (f"31\n{PLAIN}", "30 points of the 31 announced"),
        (f"29\n{PLAIN}", "30 points of the 29 announced"),
        (f"30\n{PLAIN}4\n", "0 points of the 4 announced"),
        (f"30\n{PLAIN}4\n1 2 3\n", "1 points of the 4 announced"),
        (f"-30\n{PLAIN}", "'-30' in place of a point"),
        ("name X Y Z\n" + PLAIN, "4 titles of 3 columns"),
        (PLAIN + "0.1 0.2", "2 numbers in line 31 of the points, 3 in the first"),
        (PLAIN[:-4], "a last number of 3 decimals, where others have 6"),
    ],
)
def test_what_does_not_add_up_is_refused(tmp_path: Path, text: str, telling: str) -> None:
    with pytest.raises(InputError, match=telling) as caught:
        read(tmp_path / "a.xyz", text)
    assert "\n" not in str(caught.value)


def test_an_empty_cell_is_no_number_and_shifts_nothing(tmp_path: Path) -> None:
    rows = ["x,y,z,i", *(f"{row.replace(' ', ',')},1" for row in ROWS)]
    rows[6] = "0.5,,0.25,1"
    rows[8] = ",1,2,3"
    contents = read(tmp_path / "a.csv", "\n".join(rows) + "\n")
    np.testing.assert_array_equal(contents.points[5], [0.5, np.nan, 0.25])
    np.testing.assert_array_equal(contents.points[7], [np.nan, 1, 2])


@pytest.mark.parametrize(
    ("text", "lacks"),
    [(f"30\n{PLAIN[:-1]}", "digits"), (PLAIN[:-1], "the rest is missing")],
)
def test_a_last_line_without_a_newline_is_told(tmp_path: Path, text: str, lacks: str) -> None:
    contents = read(tmp_path / "a.xyz", text)
    np.testing.assert_array_equal(contents.points, POINTS)
    (note,) = contents.notes
    assert note.code == "left_out"
    assert lacks in note.text


@pytest.mark.parametrize(
    "titles",
    [
        "id,x_coord,y_coord,z_coord",
        "id,pos_x,pos_y,pos_z",
        "id,Point X,Point Y,Point Z",
        "id,x_m,y_m,z_m",
        "id,Easting,Northing,Elevation",
        '"id","Points_0","Points_1","Points_2"',
        '"id","Points:0","Points:1","Points:2"',
        "id;X [m];Y [m];Z [m]",
    ],
)
def test_titles_that_programs_write(tmp_path: Path, titles: str) -> None:
    rows = [f"{i},{row.replace(' ', ',')}" for i, row in enumerate(ROWS)]
    contents = read(tmp_path / "a.csv", "\n".join([titles, *rows, ""]))
    np.testing.assert_array_equal(contents.points, POINTS)


def test_normals_are_not_taken_for_points(tmp_path: Path) -> None:
    titles = ",".join(f'"{name}_{k}"' for name in ("Normals", "Points") for k in range(3))
    rows = ["0,0,1," + row.replace(" ", ",") for row in ROWS]
    contents = read(tmp_path / "a.csv", "\n".join([titles, *rows, ""]))
    np.testing.assert_array_equal(contents.points, POINTS)
    np.testing.assert_array_equal(contents.normals, [[0, 0, 1]] * len(POINTS))


@pytest.mark.parametrize("titles", ["r,theta,phi", "lat lon alt", "time,a,b", "u;v;w"])
def test_titles_of_other_columns_are_refused(tmp_path: Path, titles: str) -> None:
    with pytest.raises(InputError, match="expected titles that say which columns are x, y and z"):
        read(tmp_path / "a.txt", titles + "\n" + PLAIN)


def test_a_comment_that_may_be_titles_is_told(tmp_path: Path) -> None:
    contents = read(tmp_path / "a.txt", "# r theta phi\n" + PLAIN)
    np.testing.assert_array_equal(contents.points, POINTS)
    assert (
        "the comment above its points, 'r theta phi', is not understood" in contents.notes[0].text
    )
    assert read(tmp_path / "b.txt", "# written by hand on a Sunday\n" + PLAIN).notes == ()
    assert read(tmp_path / "c.txt", "//X Y Z\n" + PLAIN).notes == ()


def test_numbers_for_titles_are_no_point(tmp_path: Path) -> None:
    contents = read(tmp_path / "a.csv", "0,1,2\n" + PLAIN.replace(" ", ","))
    np.testing.assert_array_equal(contents.points, POINTS)


def test_a_wrong_count_is_told_once(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="30 points of the 31 announced") as caught:
        read(tmp_path / "a.pts", "31\n" + PLAIN)
    assert str(caught.value).count("expected") == 1


def test_a_last_number_may_have_fewer_decimals_where_others_have(tmp_path: Path) -> None:
    rows = [" ".join(repr(round(v, 3)) for v in row) for row in POINTS.tolist()]
    text = "\n".join([*rows, "0.125 0.5 0.25"])
    assert len(read(tmp_path / "a.xyz", text).points) == len(POINTS) + 1


def test_utf_16_ends_in_a_newline_too(tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    path.write_bytes(PLAIN.encode("utf-16"))
    assert read_text_cloud(path).notes == ()
