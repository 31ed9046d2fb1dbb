# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which pixels image a surface as finely as asked."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.imaging.depth import DepthImage
from focus_planner.core.imaging.pixels import pixel_grid, tiles_of
from focus_planner.core.rig.camera import Camera
from focus_planner.core.surface.resolution import longest_axes


def fine_pixels(
    depths: DepthImage, camera: Camera, most: float, scale: float = 1.0
) -> NDArray[np.bool_]:
    """Return where a pixel covers at most so much along the surface, where it covers most.

    What it covers is told by the points that neighbouring pixels show: on each axis the nearer one,
    because across an edge of the surface they are far apart.

    Parameters
    ----------
    depths : (H, W) array
        Metres along the optical axis; inf where the surface is not.
    camera : Camera
    most : float
        Millimetres per pixel that the camera reads out; inf for no limit.
    scale : float
        Of the picture's sides, as for the depths.

    Returns
    -------
    (H, W) array of bool
        Without a limit, True everywhere; else False where the surface is not.
    """
    if math.isinf(most):
        return np.ones(depths.shape, dtype=np.bool_)
    grid, own = pixel_grid(camera.intrinsics, scale), pixel_grid(camera.intrinsics)
    rays = tiles_of(camera.intrinsics, grid).rays.astype(np.float64)
    ahead = np.where(np.isfinite(depths), depths, np.nan).astype(np.float64)
    points = ahead[..., None] * np.concatenate([rays, np.ones((*depths.shape, 1))], axis=-1)
    across = _nearer_step(points, axis=1) * (own.pitch[0] / grid.pitch[0])
    down = _nearer_step(points, axis=0) * (own.pitch[1] / grid.pitch[1])
    lengths = longest_axes(np.stack([across, down], axis=-1).reshape(-1, 3, 2))
    fine: NDArray[np.bool_] = (1000 * lengths <= most).reshape(depths.shape)  # not where it is NaN
    return fine


def _nearer_step(points: FloatArray, axis: int) -> FloatArray:
    """Return (H, W, 3) the way from each pixel's point to the nearer of its two neighbours'."""
    steps = np.diff(points, axis=axis)
    none = np.full_like(np.take(points, [0], axis=axis), np.nan)
    before = np.concatenate([none, steps], axis=axis)
    after = np.concatenate([steps, none], axis=axis)
    away = [np.nan_to_num((each**2).sum(axis=-1), nan=np.inf) for each in (before, after)]
    nearer: FloatArray = np.where((away[0] <= away[1])[..., None], before, after)
    return nearer
