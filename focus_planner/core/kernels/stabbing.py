# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""The best cells of one camera that takes several shots of a view: stabbing by several points.

A sample counts once however many of the cells hold it. With cells in ascending order an interval
that holds one of the first k but not the k-th lies below the k-th, so the best of the first k that
end at cell j are

    f_k(j) = max over i < j of f_{k-1}(i) + W(i, j),

where W(i, j) is the weight of the intervals that hold j but not i. As j grows, an interval that
enters adds its weight for every i so far, and one that leaves takes it away again for all i below
its first cell. So once a later i is as good as an earlier one it stays so, and the earlier one can
be forgotten: what is left are candidates of ascending i and descending value, of which the first is
the best. Where intervals take something away is found by union and find, so all is nearly linear.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel


class _Candidates(NamedTuple):
    """Candidates i for the cell before j.

    ``up`` of a forgotten one leads to the next lower one that is not, at last to -1; ``before``
    and ``after`` are the neighbours of those left, and ``lead`` is by how much one is better than
    the one after it. ``ends`` are the first and the last, -1 if none, and ``values`` those of both
    but for what has entered since, which is the same for all.
    """

    up: IntArray
    before: IntArray
    after: IntArray
    lead: Offsets
    ends: IntArray
    values: Offsets


@kernel
def _find(up, i):
    """Return the last candidate up to i that is not forgotten, -1 if there is none."""
    root = i
    while root >= 0 and up[root] != root:
        root = up[root]
    while i >= 0 and up[i] != root and i != root:
        up[i], i = root, up[i]
    return root


@kernel
def _append(candidates, i, value):
    """Append candidate i; forget those before it that are no better."""
    up, before, after, lead, ends, values = candidates
    while ends[1] >= 0 and values[1] <= value:
        forgotten = ends[1]
        ends[1] = up[forgotten] = before[forgotten]
        if ends[1] >= 0:
            values[1] += lead[ends[1]]
    up[i], before[i] = i, ends[1]
    if ends[1] < 0:
        ends[0], values[0] = i, value
    else:
        after[ends[1]], lead[ends[1]] = i, values[1] - value
    ends[1], values[1] = i, value


@kernel
def _take_away(candidates, i, weight):
    """Take a weight away from the candidates up to i; forget those that become no better."""
    up, before, after, lead, ends, values = candidates
    at = _find(up, i)
    if at < 0:
        return
    values[0] -= weight
    if at == ends[1]:
        values[1] -= weight
        return
    lead[at] -= weight
    while at >= 0 and lead[at] <= 0:
        previous, following = before[at], after[at]
        up[at], before[following] = previous, previous
        if previous >= 0:
            after[previous] = following
            lead[previous] += lead[at]
        else:
            ends[0] = following
            values[0] -= lead[at]
        at = previous


@kernel
def _next_level(k, intervals, weights, enter, leaving, following, previous, best, parent):
    """Fill ``best`` (M,), what k cells that end at each one hold, from that of k - 1 cells.

    ``parent`` (M,) becomes the cell before; the first k - 1 cells have none.
    """
    cells = len(best)
    candidates = _Candidates(
        np.full(cells, -1, dtype=np.int32),
        np.empty(cells, dtype=np.int32),
        np.empty(cells, dtype=np.int32),
        np.empty(cells, dtype=np.int64),
        np.full(2, -1, dtype=np.int32),
        np.zeros(2, dtype=np.int64),
    )
    entered = np.int64(0)
    for j in range(1, cells):
        # Those with weights below 0 first: together with those above 0 on the same cells they
        # never add anything, so who is forgotten after both stays no better.
        for sign in range(2):
            r = leaving[j - 1]
            while r >= 0:
                if (weights[r] > 0) == sign:
                    _take_away(candidates, intervals[r, 0] - 1, weights[r])
                r = following[r]
        if j >= k - 1:
            _append(candidates, j - 1, previous[j - 1] - entered)
        entered += enter[j]
        if j >= k - 1:
            best[j], parent[j] = entered + candidates.values[0], candidates.ends[0]


@kernel
def best_cells(intervals, weights, count, chosen):
    """Choose cells so that the weights of the intervals that hold any of them add up to the most.

    Parameters
    ----------
    intervals : (R, 2) array of int32
        First and last cell, inclusive.
    weights : (R,) array of int64
        Those of the intervals on the same cells are together not below 0.
    count : int
        How many cells there are, at least 1.
    chosen : (K,) array of int32
        Becomes the best K cells, ascending; the last is repeated where there are fewer.

    Returns
    -------
    int
        The sum of the weights.
    """
    levels = min(len(chosen), count)
    steps, enter = np.zeros(count + 1, dtype=np.int64), np.zeros(count, dtype=np.int64)
    leaving = np.full(count, -1, dtype=np.int32)
    following = np.empty(len(weights), dtype=np.int32)
    for r in range(len(weights)):
        first, last = intervals[r, 0], intervals[r, 1]
        steps[first] += weights[r]
        steps[last + 1] -= weights[r]
        enter[first] += weights[r]
        following[r], leaving[last] = leaving[last], r
    best = np.cumsum(steps[:count])
    parents = np.empty((levels, count), dtype=np.int32)
    for k in range(2, levels + 1):
        previous = best.copy()
        _next_level(
            k, intervals, weights, enter, leaving, following, previous, best, parents[k - 1]
        )
    cell = levels - 1 + np.argmax(best[levels - 1 :])
    value = best[cell]
    for k in range(len(chosen) - 1, -1, -1):
        chosen[k] = cell
        if 0 < k < levels:
            cell = parents[k, cell]
    return value
