# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A lower bound on the cost of every plan, for plans of any method."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.arrays import FloatArray
from focus_planner.core.bounds.lagrangian import (
    Prices,
    cost_below,
    pointwise_prices,
    prices_in_units,
)
from focus_planner.core.brief import brief_repr
from focus_planner.core.problem.cells import units_of_cost
from focus_planner.core.problem.derived import derived
from focus_planner.core.problem.gains import Gains, gains_of
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop


@dataclass(frozen=True, eq=False)
class Bound:
    """A cost that no plan for a problem can go below, and its proof.

    Attributes
    ----------
    lower_bound : float
        1000 × the weighted mean.
    prices : (N,) array
        Prices of the samples, 0 to 1, that prove it.
    """

    lower_bound: float
    prices: FloatArray

    __repr__ = brief_repr


def prepare(problem: Problem, images: int | None = None) -> Gains:
    """Return what :func:`lower_bound` sums up; a problem may keep it."""
    return derived(problem, ("gains", images), lambda: gains_of(problem, images))


def lower_bound(
    problem: Problem,
    cost: float,
    near: float,
    gap: float = 1e-6,
    start: FloatArray | None = None,
    on_progress: ProgressCallback = never_stop,
    most_steps: int | None = None,
    images: int | None = None,
) -> Bound:
    """Return a lower bound on the cost of every plan for a problem.

    It is that of the Lagrangian relaxation (``lagrangian.py``; docs/algorithm.md), on bodies a few
    hundredths of a percent below the optimum; method ``optimal`` closes the remaining gap.

    Parameters
    ----------
    problem : Problem
    cost : float
        The cost of the plan that the bound is for, reported to ``on_progress``.
    near : float
        The cost of a good plan, which the steps aim at; the better the plan, the fewer are needed.
    gap : float
        A bound this part of ``near`` below it is good enough.
    start : (N,) array, optional
        Prices of the samples to start from, 0 to 1.
    on_progress : callable, optional
        Called after every few steps, stage "prices"; return False to stop.
    most_steps : int, optional
        Price steps, each as long as some 3 to 5 evaluations of the cost. When absent, steps are
        taken until they hardly raise the bound.
    images : int, optional
        How many pictures plans may have; by default all.
    """
    gains = prepare(problem, images)
    # With few steps, take them all: no gap is good enough to stop earlier.
    gap = gap if most_steps is None else 0.0
    goal = gains.out - units_of_cost(near * (1 - gap))
    prices = Prices(gains, None if start is None else prices_in_units(problem, start))
    rounds = 0
    while prices.steps < (most_steps or prices.steps + 1) and not prices.settled(goal):
        prices.descend(goal)
        rounds += 1
        below = cost_below(gains, min(prices.bound, gains.in_focus))
        share = min(prices.steps / most_steps, 1.0) if most_steps else None
        if not on_progress(Progress("prices", rounds, cost, below, share)):
            break
    bound = min(cost_below(gains, min(prices.bound, gains.in_focus)), cost)
    return Bound(bound, pointwise_prices(problem, prices.price))
