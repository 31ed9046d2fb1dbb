# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where cameras of a rig image points, by OpenCV; and whether that is where others say."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.rig import Rig

#: Half of what the tests' narrowest image shows, as a tangent.
_ACROSS = 0.35


def imaged(camera: Camera, points: FloatArray) -> FloatArray:
    """Return (n, 2) pixels of points in the optical frame; the first pixel's centre is 0."""
    image = camera.intrinsics
    matrix = np.array([[image.fx, 0, image.cx], [0, image.fy, image.cy], [0, 0, 1.0]])
    given = points.reshape(-1, 1, 3)
    nothing, coefficients = np.zeros(3), np.array(image.distortion or (0.0,) * 4)
    if image.distortion_model == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(given, nothing, nothing, matrix, coefficients)
    else:
        pixels, _ = cv2.projectPoints(given, nothing, nothing, matrix, coefficients)
    return np.asarray(pixels).reshape(-1, 2)


def assert_images_alike(
    rig: Rig,
    true: Rig,
    pixel: Callable[[Sequence[float]], tuple[float, float]],
    within: float = 1e-6,
    *,
    corner: float = 0.5,
) -> None:
    """Raise unless a rig images points of the world where another program has them.

    Parameters
    ----------
    rig : Rig
        As it was read.
    true : Rig
        With the poses that were written.
    pixel : callable
        A point of an optical frame in, the pixel out, by the program's own formula.
    within : float
        Pixels.
    corner : float
        Where the program has the centre of the first pixel.
    """
    rays = np.random.default_rng(3).uniform(-_ACROSS, _ACROSS, (40, 3))
    rays[:, 2] = 1.0
    depths = np.linspace(0.3, 3.0, len(rays))[:, None]
    poses = zip(
        rig.cameras, camera_rotations(rig), camera_positions(rig),
        camera_rotations(true), camera_positions(true), strict=True,
    )  # fmt: skip
    for camera, turn, place, true_turn, true_place in poses:
        points_world = (depths * rays) @ true_turn.T + true_place
        expected = np.array([pixel(point) for point in depths * rays]) - corner
        found = imaged(camera, (points_world - place) @ turn)
        assert np.abs(found - expected).max() <= within, camera.name
