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
that holds one of the first k but not the k-th lies below the k-th, so the most that the first k
take, if the k-th is cell j, is

    f_k(j) = max over i ≤ j of f_{k-1}(i) + W(i, j),

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

# Of a cell that is out of range.
_NEVER = -1


class Intervals(NamedTuple):
    """Weighted ranges of one camera's cells.

    Attributes
    ----------
    first, last : (R,) arrays of int32
        Inclusive.
    weight : (R,) array of int64
        Those of the intervals on the same cells are together not below 0.
    """

    first: IntArray
    last: IntArray
    weight: Offsets


class _Candidates(NamedTuple):
    """Candidates i for the cell before j.

    ``up`` of one that is forgotten, or out of range, leads to the next lower one that is not, at
    last to -1. ``before`` and ``after`` are the neighbours of those left, and ``lead`` is by how
    much one is better than the one after it. ``ends`` are the first and the last, -1 if none, and
    ``values`` those of both but for what has entered since, which is the same for all.
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
def _next_level(intervals, enter, leaving, following, low, high, previous, best, parent):
    """Fill ``best`` (M,), the most that cells up to each one take, from that with a cell less.

    ``parent`` (M,) becomes the cell before. Cells outside ``low`` to ``high`` are out of range.
    """
    first, _, weight = intervals
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
    for j in range(cells):
        # Those with weights below 0 first: together with those above 0 on the same cells they
        # never add anything, so who is forgotten after both stays no better.
        for sign in range(2):
            r = leaving[j - 1] if j > 0 else -1
            while r >= 0:
                if (weight[r] > 0) == sign:
                    _take_away(candidates, first[r] - 1, weight[r])
                r = following[r]
        entered += enter[j]
        best[j], parent[j] = previous[j], j
        if candidates.ends[0] >= 0 and entered + candidates.values[0] > best[j]:
            best[j], parent[j] = entered + candidates.values[0], candidates.ends[0]
        if previous[j] > _NEVER:
            _append(candidates, j, previous[j] - entered)
        else:
            candidates.up[j] = candidates.ends[1]
        if j < low or j > high:
            best[j] = _NEVER


@kernel
def _levels(intervals, low, high, best, parents):
    """Fill ``best`` (K, M), f_k(j) with the k-th cell from ``low[k]`` to ``high[k]``.

    -1 where there is no such choice; ``parents`` (K, M) become the cells before.
    """
    first, last, weight = intervals
    cells = best.shape[1]
    enter, leave = np.zeros((2, cells), dtype=np.int64)
    leaving = np.full(cells, -1, dtype=np.int32)
    following = np.empty(len(weight), dtype=np.int32)
    for r in range(len(weight)):
        enter[first[r]] += weight[r]
        leave[last[r]] += weight[r]
        following[r], leaving[last[r]] = leaving[last[r]], r
    total = np.int64(0)
    for j in range(cells):
        total += enter[j]
        best[0, j] = total if low[0] <= j <= high[0] else _NEVER
        total -= leave[j]
    for k in range(1, len(best)):
        _next_level(
            intervals,
            enter,
            leaving,
            following,
            low[k],
            high[k],
            best[k - 1],
            best[k],
            parents[k],
        )


@kernel
def _append_above(c, gains, price, sign, count, intervals):
    """Append camera c's pairs that gain more than their prices; return how many there are."""
    offsets, sample, gain, first, last = gains
    for j in range(offsets[c], offsets[c + 1]):
        above = gain[j] - price[sample[j]]
        if above > 0:
            intervals.first[count], intervals.last[count] = first[j], last[j]
            intervals.weight[count] = sign * above
            count += 1
    return count


@kernel
def intervals_above(c, gains, blurred, price):
    """Return what camera c takes above the prices by focus, see :class:`PricedPairs`."""
    room = gains.offsets[c + 1] - gains.offsets[c] + blurred.offsets[c + 1] - blurred.offsets[c]
    first, last = np.empty((2, room), dtype=np.int32)
    intervals = Intervals(first, last, np.empty(room, dtype=np.int64))
    count = _append_above(c, gains, price, 1, 0, intervals)
    count = _append_above(c, blurred, price, -1, count, intervals)
    return Intervals(first[:count], last[:count], intervals.weight[:count])


@kernel
def best_cells(intervals, low, high, count, chosen):
    """Choose cells so that the weights of the intervals that hold any of them add up to the most.

    Parameters
    ----------
    intervals : Intervals
    low, high : (K,) arrays of int32
        The first and the last cell that each of the chosen ones may be, both ascending.
    count : int
        How many cells there are.
    chosen : (K,) array of int32
        Becomes the best K cells, ascending; there may be several of the same.

    Returns
    -------
    int
        The sum of the weights.
    """
    shots = len(chosen)
    best = np.empty((shots, count), dtype=np.int64)
    parents = np.empty((shots, count), dtype=np.int32)
    _levels(intervals, low, high, best, parents)
    cell = np.argmax(best[-1])
    value = best[-1, cell]
    for k in range(shots - 1, -1, -1):
        chosen[k] = cell
        if k > 0:
            cell = parents[k, cell]
    return value


@kernel
def best_cells_of_each(intervals, count, values, chosen):
    """Choose one cell, two cells and so on up to K as :func:`best_cells` does, of all ``count``.

    Fills ``values`` (K,), the sums of the weights, and ``chosen`` (K, K), a row of cells for each
    number of them. One cell more adds no more than the one before did.
    """
    shots = len(values)
    best = np.empty((shots, count), dtype=np.int64)
    parents = np.empty((shots, count), dtype=np.int32)
    low, high = np.zeros(shots, dtype=np.int32), np.full(shots, count - 1, dtype=np.int32)
    _levels(intervals, low, high, best, parents)
    for most in range(shots):
        cell = np.argmax(best[most])
        values[most] = best[most, cell]
        for k in range(most, -1, -1):
            chosen[most, k] = cell
            if k > 0:
                cell = parents[k, cell]


@kernel
def _mirrored(cells, count):
    """Return cells counted from the other end."""
    return (count - 1 - cells).astype(np.int32)


@kernel
def best_with_each(intervals, low, high, takings):
    """Fill ``takings`` (K, M): the most that K cells take if the k-th of them is a given one.

    -1 where there is no such choice; the rest is as in :func:`best_cells`.
    """
    shots, count = takings.shape
    first, last, weight = intervals
    parents = np.empty((shots, count), dtype=np.int32)
    _levels(intervals, low, high, takings, parents)
    mirrored = Intervals(_mirrored(last, count), _mirrored(first, count), weight)
    beyond = np.empty((shots, count), dtype=np.int64)
    _levels(mirrored, _mirrored(high[::-1], count), _mirrored(low[::-1], count), beyond, parents)
    steps = np.zeros(count + 1, dtype=np.int64)
    for r in range(len(weight)):
        steps[first[r]] += weight[r]
        steps[last[r] + 1] -= weight[r]
    total = np.int64(0)
    for j in range(count):
        # What both this cell's predecessors and its successors take, it takes as well.
        total += steps[j]
        for k in range(shots):
            other = beyond[shots - 1 - k, count - 1 - j]
            if takings[k, j] > _NEVER and other > _NEVER:
                takings[k, j] += other - total
            else:
                takings[k, j] = _NEVER
