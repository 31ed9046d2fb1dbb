# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The proven optimum, or the best plan found with a proof of how far it may be from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from focus_planner.core.ahead import Ahead
from focus_planner.core.arrays import IntArray
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.branch_and_cut import BranchingWithCuts
from focus_planner.core.bounds.cut_prices import CutPrices
from focus_planner.core.bounds.lagrangian import (
    Prices,
    cost_below,
    pointwise_prices,
    prices_in_units,
    rounding,
)
from focus_planner.core.problem.camera_tuples import Abandoned
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers import em
from focus_planner.core.solvers.k_view import Descent
from focus_planner.core.solvers.kicks import Kicks
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, assign_samples, finish_cells, start_cells

# Plans are recovered from the prices after so many steps, and again whenever their number has
# doubled; from open nodes after so many nodes, and again whenever their number has grown by a
# quarter.
_FIRST_RECOVERY = 50
_FIRST_RECOVERY_NODES = 16
# Cuts are sought once nodes times pairs to the power 1.5 exceed the first: in a larger problem a
# node takes longer, and more of them are needed. Where prices alone leave much of the cost, once
# nodes times pairs exceed the second, unless these nodes close most of that gap.
_WITHOUT_CUTS, _PAIRS_IF_MUCH = 1e10, 8_000_000
_MUCH = 2e-3
# That is all but this part of it.
_NEARLY = 0.3
# Cuts are sought sooner if the first eighth of those nodes, but at least so many, have not closed
# even this part of the gap.
_EIGHTH, _FEWEST_NODES = 1 / 8, 110
_HOPEFUL = 0.1
# Then the plan is kicked so many times, or as often as these pairs allow, which takes half a
# second, and so many times for every round of cuts and step of branching, a fifth of the time.
_FIRST_KICKS, _KICKS_PER_ROUND, _KICKS_PER_STEP = 256, 16, 4
_KICKED_PAIRS = 2_500_000
# How many plans are recovered from open nodes, and how many of them, the cheapest, are polished.
_PLANS, _POLISHED = 32, 3


def solve(
    problem: Problem, options: Options | None = None, on_progress: ProgressCallback = never_stop
) -> Solution:
    """Find the best plan of all, and prove it.

    Prices prove a first bound within a fraction of a percent
    (:mod:`focus_planner.core.bounds.lagrangian`). The cells that their steps choose most often,
    polished by 2-view descent, are the best plan or nearly so. Branch and bound
    (:mod:`focus_planner.core.bounds.branch_and_bound`) closes the rest of the gap, where that is
    large with cuts (:mod:`focus_planner.core.bounds.branch_and_cut`) and kicks
    (:mod:`focus_planner.core.solvers.kicks`). HiGHS was slower
    at every size from 60 samples up, on whole problems and on what reduced costs leave of them, and
    does not check the time for seconds; see ``make bench ARGS=optimum``.

    Stops when the plan is proven to exceed the lower bound by at most ``options.gap`` of its cost,
    when the callback returns False, or when there is no memory for more open nodes. Plan and bound
    are valid in any case.
    """
    return _Search(problem, options or Options(), on_progress).run()


class _Search:
    """The best plan so far, and an upper bound on the gain of every plan."""

    def __init__(self, problem: Problem, options: Options, on_progress: ProgressCallback) -> None:
        self._problem = problem
        self._options = replace(options, k=2, scope="all")
        self._on_progress = on_progress
        self._gains = gains_of(problem)
        self._bound = self._gains.in_focus
        self._prices: Prices | None = None
        self._descent: Descent | None = None
        self._kicks: Kicks | None = None
        self._keep_going = True
        self._iterations = 0
        self._reported = np.inf

    def run(self) -> Solution:
        problem = self._problem
        first = em.solve(problem, self._options, self._report)
        self._cell = start_cells(problem, first.focus_distances)
        self._units = assign_samples(problem, self._cell)[1]
        if self._unproven():
            self._price()
        if self._unproven() and self._report_stage("branching"):
            self._branch()
        prices = self._prices
        proven = self._bound <= self._goal
        solution = finish_cells(problem, self._cell, self._iterations, proven)
        return replace(
            solution,
            lower_bound=min(cost_below(self._gains, self._bound), solution.cost),
            prices=None if prices is None else pointwise_prices(problem, prices.price),
        )

    @property
    def _goal(self) -> int:
        """The gain that the bound has to come down to.

        The allowance for rounding, of the bound and of the plan's cost, is part of the gap.
        """
        gap = max(int(self._options.gap * self._units) - 2 * rounding(self._gains), 0)
        return self._gains.out - self._units + gap

    def _unproven(self) -> bool:
        return self._keep_going and self._bound > self._goal

    def _report(self, progress: Progress) -> bool:
        """Report a step with the best plan so far and the bound; return whether to go on."""
        self._iterations += 1
        self._reported = min(self._reported, progress.cost)
        bound = cost_below(self._gains, self._bound)
        self._keep_going = self._on_progress(
            replace(progress, iteration=self._iterations, cost=self._reported, lower_bound=bound)
        )
        return self._keep_going

    def _report_stage(self, stage: str) -> bool:
        return self._report(Progress(stage, 0, cost_of_units(self._units)))

    def _polish(self, cell: IntArray) -> None:
        """Descend from these cells; keep the result if it is the best plan so far."""
        self._keep(cell)  # there may be no time for the descent
        if self._problem.camera_count > 1:
            if self._descent is None:
                if not self._report_stage("k_view"):
                    return
                try:
                    self._descent = Descent(
                        self._problem, self._options, partial(self._report_stage, "k_view")
                    )
                except Abandoned:
                    return
            self._descent.run(cell, self._report)
            self._keep(self._descent.cell)

    def _keep(self, cell: IntArray) -> None:
        units = assign_samples(self._problem, cell)[1]
        if units < self._units:
            self._cell, self._units = cell.copy(), units

    def _price(self) -> None:
        """Lower the bound by prices alone, and recover plans from them."""
        start = self._options.prices
        warm = prices_in_units(self._problem, start) if start is not None else None
        prices = self._prices = Prices(self._gains, warm)
        recovery = _FIRST_RECOVERY
        while self._unproven() and not prices.settled(self._goal):
            prices.descend(self._goal)
            self._bound = min(self._bound, prices.bound)
            self._report_stage("prices")
            if self._unproven() and prices.steps >= recovery:
                self._polish(prices.frequent_cells())
                recovery = 2 * prices.steps
        if self._unproven():
            self._polish(prices.frequent_cells())

    def _branch(self) -> None:
        """Close the gap by branch and bound; with cuts, where that leaves much or takes long."""
        assert self._prices is not None
        gains, prices = self._gains, self._prices
        can_cut = gains.views == 1
        much = prices.bound - self._goal > _MUCH * self._units
        branching = Branching(gains, prices.price, prices.bound, self._goal)
        pairs = max(len(gains.gain), 1)
        if can_cut and much:
            self._close_without_cuts(branching, prices, _PAIRS_IF_MUCH / pairs)
            much = self._bound - self._goal > _NEARLY * (prices.bound - self._goal)
        if can_cut and not much:
            self._close_without_cuts(branching, prices, _WITHOUT_CUTS / pairs**1.5)
        if not can_cut:
            self._close(branching)
        elif self._unproven():
            self._close(self._cut(prices))

    def _close_without_cuts(self, branching: Branching, prices: Prices, most_nodes: float) -> None:
        """Close the gap by branch and bound as long as that seems worth it."""
        judged = max(_EIGHTH * most_nodes, _FEWEST_NODES)

        def go_on() -> bool:
            if branching.nodes < judged:
                return branching.nodes < most_nodes
            left = (self._bound - self._goal) / (prices.bound - self._goal)
            return branching.nodes < most_nodes and left < 1 - _HOPEFUL

        self._close(branching, go_on)

    def _cut(self, prices: Prices) -> Branching:
        """Lower the bound by prices of cuts as well, and kick the plan; return how to go on."""
        gains = self._gains
        cuts = CutPrices(gains, prices.price, prices.bound)
        self._kick(min(_FIRST_KICKS, _KICKED_PAIRS // max(len(gains.gain), 1)))
        while self._unproven() and not cuts.settled:
            with Ahead(self._kick_unasked) as kicked:
                cuts.descend(self._goal)
            kicked.result()
            self._bound = min(self._bound, cuts.bound)
            if self._kicks is not None:
                self._keep(self._kicks.cell)
                self._kicks.guide(cuts.plan.stands)
            self._report_stage("cuts")
        return BranchingWithCuts(gains, cuts, self._goal)

    def _kick_unasked(self) -> None:
        """Kick the best plan for a round of cuts, without asking whether to go on."""
        if self._kicks is not None:
            for _ in range(_KICKS_PER_ROUND):
                self._kick_once(self._kicks)

    def _kick_once(self, kicks: Kicks) -> None:
        """Kick the best plan, or what came of it."""
        if self._units < kicks.units:
            kicks.start(self._cell)
        kicks.kick()

    def _kick(self, count: int) -> None:
        """Kick the best plan so many times."""
        if self._descent is None:
            return
        if self._kicks is None:
            self._kicks = Kicks(self._descent, self._problem.cells.offsets)
        for _ in range(count):
            if not self._unproven():
                return
            self._kick_once(self._kicks)
            self._keep(self._kicks.cell)
            self._report_stage("kicks")

    def _close(self, branching: Branching, go_on: Callable[[], bool] = lambda: True) -> None:
        """Close the gap by branch and bound, and recover plans from open nodes."""
        recovery = _FIRST_RECOVERY_NODES
        while self._unproven() and go_on():
            # Without open nodes no plan is better than the goal.
            self._bound = min(self._bound, max(branching.bound, self._goal))
            self._report_stage("branching")
            if branching.exhausted:
                return
            if self._unproven() and branching.nodes >= recovery:
                for cell in self._cheapest(branching.plans(_PLANS))[:_POLISHED]:
                    if self._unproven():
                        self._polish(cell)
                recovery = branching.nodes + max(branching.nodes // 4, _FIRST_RECOVERY_NODES)
            if self._unproven():
                branching.step(self._goal)
            if branching.leaf is not None:
                self._polish(branching.leaf)
                branching.leaf = None
            if self._kicks is not None:
                self._kick(_KICKS_PER_STEP)

    def _cheapest(self, plans: list[IntArray]) -> list[IntArray]:
        """Return the plans, cheapest first."""
        costs = [assign_samples(self._problem, cell)[1] for cell in plans]
        return [plans[i] for i in np.argsort(costs, kind="stable")]
