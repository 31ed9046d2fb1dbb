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
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.resolution import (
    metres_per_pixel,
    only_pairs,
    pair_cameras,
    pairs_metres_per_pixel,
)
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.intrinsics import varied
from testing.problems import around, camera, forward, looking_at, plane, sphere

IMAGE = CameraIntrinsics(640, 480, 300.0, 300.0, 319.5, 239.5)
TOWARDS = (0.0, 0.0, -1.0)


def length(one, point, normal):
    """Of a single point before a single camera."""
    points, normals = np.array([point], dtype=float), np.array([normal], dtype=float)
    return metres_per_pixel(points, normals, Rig((one,)), np.zeros(1, dtype=np.int32))[0]


def tilted(degrees, about=0.0):
    """A normal towards the camera, tilted about an axis in the picture's plane."""
    axis = np.array([math.cos(about), math.sin(about), 0.0])
    return Rotation.from_rotvec(math.radians(degrees) * axis).apply(TOWARDS)


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.6), (0.3, -0.2, 0.6), (-0.6, 0.4, 0.6)])
def test_on_a_plane_that_faces_the_camera_it_is_depth_over_focal_length(point):
    assert length(forward(intrinsics=IMAGE), point, TOWARDS) == pytest.approx(0.6 / 300, rel=1e-14)


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0, 60.0, 85.0, 89.9])
@pytest.mark.parametrize("about", [0.0, 0.7, math.pi / 2, 2.5])
def test_on_the_axis_a_tilt_lengthens_it_by_its_cosine(degrees, about):
    told = length(forward(intrinsics=IMAGE), (0.0, 0.0, 0.75), tilted(degrees, about))
    assert told == pytest.approx(0.75 / 300 / math.cos(math.radians(degrees)), rel=1e-9)


def test_pixels_that_are_not_square_count_by_their_longer_side():
    for fx, fy in ((300.0, 400.0), (400.0, 300.0)):
        one = forward(intrinsics=replace(IMAGE, fx=fx, fy=fy))
        assert length(one, (0.1, 0.1, 0.6), TOWARDS) == pytest.approx(0.6 / 300)


def test_bins_are_pixels():
    once, binned = (forward(intrinsics=replace(IMAGE, binning=b)) for b in ((1, 1), (3, 2)))
    assert length(binned, (0.0, 0.0, 0.6), TOWARDS) == pytest.approx(
        3 * length(once, (0.0, 0.0, 0.6), TOWARDS)
    )


def test_the_sign_of_the_normal_does_not_matter():
    one, normal = forward(intrinsics=IMAGE), np.array([0.3, -0.5, -0.8])
    assert length(one, (0.1, 0.2, 0.6), normal) == length(one, (0.1, 0.2, 0.6), -normal)


def test_seen_edge_on_it_is_infinite():
    assert length(forward(intrinsics=IMAGE), (0.0, 0.0, 0.6), (1.0, 0.0, 0.0)) == math.inf


def test_a_fisheye_without_coefficients_has_equal_angles_per_pixel():
    # A sphere about the camera's centre: a pixel is 1 / f of its radius towards the axis, and
    # across that θ / sin θ less.
    image = replace(IMAGE, distortion_model="equidistant", distortion=(0.0,) * 4)
    for angle in (0.0, 1e-9, 1e-5, 0.2, 0.9, 1.4):
        away = np.array([math.sin(angle), 0.0, math.cos(angle)])
        told = length(forward(intrinsics=image), 0.8 * away, -away)
        assert told == pytest.approx(0.8 / 300, rel=1e-8)


@given(
    image=varied(st.just(IMAGE)),
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    ray=st.tuples(st.floats(-0.7, 0.7), st.floats(-0.5, 0.5)),
    depth=st.floats(0.2, 5.0),
    normal=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
)
def test_it_agrees_with_steps_along_the_surface(image, turn, ray, depth, normal):
    assume(reference.grows(image, 1.1 * math.hypot(*ray) + 1e-3))
    rotation = Rotation.from_rotvec(turn)
    one = camera(position=(0.3, -0.2, 0.7), orientation=tuple(rotation.as_quat()), intrinsics=image)
    point = np.array(one.position) + rotation.apply(depth * np.array([*ray, 1.0]))
    assume(np.linalg.norm(normal) > 0.1)
    normal = np.array(normal) / np.linalg.norm(normal)
    sight = (point - np.array(one.position)) / np.linalg.norm(point - np.array(one.position))
    assume(abs(normal @ sight) > 0.1)
    expected = reference.metres_per_pixel(one, point, normal)
    assert length(one, point, normal) == pytest.approx(expected, rel=2e-3)


def test_each_pair_has_that_of_its_camera_and_sample():
    kinds = [
        {},
        {"distortion_model": "plumb_bob", "distortion": (-0.2, 0.05, 0.001, -0.002)},
        {"distortion_model": "equidistant", "distortion": (0.02, -0.01, 0.0, 0.0), "fx": 200.0},
        {"binning": (2, 4)},
    ]
    plain = around(4, 1.2).cameras
    rig = Rig(
        tuple(
            replace(one, intrinsics=replace(one.intrinsics, **kind))
            for one, kind in zip(plain, kinds, strict=True)
        )
    )
    scene = Scene(sphere(0.3))
    samples = scene.sample(60, 1)
    visibility = visible_pairs(scene, rig, samples)
    lengths = pairs_metres_per_pixel(visibility, samples, rig)
    pairs = list(zip(pair_cameras(visibility), visibility.sample_index, lengths, strict=True))
    assert {c for c, _, _ in pairs} == set(range(4))
    for c, p, told in pairs:
        expected = reference.metres_per_pixel(
            rig.cameras[c], samples.points[p], visibility.normals[p]
        )
        assert told == pytest.approx(expected, rel=2e-3)


def test_pairs_are_taken_out_camera_by_camera():
    scene, rig = Scene(sphere(0.3)), around(3, 1.0)
    visibility = visible_pairs(scene, rig, scene.sample(50, 1))
    kept = np.random.default_rng(0).random(len(visibility.sample_index)) < 0.5
    part = only_pairs(visibility, kept)
    before = set(zip(pair_cameras(visibility)[kept], visibility.sample_index[kept], strict=True))
    assert set(zip(pair_cameras(part), part.sample_index, strict=True)) == before
    assert len(part.sample_index) == kept.sum()
    assert part.camera_offsets[-1] == kept.sum()
    none = only_pairs(visibility, np.zeros_like(kept))
    assert none.camera_offsets.tolist() == [0] * 4


def test_a_surface_looked_at_from_afar_is_imaged_more_coarsely():
    scene = Scene(plane(0.2, 0.2, 0.0))
    rig = Rig(tuple(looking_at(f"c{k}", (0, 0.01, -k / 2), (0, 0, 0)) for k in (1, 2)))
    samples = scene.sample(40, 0)
    visibility = visible_pairs(scene, rig, samples)
    lengths = pairs_metres_per_pixel(visibility, samples, rig)
    near, far = (lengths[pair_cameras(visibility) == c] for c in range(2))
    assert len(near) == len(far) == 40
    assert near == pytest.approx(0.5 / 300, rel=0.03)
    assert far == pytest.approx(1.0 / 300, rel=0.03)
