# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where the pixels of a picture are, and the rays that they show."""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.distortion import first_rays, frustum_and_projection

# Bytes of tiles to keep, as cameras of one kind follow one another; and pixels to find the rays of
# at a time.
_MOST_KEPT, _BAND = 400_000_000, 1_000_000


@dataclass(frozen=True)
class PixelGrid:
    """The pixels of a picture: those that are read out, or larger ones in their place.

    Attributes
    ----------
    width, height : int
    pitch : tuple of 2 floats
        Their columns' and rows' spacing, in pixels of the sensor's full resolution.
    first : tuple of 2 floats
        The centre of the first, top left, in pixels of the full resolution.
    """

    width: int
    height: int
    pitch: tuple[float, float]
    first: tuple[float, float]


def pixel_grid(intrinsics: CameraIntrinsics, scale: float = 1.0) -> PixelGrid:
    """Return the pixels that are read out, binned as the camera bins them.

    Parameters
    ----------
    intrinsics : CameraIntrinsics
    scale : float
        Of the picture's sides; they are rounded to whole pixels, at least one.
    """
    x, y, width, height = intrinsics.pixels_read
    columns, rows = intrinsics.binning
    across = max(round(width // columns * scale), 1)
    down = max(round(height // rows * scale), 1)
    pitch = width / across, height / down
    return PixelGrid(across, down, pitch, (x + pitch[0] / 2 - 0.5, y + pitch[1] / 2 - 0.5))


_Key: TypeAlias = tuple[CameraIntrinsics, PixelGrid]
_lock = threading.Lock()
_kept: OrderedDict[_Key, kernels.Tiles] = OrderedDict()


def tiles_of(intrinsics: CameraIntrinsics, grid: PixelGrid) -> kernels.Tiles:
    """Return the rays of a picture's pixels, in tiles."""
    with _lock:
        tiles = _kept.pop((intrinsics, grid), None) or _tiles(intrinsics, grid)
        _kept[intrinsics, grid] = tiles
        while sum(each.rays.nbytes for each in _kept.values()) > _MOST_KEPT:
            _kept.popitem(last=False)
    return tiles


def _tiles(intrinsics: CameraIntrinsics, grid: PixelGrid) -> kernels.Tiles:
    rays = _rays(intrinsics, grid)
    shape = -(-grid.height // kernels.TILE), -(-grid.width // kernels.TILE)
    bounds = np.empty((*shape, 4))
    affine = np.empty((*shape, kernels.AFFINE))
    steps = np.array(grid.pitch) / [intrinsics.fx, intrinsics.fy]
    kernels.bound_tiles(rays, steps, bounds, affine)
    return kernels.Tiles(rays, bounds, _blocks(bounds), affine)


def _rays(intrinsics: CameraIntrinsics, grid: PixelGrid) -> NDArray[np.float32]:
    """Return (H, W, 2) x and y at depth 1; 32 bits tell a pixel's thousandth."""
    rays = np.empty((grid.height, grid.width, 2), np.float32)
    rows = max(_BAND // grid.width, 1)
    for top in range(0, grid.height, rows):
        band = rays[top : top + rows]
        band[...] = _rays_of_rows(intrinsics, grid, top, len(band))
    return rays


def _rays_of_rows(
    intrinsics: CameraIntrinsics, grid: PixelGrid, top: int, count: int
) -> FloatArray:
    u = grid.first[0] + grid.pitch[0] * np.arange(grid.width)
    v = grid.first[1] + grid.pitch[1] * np.arange(top, top + count)
    targets = np.empty((count, grid.width, 2))
    targets[..., 0] = (u - intrinsics.cx) / intrinsics.fx
    targets[..., 1] = ((v - intrinsics.cy) / intrinsics.fy)[:, None]
    if not intrinsics.distortion_model:
        return targets
    _, projection = frustum_and_projection(intrinsics)
    flat = targets.reshape(-1, 2)
    rays = first_rays(intrinsics, flat)
    coefficients = np.array(projection[kernels.PROJECTION :])
    kernels.undistort(rays, flat, int(projection[0]), coefficients, projection[1])
    return rays.reshape(targets.shape)


def _blocks(bounds: FloatArray) -> FloatArray:
    """Return the bounds of blocks of tiles."""
    rows, columns = (np.arange(0, length, kernels.BLOCK) for length in bounds.shape[:2])
    least = np.minimum.reduceat(np.minimum.reduceat(bounds, rows, 0), columns, 1)
    most = np.maximum.reduceat(np.maximum.reduceat(bounds, rows, 0), columns, 1)
    blocks: FloatArray = np.where([True, False, True, False], least, most)
    return blocks
