# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Prices of samples and of cuts: a tighter bound than that of prices alone (docs/algorithm.md)."""

from __future__ import annotations

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import Offsets
from focus_planner.core.bounds.odd_holes import chosen, joined, no_cuts, separate
from focus_planner.core.problem.gains import Gains

# Price steps between two searches for cuts.
_STEPS = 80
_REACH = 4
# Corners are rounded by this part of what is left to the goal, dealt among the cameras, while cuts
# are sought. When these many rounds lower the bound by less than this part of what is left,
# corners shrink by a factor from round to round, down to the narrowest.
_WIDTH, _NARROWER, _NARROWEST = 0.06, 0.8, 0.004
_WORTHWHILE = 0.006
# Cuts without a price are dropped every so many rounds.
_ROUNDS = 8
# Wide corners prove little, so every so many rounds it is seen what sharp ones would prove.
_ROUNDS_PER_LOOK, _LOOK_STEPS = 16, 120


class CutPrices:
    """A descent on the prices of samples and of cuts, which are sought meanwhile.

    Parameters
    ----------
    gains : Gains
        With one view per sample.
    price : (N,) array of int64
        Of the samples, to start from; units.
    bound : int
        What these prove, exactly; units.

    Attributes
    ----------
    cuts : CutPool
    price : (N + K,) array of int64
        The prices of the samples and of the K cuts that prove the bound, units.
    bound : int
        The least so far; exact, in units.
    plan : FractionalPlan
        What the last steps take; of no sample and no camera before the first.
    unit : float
        Of the widths of rounded corners: what was left to the goal at first, dealt among the
        cameras.
    """

    def __init__(self, gains: Gains, price: Offsets, bound: int) -> None:
        self.whole = whole_of(gains)
        self.cuts = no_cuts()
        self.price, self.bound = price.copy(), bound
        self._gains = gains
        self._random = np.random.default_rng(0)
        self.plan = kernels.FractionalPlan(
            np.zeros(len(gains.gain)), np.zeros(int(gains.cell_offsets[-1]))
        )
        # Where steps go on from, and what that proves.
        self._last, self._last_bound = price.copy(), bound
        self._width, self.unit = _WIDTH, 1.0
        self._before = 2**62
        self._narrowing = False
        self._rounds = 0
        self.settled = False

    def descend(self, goal: int) -> None:
        """Take some steps towards a bound of ``goal``, and seek cuts.

        ``settled`` becomes whether more of these would hardly lower the bound.
        """
        if self._rounds == 0:
            self.unit = max((self.bound - goal) / self._gains.camera_count, 1.0)
        width = self._width * self.unit
        steps = kernels.Steps(_STEPS, width, width)
        self._last_bound = self._adapt(goal, self._last, steps, self.plan)
        self._rounds += 1
        if self._narrowing:
            self._width *= _NARROWER
            self.settled = self._width < _NARROWEST
        elif self._rounds % _ROUNDS == 0:
            fallen = self._before - self._last_bound
            self._narrowing = fallen < _WORTHWHILE * (self._last_bound - goal)
            self._before = self._last_bound
        if self._rounds % _ROUNDS == 0:
            self._drop_cuts()
        if self._rounds % _ROUNDS_PER_LOOK == 0 and not self._narrowing:
            self._look(goal)
        if not self.settled:
            self.add_cuts(self.plan)

    def add_cuts(self, plan: kernels.FractionalPlan) -> int:
        """Add cuts that a fractional solution violates, without a price; return how many."""
        found = separate(self._gains, self.whole.camera, plan, self._random)
        self.cuts = joined(self.cuts, found)
        none = np.zeros_like(found.limit)
        self.price = np.concatenate([self.price, none])
        self._last = np.concatenate([self._last, none])
        return len(found.limit)

    def _drop_cuts(self) -> None:
        samples = len(self._gains.most)
        priced = (self.price[samples:] > 0) | (self._last[samples:] > 0)
        kept = np.flatnonzero(priced).astype(np.int64)
        self.cuts = chosen(self.cuts, kept)
        every = np.concatenate([np.arange(samples), samples + kept])
        self.price, self._last = self.price[every], self._last[every]

    def _look(self, goal: int) -> None:
        """See what prices near the last prove at sharp corners; leave the last as they are."""
        plan = kernels.FractionalPlan(*map(np.empty_like, self.plan))
        steps = kernels.Steps(_LOOK_STEPS, self._width * self.unit, _NARROWEST * self.unit)
        self._adapt(goal, self._last.copy(), steps, plan)

    def _adapt(
        self, goal: int, last: Offsets, steps: kernels.Steps, plan: kernels.FractionalPlan
    ) -> int:
        """Take steps from the last prices; return what those of the last step prove."""
        high = (np.diff(self._gains.cell_offsets) - 1).astype(np.int32)
        best = last.copy()
        bound, final = kernels.adapt_all(
            kernels.CutNode(np.zeros_like(high), high, *self._parts(best)),
            self._parts(last),
            self.cuts,
            self.whole,
            self._last_bound,
            goal,
            _REACH,
            steps,
            plan,
        )
        if bound < self.bound:
            self.price, self.bound = best, bound
        return int(final)

    def _parts(self, price: Offsets) -> tuple[Offsets, Offsets]:
        samples = len(self._gains.most)
        return price[:samples], price[samples:]


def whole_of(gains: Gains) -> kernels.Whole:
    """Return what kernels need of all pairs to price cuts."""
    camera = np.repeat(np.arange(gains.camera_count, dtype=np.int32), np.diff(gains.offsets))
    counts = np.bincount(gains.sample, minlength=len(gains.most))
    return kernels.Whole(
        gains.by_camera,
        camera,
        np.concatenate([[0], np.cumsum(counts)]),
        np.argsort(gains.sample, kind="stable"),
        gains.most,
        gains.cell_offsets,
    )
