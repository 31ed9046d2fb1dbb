# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What one more picture gains, where pictures are limited, and taking and leaving pictures out.

A camera of the rig takes some of its shots, in cells; the cell of the others is ``NO_PICTURE``.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.ranking import (
    NO_CHOICE,
    NO_PICTURE,
    rank,
    sums_beside,
)


@parallel_kernel
def gains_of_pictures(by_camera, focus, views, cell_offsets, cell, ranking, gain, where):
    """Fill what one more picture of each view gains (V,), in units, and its cell.

    ``gain`` is -1 for a view that takes all its shots already.

    Parameters
    ----------
    by_camera : PairsByCamera
    focus : (N,) array of int64
    views : CameraViews
        With what a missing view costs, however many are needed.
    cell_offsets : (C + 1,) array of int64
    cell : (C,) array of int32
    ranking : (N, needed + 1) array of int64
    gain : (V,) array of int64
    where : (V,) array of int32
        -1 for a picture without a cell, which holds nothing in focus.
    """
    offsets = views.offsets
    for v in prange(len(gain)):
        c = _next_shot(offsets[v], offsets[v + 1], cell)
        if c < 0:
            gain[v], where[v] = -1, NO_PICTURE
        else:
            steps = np.zeros(cell_offsets[c + 1] - cell_offsets[c] + 1, dtype=np.int64)
            blurred = _sum_gains(c, by_camera, focus, views, cell, ranking, steps)
            gain[v], where[v] = _best(blurred, steps)


@kernel
def _next_shot(low, high, cell):
    """Return the first of these cameras whose picture is not taken; -1 if there is none."""
    for c in range(low, high):
        if cell[c] == NO_PICTURE:
            return c
    return -1


@kernel
def _sum_gains(c, by_camera, focus, views, cell, ranking, steps):
    """Fill what holding samples gains, from cell to cell; return what the picture gains anyway."""
    offsets, seen, base, first, last = by_camera
    view = views.number[c]
    own, sums = np.full(1, view, dtype=np.int32), np.empty(2, dtype=np.int64)
    blurred = np.int64(0)
    for j in range(offsets[c], offsets[c + 1]):
        p = seen[j]
        now = NO_CHOICE
        for shot in range(views.offsets[view], views.offsets[view + 1]):
            if cell[shot] != NO_PICTURE:
                held = first[j] <= cell[shot] <= last[j]
                now = min(now, base[j] + (0 if held else focus[p]))
        sums_beside(p, own, views, ranking, sums)
        before = min(sums[0], now + sums[1])
        out = min(before, base[j] + focus[p] + sums[1])
        blurred += before - out
        if first[j] <= last[j]:
            more = out - min(out, base[j] + sums[1])
            steps[first[j]] += more
            steps[last[j] + 1] -= more
    return blurred


@kernel
def _best(blurred, steps):
    """Return the most that a picture gains, and its cell."""
    best, where, total = np.int64(0), -1, np.int64(0)
    for i in range(len(steps) - 1):
        total += steps[i]
        if total > best or where < 0:
            best, where = total, i
    return blurred + best, where


@kernel
def place(c, to, by_camera, by_sample, focus, views, cell, ranking):
    """Put camera c's picture into a cell, or leave it out; rank the samples that it sees anew."""
    cell[c] = to
    for j in range(by_camera.offsets[c], by_camera.offsets[c + 1]):
        rank(by_camera.sample[j], by_sample, focus, views, cell, ranking)
