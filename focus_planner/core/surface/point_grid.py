# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Points sorted into cubes, so that kernels find those near a place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray

# Along each axis: keys of three of them fit 60 bits.
_MAX_CUBES = 2**19


def cubes(
    points: FloatArray, side: float, margin: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, float]:
    """Return the cubes of a grid over the points' bounding box that they lie in.

    Returns
    -------
    keys : (M,) array of int64
        The cube that each point lies in.
    counts : (3,) array of int64
        Cubes along each axis, with ``margin`` empty ones at either end.
    low : (3,) array
        A corner of the first cube that is not margin.
    side : float
        Of a cube: as asked for, or as much more as it takes for keys to fit 60 bits.
    """
    low = points.min(axis=0)
    side = max(side, float((points.max(axis=0) - low).max()) / _MAX_CUBES)
    cells = [np.floor((points[:, a] - low[a]) / side).astype(np.int64) + margin for a in range(3)]
    counts = np.array([int(cell.max()) + 1 + margin for cell in cells])
    return (cells[0] * counts[1] + cells[1]) * counts[2] + cells[2], counts, low, side


def runs(keys: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (M,) a stable order that sorts keys, and where runs of equal ones start."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    return order, np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]]))


def point_grid(points: FloatArray, side: float) -> tuple[kernels.PointGrid, NDArray[np.int64]]:
    """Return a grid of points, and (M,) the order that they have in it.

    Parameters
    ----------
    points : (M, 3) array
        Metres.
    side : float
        Of a cube, metres: points up to that far from a place are found.
    """
    keys, counts, low, side = cubes(points, side, margin=1)
    order, starts = runs(keys)
    grid = kernels.PointGrid(
        np.ascontiguousarray(points[order]),
        low,
        side,
        counts,
        keys[order[starts]],
        np.concatenate([starts, [len(points)]]),
    )
    return grid, order
