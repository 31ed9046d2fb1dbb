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

import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
import trimesh

from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.bodies import bodies
from focus_planner.io.surfaces import load_surface

# Numbers that no float32 and no ten digits can hold.
BALL = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
NORMALS = np.array(BALL.vertices)
FACES = np.array(BALL.faces)
VERTICES = 0.3 * NORMALS + np.random.default_rng(1).normal(scale=1e-3, size=NORMALS.shape)


def write_mesh(path: Path, normals: bool, **options: object) -> Path:
    mesh = trimesh.Trimesh(VERTICES, FACES, vertex_normals=NORMALS.copy(), process=False)
    kind = path.suffix[1:]
    named = {"ply": "vertex_normal", "obj": "include_normals", "glb": "include_normals"}
    if kind in named:
        options[named[kind]] = normals
    data = mesh.export(file_type=kind, **options)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def write_ply(path: Path, *, normals: bool = False, ascii_: bool = False) -> Path:
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(VERTICES), o3d.utility.Vector3iVector(FACES)
    )
    if normals:
        mesh.vertex_normals = o3d.utility.Vector3dVector(NORMALS)
    o3d.io.write_triangle_mesh(str(path), mesh, write_ascii=ascii_)
    return path


def write_cloud(
    path: Path, *, normals: bool = False, ascii_: bool = False, packed: bool = False
) -> Path:
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(VERTICES))
    if normals:
        cloud.normals = o3d.utility.Vector3dVector(NORMALS)
    o3d.io.write_point_cloud(str(path), cloud, write_ascii=ascii_, compressed=packed)
    return path


def ascii_ply(vertices: list[str], faces: list[str]) -> str:
    return "\n".join(
        [
            "ply",
            "format ascii 1.0",
            f"element vertex {len(vertices)}",
            *(f"property double {axis}" for axis in "xyz"),
            f"element face {len(faces)}",
            "property list uchar int vertex_indices",
            "end_header",
            *vertices,
            *faces,
            "",
        ]
    )


def test_a_ply_of_doubles_comes_through_bit_for_bit(tmp_path: Path) -> None:
    mesh = load_surface(write_ply(tmp_path / "ball.ply"))
    assert isinstance(mesh, Mesh)
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(mesh.triangles, FACES)
    assert mesh.vertex_normals is None


@pytest.mark.parametrize("kind", ["obj", "off"])
def test_text_meshes_keep_all_digits(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"ball.{kind}"
    points = [" ".join(map(repr, vertex)) for vertex in VERTICES.tolist()]
    if kind == "obj":
        lines = [f"v {point}" for point in points]
        lines += ["f " + " ".join(map(str, face)) for face in (FACES + 1).tolist()]
    else:
        lines = ["OFF", f"{len(VERTICES)} {len(FACES)} 0", *points]
        lines += ["3 " + " ".join(map(str, face)) for face in FACES.tolist()]
    path.write_text("\n".join(lines) + "\n")
    mesh = load_surface(str(path))
    assert isinstance(mesh, Mesh)
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(mesh.triangles, FACES)


@pytest.mark.parametrize("kind", ["ply", "obj", "stl", "off", "glb"])
def test_meshes_of_every_kind_are_read(tmp_path: Path, kind: str) -> None:
    mesh = load_surface(write_mesh(tmp_path / f"ball.{kind.upper()}".lower(), normals=False))
    assert isinstance(mesh, Mesh)
    corners = mesh.vertices[mesh.triangles]
    np.testing.assert_allclose(corners, VERTICES[FACES], atol=1e-7)
    assert mesh.vertex_normals is None


def test_the_ending_may_be_in_capitals(tmp_path: Path) -> None:
    write_ply(tmp_path / "ball.ply").rename(tmp_path / "BALL.PLY")
    assert isinstance(load_surface(tmp_path / "BALL.PLY"), Mesh)


def test_a_gltf_is_read_with_its_buffers_and_poses(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    moved = trimesh.transformations.translation_matrix([0, 0, 2])
    scene.add_geometry(trimesh.Trimesh(VERTICES, FACES, process=False))
    scene.add_geometry(trimesh.Trimesh(VERTICES, FACES, process=False), transform=moved)
    for name, data in scene.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    mesh = load_surface(tmp_path / "model.gltf")
    assert isinstance(mesh, Mesh)
    assert len(mesh.triangles) == 2 * len(FACES)
    assert mesh.vertices[:, 2].max() == pytest.approx(2 + VERTICES[:, 2].max())
    buffer = next(tmp_path.glob("*.bin"))
    buffer.write_bytes(buffer.read_bytes()[:-100])
    with pytest.raises(InputError, match="complete gltf file"):
        load_surface(tmp_path / "model.gltf")


@pytest.mark.parametrize("kind", ["ply", "obj", "glb"])
def test_vertex_normals_of_the_file_are_used(tmp_path: Path, kind: str) -> None:
    mesh = load_surface(write_mesh(tmp_path / f"ball.{kind}", normals=True))
    assert isinstance(mesh, Mesh)
    assert mesh.vertex_normals is not None
    of_corners = mesh.vertex_normals[mesh.triangles]
    np.testing.assert_allclose(of_corners, NORMALS[FACES], atol=1e-6)


def test_an_ascii_ply_with_quads_and_a_comment_is_read(tmp_path: Path) -> None:
    path = tmp_path / "quads.ply"
    text = ascii_ply(["0 0 0", "1 0 0", "0 1 0", "1 1 1"], ["3 0 1 2", "4 0 1 3 2"])
    path.write_text(text.replace("1.0\n", "1.0\ncomment element vertex 99\n"))
    mesh = load_surface(path)
    assert isinstance(mesh, Mesh)
    assert len(mesh.triangles) == 3


@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("ascii_", [False, True])
@pytest.mark.parametrize("kind", ["ply", "pcd"])
def test_clouds_are_read(tmp_path: Path, kind: str, ascii_: bool, normals: bool) -> None:
    cloud = load_surface(write_cloud(tmp_path / f"cloud.{kind}", normals=normals, ascii_=ascii_))
    assert isinstance(cloud, PointCloud)
    exact = kind == "ply" and not ascii_
    np.testing.assert_allclose(cloud.points, VERTICES, rtol=0, atol=0 if exact else 1e-6)
    assert (cloud.normals is not None) == normals
    if cloud.normals is not None:
        np.testing.assert_allclose(cloud.normals, NORMALS, atol=1e-5)


def test_a_big_endian_ply_is_read(tmp_path: Path) -> None:
    header = f"ply\nformat binary_big_endian 1.0\nelement vertex {len(VERTICES)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
    path = tmp_path / "cloud.ply"
    path.write_bytes(header.encode() + VERTICES.astype(">f8").tobytes())
    cloud = load_surface(path)
    assert isinstance(cloud, PointCloud)
    np.testing.assert_array_equal(cloud.points, VERTICES)


def test_a_compressed_pcd_with_much_to_compress_is_read(tmp_path: Path) -> None:
    points = np.repeat(np.float32(VERTICES[:40]), 50, axis=0)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.float64(points)))
    o3d.io.write_point_cloud(str(tmp_path / "cloud.pcd"), cloud, compressed=True)
    assert (tmp_path / "cloud.pcd").stat().st_size < points.nbytes / 4
    read = load_surface(tmp_path / "cloud.pcd")
    assert isinstance(read, PointCloud)
    np.testing.assert_array_equal(read.points, points)


def test_a_compressed_pcd_is_read(tmp_path: Path) -> None:
    cloud = load_surface(write_cloud(tmp_path / "cloud.pcd", normals=True, packed=True))
    assert isinstance(cloud, PointCloud)
    np.testing.assert_allclose(cloud.points, VERTICES, atol=1e-6)
    np.testing.assert_allclose(cloud.normals, NORMALS, atol=1e-5)


def test_a_pcd_of_doubles_with_padding_comes_through_bit_for_bit(tmp_path: Path) -> None:
    record = np.zeros(len(VERTICES), np.dtype([("pad", "<u1", 3), ("xyz", "<f8", 3), ("i", "<u2")]))
    record["xyz"] = VERTICES
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS _ x y z intensity\nSIZE 1 8 8 8 2\nTYPE U F F F U\n"
        f"COUNT 3 1 1 1 1\nWIDTH {len(record)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {len(record)}\nDATA binary\n"
    )
    (tmp_path / "cloud.pcd").write_bytes(header.encode() + record.tobytes())
    cloud = load_surface(tmp_path / "cloud.pcd")
    assert isinstance(cloud, PointCloud)
    np.testing.assert_array_equal(cloud.points, VERTICES)


@pytest.mark.parametrize("kind", ["xyz", "xyzn", "pts", "npy"])
def test_plain_clouds_come_through_bit_for_bit(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"cloud.{kind}"
    table = np.hstack([VERTICES, NORMALS])
    if kind == "npy":
        np.save(path, table)
    else:
        first = [str(len(table))] if kind == "pts" else ["# x y z"]
        lines = [" ".join(map(repr, row)) for row in table.tolist()]
        path.write_text("\n".join([*first, *lines]) + "\n")
    cloud = load_surface(path)
    assert isinstance(cloud, PointCloud)
    np.testing.assert_array_equal(cloud.points, VERTICES)
    assert (cloud.normals is not None) == (kind in {"xyzn", "npy"})


KINDS = [
    *("mesh.ply", "mesh_ascii.ply", "mesh.obj", "mesh.stl", "mesh_ascii.stl", "mesh.off"),
    *("mesh.glb", "cloud.ply", "cloud_ascii.ply", "cloud.pcd", "cloud_ascii.pcd"),
    *("cloud_packed.pcd", "cloud.xyz", "cloud.xyzn", "cloud.pts", "cloud.npy"),
]


def write_surface(path: Path) -> Path:
    """Write one of ``KINDS``."""
    ascii_, packed = "ascii" in path.name, "packed" in path.name
    if path.suffix == ".npy":
        np.save(path, VERTICES)
    elif path.name.startswith("cloud"):
        write_cloud(path, normals=True, ascii_=ascii_, packed=packed)
    elif path.suffix == ".ply":
        write_ply(path, normals=True, ascii_=ascii_)
    elif path.name == "mesh_ascii.stl":
        path.write_text(trimesh.Trimesh(VERTICES, FACES).export(file_type="stl_ascii"))
    else:
        write_mesh(path, normals=True)
    return path


# Where all that is announced is there, and only the last number is cut.
ONLY_DIGITS = {
    ("cloud_ascii.ply", 0.9995),
    ("cloud_ascii.pcd", 0.9995),
    ("cloud.pts", 0.9995),
}


@pytest.mark.parametrize("name", KINDS)
def test_damage_is_never_more_than_an_error(tmp_path: Path, name: str) -> None:
    path = write_surface(tmp_path / name)
    content = path.read_bytes()
    random = np.random.default_rng(5)
    for _ in range(20):
        damaged = bytearray(content)
        for at in random.integers(
            min(len(content), 400 if random.random() < 0.5 else 10**9), size=3
        ):
            damaged[at] = random.integers(256)
        path.write_bytes(damaged)
        with suppress(InputError):
            load_surface(path)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.5, 0.8, 0.95, 0.9995])
@pytest.mark.parametrize("name", KINDS)
def test_a_file_cut_off_is_refused(tmp_path: Path, name: str, share: float) -> None:
    path = write_surface(tmp_path / name)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    if (name, share) in ONLY_DIGITS:
        (note,) = load_surface(path).notes
        assert note.code == "left_out"
        assert "its last number may lack digits" in note.text
        return
    with pytest.raises(InputError, match=re.escape(str(path))) as caught:
        load_surface(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "name", ["mesh_ascii.ply", "mesh.off", "cloud_ascii.ply", "cloud_ascii.pcd", "cloud.pts"]
)
def test_a_file_that_tells_its_length_lacks_no_more_than_digits(tmp_path: Path, name: str) -> None:
    path = write_surface(tmp_path / name)
    content = path.read_bytes().rstrip()
    whole = load_surface(path)
    for end in range(len(content) - 60, len(content) + 1):
        path.write_bytes(content[:end])
        try:
            surface = load_surface(path)
        except InputError:
            continue
        assert [note.code for note in surface.notes] == ["left_out"]
        if isinstance(surface, Mesh) and isinstance(whole, Mesh):
            assert surface.triangles.shape == whole.triangles.shape
            np.testing.assert_array_equal(surface.triangles[:-1], whole.triangles[:-1])
        elif isinstance(surface, PointCloud) and isinstance(whole, PointCloud):
            np.testing.assert_array_equal(surface.points[:-1], whole.points[:-1])


@pytest.mark.parametrize("kind", ["off", "ply", "pts", "pcd"])
def test_a_file_cut_off_between_lines_is_refused_where_it_tells_its_length(
    tmp_path: Path, kind: str
) -> None:
    path = tmp_path / f"surface.{kind}"
    if kind in {"pts", "pcd"}:
        write_cloud(path, ascii_=True)
    elif kind == "ply":
        write_ply(path, ascii_=True)
    else:
        write_mesh(path, normals=False)
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-5]))
    with pytest.raises(InputError, match=r"\d+ (points )?announced"):
        load_surface(path)


@pytest.mark.parametrize(
    "kind", ["ply", "obj", "stl", "off", "glb", "gltf", "pcd", "xyz", "xyzn", "pts", "npy"]
)
@pytest.mark.parametrize("content", [b"no surface at all\n", bytes(range(256)) * 9, b"\n"])
def test_what_is_no_surface_is_refused(
    tmp_path: Path, kind: str, content: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"surface.{kind}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_surface(path)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.ply: expected a mesh or point cloud, got no such"):
        load_surface(tmp_path / "none.ply")
    with pytest.raises(InputError, match="got a folder"):
        load_surface(tmp_path)
    (tmp_path / "empty.ply").touch()
    with pytest.raises(InputError, match="got an empty file"):
        load_surface(tmp_path / "empty.ply")
    (tmp_path / "body.docx").write_text("hello")
    with pytest.raises(InputError, match=r"ends in ply, obj.*, got '\.docx'"):
        load_surface(tmp_path / "body.docx")


@pytest.mark.parametrize(
    ("faces", "vertices", "telling"),
    [
        (["3 0 1 2"], ["0 0 0", "1 nan 0", "0 1 0"], "NaN or infinity in 1 of 3 .first: vertex 1."),
        (["3 0 1 2"], ["0 0 0", "1 inf 0", "0 1 0"], "NaN or infinity"),
        (["3 0 1 7"], ["0 0 0", "1 0 0", "0 1 0"], "vertex indices from 0 to 2"),
        (["3 0 1 1"], ["0 0 0", "1 0 0", "0 1 0"], "1 of 1 degenerate"),
        ([], ["0 0 0", "1 0 0", "0 1 0"], "at least 16 points, got 3"),
        (["3 0 1 2"], ["0 0 0", "1 zero 0", "0 1 0"], "complete ply file"),
    ],
)
def test_a_broken_mesh_is_refused(
    tmp_path: Path, faces: list[str], vertices: list[str], telling: str
) -> None:
    (tmp_path / "mesh.ply").write_text(ascii_ply(vertices, faces))
    with pytest.raises(InputError, match=telling):
        load_surface(tmp_path / "mesh.ply")


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "a corner at vertex 9 of 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangle"),
        ("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", "a last face of less than three corners"),
        ("v 0 0 0\nv 1 0 0\nv 0 1", "no triangle"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 0 1", "a vertex of less than three numbers"),
    ],
)
def test_a_broken_obj_is_refused(tmp_path: Path, text: str, telling: str) -> None:
    (tmp_path / "mesh.obj").write_text(text)
    with pytest.raises(InputError, match=telling):
        load_surface(tmp_path / "mesh.obj")


def test_a_small_or_empty_cloud_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cloud.xyz"
    path.write_text("# nothing\n")
    with pytest.raises(InputError, match="got an empty cloud"):
        load_surface(path)
    path.write_text("0 0 0\n" * 3)
    with pytest.raises(InputError, match="at least 16 points, got 3"):
        load_surface(path)
    (tmp_path / "cloud.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n"
    )
    with pytest.raises(InputError, match="got an empty cloud"):
        load_surface(tmp_path / "cloud.ply")


def test_an_obj_with_materials_that_are_missing_is_read(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mesh.obj"
    path.write_text("mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl skin\nf 1 2 3\n")
    assert isinstance(load_surface(path), Mesh)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("path", bodies(), ids=lambda path: path.stem)
def test_the_bodies_are_surfaces(path: Path) -> None:
    mesh = load_surface(path)
    assert isinstance(mesh, Mesh)
    assert mesh.triangles.shape == (27_420, 3)
    assert mesh.vertices[:, 2].min() == pytest.approx(0, abs=1e-3)
