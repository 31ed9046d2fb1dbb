# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Obj files as exporters write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.formats.obj import read_obj

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def triangles(path: Path, text: str, encoding: str = "utf-8") -> list[list[int]]:
    """Return the triangles by the file's own vertices."""
    path.write_bytes(text.encode(encoding))
    contents = read_obj(path)
    assert contents.triangles is not None
    numbering = contents.numbering
    found = contents.triangles if numbering is None else numbering[contents.triangles]
    return list(found.tolist())


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 2 3",
        "f\t1\t2 3",
        "  f 1  2   3  ",
        "f -4 -3 -2",
        "f 1/1 2/2 3/3",
        "f 1/1/1 2/2/1 3/3/1",
        "f 1//1 2//1 3//1",
        "f -4/-1/-1 -3/-1/-1 -2/-1/-1",
        "f 1// 2// 3//",
        "fo 1 2 3",
        "f 1 2 \\\n3",
        "f 1 2 3 # of 3",
        "f 1 2 3\r",
    ],
)
def test_corners_are_written_in_many_ways(tmp_path: Path, faces: str) -> None:
    text = f"# a square\n{SQUARE}vt 0 0\nvn 0 0 1\ng part\nusemtl skin\ns off\n{faces}\n"
    assert triangles(tmp_path / "a.obj", text) == [[0, 1, 2]]


@pytest.mark.parametrize(
    "above",
    [
        "usemtl wood \\\n grain",
        "g left \\\n upper \\\n v",
        "g left \\\nf",
        "mtllib a.mtl \\ \n b.mtl",
        # Names of folders on Windows, above whole statements.
        "mtllib C:\\models\\\nvn 0 0 1",
        "usemtl C:\\skin\\\nf 1 3 4",
        "g part \\\n of \\\nf -4 -2/-1 -1//",
        "# until here \\\nf 1 3 4",
    ],
)
def test_names_may_be_continued(tmp_path: Path, above: str) -> None:
    found = triangles(tmp_path / "a.obj", f"{SQUARE}vt 0 0\n{above}\nf 1 2 3\n")
    assert found[-1] == [0, 1, 2]
    assert found[:-1] == ([[0, 2, 3]] if "\nf " in above else [])


def test_faces_and_vertices_may_be_continued(tmp_path: Path) -> None:
    text = f"v 0 0 \\\n 0\n{SQUARE[8:]}f 1 2 \\\n3 \\\n4\n"
    assert triangles(tmp_path / "a.obj", text) == [[0, 1, 2], [0, 2, 3]]


COUNTED = (
    "####\n# Object a.obj\n# Vertices: 4\n# Faces: {}\n####\n"
    + SQUARE
    + "# 4 vertices, 0 vertices normals\n\nf 1 2 3 4\n# {} faces, 0 coords texture\n"
)


@pytest.mark.parametrize(
    "text",
    [
        COUNTED.format(1, 1),
        COUNTED.format(2, 2),  # triangles, of which it has quads
        COUNTED.format(1, 1).replace("\n", "\r\n"),
        f"#Vertex Count 4\n#Face Count 1\n{SQUARE}f 1 2 3\n",
        f"{SQUARE}# 4 vertices\nf 1 2 3\n# 1 faces\n{SQUARE}# 4 vertices\nf 5 6 7\n# 1 faces\n",
        f"# reduced from 900 vertices\n# 2 polygons - 8 triangles\n{SQUARE}f 1 2 3\n# 9 coords\n",
    ],
)
def test_comments_that_count_what_came(tmp_path: Path, text: str) -> None:
    assert triangles(tmp_path / "a.obj", text)
    assert read_obj(tmp_path / "a.obj").notes == ()


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        (COUNTED.format(3, 2), "the 3 faces that its comments count, got 1; it is probably trunc"),
        (f"# 5 vertices\n{SQUARE}f 1 2 3\n", "the 5 vertices that its comments count, got 4;"),
        (f"#Face Count 2\n{SQUARE}f 1 2 3\n", "the 2 faces that its comments count, got 1;"),
        (COUNTED.format(1, 1) + COUNTED.format(1, 1)[:-80], "that its comments count, got"),
    ],
)
def test_less_than_comments_count_is_refused(tmp_path: Path, text: str, telling: str) -> None:
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(InputError, match=telling) as caught:
        read_obj(tmp_path / "a.obj")
    assert "if it is whole, delete those comments" in str(caught.value)


def test_more_than_comments_count_is_told(tmp_path: Path) -> None:
    text = f"{SQUARE}# 4 vertices\nf 1 2 3\n# 1 faces\n{SQUARE}f 5 6 7\n"
    assert len(triangles(tmp_path / "a.obj", text)) == 2
    vertices, faces = (note.text for note in read_obj(tmp_path / "a.obj").notes)
    assert vertices.endswith(
        "a.obj: 8 vertices came, where its comments count 4: if it was cut off, the rest is"
        " missing; if it is whole, delete those comments"
    )
    assert "2 faces came, where its comments count 1" in faces


def test_corners_count_back_from_where_they_stand(tmp_path: Path) -> None:
    part = f"{SQUARE}vn 0 0 1\nf -4//-1 -3//-1 -2//-1 -1//-1\n"
    later = part.replace("vn 0 0 1", "vn 0 0 -1").replace(" 0\n", " 5\n")
    found = triangles(tmp_path / "a.obj", part + later)
    assert found == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    contents = read_obj(tmp_path / "a.obj")
    assert contents.normals is not None
    assert contents.triangles is not None
    assert contents.normals[contents.triangles[:, 0], 2].tolist() == [1, 1, -1, -1]


def test_polygons_may_be_concave(tmp_path: Path) -> None:
    arrow = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n"
    (tmp_path / "a.obj").write_text(arrow)
    contents = read_obj(tmp_path / "a.obj")
    assert contents.triangles is not None
    a, b, c = (contents.points[contents.triangles[:, i]] for i in range(3))
    parts = np.cross(b - a, c - a)[:, 2] / 2
    assert (parts > 0).all()
    assert parts.sum() == pytest.approx(2.5)


def test_colours_and_weights_follow_the_coordinates(tmp_path: Path) -> None:
    text = "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 1.0\nv\t1 1 0\nf 1 2 3\n"
    assert triangles(tmp_path / "a.obj", text) == [[0, 1, 2]]
    assert read_obj(tmp_path / "a.obj").points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_does_not_matter(tmp_path: Path, encoding: str) -> None:
    assert triangles(tmp_path / "a.obj", SQUARE + "f 1 2 3\n", encoding) == [[0, 1, 2]]


def test_normals_that_a_corner_lacks_are_none(tmp_path: Path) -> None:
    text = f"{SQUARE}vn 0 0 1\nf 1//1 2//1 3//1\nf 1/1 3/1 4/1\nf 2//1 3//9 4//1\n"
    assert triangles(tmp_path / "a.obj", text) == [[0, 1, 2], [0, 2, 3], [1, 2, 3]]
    contents = read_obj(tmp_path / "a.obj")
    assert contents.normals is not None
    assert contents.triangles is not None
    of_corners = contents.normals[contents.triangles][:, :, 2]
    np.testing.assert_array_equal(of_corners, [[1, 1, 1], [np.nan] * 3, [1, np.nan, 1]])


@pytest.mark.parametrize(
    ("faces", "telling"),
    [
        ("f 1 2 5\n", "a corner at vertex 5 of 4"),
        ("f 1 2 -5\n", "a corner at vertex 0 of 4"),
        ("f 0 1 2\n", "a corner 0, where vertices are counted from 1"),
        ("f 1 2 3.5\n", "corners of faces that are no whole numbers"),
        ("f 1 2 three\n", "got something else in place of a number"),
        ("f\n", "a face without corners"),
        ("f 1 2", "a last face of less than three corners"),
        ("", "no triangle"),
        ("v 1 2\nf 1 2 3\n", "a vertex of less than three numbers"),
        ("v 1 2 x\nf 1 2 3\n", "got something else in place of a number"),
        ("f 1 2 3\nsurf 0 1 0 1 1 2 3 4\n", "a mesh of polygons, got free-form surfaces"),
        ("f 1 2 3\ncall part.obj\n", "got a call of another file"),
    ],
)
def test_what_does_not_add_up_is_refused(tmp_path: Path, faces: str, telling: str) -> None:
    with pytest.raises(InputError, match=telling):
        triangles(tmp_path / "a.obj", SQUARE + faces)
