# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Bounds with cuts on plans whose cameras are confined to a part of their cells."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.branch_and_bound import adapting, cut_off
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.cut_prices import adapt_cuts, spread, takings_with_cuts
from focus_planner.core.kernels.local_cuts import CutNode, Whole, gather_cuts
from focus_planner.core.kernels.local_prices import Node

# Shares of cells in so many parts.
_PARTS = 100


@kernel
def _most_taken(c, node, cuts, gains):
    """Return the most that one cell of camera c takes, of those that it may be set to."""
    offsets, sample, gain, first, last = gains
    begin, end, low, high = offsets[c], offsets[c + 1], node.low[c], node.high[c]
    above, steps = np.empty(end - begin, dtype=np.int64), np.zeros(high - low + 2, dtype=np.int64)
    for j in range(begin, end):
        above[j - begin] = gain[j] - node.price[sample[j]]
    for k in np.flatnonzero(node.multiplier):
        weight = node.multiplier[k]
        for e in range(cuts.pair_offsets[k], cuts.pair_offsets[k + 1]):
            if begin <= cuts.pair[e] < end:
                above[cuts.pair[e] - begin] -= weight
        for r in range(cuts.range_offsets[k], cuts.range_offsets[k + 1]):
            if cuts.camera[r] == c and cuts.first[r] <= high and cuts.last[r] >= low:
                steps[max(cuts.first[r], low) - low] += weight
                steps[min(cuts.last[r], high) - low + 1] -= weight
    for j in range(begin, end):
        if above[j - begin] > 0 and first[j] <= high and last[j] >= low:
            steps[max(first[j], low) - low] += above[j - begin]
            steps[min(last[j], high) - low + 1] -= above[j - begin]
    best, total = np.int64(-1), np.int64(0)
    for i in range(high - low + 1):
        total += steps[i]
        best = max(best, total)
    return best


@kernel
def _report(cameras, local, price, multiplier, chosen, slack, node):
    """Report each camera's best cell and where to split it; cut off ends that no plan can use."""
    extra, takings = np.empty(len(local.pair), dtype=np.int64), np.empty_like(local.fixed)
    spread(local, multiplier, extra)
    for k in range(len(cameras)):
        c = cameras[k]
        node.score[c] = 0
        if node.high[c] < node.low[c]:
            continue
        part = takings[local.cell_offsets[k] : local.cell_offsets[k + 1]]
        value, cell = takings_with_cuts(k, local, price, multiplier, extra, part)
        cut_off(k, c, local, value, cell, slack, takings, chosen, node)


@kernel
def _tighten(node, cut_node, base, cameras, cuts, whole, goal, reach, steps):
    """Lower a node's bound by the prices and multipliers around cameras; return it."""
    local = gather_cuts(cameras, cut_node, cuts, whole, reach)
    price = np.zeros(len(local.sample) + 1, dtype=np.int64)
    price[:-1] = cut_node.price[local.sample]
    multiplier = cut_node.multiplier[local.cut]
    ends = price.copy(), multiplier.copy()
    bound, _, _, share = adapt_cuts(local, whole.most, base, goal, steps, price, multiplier, ends)
    chosen = np.rint(_PARTS * share).astype(np.int64)
    cut_node.price[local.sample] = price[:-1]
    cut_node.multiplier[local.cut] = multiplier
    if bound > goal:
        _report(cameras, local, price, multiplier, chosen, bound - goal, node)
    return bound


@kernel
def _confine(b, branch, near, cuts, whole, nodes, goal, reach, steps):
    """Confine one camera of node b, and bound what is left; return the bound."""
    samples, c, bound = len(whole.most), branch.camera[b], nodes.bound[b]
    low, high = nodes.low[b], nodes.high[b]
    cut_node = CutNode(low, high, nodes.price[b, :samples], nodes.price[b, samples:])
    if c >= 0:
        bound -= _most_taken(c, cut_node, cuts, whole.gains)
        low[c], high[c] = branch.first[b], branch.last[b]
        bound += _most_taken(c, cut_node, cuts, whole.gains)
    if bound <= goal:
        return bound
    cameras = adapting(b, branch, near, len(low))
    node = Node(low, high, nodes.price[b], nodes.score[b], nodes.split[b], nodes.cell[b])
    return _tighten(node, cut_node, bound, cameras, cuts, whole, goal, reach, steps)


@parallel_kernel
def confine_with_cuts(
    branch,
    near,
    cuts,
    gains,
    camera,
    sample_offsets,
    by_sample,
    most,
    cell_offsets,
    nodes,
    goal,
    reach,
    steps,
):
    """Confine one camera of each node to some of its cells, and bound what is left.

    Parameters
    ----------
    branch : focus_planner.core.kernels.branch_and_bound.Cuts
    near : Neighbourhoods
    cuts : CutPool
    gains, camera, sample_offsets, by_sample, most, cell_offsets
        See :class:`Whole`.
    nodes : Nodes
        At first copies of the parents, with bounds that are exact at their prices: those of the N
        samples, and then the K multipliers of the cuts.
    goal : int
        Units; nodes that cannot gain more need no better bound.
    reach : int
        Pairs that gain less than the price by 2^-reach of the sample's most are left out.
    steps : Steps
        Of each node.
    """
    bound = nodes.bound
    for b in prange(len(bound)):
        whole = Whole(gains, camera, sample_offsets, by_sample, most, cell_offsets)
        bound[b] = _confine(b, branch, near, cuts, whole, nodes, goal, reach, steps)
