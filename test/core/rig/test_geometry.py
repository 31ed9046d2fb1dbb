# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from focus_planner import CameraIntrinsics, Rig
from focus_planner.core.rig.geometry import (
    camera_positions,
    camera_rotations,
    image_corners,
    rotation_from_quaternion,
)
from testing import reference
from testing.problems import around, forward, looking_at


def test_rotations_are_scipys():
    quaternions = Rotation.random(200, rng=np.random.default_rng(1)).as_quat()
    matrices = rotation_from_quaternion(quaternions)
    assert matrices.shape == (200, 3, 3)
    np.testing.assert_allclose(
        matrices, Rotation.from_quat(quaternions).as_matrix(), rtol=0, atol=1e-14
    )


def test_columns_are_the_cameras_axes():
    rig = around(5, 1.0)
    for camera, rotation in zip(rig.cameras, camera_rotations(rig), strict=True):
        np.testing.assert_allclose(rotation.T, reference.camera_axes(camera), atol=1e-14)


def test_a_camera_turned_nowhere_looks_along_z():
    rig = Rig((forward("a", (1, 2, 3)), forward("b")))
    np.testing.assert_array_equal(camera_rotations(rig), [np.eye(3), np.eye(3)])
    np.testing.assert_array_equal(camera_positions(rig), [[1, 2, 3], [0, 0, 0]])


def test_corners_of_an_image_of_a_camera_turned_nowhere():
    # Pixel 0 is centred at 0, so that the image begins half a pixel before.
    intrinsics = CameraIntrinsics(100, 80, 50.0, 40.0, 49.5, 39.5)
    corners = image_corners(forward("a", (1.0, 2.0, 3.0), intrinsics=intrinsics), 2.0)
    np.testing.assert_allclose(
        corners, [[-1, 0, 5], [3, 0, 5], [3, 4, 5], [-1, 4, 5]], rtol=0, atol=1e-12
    )


def test_corners_of_an_image_whose_axis_is_not_in_its_middle():
    intrinsics = CameraIntrinsics(100, 80, 50.0, 40.0, -0.5, 79.5)
    corners = image_corners(forward(intrinsics=intrinsics), 0.5)
    np.testing.assert_allclose(
        corners, [[0, -1, 0.5], [1, -1, 0.5], [1, 0, 0.5], [0, 0, 0.5]], rtol=0, atol=1e-12
    )


def test_corners_of_a_region_are_those_of_the_pixels_read():
    intrinsics = CameraIntrinsics(
        101, 81, 50.0, 40.0, 49.5, 39.5, region=(50, 40, 51, 41), binning=(2, 2)
    )
    corners = image_corners(forward(intrinsics=intrinsics), 2.0)
    np.testing.assert_allclose(
        corners, [[0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]], rtol=0, atol=1e-12
    )


def test_corners_of_a_distorted_image_are_imaged_there():
    intrinsics = CameraIntrinsics(
        100, 80, 50.0, 40.0, 49.5, 39.5, "plumb_bob", (-0.05, 0.0, 0.001, 0.002)
    )
    camera = looking_at("a", (1.0, 2.0, 0.5), (0.0, 0.0, 0.0), intrinsics=intrinsics)
    corners = image_corners(camera, 3.0)
    places = [reference.in_image(camera, corner)[:2] for corner in corners]
    pixels = [(-0.5, -0.5), (99.5, -0.5), (99.5, 79.5), (-0.5, 79.5)]
    np.testing.assert_allclose(places, pixels, rtol=0, atol=1e-5)


def test_corners_of_a_camera_that_looks_at_the_origin_upright():
    intrinsics = CameraIntrinsics(100, 80, 50.0, 40.0, 49.5, 39.5)
    camera = looking_at("a", (2.0, 0.0, 0.0), (0.0, 0.0, 0.0), intrinsics=intrinsics)
    # It looks along -x: its right is +y, its down is -z.
    np.testing.assert_allclose(
        image_corners(camera, 1.0),
        [[1, -1, 1], [1, 1, 1], [1, 1, -1], [1, -1, -1]],
        rtol=0,
        atol=1e-12,
    )


@pytest.mark.parametrize("depth", [0.3, 1.0, 7.0])
def test_corners_are_projected_onto_the_images_corners(depth):
    intrinsics = CameraIntrinsics(580, 870, 1190.0, 1200.0, 284.8, 434.4)
    for camera in around(5, 1.0, intrinsics=intrinsics).cameras:
        axes = np.array(reference.camera_axes(camera))
        seen = (image_corners(camera, depth) - np.array(camera.position)) @ axes.T
        np.testing.assert_allclose(seen[:, 2], depth, rtol=1e-12)
        u = intrinsics.fx * seen[:, 0] / seen[:, 2] + intrinsics.cx
        v = intrinsics.fy * seen[:, 1] / seen[:, 2] + intrinsics.cy
        np.testing.assert_allclose(u, [-0.5, 579.5, 579.5, -0.5], atol=1e-9)
        np.testing.assert_allclose(v, [-0.5, -0.5, 869.5, 869.5], atol=1e-9)
