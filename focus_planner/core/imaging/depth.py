# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far what each pixel shows is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.imaging.pixels import pixel_grid, tiles_of
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.geometry import rotation_from_quaternion
from focus_planner.core.surface.scene import Scene

#: (H, W) metres along the optical axis from the centre of projection; inf where nothing is.
DepthImage = NDArray[np.float32]


class DepthCamera:
    """A scene's surface, prepared for pictures of its depth.

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        vertices, triangles = scene.opaque
        self._vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        # A copy: for arrays that cannot be written to, as meshes' are, kernels would be compiled
        # once more.
        self._triangles = np.array(triangles, dtype=np.int32, order="C")

    def depths(self, camera: Camera, scale: float = 1.0) -> DepthImage:
        """Return the depth of what is seen at the centre of every pixel that is read out.

        Parameters
        ----------
        camera : Camera
            With its region, binning and distortion.
        scale : float
            Of the picture's sides.

        Returns
        -------
        (H, W) array of float32
            Metres along the optical axis; inf where nothing is, or no ray is imaged.
        """
        tiles = tiles_of(camera.intrinsics, pixel_grid(camera.intrinsics, scale))
        image = np.empty(tiles.rays.shape[:2], np.float32)
        with kernels.threads_for(image.size):
            vertices = in_optical_frame(self._vertices, camera)
            triangles = listed_by_tile(vertices, self._triangles, tiles)
            kernels.depths(triangles, tiles, image)
        return image


def in_optical_frame(points: FloatArray, camera: Camera) -> FloatArray:
    """Return (n, 3) points in the camera's optical frame, metres."""
    rotation = rotation_from_quaternion(np.array(camera.orientation))
    turned: FloatArray = np.ascontiguousarray((points - np.array(camera.position)) @ rotation)
    return turned


def listed_by_tile(
    vertices: FloatArray,
    corners: IntArray,
    tiles: kernels.Tiles,
    radius: float = 0.0,
    inverse_focus: float = 0.0,
    margin: float = 0.0,
) -> kernels.Triangles:
    """Return triangles with lists of those that each tile may show.

    Parameters
    ----------
    vertices : (V, 3) array
        In the camera's optical frame, metres.
    corners : (T, 3) array of int32
    tiles : Tiles
    radius : float
        Of the aperture, metres.
    inverse_focus : float
        Of the distance of the plane that all its points see alike, 1/m.
    margin : float
        How far beside pixels' centres their rays may be, at depth 1.
    """
    boxes = np.empty((len(corners), 4))
    kernels.bound_triangles(vertices, corners, radius, inverse_focus, boxes)
    starts = np.empty(tiles.bounds.shape[0] * tiles.bounds.shape[1] + 1, np.int64)
    listed = np.empty(0, np.int32)
    count = kernels.list_by_tile(boxes, tiles.bounds, tiles.blocks, margin, starts, listed)
    if count:
        listed = np.empty(count, np.int32)
        kernels.list_by_tile(boxes, tiles.bounds, tiles.blocks, margin, starts, listed)
    return kernels.Triangles(vertices, corners, starts, listed)
