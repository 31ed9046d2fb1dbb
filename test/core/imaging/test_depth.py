# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from dataclasses import replace

import cv2
import numpy as np
import pytest

from focus_planner import Camera, CameraIntrinsics, Mesh, PointCloud, Scene
from focus_planner.core.imaging.depth import DepthCamera, listed_by_tile
from focus_planner.core.imaging.pixels import pixel_grid, tiles_of
from focus_planner.core.rig.geometry import rotation_from_quaternion

SMALL = CameraIntrinsics(width=80, height=60, fx=90.0, fy=85.0, cx=38.3, cy=30.9)
IMAGES = {
    "pinhole": SMALL,
    "barrel": replace(SMALL, distortion_model="plumb_bob", distortion=(-0.25, 0.06, 2e-3, -1e-3)),
    "rational": replace(
        SMALL,
        distortion_model="rational_polynomial",
        distortion=(0.3, -0.1, 1e-3, -7e-4, 0.02, 0.4, 0.05, -0.01, 2e-3, -1e-3, 3e-3, 5e-4),
    ),
    "fisheye": replace(
        SMALL, fx=45.0, fy=45.0, distortion_model="equidistant", distortion=(-0.02, 0.01, 0.0, 0.0)
    ),
    "region and bins": replace(SMALL, region=(7, 11, 61, 45), binning=(2, 3)),
    "distorted region and bins": replace(
        SMALL,
        region=(7, 11, 61, 45),
        binning=(2, 3),
        distortion_model="plumb_bob",
        distortion=(-0.25, 0.06, 2e-3, -1e-3),
    ),
}
images = pytest.mark.parametrize("intrinsics", IMAGES.values(), ids=IMAGES.keys())


def camera_with(intrinsics=SMALL, position=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0)):
    return Camera("cam", position, orientation, intrinsics)


def random_triangles(seed=0, count=200):
    """Return triangles all around the origin, some of them behind it, some through its plane."""
    random = np.random.default_rng(seed)
    middles = 3 * random.standard_normal((count, 1, 3)) + np.array([0, 0, 2])
    corners = middles + random.standard_normal((count, 3, 3))
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def pixel_centres(intrinsics):
    """Return (H, W) u and v of the centres of the pixels as they are read out."""
    x, y, width, height = intrinsics.pixels_read
    columns, rows = intrinsics.binning
    u = x - 0.5 + columns * (np.arange(width // columns) + 0.5)
    v = y - 0.5 + rows * (np.arange(height // rows) + 0.5)
    return np.meshgrid(u, v)


def cast(scene, camera, rays):
    """Return the depth that Open3D's rays hit at."""
    rotation = rotation_from_quaternion(np.array(camera.orientation))
    directions = np.column_stack([rays.reshape(-1, 2), np.ones(rays[..., 0].size)]) @ rotation.T
    origins = np.broadcast_to(np.array(camera.position), directions.shape)
    return scene.first_hits(origins, directions)[0].reshape(rays.shape[:2])


@images
def test_pixels_show_the_rays_that_opencv_images_at_their_centres(intrinsics):
    rays = tiles_of(intrinsics, pixel_grid(intrinsics)).rays
    u, v = pixel_centres(intrinsics)
    assert rays.shape == (*u.shape, 2)
    points = np.concatenate([rays, np.ones((*u.shape, 1))], axis=-1).reshape(-1, 1, 3)
    matrix = np.array(
        [[intrinsics.fx, 0, intrinsics.cx], [0, intrinsics.fy, intrinsics.cy], [0, 0, 1]]
    )
    nothing, k = np.zeros(3), np.array(intrinsics.distortion or (0.0,) * 4)
    project = (
        cv2.fisheye.projectPoints
        if intrinsics.distortion_model == "equidistant"
        else cv2.projectPoints
    )
    if project is cv2.projectPoints:
        imaged, _ = project(points, nothing, nothing, matrix, k)
    else:
        imaged, _ = project(points, nothing, nothing, matrix, k.reshape(4, 1))
    np.testing.assert_allclose(imaged.reshape(*u.shape, 2), np.stack([u, v], -1), atol=1e-5)


@images
@pytest.mark.parametrize("seed", range(3))
def test_depths_are_where_rays_through_pixels_first_hit(intrinsics, seed):
    turned = np.random.default_rng(seed).standard_normal(4)
    orientation = tuple((turned / np.linalg.norm(turned)).tolist())
    camera = camera_with(intrinsics, (0.1, -0.2, 0.3), orientation)
    scene = Scene(random_triangles(seed))
    depths = DepthCamera(scene).depths(camera)
    expected = cast(scene, camera, tiles_of(intrinsics, pixel_grid(intrinsics)).rays)
    close = np.isclose(depths, expected, rtol=1e-3)
    assert np.isfinite(expected).mean() > 0.2
    assert (~close).mean() < 2e-3  # single precision in the rays: a few graze an edge


def test_a_cloud_is_as_opaque_as_for_planning():
    random = np.random.default_rng(1)
    directions = random.standard_normal((4000, 3))
    scene = Scene(PointCloud(directions / np.linalg.norm(directions, axis=1)[:, None]))
    camera = camera_with(position=(0.0, 0.0, -3.0))
    depths = DepthCamera(scene).depths(camera)
    expected = cast(scene, camera, tiles_of(SMALL, pixel_grid(SMALL)).rays)
    assert (~np.isclose(depths, expected, rtol=1e-4)).mean() < 2e-3
    assert depths.min() == pytest.approx(2, abs=0.01)


def plane(depth, half=5.0):
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    vertices = np.column_stack([corners, np.full(4, depth)])
    return Mesh(vertices, np.array([[0, 2, 1], [0, 3, 2]]))


def test_depth_is_along_the_axis():
    depths = DepthCamera(Scene(plane(2.0))).depths(camera_with())
    np.testing.assert_allclose(depths, 2.0, rtol=1e-6)


def test_neighbouring_triangles_leave_no_gap():
    # Rays hit vertices and edges of this grid exactly.
    u, v = np.meshgrid(np.arange(-1, 82), np.arange(-1, 62))
    intrinsics = replace(SMALL, fx=64.0, fy=64.0, cx=32.0, cy=32.0)
    vertices = np.column_stack([(u.ravel() - 32) / 64, (v.ravel() - 32) / 64, np.ones(u.size)])
    here = (np.arange(61)[:, None] * 83 + np.arange(82)).ravel()
    triangles = np.concatenate(
        [np.stack([here, here + 83, here + 84], 1), np.stack([here, here + 84, here + 1], 1)]
    )
    depths = DepthCamera(Scene(Mesh(vertices, triangles))).depths(camera_with(intrinsics))
    np.testing.assert_allclose(depths, 1.0, rtol=1e-6)


def test_where_nothing_is_depth_is_infinite():
    behind = DepthCamera(Scene(plane(-2.0))).depths(camera_with())
    assert np.isinf(behind).all()


def test_beyond_what_a_fisheye_sees_there_is_nothing():
    intrinsics = replace(
        SMALL, fx=15.0, fy=15.0, distortion_model="equidistant", distortion=(0.0,) * 4
    )
    depths = DepthCamera(Scene(plane(1.0, 1e4))).depths(camera_with(intrinsics))
    u, v = pixel_centres(intrinsics)
    off_axis = np.hypot((u - intrinsics.cx) / 15, (v - intrinsics.cy) / 15)
    assert np.isinf(depths[off_axis > np.pi / 2]).all()
    assert np.isfinite(depths[off_axis < 1.5]).all()


def test_a_smaller_picture_shows_the_same():
    depths = DepthCamera(Scene(random_triangles(2))).depths(camera_with(), scale=0.5)
    assert depths.shape == (30, 40)
    assert pixel_grid(SMALL, 0.5).first == (0.5, 0.5)
    assert pixel_grid(SMALL, 1e-6).width == 1


def test_a_triangle_far_beside_the_picture_is_in_none_of_its_tiles():
    # From before the camera to behind it, 1 m to the right: only seen at more than 1 / 0.1.
    radius = 0.01
    triangle = np.array([[1.0, 0.0, 0.1], [1.2, 0.1, 0.1], [1.0, 0.2, -0.1]])
    tiles = tiles_of(SMALL, pixel_grid(SMALL))
    corners = np.array([[0, 1, 2]], np.int32)
    for beside in (triangle, triangle * [-1, 1, 1], triangle[:, [1, 0, 2]]):
        placed = np.ascontiguousarray(beside)
        assert not len(listed_by_tile(placed, corners, tiles, radius, 1.0).listed)
    across = triangle - [1.0, 0.0, 0.0]  # within the aperture: it may be seen anywhere
    listed = listed_by_tile(np.ascontiguousarray(across), corners, tiles, radius, 1.0).listed
    assert len(listed) == tiles.bounds[..., 0].size
