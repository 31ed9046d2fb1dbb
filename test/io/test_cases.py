# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Files as people have them, each of which stands for a kind, and what is to come of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.notes import Note
from focus_planner.core.surface.surface import Mesh, PointCloud, Surface
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.colmap import load_colmap
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.nerfstudio import load_nerfstudio
from focus_planner.io.surfaces import load_surface

CASES = Path(__file__).parent / "cases"
POINTS = 4000


def area(surface: Surface) -> float:
    assert isinstance(surface, Mesh)
    return float(np.sqrt((surface.cross_products**2).sum(axis=1)).sum() / 2)


def texts(notes: tuple[Note, ...], code: str = "left_out") -> list[str]:
    assert {note.code for note in notes} <= {code}
    return [note.text for note in notes]


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("01_obj_relative_indices/relative.obj", 1.68),
        ("02_obj_tabs_and_indents/tab_faces.obj", 1.68),
        ("02_obj_tabs_and_indents/tab_vertices.obj", 1.68),
        ("03_ply_polygons_of_several_sizes/quads_and_triangles.ply", 1.12),
        ("10_gltf_extensions/quantized.glb", 1.12),
    ],
)
def test_meshes_are_whole(file: str, expected: float) -> None:
    mesh = load_surface(CASES / file)
    assert area(mesh) == pytest.approx(expected, rel=1e-4)
    assert mesh.notes == ()
    if "relative" in file:
        assert isinstance(mesh, Mesh)
        assert len(np.unique(mesh.triangles)) == len(mesh.vertices) == 16


@pytest.mark.parametrize(
    "file",
    [
        "04_ply_lists_per_vertex/views.ply",
        "05_ply_element_face_0/meshlab_like.ply",
        *(f"15_text_clouds/{name}" for name in ("cloud.txt", "commas.xyz", "mark.xyz")),
        *(f"15_text_clouds/{name}" for name in ("no_count.pts", "titles.xyz")),
    ],
)
def test_clouds_are_whole(file: str) -> None:
    cloud = load_surface(CASES / file)
    assert isinstance(cloud, PointCloud)
    assert len(cloud.points) == POINTS
    assert cloud.normals is cloud.importance is None
    assert cloud.notes == ()
    whole = load_surface(CASES / "05_ply_element_face_0/meshlab_like.ply")
    assert isinstance(whole, PointCloud)
    np.testing.assert_allclose(cloud.points, whole.points, rtol=0, atol=1e-6)


def test_normals_that_are_none_are_as_if_there_were_none() -> None:
    cloud = load_surface(CASES / "06_zero_normals/cloud_all_zero.ply")
    assert isinstance(cloud, PointCloud)
    assert cloud.normals is None
    (text,) = texts(cloud.notes)
    assert text == (
        "left out: the normals of all 4,000 points, which are missing, zero or not finite;"
        " estimates from the points are used instead"
    )
    mesh = load_surface(CASES / "06_zero_normals/mesh_one_unreferenced.ply")
    assert isinstance(mesh, Mesh)
    assert area(mesh) == pytest.approx(1.12)
    assert mesh.vertex_normals is not None
    assert len(mesh.vertices) == len(mesh.vertex_normals) == 8
    (text,) = texts(mesh.notes)
    assert text == (
        "left out: the normals of 1 of 9 vertices, which are missing, zero or not finite;"
        " no triangle has these vertices"
    )


def test_what_is_no_surface_is_left_out_and_counted() -> None:
    mesh = load_surface(CASES / "07_degenerate_triangles/one_sliver.obj")
    assert area(mesh) == pytest.approx(1.12)
    (text,) = texts(mesh.notes)
    assert text == "left out: 1 of 13 triangles, which have no area; the rest is planned for"
    cloud = load_surface(CASES / "08_pcd_nan/organized.pcd")
    assert isinstance(cloud, PointCloud)
    (text,) = texts(cloud.notes)
    left = POINTS - len(cloud.points)
    assert left > 0
    assert text == (
        f"left out: {left} of 4,000 points, which are not finite numbers; the rest is planned for"
    )


@pytest.mark.parametrize(
    ("file", "lacks"),
    [
        ("box.obj", "the rest is missing"),
        ("cloud.xyz", "the rest is missing"),
        ("cloud.pcd", "its last number may lack digits"),
    ],
)
def test_a_last_line_without_a_newline_is_read_and_told(file: str, lacks: str) -> None:
    surface = load_surface(CASES / "09_no_final_newline" / file)
    if isinstance(surface, Mesh):
        assert area(surface) == pytest.approx(1.12)
    else:
        assert len(surface.points) == POINTS
    (text,) = texts(surface.notes)
    assert text.endswith(
        f"{file}: its last line does not end in a newline: if it was cut off there, {lacks}; if it"
        " is whole, add a newline at its end"
    )


def test_an_extension_that_cannot_be_read_is_named() -> None:
    pytest.importorskip("DracoPy")
    with pytest.raises(InputError, match="got KHR_draco_mesh_compression that cannot") as caught:
        load_surface(CASES / "10_gltf_extensions/draco.glb")
    assert "\n" not in str(caught.value)


def test_frames_of_images_become_cameras() -> None:
    path = CASES / "11_nerfstudio_transforms/transforms.json"
    rig, _ = load_nerfstudio(path, ImportOptions())
    assert [camera.name for camera in rig.cameras] == ["cam_a", "cam_b"]
    assert [camera.intrinsics.fx for camera in rig.cameras] == [1190.7, 1195.2]


def test_a_byte_order_mark_does_not_matter() -> None:
    rig = load_colmap(CASES / "13_colmap_text/bom")
    assert [camera.name for camera in rig.cameras] == ["a", "b"]


def test_a_scanners_confidence_is_no_importance() -> None:
    path = CASES / "16_weight_is_importance/confidence.ply"
    cloud = load_surface(path)
    assert isinstance(cloud, PointCloud)
    assert cloud.importance is None
    (text,) = texts(cloud.notes, "importance")
    assert text == (
        f"{path}: weight is not used, since scanners call their confidence so; if it is the"
        " importance, give --importance-property the value weight"
    )
    asked = load_surface(path, importance_property="weight")
    assert isinstance(asked, PointCloud)
    assert asked.importance is not None
    (text,) = texts(asked.notes, "importance")
    assert text.endswith("weight is used as the importance of the surface, as asked")


def test_bytes_after_the_end_are_told() -> None:
    mesh = load_surface(CASES / "18_stl_trailing_bytes/trailing.stl")
    assert area(mesh) == pytest.approx(1.12)
    (text,) = texts(mesh.notes)
    assert text.startswith("left out: 2 bytes after the last of the triangles in ")
