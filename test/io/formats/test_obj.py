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
