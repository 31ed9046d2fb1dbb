# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Bounds on plans whose cameras are confined to a part of their cells (docs/algorithm.md)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.arrays import PricedPairs
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.local_prices import (
    Node,
    adapt,
    empty_local,
    gather,
    takings_of,
    takings_of_view,
)
from focus_planner.core.kernels.stabbing import best_cells, intervals_above


class Nodes(NamedTuple):
    """B nodes of the search, a row each; :func:`confine` changes them.

    Attributes
    ----------
    bound : (B,) array of int64
        What no plan of the node gains more than, units.
    low, high : (B, C) arrays of int32
        Each camera's first and last cell; low > high for a camera without cells. The cells of the
        shots of one view are ascending, and so are these.
    price : (B, N) array of int64
        Prices that prove the bound, units.
    score : (B, C) array of int64
        How promising it is to branch on a camera; 0 if nothing is known.
    split : (B, C) array of int32
        The last cell of the lower half, where the score is above 0.
    cell : (B, C) array of int32
        Each camera's best cell at these prices.
    """

    bound: Offsets
    low: IntArray
    high: IntArray
    price: Offsets
    score: Offsets
    split: IntArray
    cell: IntArray


class Cuts(NamedTuple):
    """How each of B nodes differs from its parent.

    Attributes
    ----------
    camera : (B,) array of int64
        The camera to confine; -1 for none.
    first, last : (B,) arrays of int64
        The cells to confine it to.
    wide : (B,) array of bool
        Whether all prices adapt, not only those around the camera.
    """

    camera: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    wide: NDArray[np.bool_]


class Neighbourhoods(NamedTuple):
    """The cameras around which prices adapt when one is confined, itself included.

    Attributes
    ----------
    offsets : (C + 1,) array of int64
        Camera c's are ``offsets[c]`` to ``offsets[c + 1]``.
    camera : (L,) array of int32
    """

    offsets: Offsets
    camera: IntArray


@kernel
def _split(c, a, b, value, slack, takings, chosen, node):
    """Choose where to split camera c's cells a to b, and score that.

    Between two cells that were each best at times, at the least that lies between them.
    """
    total, past, previous, least, where = 0, 0, -1, value, 0
    for i in range(a, b + 1):
        total += chosen[i]
    for i in range(a, b + 1):
        if previous >= 0 and takings[i] <= least:
            least, where = takings[i], i
        if chosen[i] > 0:
            if previous >= 0:
                worth = min(past, total - past) * (value - least + slack // 1024)
                if worth > node.score[c]:
                    node.score[c] = worth
                    node.split[c] = node.low[c] + min(max(where, previous), i - 1)
            past += chosen[i]
            previous, least, where = i, value, i


@kernel
def cut_off(k, c, local, value, top, slack, takings, chosen, node):
    """Report the best cell of the k-th camera, c, and where to split it; cut off its ends."""
    low, high = node.low, node.high
    # Where the best prices serve each sample once, these cells are a plan that gains as much.
    node.cell[c] = low[c] - local.low[k] + top
    if high[c] == low[c]:
        return
    begin = local.cell_offsets[k] + local.low[k]
    a, b = begin, begin + high[c] - low[c]
    while takings[a] < value - slack:
        a += 1
    while takings[b] < value - slack:
        b -= 1
    a, b = a - begin, b - begin
    part = slice(begin, local.cell_offsets[k + 1])
    _split(c, a, b, value, slack, takings[part], chosen[part], node)
    high[c] = low[c] + b
    low[c] = low[c] + a


@kernel
def _report(cameras, local, shots, price, chosen, slack, node):
    """Report each camera's best cell and where to split it; cut off ends that no plan can use."""
    takings, cell_offsets = np.empty(len(chosen), dtype=np.int64), local.cell_offsets
    cells = np.empty(shots, dtype=np.int32)
    for k in range(0, len(cameras), shots):
        c = cameras[k]
        node.score[c : c + shots] = 0
        if node.high[c] < node.low[c]:
            continue
        if shots == 1:
            part = takings[cell_offsets[k] : cell_offsets[k + 1]]
            value, cells[0] = takings_of(k, local, price, part)
        else:
            value = takings_of_view(k, local, price, takings, cells)
        for shot in range(shots):
            cut_off(k + shot, c + shot, local, value, cells[shot], slack, takings, chosen, node)


@kernel
def _tighten(node, base, cameras, pairs, by_sample, goal, reach, iterations):
    """Lower a node's bound, ``base`` at its prices, by the prices around cameras; return it.

    The cameras lose the ends of their ranges that no plan above ``goal`` can use.
    """
    local = empty_local(node, cameras, pairs)
    count = gather(node, cameras, pairs, by_sample, reach, local)
    sample, chosen = local.sample[:count], np.zeros(len(local.fixed), dtype=np.int64)
    price = node.price[sample]
    bound = adapt(local, pairs, by_sample.most, base, goal, iterations, price, chosen)
    node.price[sample] = price
    if bound > goal:
        _report(cameras, local, pairs.shots, price, chosen, bound - goal, node)
    return bound


@kernel
def _add_clipped(c, gains, low, high, price, sign, steps):
    """Add, or take away, what camera c takes, as differences from cell ``low`` to ``high``."""
    offsets, sample, gain, first, last = gains
    for j in range(offsets[c], offsets[c + 1]):
        above = gain[j] - price[sample[j]]
        if above > 0 and first[j] <= high and last[j] >= low:
            steps[max(first[j], low) - low] += sign * above
            steps[min(last[j], high) - low + 1] -= sign * above


@kernel
def _most_taken(c, pairs, low, high, price):
    """Return the most that camera c's view takes within the cells ``low`` to ``high`` (C,)."""
    if pairs.shots > 1:
        begin = c - c % pairs.shots
        end = begin + pairs.shots
        return best_cells(
            intervals_above(begin, pairs.gains, pairs.blurred, price),
            low[begin:end],
            high[begin:end],
            pairs.cell_offsets[c + 1] - pairs.cell_offsets[c],
            np.empty(pairs.shots, dtype=np.int32),
        )
    steps = np.zeros(high[c] - low[c] + 2, dtype=np.int64)
    _add_clipped(c, pairs.gains, low[c], high[c], price, 1, steps)
    _add_clipped(c, pairs.blurred, low[c], high[c], price, -1, steps)
    best, total = np.int64(-1), np.int64(0)
    for i in range(high[c] - low[c] + 1):
        total += steps[i]
        best = max(best, total)
    return best


@kernel
def _order(c, shots, low, high):
    """Narrow the ranges of camera c's view to ascending cells; return whether there are any."""
    begin = c - c % shots
    for other in range(begin + 1, begin + shots):
        low[other] = max(low[other], low[other - 1])
    for other in range(begin + shots - 2, begin - 1, -1):
        high[other] = min(high[other], high[other + 1])
    return bool((low[begin : begin + shots] <= high[begin : begin + shots]).all())


@kernel
def adapting(b, cuts, near, cameras):
    """Return those of so many cameras around which node b's prices adapt."""
    if cuts.wide[b]:
        return np.arange(cameras).astype(np.int32)
    c = cuts.camera[b]
    return near.camera[near.offsets[c] : near.offsets[c + 1]].copy()


@kernel
def _confine(
    b,
    cuts,
    near,
    gains,
    blurred,
    blurred_views,
    cell_offsets,
    views,
    shots,
    by_sample,
    nodes,
    goal,
    reach,
    iterations,
):
    """Confine one camera of node b, and bound what is left; return the bound."""
    pairs = PricedPairs(gains, blurred, blurred_views, cell_offsets, views, shots)
    low, high, price = nodes.low[b], nodes.high[b], nodes.price[b]
    c, bound = cuts.camera[b], nodes.bound[b]
    if c >= 0:
        bound -= _most_taken(c, pairs, low, high, price)
        low[c], high[c] = cuts.first[b], cuts.last[b]
        if not _order(c, shots, low, high):
            return goal
        bound += _most_taken(c, pairs, low, high, price)
    if bound <= goal:
        return bound
    cameras = adapting(b, cuts, near, len(low))
    node = Node(low, high, price, nodes.score[b], nodes.split[b], nodes.cell[b])
    return _tighten(node, bound, cameras, pairs, by_sample, goal, reach, iterations)


@parallel_kernel
def confine(
    cuts,
    near,
    gains,
    blurred,
    blurred_views,
    cell_offsets,
    views,
    shots,
    by_sample,
    nodes,
    goal,
    reach,
    iterations,
):
    """Confine one camera of each node to some of its cells, and bound what is left.

    Parameters
    ----------
    cuts : Cuts
    near : Neighbourhoods
    gains, blurred, blurred_views, cell_offsets, views, shots
        See :class:`PricedPairs`. Where several shots are one view all prices have to adapt.
    by_sample : GainsBySample
    nodes : Nodes
        At first copies of the parents, with bounds that are exact at their prices.
    goal : int
        Units; nodes that cannot gain more need no better bound.
    reach : int
        Pairs that gain less than the price by 2^-reach of the sample's most are left out.
    iterations : int
        The most price steps per node.
    """
    bound = nodes.bound
    for b in prange(len(bound)):
        bound[b] = _confine(
            b,
            cuts,
            near,
            gains,
            blurred,
            blurred_views,
            cell_offsets,
            views,
            shots,
            by_sample,
            nodes,
            goal,
            reach,
            iterations,
        )


@kernel
def gains_by_sample(by_camera, by_sample):
    """Fill ``by_sample`` with the gains of ``by_camera``, but for ``most``: a counting sort."""
    offsets, sample, gain, _, _ = by_camera
    sample_offsets, camera, sorted_gain, _ = by_sample
    sample_offsets[:] = 0
    for p in sample:
        sample_offsets[p + 1] += 1
    for p in range(len(sample_offsets) - 1):
        sample_offsets[p + 1] += sample_offsets[p]
    at = sample_offsets[:-1].copy()
    for c in range(len(offsets) - 1):
        for j in range(offsets[c], offsets[c + 1]):
            p = sample[j]
            camera[at[p]], sorted_gain[at[p]] = c, gain[j]
            at[p] += 1
