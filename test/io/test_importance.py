# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
import trimesh

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.surfaces import load_surface

BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
COUNT = len(BALL.vertices)
IMPORTANCE = np.random.default_rng(0).integers(0, 9, COUNT) / 4  # float32 holds them


def write_ply(path: Path, encoding: str = "binary", **columns: FloatArray) -> Path:
    mesh = trimesh.Trimesh(BALL.vertices, BALL.faces, process=False)
    mesh.vertex_attributes.update(columns)
    path.write_bytes(mesh.export(file_type="ply", encoding=encoding))
    return path


def write_ply_cloud(path: Path, encoding: str, name: str = "importance") -> Path:
    """Write points and 8-bit importance, four times the usual."""
    header = f"ply\nformat {encoding} 1.0\nelement vertex {COUNT}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += f"property uchar {name}\nend_header\n"
    if encoding == "ascii":
        rows = zip(BALL.vertices.tolist(), (4 * IMPORTANCE).astype(int), strict=True)
        body = "".join(f"{x} {y} {z} {value}\n" for (x, y, z), value in rows).encode()
    else:
        order = ">" if "big" in encoding else "<"
        record = np.empty(COUNT, np.dtype([("xyz", f"{order}f8", 3), ("value", "u1")]))
        record["xyz"], record["value"] = BALL.vertices, 4 * IMPORTANCE
        body = record.tobytes()
    path.write_bytes(header.encode() + body)
    return path


def write_pcd(path: Path, *, ascii_: bool, packed: bool, name: str = "importance") -> Path:
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(np.float32(BALL.vertices)))
    cloud.point[name] = o3d.core.Tensor(IMPORTANCE[:, None].astype(np.float32))
    o3d.t.io.write_point_cloud(str(path), cloud, write_ascii=ascii_, compressed=packed)
    return path


def importance_of(path: Path, importance: Path | None = None) -> FloatArray | None:
    surface = load_surface(path, importance)
    return surface.vertex_importance if isinstance(surface, Mesh) else surface.importance


@pytest.mark.parametrize("name", ["importance", "weight"])
@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_a_ply_may_say_what_its_vertices_count(tmp_path: Path, encoding: str, name: str) -> None:
    path = write_ply(tmp_path / "ball.ply", encoding, **{name: IMPORTANCE})
    surface = load_surface(path, importance_property=name)
    assert isinstance(surface, Mesh)
    np.testing.assert_array_equal(surface.vertex_importance, IMPORTANCE)
    np.testing.assert_allclose(surface.vertices, BALL.vertices, atol=1e-7)
    np.testing.assert_array_equal(surface.triangles, BALL.faces)


def test_only_importance_counts_by_itself(tmp_path: Path) -> None:
    both = {"weight": np.ones(COUNT), "importance": IMPORTANCE}
    path = write_ply(tmp_path / "ball.ply", **both)
    np.testing.assert_array_equal(importance_of(path), IMPORTANCE)
    (note,) = load_surface(path).notes
    assert note.code == "importance"
    assert note.text.startswith(f"{path}: importance is used as the importance of the surface")
    asked = load_surface(path, importance_property="weight")
    assert isinstance(asked, Mesh)
    np.testing.assert_array_equal(asked.vertex_importance, np.ones(COUNT))
    for name, told in (("confidence", 0), ("weight", 1)):
        surface = load_surface(write_ply(path, **{name: IMPORTANCE}))
        assert isinstance(surface, Mesh)
        assert surface.vertex_importance is None
        assert len([note for note in surface.notes if "weight is not used" in note.text]) == told


def test_a_property_that_is_asked_for_must_be_there(tmp_path: Path) -> None:
    path = write_ply(tmp_path / "ball.ply", confidence=IMPORTANCE)
    telling = r"ball\.ply: expected weight, which --importance-property asks for, .*got confidence"
    with pytest.raises(InputError, match=telling):
        load_surface(path, importance_property="weight")
    with pytest.raises(InputError, match="among its numbers, got none"):
        load_surface(write_ply(path), importance_property="weight")


def test_a_table_with_titles_may_say_what_its_points_count(tmp_path: Path) -> None:
    path = tmp_path / "ball.csv"
    table = np.column_stack([IMPORTANCE, BALL.vertices]).tolist()
    lines = ["Importance,X,Y,Z", *(",".join(map(repr, row)) for row in table)]
    path.write_text("\n".join(lines) + "\n")
    surface = load_surface(path)
    assert isinstance(surface, PointCloud)
    np.testing.assert_array_equal(surface.importance, IMPORTANCE)
    np.testing.assert_array_equal(surface.points, BALL.vertices)


def test_numbers_are_matched_before_anything_is_left_out(tmp_path: Path) -> None:
    points = np.array(BALL.vertices)
    points[[3, 8]] = np.nan
    np.save(tmp_path / "ball.npy", points)
    numbers = write_numbers(tmp_path / "numbers", np.arange(COUNT))
    cloud = load_surface(tmp_path / "ball.npy", numbers)
    assert isinstance(cloud, PointCloud)
    np.testing.assert_array_equal(cloud.importance, np.delete(np.arange(COUNT), [3, 8]))
    assert sorted(note.code for note in cloud.notes) == ["importance", "left_out"]
    # Two triangles that meet at a crease: its vertices have two normals each.
    (tmp_path / "crease.obj").write_text(
        "v 9 9 9\nv 0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 1\nvn 0 0 -1\nvn -1 0 0\n"
        "f 2//1 3//1 4//1\nf 2//2 5//2 3//2\nf 2//1 2//1 3//1\n"
    )
    mesh = load_surface(tmp_path / "crease.obj", write_numbers(numbers, np.arange(5)))
    assert isinstance(mesh, Mesh)
    assert mesh.vertex_importance is not None
    assert mesh.vertex_normals is not None
    np.testing.assert_array_equal(mesh.vertex_importance[mesh.triangles], [[1, 2, 3], [1, 4, 2]])
    of_corners = mesh.vertex_normals[mesh.triangles]
    np.testing.assert_array_equal(of_corners, [[[0, 0, -1]] * 3, [[-1, 0, 0]] * 3])
    assert [note.code for note in mesh.notes] == ["importance", "left_out"]


def test_a_last_number_without_a_newline_is_told(tmp_path: Path) -> None:
    (tmp_path / "numbers").write_text("1\n" * (COUNT - 1) + "2")
    surface = load_surface(write_ply(tmp_path / "ball.ply"), tmp_path / "numbers")
    assert isinstance(surface, Mesh)
    assert surface.vertex_importance is not None
    assert surface.vertex_importance[-1] == 2
    assert any("its last number may lack digits" in note.text for note in surface.notes)


def test_textures_do_not_take_vertices_apart(tmp_path: Path) -> None:
    header = ["ply", "format ascii 1.0", f"element vertex {COUNT}"]
    header += [f"property double {name}" for name in ("x", "y", "z", "importance")]
    header += [f"element face {len(BALL.faces)}", "property list uchar int vertex_indices"]
    header += ["property list uchar float texcoord", "end_header"]
    vertices = np.column_stack([BALL.vertices, IMPORTANCE]).tolist()
    lines = [" ".join(map(repr, vertex)) for vertex in vertices]
    for i, (a, b, c) in enumerate(BALL.faces):  # each face has a place of its own in the texture
        lines.append(f"3 {a} {b} {c} 6 {i} 0 {i} 0.1 {i} 0.2")
    path = tmp_path / "ball.ply"
    path.write_text("\n".join([*header, *lines, ""]))
    surface = load_surface(path)
    assert isinstance(surface, Mesh)
    np.testing.assert_array_equal(surface.vertices, BALL.vertices)
    np.testing.assert_array_equal(surface.triangles, BALL.faces)
    np.testing.assert_array_equal(surface.vertex_importance, IMPORTANCE)


@pytest.mark.parametrize("name", ["importance", "weight"])
@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_ply_may_say_what_its_points_count(tmp_path: Path, encoding: str, name: str) -> None:
    path = write_ply_cloud(tmp_path / "ball.ply", encoding, name)
    surface = load_surface(path, importance_property=name)
    assert isinstance(surface, PointCloud)
    np.testing.assert_array_equal(surface.points, BALL.vertices)
    np.testing.assert_array_equal(surface.importance, 4 * IMPORTANCE)


@pytest.mark.parametrize("name", ["importance", "weight"])
@pytest.mark.parametrize(("ascii_", "packed"), [(True, False), (False, False), (False, True)])
def test_a_pcd_may_say_what_its_points_count(
    tmp_path: Path, ascii_: bool, packed: bool, name: str
) -> None:
    path = write_pcd(tmp_path / "ball.pcd", ascii_=ascii_, packed=packed, name=name)
    surface = load_surface(path, importance_property=name)
    assert isinstance(surface, PointCloud)
    np.testing.assert_array_equal(surface.importance, IMPORTANCE)
    np.testing.assert_allclose(surface.points, BALL.vertices, atol=1e-6)
    assert surface.normals is None


def test_a_pcd_may_have_normals_as_well(tmp_path: Path) -> None:
    columns = ["x", "y", "z", "importance", "normal_x", "normal_y", "normal_z"]
    table = np.column_stack([BALL.vertices, IMPORTANCE, BALL.vertices])
    path = tmp_path / "ball.pcd"
    path.write_text(
        f"VERSION 0.7\nFIELDS {' '.join(columns)}\nSIZE{' 8' * 7}\nTYPE{' F' * 7}\n"
        f"WIDTH {COUNT}\nHEIGHT 1\nPOINTS {COUNT}\nDATA ascii\n"
        + "".join(" ".join(map(repr, row)) + "\n" for row in table.tolist())
    )
    surface = load_surface(path)
    assert isinstance(surface, PointCloud)
    np.testing.assert_array_equal(surface.importance, IMPORTANCE)
    np.testing.assert_allclose(surface.normals, BALL.vertices / 0.3)


def write_numbers(path: Path, values: FloatArray) -> Path:
    if path.suffix == ".npy":
        np.save(path, values)
    else:
        np.savetxt(path, values)
    return path


@pytest.mark.parametrize("numbers", ["numbers.txt", "numbers.npy", "numbers"])
@pytest.mark.parametrize(
    "surface", ["ball.ply", "bad.ply", "ball.off", "cloud.ply", "ball.pcd", "ball.xyz", "ball.npy"]
)
def test_a_file_of_numbers_replaces_what_the_surface_says(
    tmp_path: Path, surface: str, numbers: str
) -> None:
    path = tmp_path / surface
    if surface == "ball.ply":
        write_ply(path, importance=np.ones(COUNT))
    elif surface == "bad.ply":  # something else that happens to be called a weight
        write_ply(path, weight=np.full(COUNT, np.nan))
    elif surface == "cloud.ply":
        write_ply_cloud(path, "ascii")
    elif surface == "ball.pcd":
        write_pcd(path, ascii_=False, packed=False)
    elif surface == "ball.off":
        path.write_text(trimesh.Trimesh(BALL.vertices, BALL.faces).export(file_type="off") + "\n")
    else:
        write_numbers(path, BALL.vertices)
    given = np.arange(COUNT) / 3
    read = importance_of(path, write_numbers(tmp_path / numbers, given))
    np.testing.assert_array_equal(read, given)


@pytest.mark.parametrize("kind", ["stl", "glb"])
def test_formats_that_do_not_keep_vertices_take_no_file(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"ball.{kind}"
    BALL.export(path)
    with pytest.raises(
        InputError, match=r"one of the formats ply, obj, off, pcd, .*ball\.\w+; .*save the mesh as"
    ):
        load_surface(path, write_numbers(tmp_path / "numbers.txt", IMPORTANCE))


@pytest.mark.parametrize(
    ("content", "telling"),
    [
        (
            "1\n" * (COUNT - 1),
            rf"numbers: expected {COUNT} numbers, one per vertex, got {COUNT - 1}",
        ),
        ("1\n" * (COUNT + 1), rf"one per vertex, got {COUNT + 1}"),
        ("1\n" * (COUNT - 1) + "one\n", "got something else in place of a number"),
        ("1\n" * (COUNT - 1) + "nan\n", rf"NaN or infinity in 1 .*first: vertex {COUNT - 1}"),
        ("1\n" * (COUNT - 1) + "-1\n", r"at least 0, got 1 of \d+ below .*-1 of vertex"),
        ("0\n" * COUNT, "some above 0"),
        ("", "an empty file"),
        ("\x00\xff", "float|text"),
        (None, "no such file"),
    ],
)
def test_a_file_of_other_things_is_refused(
    tmp_path: Path, content: str | None, telling: str
) -> None:
    path = write_ply(tmp_path / "ball.ply")
    if content is not None:
        (tmp_path / "numbers").write_text(content, encoding="latin-1")
    with pytest.raises(InputError, match=telling) as caught:
        load_surface(path, tmp_path / "numbers")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "telling"),
    [
        (np.ones((COUNT, 1)), r"numbers\.npy: expected shape \(n\), got shape"),
        (np.ones(3), r"numbers\.npy: expected \d+ numbers, one per vertex, got 3"),
        (np.array(["a"] * COUNT), r"numbers\.npy: expected numbers"),
        (np.array([None] * COUNT), "no array of numbers"),
        (np.full(COUNT, np.inf), "NaN or infinity"),
    ],
)
def test_an_array_of_other_things_is_refused(
    tmp_path: Path, values: FloatArray, telling: str
) -> None:
    np.save(tmp_path / "numbers.npy", values)
    with pytest.raises(InputError, match=telling):
        load_surface(write_ply(tmp_path / "ball.ply"), tmp_path / "numbers.npy")


@pytest.mark.parametrize(
    ("values", "telling"),
    [
        (np.full(COUNT, np.nan), "vertex_importance: .*NaN or infinity"),
        (-IMPORTANCE, "vertex_importance: expected numbers of at least 0"),
        (np.zeros(COUNT), "vertex_importance: expected some above 0"),
    ],
)
def test_a_surface_that_says_nonsense_is_refused(
    tmp_path: Path, values: FloatArray, telling: str
) -> None:
    with pytest.raises(InputError, match=telling):
        load_surface(write_ply(tmp_path / "ball.ply", importance=values))
