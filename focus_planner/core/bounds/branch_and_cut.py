# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Branch and bound on the prices of samples and of cuts (docs/algorithm.md).

Nodes are as in :mod:`focus_planner.core.bounds.branch_and_bound`; their prices go on with those of
the cuts, which are free to fall, or to rise, where all their cameras are among those whose prices
adapt. Cuts hold in every plan, so those that are found at one node serve all.
"""

from __future__ import annotations

import heapq

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import Offsets
from focus_planner.core.bounds.branch_and_bound import REACH, Branching, Node, Part
from focus_planner.core.bounds.cut_prices import CutPrices
from focus_planner.core.problem.gains import Gains

# Cuts are sought at the node with the highest bound after so many steps of branching, by so many
# price steps with corners rounded by so much, until there are so many cuts.
_SEARCH_EVERY = 5
_SEARCH_STEPS, _SEARCH_WIDTH = 50, 0.03
_MOST_CUTS = 6000
# The price steps of every node, and how much corners are rounded at first and at last. Widths are
# in units of the root's.
_STEPS, _WIDTH, _NARROWEST = 300, 0.1, 0.007


class BranchingWithCuts(Branching):
    """A search in progress, as :class:`Branching`, from a bound with cuts.

    Parameters
    ----------
    gains : Gains
        With one view per sample.
    root : CutPrices
    goal : int
        Units; nodes that cannot gain more are dropped.
    """

    def __init__(self, gains: Gains, root: CutPrices, goal: int) -> None:
        self._root = root
        self._taken = 0
        super().__init__(gains, root.price, root.bound, goal)

    def step(self, goal: int) -> None:
        """Take one step of branching; now and then, seek cuts at the most promising node."""
        super().step(goal)
        self._taken += 1
        if self._taken % _SEARCH_EVERY == 0 and len(self._root.cuts.limit) < _MOST_CUTS:
            self._seek_cuts(goal)

    def _seek_cuts(self, goal: int) -> None:
        if not self._open:
            return
        node = self._open[0]
        gains = self._gains
        plan = kernels.FractionalPlan(
            np.zeros(len(gains.gain)), np.zeros(int(gains.cell_offsets[-1]))
        )
        node.price = self._padded(node.price)
        samples = len(gains.most)
        bound, last = -node.negative_bound, node.price.copy()
        width = _SEARCH_WIDTH * self._root.unit
        bound, _ = kernels.adapt_all(
            kernels.CutNode(node.low, node.high, node.price[:samples], node.price[samples:]),
            (last[:samples], last[samples:]),
            self._root.cuts,
            self._root.whole,
            bound,
            goal,
            4,
            kernels.Steps(_SEARCH_STEPS, width, width),
            plan,
        )
        heapq.heappop(self._open)
        node.negative_bound = -bound
        self._keep([node], goal)
        self._root.add_cuts(plan)

    @property
    def _price_count(self) -> int:
        return len(self._root.price)

    def _adapt(self, parts: list[Part], goal: int) -> list[Node]:
        for part in parts:
            part.node.price = self._padded(part.node.price)
        return super()._adapt(parts, goal)

    def _confine(self, cuts: kernels.Cuts, nodes: kernels.Nodes, goal: int) -> None:
        unit = self._root.unit
        steps = kernels.Steps(_STEPS, _WIDTH * unit, _NARROWEST * unit)
        # Threads meet once per batch here, not at every step.
        with kernels.threads_for(_STEPS * len(self._gains.gain)):
            kernels.confine_with_cuts(
                cuts, self._near, self._root.cuts, *self._root.whole, nodes, goal, REACH, steps
            )

    def _padded(self, price: Offsets) -> Offsets:
        """Return a node's prices, with 0 for the cuts that were found after it."""
        missing = len(self._root.price) - len(price)
        return np.concatenate([price, np.zeros(missing, dtype=np.int64)])
