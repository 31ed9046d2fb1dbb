# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import dataclasses

import numpy as np
import pytest

from focus_planner import (
    Camera,
    InputError,
    Mesh,
    PlanRequest,
    PointCloud,
    Rig,
    Scene,
    cylinder_rig,
    plan_focus,
)
from focus_planner.core.surface.sampling import sample_mesh
from testing.problems import WIDE_ANGLE, around, body, looking_at, plane, sphere, torus

REQUEST = PlanRequest("em", samples=500)
BODY = body()


def in_millimetres(surface):
    if isinstance(surface, Mesh):
        return Mesh(1000 * surface.vertices, surface.triangles)
    return PointCloud(1000 * surface.points, surface.normals)


def cloud_of(mesh, *, normals=True, count=8000):
    samples = sample_mesh(mesh, count, 0)
    return PointCloud(samples.points, samples.normals if normals else None)


def moved(rig, factor=1.0, offset=(0.0, 0.0, 0.0)):
    return Rig(
        tuple(
            Camera(
                c.name,
                tuple(factor * np.array(c.position) + np.array(offset)),
                c.orientation,
                c.intrinsics,
                c.lens,
            )
            for c in rig.cameras
        )
    )


def expect(message, surface, rig, request=REQUEST):
    with pytest.raises(InputError, match=message):
        plan_focus(Scene(surface), rig, request)


@pytest.mark.parametrize(
    "surface",
    [BODY, cloud_of(BODY), cloud_of(BODY, normals=False)],
    ids=["body", "cloud", "cloud without normals"],
)
def test_a_surface_in_millimetres_is_suspected(surface):
    rig = cylinder_rig(3, 8)
    plan_focus(Scene(surface), rig, REQUEST)
    expect(
        "surface and camera poses: expected metres for both, got a surface .* across of which "
        ".*the surface is probably in millimetres: divide by 1000",
        in_millimetres(surface),
        rig,
    )


def test_camera_poses_in_millimetres_are_suspected():
    expect(
        "camera poses: .* 100 times the surface's size of it, in metres, got 24 of 24 beyond, "
        "cam_0_00 .* across; "
        "the camera poses are probably in millimetres",
        BODY,
        moved(cylinder_rig(3, 8), 1000.0),
    )


@pytest.mark.parametrize(
    ("surface", "rig"),
    [
        (BODY, cylinder_rig(3, 8)),
        (cloud_of(BODY, count=30_000), cylinder_rig(3, 8)),
        (sphere(0.4), around(4, 1.2)),
    ],
    ids=["body", "cloud", "sphere"],
)
def test_inverted_normals_are_suspected(surface, rig):
    if isinstance(surface, Mesh):
        inverted = Mesh(surface.vertices, surface.triangles[:, ::-1])
    else:
        inverted = PointCloud(surface.points, -surface.normals)
    expect(
        r"surface normals: expected outward normals .*% of the surface seen from behind and \d+% "
        "from the front; the normals are probably inverted",
        inverted,
        rig,
    )


def test_a_cloud_without_normals_has_none_to_invert():
    rig = cylinder_rig(3, 8)
    plan = plan_focus(Scene(cloud_of(BODY, normals=False)), rig, REQUEST)
    true = plan_focus(Scene(BODY), rig, REQUEST)
    share = true.covered_area / true.surface_area
    assert plan.covered_area / plan.surface_area == pytest.approx(share, abs=0.04)


@pytest.mark.parametrize("surface", [sphere(0.4), cloud_of(sphere(0.4), normals=False)])
def test_cameras_inside_the_body_are_named(surface):
    # One of four within the sphere.
    cameras = (*around(3, 1.2).cameras, looking_at("lost", (0.05, 0, 0.1), (1, 0, 0)))
    expect(
        r"camera poses: expected cameras outside the body, got 1 of 4 inside it \(lost\); "
        "check the frames and units",
        surface,
        Rig(cameras),
    )
    many = tuple(looking_at(f"in_{i}", (0.01 * i, 0, 0.1), (1, 0, 0)) for i in range(4))
    expect(
        r"got 4 of 8 inside it \(in_0, in_1, in_2, \.\.\.\)",
        surface,
        Rig((*many, *around(4, 1.2).cameras)),
    )


@pytest.mark.parametrize("normals", [True, False])
def test_a_camera_near_a_sparse_cloud_is_not_inside(normals):
    """What stands in for the surface between the points reaches past the cameras there."""
    shell, beside = sphere(0.3, centre=(0, 0, 0)), 0.33
    surface = cloud_of(shell, normals=normals, count=60)
    close = moved(cylinder_rig(1, 24, radius=beside, bottom=0, top=0))
    apart = cylinder_rig(2, 8, radius=1.0, bottom=-0.2, top=0.2)
    cameras = tuple(dataclasses.replace(c, name=f"close_{c.name}") for c in close.cameras)
    plan = plan_focus(Scene(surface), Rig((*apart.cameras, *cameras)), REQUEST)
    assert plan.covered_area > 0


@pytest.mark.parametrize("normals", [True, False])
def test_200_points_of_a_body_enclose_no_camera(normals):
    for seed in (1, 2, 3):
        samples = sample_mesh(body("arms_out"), 200, seed)
        surface = PointCloud(samples.points, samples.normals if normals else None)
        assert plan_focus(Scene(surface), cylinder_rig(), REQUEST).covered_area > 1


def test_a_camera_in_a_fold_is_not_inside():
    # In the torus' hole, and between a body's arm and side.
    rig = Rig((*around(3, 1.2).cameras, looking_at("hole", (0.0, 0, 0.05), (1, 0, 0))))
    plan_focus(Scene(torus(0.4, 0.15)), rig, REQUEST)


def test_cameras_that_look_elsewhere_see_nothing():
    # Tangentially: read in no other way would they see much.
    cameras = tuple(
        looking_at(c.name, c.position, np.add(c.position, (-c.position[1], c.position[0], 0.7)))
        for c in around(4, 1.2).cameras
    )
    expect(
        "camera poses: expected cameras that see the surface, got none that does; check that the "
        "poses are of optical frames",
        sphere(0.4),
        Rig(cameras),
    )


@pytest.mark.parametrize("kind", ["mesh", "cloud"])
def test_importance_that_no_camera_sees_is_an_error(kind):
    # All cameras stand above; what counts lies below.
    mesh = sphere(0.3)
    rig = Rig(
        (looking_at("a", (0.8, 0, 1.0), (0, 0, 0)), looking_at("b", (0, 0.8, 1.0), (0, 0, 0)))
    )
    if kind == "mesh":
        below = 1.0 * (mesh.vertices[:, 2] < -0.2)
        surface = dataclasses.replace(mesh, vertex_importance=below)
    else:
        cloud = cloud_of(mesh)
        surface = dataclasses.replace(cloud, importance=1.0 * (cloud.points[:, 2] < -0.2))
    message = "importance: expected some above 0 where a camera sees the surface, got 0 on all"
    expect(message, surface, rig)
    if kind == "cloud":
        expect(message, surface, rig, PlanRequest("em", samples=0))


@pytest.mark.parametrize(
    "changes",
    [
        {"region": (0, 0, 40, 40)},
        {"distortion_model": "plumb_bob", "distortion": (1e9, 0.0, 0.0, 0.0), "cx": -9.0},
    ],
    ids=["region", "distortion"],
)
def test_images_that_leave_the_surface_out_are_suspected(changes):
    intrinsics = dataclasses.replace(WIDE_ANGLE, **changes)
    expect(
        r"image\.region, image\.distortion: expected images with some of the surface in them, got"
        r" none \(\d+% of it would be seen in whole images, without distortion\); check the",
        sphere(0.2),
        around(4, 1.5, intrinsics=intrinsics),
    )


def test_another_frame_sees_nothing():
    expect("camera poses", sphere(0.4), moved(around(4, 1.2), offset=(0, 0, 20.0)))


def test_little_seen_is_no_error_of_its_own():
    # One small camera before a large wall sees 1 % of it, and there is nothing to suspect.
    wall = plane(8.0, 8.0, 1.0)
    rig = Rig((looking_at("c", (0, 0, 0), (0, 0, 1), up=(0, -1, 0)),))
    narrow = dataclasses.replace(rig.cameras[0].intrinsics, fx=900.0, fy=900.0)
    rig = Rig((dataclasses.replace(rig.cameras[0], intrinsics=narrow),))
    plan = plan_focus(Scene(wall), rig, PlanRequest("em", samples=4000))
    assert 0 < plan.covered_area < 0.02 * plan.surface_area


@pytest.mark.parametrize("columns", [1, 3])
def test_a_few_cameras_before_the_feet_see_little_and_are_right(columns):
    rig = cylinder_rig(1, columns, bottom=0.1, top=0.1)
    plan = plan_focus(Scene(BODY), rig, REQUEST)
    assert 0 < plan.covered_area < 0.2 * plan.surface_area


def test_a_surface_and_a_rig_that_are_both_in_millimetres_are_suspected():
    expect(
        "surface and camera poses: .* all of it beyond the hyperfocal distance; both are probably"
        " in millimetres",
        in_millimetres(BODY),
        moved(cylinder_rig(3, 8), 1000.0),
    )


def test_a_few_cameras_before_a_surface_in_millimetres_suspect_it():
    whole = cylinder_rig()
    few = Rig(whole.cameras[72:102])
    expect("surface is probably in millimetres", in_millimetres(BODY), few)


def test_a_surface_in_centimetres_is_suspected():
    mesh = Mesh(BODY.vertices * 100, BODY.triangles)
    expect("surface is probably in centimetres: divide by 100", mesh, cylinder_rig(3, 8))


def test_one_camera_in_millimetres_is_named():
    rig = cylinder_rig(3, 8)
    stray = dataclasses.replace(rig.cameras[5], position=(750.0, 0.0, 100.0))
    cameras = (*rig.cameras[:5], stray, *rig.cameras[6:])
    expect("got 1 of 24 beyond, cam_0_05", BODY, Rig(cameras))
