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
``steps`` has what each camera would gain, as differences from cell to cell, and is kept exact as
cameras are taken. Only the best cell is found lazily.
"""

from __future__ import annotations

from heapq import heapify, heappop, heapreplace
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.ranking import VIEW, VIEW_BITS, held_by_another, rerank


class GreedyState(NamedTuple):
    """Which cameras are taken, and what the others gain.

    Attributes
    ----------
    cell : (C,) array of int32
        The cells of those that are taken; -1 for the others.
    ranking : (N, needed) array of int64
        The cheapest views of each sample, see ``ranking.py``.
    steps : (M + C,) array of int64
        What each camera gains, as differences from cell to cell; a camera's part is one longer
        than its cells.
    gain : (C,) array of int64
        What a camera gains in its best cell, units, or gained once, which is no less. -1 if it is
        taken or has no cells.
    where : (C,) array of int32
        That cell.
    fresh : (C,) array of bool
        Whether that is so now.
    """

    cell: IntArray
    ranking: Offsets
    steps: Offsets
    gain: Offsets
    where: IntArray
    fresh: NDArray[np.bool_]


@parallel_kernel
def first_gains(by_camera, focus, views, cell_offsets, state):
    """Fill what cameras gain while none is taken.

    Parameters
    ----------
    by_camera : PairsByCamera
    focus : (N,) array of int64
    views : CameraViews
    cell_offsets : (C + 1,) array of int64
    state : GreedyState
        With ``cell`` and ``ranking``.
    """
    for c in prange(len(views.number)):
        _sum_gains(c, by_camera, focus, views, cell_offsets, state)
        _find_best(c, cell_offsets, state)


@kernel
def _sum_gains(c, by_camera, focus, views, cell_offsets, state):
    """Fill what camera c gains, as differences from cell to cell, while none is taken."""
    offsets, seen, base, first, last = by_camera
    view, ranking = views.number[c], state.ranking
    steps = state.steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1]
    steps[:] = 0
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= last[j]:
            gain = _gain(view, base[j], focus[seen[j]], ranking[seen[j]])
            steps[first[j]] += gain
            steps[last[j] + 1] -= gain


@kernel
def take_cameras(work, by_camera, by_sample, focus, views, cell_offsets, state):
    """Take cameras, each time the one that gains most in its best cell; return the gain in units.

    Ends when all are taken, or after about so much ``work``, in cells and pairs looked at. What a
    camera once gained bounds what it gains now: only the camera with the largest bound is looked
    at again. Ties go to the first camera, and to its first cell.
    """
    gain, fresh = state.gain, state.fresh
    queue = [(-gain[c], c) for c in range(len(gain)) if gain[c] >= 0]
    heapify(queue)
    total = np.int64(0)
    while len(queue) > 0 and work > 0:
        c = queue[0][1]
        if fresh[c]:
            heappop(queue)
            total += gain[c]
            work -= _take(c, by_camera, by_sample, focus, views, cell_offsets, state)
        else:
            _find_best(c, cell_offsets, state)
            heapreplace(queue, (-gain[c], c))
            work -= cell_offsets[c + 1] - cell_offsets[c]
    return total


@kernel
def _find_best(c, cell_offsets, state):
    """Find the most that camera c gains, and the first cell where it does."""
    best, where, total = np.int64(-1), -1, np.int64(0)
    steps = state.steps[cell_offsets[c] + c : cell_offsets[c + 1] + c]
    for i in range(len(steps)):
        total += steps[i]
        if total > best:
            best, where = total, i
    state.gain[c], state.where[c], state.fresh[c] = best, where, True


@kernel
def _gain(view, base, focus, keys):
    """Return what a view that does not hold a sample gains from that; ``keys`` rank the sample."""
    last = len(keys) - 1
    for i in range(last):
        if keys[i] & VIEW == view:
            return focus
    return max((keys[last] >> VIEW_BITS) - base, np.int64(0))


@kernel
def _take(c, by_camera, by_sample, focus, views, cell_offsets, state):
    """Put camera c into its best cell; correct what others gain from the samples it holds there.

    Returns how many pairs were looked at.
    """
    offsets, seen, base, first, last = by_camera
    at, view, work = state.where[c], views.number[c], offsets[c + 1] - offsets[c]
    ranking, cell, sample_offsets = state.ranking, state.cell, by_sample.offsets
    before = np.empty(ranking.shape[1], dtype=np.int64)
    for j in range(offsets[c], offsets[c + 1]):
        p = seen[j]
        if (
            first[j] <= at <= last[j]
            and _gain(view, base[j], focus[p], ranking[p]) > 0
            and not held_by_another(c, view, first[j], last[j], views, cell)
        ):
            before[:] = ranking[p]
            rerank(p, view, base[j], by_sample, focus, views, cell, ranking)
            _correct(p, c, before, by_sample, focus, views, cell_offsets, state)
            work += sample_offsets[p + 1] - sample_offsets[p]
    cell[c], state.gain[c] = at, -1
    return work


@kernel
def _correct(p, taken, before, by_sample, focus, views, cell_offsets, state):
    """Correct what cameras gain from sample p, ranked as ``before`` until a camera was taken."""
    offsets, camera, base, first, last = by_sample
    number, cell, steps, fresh = views.number, state.cell, state.steps, state.fresh
    own, weight, after = number[taken], focus[p], state.ranking[p]
    for q in range(offsets[p], offsets[p + 1]):
        c = camera[q]
        view = number[c]
        less = _gain(view, base[q], weight, before)
        # The view's other shots gain nothing from a sample that one of them holds.
        if less > 0 and view != own:
            less -= _gain(view, base[q], weight, after)
        if (
            less > 0
            and first[q] <= last[q]
            and cell[c] < 0
            and not held_by_another(c, view, first[q], last[q], views, cell)
        ):
            low = cell_offsets[c] + c
            steps[low + first[q]] -= less
            steps[low + last[q] + 1] += less
            fresh[c] = False
