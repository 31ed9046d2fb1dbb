# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Points of a cloud that lie apart from the surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.cloud_shape import Neighbours

# A point on the surface is near the points that are near it. Beside a surface, a stray has points
# of the surface for neighbours, and is none of theirs.
_FEW_ADMIRERS = 2
_APART = 4.0  # times the median area
_FAR = 10.0
# The least of the variances of a stray's neighbours, relative to the next: they are all around it,
# or they are a surface that is scanned sparsely.
_FLAT = 0.05


def stray_points(points: FloatArray, neighbours: Neighbours) -> NDArray[np.bool_]:
    """Return (M,) which points lie apart from the surface.

    Parameters
    ----------
    points : (M, 3) array
        Metres.
    neighbours : Neighbours
        Of these points.
    """
    areas = neighbours.areas
    relative = areas / (np.median(areas) or 1.0)
    named = np.bincount(neighbours.index.ravel(), minlength=len(points)) - 1
    stray: NDArray[np.bool_] = (named < _FEW_ADMIRERS) & (relative > _APART)
    far = np.flatnonzero(~stray & (relative > _FAR))
    around = points[neighbours.index[far]]
    around = around - around.mean(axis=1, keepdims=True)
    variances = np.linalg.eigvalsh(np.einsum("nia,nib->nab", around, around))
    stray[far] = variances[:, 0] > _FLAT * variances[:, 1]
    return stray
