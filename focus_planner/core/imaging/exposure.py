# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures as a camera with a thin lens takes them.

A picture is the mean of pictures from points all over the aperture, each a pinhole's, sheared so
that they agree on the plane of focus (P. Haeberli and K. Akeley, The Accumulation Buffer, SIGGRAPH
1990). Each is exact, so occlusion is: what is before a depth edge covers what is behind it, and at
its blurred rim lets it shine through.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.imaging.aims import sets_of_aims
from focus_planner.core.imaging.depth import DepthCamera, in_optical_frame, listed_by_tile
from focus_planner.core.imaging.looks import shaded
from focus_planner.core.imaging.pixels import pixel_grid, tiles_of
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.geometry import rotation_from_quaternion
from focus_planner.core.rig.optics import aperture_diameter
from focus_planner.core.surface.appearance import Colours, decode, encode
from focus_planner.core.surface.scene import Scene

# Behind the surface: neutral, as sRGB.
BACKGROUND = (58, 60, 64)
# Rays per pixel: of the sharpest, and how many more per square pixel of the widest blur, so that
# single edges do not show in it. At most those of the largest set: there, each counts too little.
_RAYS, _RAYS_PER_AREA = 12, 0.5
_WIDEST = 1e3  # pixels: for which there are rays enough


class PictureCamera(DepthCamera):
    """A scene's surface, prepared for pictures of it and of its depth.

    It shows the surface's texture or colours, else a pattern whose finest chips are a few pixels
    wide whatever the distance, so that sharpness shows at once.

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self._shaded = shaded(scene, self._vertices, self._triangles)

    def picture(
        self, camera: Camera, focus_distance: float, scale: float = 1.0, density: float = 1.0
    ) -> Colours:
        """Return what the camera sees, focused at a distance.

        Parameters
        ----------
        camera : Camera
        focus_distance : float
            s, metres; above 0.
        scale : float
            Of the picture's sides.
        density : float
            How many rays each pixel gets, relative to as many as leave no grain.

        Returns
        -------
        (H, W, 3) array of uint8
            As sRGB.
        """
        return encode(self.exposure(camera, focus_distance, scale, density))

    def exposure(
        self, camera: Camera, focus_distance: float, scale: float = 1.0, density: float = 1.0
    ) -> NDArray[np.float32]:
        """Return (H, W, 3) the same as :meth:`picture` in linear light, 0 to 1."""
        intrinsics = camera.intrinsics
        grid = pixel_grid(intrinsics, scale)
        tiles = tiles_of(intrinsics, grid)
        aperture, inverse_focus = aperture_diameter(camera), 1 / focus_distance
        aims, starts = sets_of_aims()
        radius = aperture * float(np.sqrt((aims[:, :2] ** 2).sum(axis=1)).max())
        margin = float(np.abs(aims[:, 2:]).max() * 2 * np.abs(tiles.affine[..., 7:]).max())
        pixel = grid.pitch[0] / intrinsics.fx
        image = np.empty((grid.height, grid.width, 3), np.float32)
        with kernels.threads_for(image.size):
            vertices = in_optical_frame(self._vertices, camera)
            triangles = listed_by_tile(
                vertices, self._triangles, tiles, radius, inverse_focus, margin
            )
            kernels.expose(
                triangles,
                tiles,
                self._shaded.looks,
                self._light(camera, vertices),
                aims,
                starts,
                _chosen(triangles, tiles, starts, density, inverse_focus, aperture / pixel),
                aperture,
                inverse_focus,
                pixel,
                decode(np.array(BACKGROUND, np.uint8)).astype(np.float64),
                image,
            )
        return image

    def _light(self, camera: Camera, vertices: FloatArray) -> NDArray[np.float32]:
        rotation = rotation_from_quaternion(np.array(camera.orientation))
        normals = np.ascontiguousarray(self._shaded.normals @ rotation)
        light = np.empty((len(self._triangles), 3, 2), np.float32)
        kernels.light_corners(vertices, self._triangles, normals, rotation[2].copy(), light)
        return light


def _chosen(
    triangles: kernels.Triangles,
    tiles: kernels.Tiles,
    starts: NDArray[np.int64],
    density: float,
    inverse_focus: float,
    strength: float,
) -> NDArray[np.int64]:
    """Return (Y, X) which set of rays is dense enough for each tile's widest blur.

    Parameters
    ----------
    triangles, tiles : kernels' arrays
    starts : (K + 1,) array
        Of the sets of rays.
    density : float
        How many rays there are to be, relative to as many as leave no grain.
    inverse_focus : float
        1/m.
    strength : float
        Pixels of blur per difference of inverse depths, 1/m.
    """
    from scipy.ndimage import maximum_filter  # noqa: PLC0415 - takes as long as a plan

    farthest = np.empty(tiles.bounds.shape[:2])
    kernels.farthest_off_focus(triangles, tiles, inverse_focus, farthest)
    # Those around a tile count as well: so few blurred edges run between tiles of different rays.
    widest = maximum_filter(np.minimum(strength * farthest, _WIDEST), 3, mode="nearest")
    wanted = density * (_RAYS + _RAYS_PER_AREA * widest**2)
    return np.searchsorted(np.diff(starts), wanted).clip(max=len(starts) - 2)
