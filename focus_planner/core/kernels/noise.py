# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far points lie from the surface that is fitted to their neighbours."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.local_fit import COUNT, FITTED, RESIDUAL, fit
from focus_planner.core.kernels.point_grid import RUNS, runs_near

# A place's points that are no farther from it along the surface, relative to the radius, and across
# it, relative to the residual, are those in the middle of the scatter.
_BESIDE = 0.5
_ACROSS = 0.5


@parallel_kernel
def residuals(grid, averages, places, radius, few):
    """Return (n, 3) the residual around each place, the number of points, and the middle's share.

    NaN where there are few points. The first fit moves a place, which is off the surface itself,
    onto it; the second counts. The middle's share is that of the points nearby that are within
    half the residual of the surface.
    """
    found = np.full((len(places), 3), np.nan)
    for p in prange(len(places)):
        fitted, work, facing = np.zeros(FITTED), np.empty((RUNS, 2), dtype=np.int64), np.zeros(3)
        at = places[p].copy()
        for _ in range(2):
            fit(grid, averages, at, facing, radius, False, True, few, work, fitted)
            if fitted[COUNT] < few:
                break
            at[:] = fitted[:3]
        if fitted[COUNT] >= few:
            found[p, 0], found[p, 1] = fitted[RESIDUAL], fitted[COUNT]
            found[p, 2] = _middle(grid, fitted, radius, work)
    return found


@kernel
def _middle(grid, fitted, radius, work):
    runs_near(grid, fitted[:3], work)
    inside = middle = 0
    for run in range(RUNS):
        for i in range(work[run, 0], work[run, 1]):
            square = height = 0.0
            for a in range(3):
                offset = grid.points[i, a] - fitted[a]
                square += offset * offset
                height += offset * fitted[3 + a]
            if square < radius * radius and square - height * height < (_BESIDE * radius) ** 2:
                inside += 1
                middle += abs(height) < _ACROSS * fitted[RESIDUAL]
    return middle / inside if inside else np.nan
