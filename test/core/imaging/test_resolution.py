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

from focus_planner import Camera, CameraIntrinsics, Lens, Rig, Scene
from focus_planner.core.imaging.depth import DepthCamera
from focus_planner.core.imaging.resolution import fine_pixels
from focus_planner.core.surface.resolution import metres_per_pixel
from testing import reference
from testing.problems import plane, sphere

IMAGE = CameraIntrinsics(120, 80, 100.0, 100.0, 59.5, 39.5)


def looking(intrinsics=IMAGE):
    return Camera("cam", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), intrinsics, Lens(0.05, 10.0))


def fine(surface, most, intrinsics=IMAGE, scale=1.0):
    camera = looking(intrinsics)
    depths = DepthCamera(Scene(surface)).depths(camera, scale)
    return fine_pixels(depths, camera, most, scale), depths


@pytest.mark.parametrize("scale", [1.0, 0.5, 0.25])
@pytest.mark.parametrize("binning", [(1, 1), (2, 2)])
def test_a_plane_that_faces_the_camera_has_depth_over_focal_length(binning, scale):
    # 10 mm per pixel at 1 m, whatever the size of the picture; twice that in bins of two.
    image = replace(IMAGE, binning=binning)
    length = 10.0 * binning[0]
    for most, expected in ((1.01 * length, True), (0.99 * length, False)):
        mask, depths = fine(plane(5.0, 5.0, 1.0), most, image, scale)
        assert np.isfinite(depths).all()
        assert (mask == expected).all()


def test_without_a_limit_all_pixels_are():
    mask, depths = fine(plane(0.2, 0.2, 1.0), math.inf)
    assert mask.all()
    assert not np.isfinite(depths).all()


def test_where_the_surface_is_not_no_pixel_is():
    mask, depths = fine(plane(0.2, 0.2, 1.0), 100.0)
    assert (mask == np.isfinite(depths)).all()


@pytest.mark.parametrize(
    "distortion",
    [{}, {"distortion_model": "plumb_bob", "distortion": (-0.2, 0.05, 0.001, -0.002)}],
)
def test_on_a_curved_surface_it_agrees_with_the_tangent_plane(distortion):
    centre, radius = np.array([0.05, 0.0, 1.0]), 0.3
    ball = sphere(radius, centre, subdivisions=5)
    camera = looking(replace(IMAGE, width=480, height=320, fx=400.0, fy=400.0, cx=239.5, cy=159.5))
    camera = replace(camera, intrinsics=replace(camera.intrinsics, **distortion))
    scene = Scene(ball)
    depths = DepthCamera(scene).depths(camera)
    samples = scene.sample(4000, 0)
    towards = -samples.points / np.linalg.norm(samples.points, axis=1)[:, None]
    front = samples.take(np.flatnonzero((samples.normals * towards).sum(axis=1) > 0.25))
    lengths = 1000 * metres_per_pixel(
        front.points, front.normals, Rig((camera,)), np.zeros(len(front), dtype=np.int32)
    )
    u, v = reference.pixels(camera.intrinsics, *(front.points[:, :2] / front.points[:, 2:]).T)
    columns, rows = np.rint(u).astype(int), np.rint(v).astype(int)
    for share in (0.2, 0.5, 0.8):
        most = float(np.quantile(lengths, share))
        told = fine_pixels(depths, camera, most)[rows, columns]
        clear = np.abs(lengths / most - 1) > 0.12  # facets, and the pixel beside the point
        assert clear.sum() > 600
        assert (told == (lengths <= most))[clear].mean() > 0.99
