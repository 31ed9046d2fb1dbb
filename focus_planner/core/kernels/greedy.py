# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lazy greedy: what a camera gains beside those that are taken, and taking the best of them.

A camera that is not taken holds nothing in focus, but is there: its samples may be assigned to it.
"""

from __future__ import annotations

from heapq import heapify, heappop, heapreplace
from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.ranking import VIEW, VIEW_BITS, held_by_another, rerank


class GreedyState(NamedTuple):
    """Which cameras are taken, and what was last found about the others.

    Attributes
    ----------
    cell : (C,) array of int32
        The cells of those that are taken; -1 for the others.
    ranking : (N, needed) array of int64
        The cheapest views of each sample, see ``ranking.py``.
    gain : (C,) array of int64
        What a camera gains in its best cell, units: no less than it gains now, since gains only
        fall. -1 if it is taken or has no cells.
    where : (C,) array of int32
        That cell.
    found : (C,) array of int64
        How many cameras were taken when that was found.
    taken : (1,) array of int64
        How many are.
    """

    cell: IntArray
    ranking: Offsets
    gain: Offsets
    where: IntArray
    found: Offsets
    taken: Offsets


@parallel_kernel
def first_gains(by_camera, focus, views, cell_offsets, state):
    """Fill ``gain`` and ``where`` while no camera is taken.

    Parameters
    ----------
    by_camera : PairsByCamera
    focus : (N,) array of int64
    views : CameraViews
    cell_offsets : (C + 1,) array of int64
    state : GreedyState
    """
    gain, where = state.gain, state.where
    for c in prange(len(gain)):
        gain[c], where[c] = -1, -1
        if cell_offsets[c] < cell_offsets[c + 1]:
            gain[c], where[c] = _best_cell(c, by_camera, focus, views, cell_offsets, state)


@kernel
def take_cameras(pairs, by_camera, by_sample, focus, views, cell_offsets, state):
    """Take cameras, each time the one that gains most in its best cell; return the gain in units.

    Ends when all are taken, or about so many pairs were looked at. What a camera gained before
    bounds what it gains now: only those are looked at again whose bound is the largest. Ties go to
    the first camera, and to its first cell.
    """
    queue = [(-state.gain[c], c) for c in range(len(state.gain)) if state.gain[c] >= 0]
    heapify(queue)
    total = np.int64(0)
    while len(queue) > 0 and pairs > 0:
        c = queue[0][1]
        pairs -= by_camera.offsets[c + 1] - by_camera.offsets[c]
        if state.found[c] < state.taken[0]:
            state.gain[c], state.where[c] = _best_cell(
                c, by_camera, focus, views, cell_offsets, state
            )
            state.found[c] = state.taken[0]
            heapreplace(queue, (-state.gain[c], c))
        else:
            heappop(queue)
            total += state.gain[c]
            _take(c, by_camera, by_sample, focus, views, state)
    return total


@kernel
def _best_cell(c, by_camera, focus, views, cell_offsets, state):
    """Return the most that camera c gains, and the first cell where it does."""
    offsets, seen, base, first, last = by_camera
    steps = np.zeros(cell_offsets[c + 1] - cell_offsets[c] + 1, dtype=np.int64)
    view = views.number[c]
    alone = views.offsets[view + 1] - views.offsets[view] == 1
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= last[j] and (
            alone or not held_by_another(c, view, first[j], last[j], views, state.cell)
        ):
            gain = _gain(seen[j], view, base[j], focus[seen[j]], state.ranking)
            steps[first[j]] += gain
            steps[last[j] + 1] -= gain
    best, where, total = np.int64(-1), 0, np.int64(0)
    for i in range(len(steps) - 1):
        total += steps[i]
        if total > best:
            best, where = total, i
    return best, where


@kernel
def _gain(p, view, base, focus, ranking):
    """Return what a view that does not hold sample p gains from holding it."""
    last = ranking.shape[1] - 1
    for i in range(last):
        if ranking[p, i] & VIEW == view:
            return focus
    return max((ranking[p, last] >> VIEW_BITS) - base, np.int64(0))


@kernel
def _take(c, by_camera, by_sample, focus, views, state):
    """Put camera c into its best cell; rank the samples that it holds there."""
    offsets, seen, base, first, last = by_camera
    at, view = state.where[c], views.number[c]
    state.cell[c], state.gain[c] = at, -1
    state.taken[0] += 1
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= at <= last[j]:
            rerank(seen[j], view, base[j], by_sample, focus, views, state.cell, state.ranking)
