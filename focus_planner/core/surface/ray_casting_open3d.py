# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Ray casting by Open3D, for systems that embreex has no wheel for."""

from __future__ import annotations

from threading import Lock
from typing import Any

import numpy as np
from numba import config
from numpy.typing import NDArray

from focus_planner.core.arrays import IntArray
from focus_planner.core.surface.open3d import open3d


class Open3DRays:
    """A ray-casting structure of Open3D's; see :class:`~.ray_casting.RayCaster`.

    Parameters
    ----------
    vertices : (V, 3) array of float32
    triangles : (T, 3) array of uint32
    """

    def __init__(self, vertices: NDArray[np.float32], triangles: NDArray[np.uint32]) -> None:
        self._scene = open3d().t.geometry.RaycastingScene()
        self._scene.add_triangles(vertices, triangles)
        self._building = Lock()
        self._is_built = False

    def occluded(self, rays: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return whether something blocks each ray between its origin and its end."""
        tensor = open3d().core.Tensor.from_numpy(rays)
        hidden: NDArray[np.bool_] = (
            self._built().test_occlusions(tensor, 0.0, 1.0, nthreads=_threads()).numpy()
        )
        return hidden

    def first_hits(
        self, rays: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], IntArray, NDArray[np.float32]]:
        """Return the distance, the triangle and the normal of what each ray hits first."""
        tensor = open3d().core.Tensor.from_numpy(rays)
        hits = self._built().cast_rays(tensor, nthreads=_threads())
        triangle = hits["primitive_ids"].numpy().astype(np.int32)  # of unsigned ones, -1 for none
        return hits["t_hit"].numpy(), triangle, hits["primitive_normals"].numpy()

    def _built(self) -> Any:
        """Return the structure, which is built when it is first asked, by no two threads."""
        with self._building:
            if not self._is_built:
                self._scene.count_intersections(np.zeros((1, 6), dtype=np.float32))
                self._is_built = True
        return self._scene


def _threads() -> int:
    """Return how many threads rays take: as many as kernels may, so one where processes share."""
    return int(config.NUMBA_NUM_THREADS)
