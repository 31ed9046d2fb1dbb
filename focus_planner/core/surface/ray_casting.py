# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What casts rays at triangles: Embree, of the package embreex or, where that has no wheel, Open3D.

Both are Embree and find the same hits, distances up to rounding; but Open3D takes half a second to
import, and lets no other thread run Python while it casts.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.surface.ray_casting_embree import EmbreeRays, has_embree
from focus_planner.core.surface.ray_casting_open3d import Open3DRays


class RayCaster(Protocol):
    """A ray-casting structure, which any thread may ask."""

    def occluded(self, rays: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return whether something blocks each ray between its origin and its end.

        Parameters
        ----------
        rays : (n, 6) array of float32
            Origin, and the vector from there to the end.

        Returns
        -------
        (n,) array of bool
        """

    def first_hits(
        self, rays: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], IntArray, NDArray[np.float32]]:
        """Return what each ray hits first, be it beyond the ray's end.

        Parameters
        ----------
        rays : (n, 6) array of float32

        Returns
        -------
        distance : (n,) array of float32
            In lengths of the ray's vector; infinite where nothing is hit.
        triangle : (n,) array of int32
            -1 where nothing is hit.
        normal : (n, 3) array of float32
            Of the triangle, of any length, on the side from which its corners go round
            anticlockwise; 0 where nothing is hit.
        """


def ray_caster(vertices: FloatArray, triangles: IntArray) -> RayCaster:
    """Return what casts rays at a mesh; what it needs is built when it is first asked.

    Parameters
    ----------
    vertices : (V, 3) array
        Metres; in float32, so best around the origin.
    triangles : (T, 3) array of int32
    """
    corners = np.ascontiguousarray(vertices, dtype=np.float32)
    indices = np.ascontiguousarray(triangles, dtype=np.uint32)
    if has_embree():
        return EmbreeRays(corners, indices)
    return Open3DRays(corners, indices)
