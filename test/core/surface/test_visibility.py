# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from focus_planner import Camera, CameraIntrinsics, Lens, Mesh, PointCloud, Rig, Scene, cylinder_rig
from focus_planner.core.rig.distortion import frustum_and_projection
from focus_planner.core.rig.geometry import rotation_from_quaternion
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.intrinsics import varied
from testing.problems import (
    WIDE_ANGLE,
    around,
    box,
    forward,
    looking_at,
    merged,
    pairs_of,
    plane,
    sphere,
    torus,
)

SURFACES = {
    "sphere": sphere(0.4),
    "box": box((0.5, 0.7, 0.6)),
    "torus": torus(0.4, 0.15),
    "two spheres": merged(sphere(0.2, (0.25, 0, 0)), sphere(0.3, (-0.3, 0.1, 0))),
    "far from the origin": sphere(0.4, (900.0, -400.0, 30.0)),
}


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES.keys())
def test_cameras_see_what_brute_force_says(surface):
    scene = Scene(surface)
    samples = scene.sample(150, 2)
    centre = tuple(scene.centre)
    # A narrow image cuts the surface off.
    rig = Rig(
        tuple(
            looking_at(f"c{i}", tuple(scene.centre + offset), centre, intrinsics=intrinsics)
            for i, (offset, intrinsics) in enumerate(
                [
                    ((1.5, 0.2, 0.1), WIDE_ANGLE),
                    ((0.1, -1.2, 0.4), WIDE_ANGLE),
                    ((-0.9, 0.5, -0.6), CameraIntrinsics(200, 150, 300.0, 300.0, 100.0, 75.0)),
                    ((-0.3, 0.2, 1.1), WIDE_ANGLE),
                ]
            )
        )
    )
    found = pairs_of(visible_pairs(scene, rig, samples))
    unsure = 0
    for p in range(len(samples)):
        for c, camera in enumerate(rig.cameras):
            arguments = surface, camera, samples.points[p], samples.normals[p]
            # Rays graze edges: what depends on a hair's breadth is not asked for.
            surely = reference.sees(*arguments, 0.5e-4 * scene.diagonal, 1e-5)
            perhaps = reference.sees(*arguments, 2e-4 * scene.diagonal, -1e-5)
            if surely == perhaps:
                assert ((p, c) in found) == surely, (p, c)
            else:
                unsure += 1
    assert unsure < 0.01 * len(samples) * len(rig)
    assert 0.1 < len(found) / (len(samples) * len(rig)) < 0.6


def wall(points, normal=(0.0, 0.0, -1.0)):
    """Samples at points, before an object far behind them."""
    points = np.asarray(points, dtype=float)
    ones = np.ones(len(points))
    return Samples(points, np.tile(normal, (len(points), 1)), ones, ones)


BEHIND = Scene(plane(1.0, 1.0, 50.0))


def test_the_image_ends_at_the_outer_edges_of_its_pixels():
    intrinsics = CameraIntrinsics(8, 6, 10.0, 12.0, 3.25, 2.75)
    # Rays through the four corners of every pixel of a wider image, 1 % inside the pixel.
    u, v = np.meshgrid(np.arange(-2, 11), np.arange(-2, 9))
    u, v = u.ravel(), v.ravel()
    for du in (-0.495, 0.495):
        for dv in (-0.495, 0.495):
            z = np.linspace(1.0, 3.0, len(u))
            x, y = (u + du - 3.25) / 10.0 * z, (v + dv - 2.75) / 12.0 * z
            rig = Rig((forward(intrinsics=intrinsics),))
            found = visible_pairs(BEHIND, rig, wall(np.stack([x, y, z], axis=1)))
            expected = np.flatnonzero((u >= 0) & (u < 8) & (v >= 0) & (v < 6))
            np.testing.assert_array_equal(found.sample_index, expected)
            assert len(expected) == 48


def test_the_image_is_the_right_way_up():
    # x to the right, y down: the image's own axes, seen in the world through the pose.
    camera = looking_at(
        "c", (2.0, 0.0, 1.0), (0.0, 0.0, 1.0), intrinsics=CameraIntrinsics(10, 10, 10, 10, -0.5, 0)
    )
    # Only columns right of the principal point and rows below it are in the image.
    points = [[0, 0.5, 0.5], [0, -0.5, 0.5], [0, 0.5, 1.5], [0, -0.5, 1.5]]
    found = visible_pairs(BEHIND, Rig((camera,)), wall(points, (1.0, 0.0, 0.0)))
    np.testing.assert_array_equal(found.sample_index, [0])


def test_nothing_behind_the_camera_or_within_its_focal_length_is_seen():
    lens = Lens(0.05, 10.0)
    points = [[0, 0, z] for z in (-1.0, 0.0, 0.02, 0.05, 0.0501, 0.3)]
    found = visible_pairs(BEHIND, Rig((forward(lens=lens),)), wall(points))
    np.testing.assert_array_equal(found.sample_index, [4, 5])


def test_a_surface_is_seen_from_its_outer_side_only():
    points = [[0, 0, 1.0], [0.5, 0, 1.0]]
    rig = Rig((forward(),))
    assert len(visible_pairs(BEHIND, rig, wall(points, (0, 0, 1.0))).sample_index) == 0
    # Facing is told by the line of sight, not by the optical axis.
    oblique = visible_pairs(BEHIND, rig, wall(points, (-0.995, 0, 0.0999)))
    np.testing.assert_array_equal(oblique.sample_index, [1])


def test_a_wall_hides_what_is_behind_it():
    scene = Scene(merged(plane(1.0, 1.0, 1.0), plane(8.0, 8.0, 2.0)))
    x = np.array([0.0, 0.4, 0.9, 0.99, 1.01, 1.5])
    points = np.stack([x, np.zeros(6), np.full(6, 2.0)], axis=1)
    found = visible_pairs(scene, Rig((forward(),)), wall(points))
    # The near wall's shadow on the far one ends at x = 1.
    np.testing.assert_array_equal(found.sample_index, [4, 5])


def test_a_sheet_as_thin_as_a_shirt_hides_what_is_behind_it():
    scene = Scene(merged(plane(1.0, 1.0, 1.0), plane(1.0, 1.0, 1.002)))
    xy = np.stack(np.meshgrid(np.linspace(-0.4, 0.4, 9), np.linspace(-0.4, 0.4, 9)), axis=-1)
    for depth, seen in ((1.0, 81), (1.002, 0)):
        points = np.concatenate([xy.reshape(-1, 2), np.full((81, 1), depth)], axis=1)
        assert len(visible_pairs(scene, Rig((forward(),)), wall(points)).sample_index) == seen


def test_pairs_stand_camera_by_camera_samples_ascending():
    scene = Scene(sphere(0.4))
    rig = around(5, 1.5)
    visibility = visible_pairs(scene, rig, scene.sample(300, 0))
    assert visibility.camera_offsets.shape == (6,)
    assert visibility.camera_offsets[0] == 0
    assert visibility.camera_offsets[-1] == len(visibility.sample_index)
    for low, high in zip(
        visibility.camera_offsets[:-1], visibility.camera_offsets[1:], strict=True
    ):
        assert high > low
        assert (np.diff(visibility.sample_index[low:high]) > 0).all()


def test_blocks_of_rays_make_no_difference(monkeypatch):
    scene, rig = Scene(torus(0.4, 0.15)), around(4, 1.5)
    samples = scene.sample(200, 0)
    whole = visible_pairs(scene, rig, samples)
    monkeypatch.setattr("focus_planner.core.surface.visibility._RAYS_AT_ONCE", 7)
    blocks = visible_pairs(scene, rig, samples)
    np.testing.assert_array_equal(whole.sample_index, blocks.sample_index)
    np.testing.assert_array_equal(whole.camera_offsets, blocks.camera_offsets)


@pytest.mark.parametrize("oriented", [True, False])
@pytest.mark.parametrize(
    "mesh",
    [
        sphere(0.4, subdivisions=4),
        merged(
            sphere(0.2, (0.25, 0, 0), subdivisions=4), sphere(0.3, (-0.3, 0.1, 0), subdivisions=4)
        ),
    ],
    ids=["sphere", "two spheres"],
)
def test_a_dense_cloud_is_seen_like_its_mesh(mesh, oriented):
    dense = sample_mesh(mesh, 20_000, 1)
    cloud = PointCloud(dense.points, dense.normals if oriented else None)
    rig = around(6, 1.6)
    samples = sample_mesh(mesh, 2000, 5)
    seen = pairs_of(visible_pairs(Scene(mesh), rig, samples))
    scene = Scene(cloud)
    # The same points, with the estimated normals of the nearest points of the cloud.
    if not oriented:
        _, nearest = cKDTree(dense.points).query(samples.points)
        own = scene.sample(0, 0).take(nearest)
        samples = replace(samples, normals=own.normals, patches=own.patches)
    seen_cloud = pairs_of(visible_pairs(scene, rig, samples))
    assert len(seen ^ seen_cloud) < 0.04 * len(seen)


def test_a_sphere_shows_each_camera_its_analytic_share():
    # From distance D a sphere of radius R shows the cap cos > R/D: (1 − R/D)/2 of its area.
    mesh, rig = sphere(0.25, subdivisions=4), cylinder_rig(1, 4, radius=1.0, bottom=0, top=0)
    rig = Rig(tuple(looking_at(c.name, c.position, (0, 0, 0)) for c in rig.cameras))
    samples = Scene(mesh).sample(40_000, 0)
    counts = np.diff(visible_pairs(Scene(mesh), rig, samples).camera_offsets)
    np.testing.assert_allclose(counts / 40_000, (1 - 0.25) / 2, atol=0.01)


def test_a_flipped_mesh_is_seen_by_nobody():
    mesh = sphere(0.4)
    flipped = Mesh(mesh.vertices, mesh.triangles[:, ::-1])
    scene = Scene(flipped)
    assert len(visible_pairs(scene, around(4, 1.5), scene.sample(200, 0)).sample_index) == 0


# --- distortion, binning, region of interest -------------------------------------------------


def seen_of(points, intrinsics):
    """Which of the points before a camera at the origin it sees."""
    return visible_pairs(
        BEHIND, Rig((forward(intrinsics=intrinsics),)), wall(points)
    ).sample_index.tolist()


def at_pixels(intrinsics, u, v, depth=2.0):
    """Points that a pinhole images at these pixel coordinates."""
    u, v = np.ravel(u), np.ravel(v)
    x, y = (u - intrinsics.cx) / intrinsics.fx * depth, (v - intrinsics.cy) / intrinsics.fy * depth
    return np.column_stack([x, y, np.full(len(u), depth)])


def test_a_barrel_sees_what_the_pinhole_does_not_and_a_pincushion_less():
    # At 1.1 focal lengths from the centre the pinhole's image, which reaches to 320 / 300, is out.
    points = [[1.1, 0.0, 1.0], [1.0, 0.0, 1.0], [0.9, 0.0, 1.0]]
    assert seen_of(points, WIDE_ANGLE) == [1, 2]
    barrel = replace(WIDE_ANGLE, distortion_model="plumb_bob", distortion=(-0.05, 0, 0, 0))
    # 1.1 · (1 − 0.05 · 1.21) = 1.033
    assert seen_of(points, barrel) == [0, 1, 2]
    # 1.0 · (1 + 0.1) = 1.1; 0.9 · (1 + 0.081) = 0.973
    pincushion = replace(WIDE_ANGLE, distortion_model="plumb_bob", distortion=(0.1, 0, 0, 0))
    assert seen_of(points, pincushion) == [2]


def test_what_folds_back_into_the_image_is_not_seen():
    # r − r³/3 grows up to r = 1, and is 0 again, as on the axis, at √3.
    intrinsics = replace(WIDE_ANGLE, distortion_model="plumb_bob", distortion=(-1 / 3, 0, 0, 0))
    r = np.array([0.0, 0.5, 0.999, 1.001, 1.5, np.sqrt(3)])
    u, v = reference.pixels(intrinsics, r, 0 * r)
    assert reference.is_read(intrinsics, u, v).all()
    assert seen_of(np.column_stack([r, 0 * r, 1 + 0 * r]), intrinsics) == [0, 1, 2]
    # Off the axes as well, where a rectangle around what is seen holds more than that.
    assert seen_of(np.column_stack([0.6 * r, 0.8 * r, 1 + 0 * r]), intrinsics) == [0, 1, 2]


def test_tangential_terms_do_not_fold_back_either():
    # x + 3 p₂ x² is 0 again at x = −1 / (3 p₂).
    intrinsics = replace(WIDE_ANGLE, distortion_model="plumb_bob", distortion=(0, 0, 0, 0.01))
    assert seen_of([[-1 / 0.03, 0.0, 1.0], [-0.5, 0.0, 1.0]], intrinsics) == [1]


def test_a_pole_is_not_passed():
    # r / (1 − r²/4) is infinite at r = 2, and comes back from the other side.
    intrinsics = replace(
        WIDE_ANGLE, distortion_model="rational_polynomial", distortion=(0, 0, 0, 0, 0, -0.25, 0, 0)
    )
    assert seen_of([[0.5, 0.0, 1.0], [100.0, 0.0, 1.0]], intrinsics) == [0]


def test_a_fisheye_sees_up_to_a_right_angle_and_nothing_behind():
    intrinsics = CameraIntrinsics(400, 400, 120.0, 120.0, 199.5, 199.5, "equidistant", (0.0,) * 4)
    angles = np.radians([0.0, 45.0, 80.0, 89.0, 91.0, 100.0, 180.0])
    points = np.column_stack([np.sin(angles), 0 * angles, np.cos(angles)]) * 10
    # 120 px a radian: 89° is imaged 186 px from the centre, 100° would be 209 px from it.
    found = visible_pairs(
        BEHIND, Rig((forward(intrinsics=intrinsics),)), wall(points, (-0.7, 0.0, -0.7))
    ).sample_index.tolist()
    assert found == [0, 1, 2, 3]
    narrow = replace(intrinsics, distortion=(-0.3, 0.0, 0.0, 0.0))  # grows up to 60.4°
    assert seen_of(points, narrow) == [0, 1]


def test_a_region_of_the_left_half_sees_the_left_half_of_a_wall():
    random = np.random.default_rng(1)
    u, v = random.uniform(-40, 680, 500), random.uniform(-40, 520, 500)
    points = at_pixels(WIDE_ANGLE, u, v)
    left = seen_of(points, replace(WIDE_ANGLE, region=(0, 0, 320, 480)))
    right = seen_of(points, replace(WIDE_ANGLE, region=(320, 0, 320, 480)))
    middle = (WIDE_ANGLE.width - 1) / 2
    assert left == [p for p in seen_of(points, WIDE_ANGLE) if u[p] < middle]
    assert sorted(left + right) == seen_of(points, WIDE_ANGLE)


def test_what_binning_leaves_over_is_not_seen():
    # Of 7 columns from the second on, three bins of two; of 5 rows from the third, one of three.
    intrinsics = replace(WIDE_ANGLE, region=(1, 2, 7, 5), binning=(2, 3))
    u, v = np.meshgrid(np.arange(10), np.arange(10))
    u, v = u.ravel(), v.ravel()
    expected = np.flatnonzero((u >= 1) & (u < 7) & (v >= 2) & (v < 5)).tolist()
    for shift in (-0.49, 0.49):
        assert seen_of(at_pixels(intrinsics, u + shift, v + shift), intrinsics) == expected


@settings(max_examples=25)
@given(
    st.lists(varied(st.sampled_from([WIDE_ANGLE, CameraIntrinsics()])), min_size=1, max_size=4),
    st.integers(0),
)
def test_any_cameras_see_what_the_oracle_says(images, seed):
    random = np.random.default_rng(seed)
    points, ones = random.uniform(-2, 2, (80, 3)), np.ones(80)
    cameras = []
    for i, intrinsics in enumerate(images):
        q = random.standard_normal(4)
        cameras.append(Camera(f"c{i}", (0.0, 0.0, 0.0), tuple(q / np.linalg.norm(q)), intrinsics))
    samples = Samples(points, -points / np.linalg.norm(points, axis=1)[:, None], ones, ones)
    found = pairs_of(visible_pairs(BEHIND, Rig(tuple(cameras)), samples))
    for c, camera in enumerate(cameras):
        for p, point in enumerate(points):
            u, v, inside = reference.in_image(camera, point)
            edges = np.abs(np.array([u + 0.5, v + 0.5]) % 1)
            if math.isnan(u) or np.minimum(edges, 1 - edges).min() > 1e-6:
                depth = (point - camera.position) @ reference.camera_axes(camera)[2]
                assert ((p, c) in found) == (inside and depth > camera.lens.focal_length), (p, c)


DISTORTED = (
    CameraIntrinsics(50, 40, 80.0, 30.0, 90.0, -7.0, "plumb_bob", (0.1, 0.0, 0.002, -0.001)),
    replace(WIDE_ANGLE, distortion_model="plumb_bob", distortion=(-0.3, 0.1, 1e-3, 1e-3, -0.02)),
    replace(
        WIDE_ANGLE, distortion_model="equidistant", distortion=(0.0,) * 4, region=(9, 9, 300, 400)
    ),
    replace(WIDE_ANGLE, fx=150.0, fy=150.0, distortion_model="equidistant", distortion=(0.0,) * 4),
)


def in_view(camera, samples, facing):
    """What is in the camera's image, and faces it, sample by sample, as the kernel rounds it."""
    x_axis, y_axis, z_axis = rotation_from_quaternion(np.array([camera.orientation]))[0].T
    dx, dy, dz = (samples.points - camera.position).T

    def along(axis):
        return axis[0] * dx + axis[1] * dy + axis[2] * dz

    intrinsics, z = camera.intrinsics, along(z_axis)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if intrinsics.distortion_model:
            x, y = along(x_axis) / z, along(y_axis) / z
            u, v = reference.pixels(intrinsics, x, y)
            inside = (
                np.hypot(x, y) < frustum_and_projection(intrinsics)[1][1]
            ) & reference.is_read(intrinsics, u, v)
        else:
            u, v = (
                intrinsics.fx * along(x_axis) / z + intrinsics.cx,
                intrinsics.fy * along(y_axis) / z + intrinsics.cy,
            )
            inside = (
                (u >= -0.5)
                & (u < intrinsics.width - 0.5)
                & (v >= -0.5)
                & (v < intrinsics.height - 0.5)
            )
    front = (samples.normals.T * [dx, dy, dz]).sum(axis=0) < 0
    return np.flatnonzero(inside & (z > camera.lens.focal_length) & (front | (not facing)))


@pytest.mark.parametrize("facing", [True, False])
@pytest.mark.parametrize("offset", [0.0, 5e3], ids=["here", "far from the origin"])
@pytest.mark.parametrize("size", [0.0, 0.05, 2.0], ids=["a point", "a hand", "a hall"])
@pytest.mark.parametrize(
    "images",
    [
        (CameraIntrinsics(), WIDE_ANGLE, CameraIntrinsics(50, 40, 80.0, 30.0, 90.0, -7.0)),
        (WIDE_ANGLE, *DISTORTED),
    ],
    ids=["pinholes", "distorted"],
)
def test_blocks_of_samples_lose_none_and_add_none(size, offset, facing, images):
    random = np.random.default_rng(0)
    normals = random.standard_normal((3000, 3)) * 0.4 + [1.0, 0.5, 0.0]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points, ones = offset + size * random.standard_normal((3000, 3)), np.ones(3000)
    patches = None if facing else np.zeros(3000, dtype=np.int32)
    samples = Samples(points, normals, ones, ones, patches)
    cameras = []
    for i in range(60):
        q = random.standard_normal(4)
        position = tuple(offset + random.standard_normal(3))
        cameras.append(
            Camera(f"c{i}", position, tuple(q / np.linalg.norm(q)), images[i % len(images)])
        )
    # What hides nothing and is oriented, or not.
    away = plane(1.0, 1.0, 1e5)
    points = sample_mesh(away, 50, 0).points
    scene = Scene(away if facing else PointCloud(points))
    found = visible_pairs(scene, Rig(tuple(cameras)), samples)
    some = 0
    for c, camera in enumerate(cameras):
        expected = in_view(camera, samples, facing)
        if not facing:  # all turned together, or none
            turned = replace(samples, normals=found.normals)
            expected = np.intersect1d(expected, in_view(camera, turned, True))
        part = slice(found.camera_offsets[c], found.camera_offsets[c + 1])
        np.testing.assert_array_equal(found.sample_index[part], expected)
        some += len(expected)
    assert size == 0.0 or some > 1000


def assert_same(a, b):
    np.testing.assert_array_equal(a.camera_offsets, b.camera_offsets)
    np.testing.assert_array_equal(a.sample_index, b.sample_index)
    np.testing.assert_array_equal(a.normals, b.normals)


def formulated(kind, count=4000):
    drawn = sample_mesh(torus(0.4, 0.15), 3000, 1)
    surface = {
        "mesh": torus(0.4, 0.15),
        "cloud": PointCloud(drawn.points, drawn.normals),
        "cloud without normals": PointCloud(drawn.points),
    }[kind]
    scene = Scene(surface)
    return scene, around(7, 1.5), scene.sample(count, 2)


KINDS = ("mesh", "cloud", "cloud without normals")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shuffled", [False, True])
def test_being_asked_changes_nothing(kind, shuffled):
    scene, rig, samples = formulated(kind)
    order = np.random.default_rng(1).permutation(len(samples)) if shuffled else None
    asked = []
    found = visible_pairs(scene, rig, samples, lambda share: asked.append(share) or True, order)
    assert len(asked) > 2
    assert 0 < asked[0] < asked[-1] < 1
    assert asked == sorted(asked)
    assert_same(found, visible_pairs(scene, rig, samples))
    np.testing.assert_array_equal(found.taken, np.arange(len(samples)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shuffled", [False, True])
@pytest.mark.parametrize("questions", [1, 3])
def test_an_ended_search_is_that_of_the_samples_taken(kind, shuffled, questions):
    scene, rig, samples = formulated(kind)
    order = np.random.default_rng(1).permutation(len(samples)) if shuffled else None
    answers = iter([True] * (questions - 1) + [False])
    found = visible_pairs(scene, rig, samples, lambda _: next(answers), order)
    count = len(found.taken)
    assert 0 < count < len(samples)
    first = np.arange(count) if order is None else np.sort(order[:count])
    np.testing.assert_array_equal(found.taken, first)
    assert_same(found, visible_pairs(scene, rig, samples.take(first)))


def test_questions_come_at_once_and_then_steadily(monkeypatch):
    scene, rig, samples = formulated("mesh", 20_000)
    cast = []
    occluded = scene.occluded
    monkeypatch.setattr(scene, "occluded", lambda rays: (cast.append(len(rays)), occluded(rays))[1])
    visible_pairs(scene, rig, samples, lambda _: True)
    assert cast[0] < 512 * len(rig)
    assert max(cast) < 100_000
