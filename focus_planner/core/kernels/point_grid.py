# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Points sorted into cubes, and the runs of them near a place.

A cube's key is its place in a row-by-row numbering of the bounding box, with a margin of one cube
all around. The cubes above one another have consecutive keys, so all points near a place are in
nine runs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, Offsets
from focus_planner.core.kernels.compiling import kernel

#: Runs of points around a place.
RUNS = 9


class PointGrid(NamedTuple):
    """Points in the order of their cubes.

    Attributes
    ----------
    points : (M, 3) array
    low : (3,) array
        A corner of the first cube.
    side : float
        Of a cube.
    counts : (3,) array of int64
        Cubes along each axis, the margin included.
    keys : (K,) array of int64
        The keys of the cubes with points, ascending.
    starts : (K + 1,) array of int64
        Cube k has the points from ``starts[k]`` to ``starts[k + 1]``.
    """

    points: FloatArray
    low: FloatArray
    side: float
    counts: NDArray[np.int64]
    keys: NDArray[np.int64]
    starts: Offsets


@kernel
def runs_near(grid, at, runs):
    """Fill (9, 2) runs of points that include all within a cube's side of a place."""
    x = math.floor((at[0] - grid.low[0]) / grid.side) + 1
    y = math.floor((at[1] - grid.low[1]) / grid.side) + 1
    z = math.floor((at[2] - grid.low[2]) / grid.side) + 1
    bottom, top = max(z - 1, 0), min(z + 1, grid.counts[2] - 1)
    run = 0
    for i in range(x - 1, x + 2):
        for j in range(y - 1, y + 2):
            runs[run] = 0
            if 0 <= i < grid.counts[0] and 0 <= j < grid.counts[1] and bottom <= top:
                column = (i * grid.counts[1] + j) * grid.counts[2]
                first = np.searchsorted(grid.keys, column + bottom)
                end = first
                while end < len(grid.keys) and grid.keys[end] <= column + top:
                    end += 1
                runs[run, 0] = grid.starts[first]
                runs[run, 1] = grid.starts[end]
            run += 1
