# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Each camera's best cells for the samples assigned to it: weighted interval stabbing."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.solution import is_assigned
from focus_planner.core.kernels.stabbing import Intervals, best_cells


@parallel_kernel
def held_weights(by_camera, focus, cell_offsets, held):
    """Fill ``held`` (M,) with the weight that each cell holds in focus of all its camera sees."""
    for c in prange(len(cell_offsets) - 1):
        _hold_weights(c, by_camera, focus, held[cell_offsets[c] : cell_offsets[c + 1]])


@kernel
def _hold_weights(c, by_camera, focus, held):
    """Fill the weight that each cell of camera c holds."""
    offsets, seen, _, first, last = by_camera
    steps = np.zeros(len(held) + 1, dtype=np.int64)
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= last[j]:
            steps[first[j]] += focus[seen[j]]
            steps[last[j] + 1] -= focus[seen[j]]
    total = np.int64(0)
    for i in range(len(held)):
        total += steps[i]
        held[i] = total


@parallel_kernel
def stab(by_camera, focus, cell_offsets, held, best, cell):
    """Move each camera to the cell that holds most of its samples' weight in focus (Eq. 8).

    Camera c's samples are those with it in ``best`` (N, needed). Ties go to the cell that holds
    most of everything the camera sees, ``held`` (M,), which the next assignment may profit from;
    without a better cell a camera stays. A prefix sum per camera. Returns how many cameras moved.
    """
    moved = 0
    for c in prange(len(cell_offsets) - 1):
        all_seen = held[cell_offsets[c] : cell_offsets[c + 1]]
        moved += _stab_one(c, by_camera, focus, all_seen, best, cell)
    return moved


@kernel
def _stab_one(c, by_camera, focus, all_seen, best, cell):
    """Move camera c; return 1 if it moved, else 0."""
    offsets, seen, _, first, last = by_camera
    if len(all_seen) == 0:
        return 0
    own = np.zeros(len(all_seen) + 1, dtype=np.int64)
    for j in range(offsets[c], offsets[c + 1]):
        p = seen[j]
        if is_assigned(p, c, best) and first[j] <= last[j]:
            own[first[j]] += focus[p]
            own[last[j] + 1] -= focus[p]
    own = np.cumsum(own[:-1])
    where = cell[c]
    for i in range(len(own)):
        if own[i] > own[where] or (own[i] == own[where] and all_seen[i] > all_seen[where]):
            where = i
    if where == cell[c]:
        return 0
    cell[c] = where
    return 1


@parallel_kernel
def stab_brackets(by_camera, focus, views, cell_offsets, best, cell):
    """Move each view's shots to the cells that together hold most of its samples' weight in focus.

    A view's samples are those with one of its shots in ``best`` (N, needed); one counts once
    however many shots hold it. Without better cells they stay. Returns how many views moved.
    """
    offsets = views.offsets
    moved = 0
    for v in prange(len(offsets) - 1):
        moved += _stab_bracket(
            offsets[v], offsets[v + 1], by_camera, focus, cell_offsets, best, cell
        )
    return moved


@kernel
def _stab_bracket(low, high, by_camera, focus, cell_offsets, best, cell):
    """Move shots ``low`` to ``high``, those that have cells; return 1 if that holds more."""
    shots = np.empty(high - low, dtype=np.int64)
    count = 0
    for c in range(low, high):
        if cell_offsets[c + 1] > cell_offsets[c]:
            shots[count] = c
            count += 1
    if count == 0:
        return 0
    one = shots[0]  # all have the same pairs and cells
    own, held = _own_intervals(one, low, high, by_camera, focus, best, cell)
    cells = cell_offsets[one + 1] - cell_offsets[one]
    first, last = np.zeros(count, dtype=np.int32), np.full(count, cells - 1, dtype=np.int32)
    chosen = np.empty(count, dtype=np.int32)
    if best_cells(own, first, last, cells, chosen) <= held:
        return 0
    for k in range(count):
        cell[shots[k]] = chosen[k]
    return 1


@kernel
def _own_intervals(one, low, high, by_camera, focus, best, cell):
    """Return the cells that hold the samples of a view, and the weight that its shots hold now."""
    offsets, seen, _, first, last = by_camera
    room = offsets[one + 1] - offsets[one]
    firsts, lasts = np.empty((2, room), dtype=np.int32)
    weights = np.empty(room, dtype=np.int64)
    count, total = 0, np.int64(0)
    for j in range(offsets[one], offsets[one + 1]):
        if first[j] > last[j]:
            continue
        mine, held = False, False
        for c in range(low, high):
            mine |= is_assigned(seen[j], c, best)
            held |= first[j] <= cell[c] <= last[j]
        if mine:
            firsts[count], lasts[count], weights[count] = first[j], last[j], focus[seen[j]]
            count += 1
            total += focus[seen[j]] if held else 0
    return Intervals(firsts[:count], lasts[:count], weights[:count]), total
