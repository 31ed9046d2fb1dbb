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

# Price steps between two searches for cuts, and where no cuts are sought yet.
_STEPS, _FIRST_STEPS = 60, 100
_PATIENCE = 30
_BEYOND = 1e-6
# Of 0 to 3, 0.1 to 0.3 came nearest to the relaxation's optimum in 600 steps, and with a third of
# the pairs taken in part.
DAMPED = 0.15
_REACH = 4
# Steps aim at this part of what is left to the goal: more after those that got a tenth of it, less
# after others.
_HOPE_FIRST, _HOPE_LEAST, _HOPE_MOST = 0.04, 5e-4, 0.06
_HOPE_GROWTH, _HOPE_FALL = 1.3, 0.7
_REACHED = 0.1
# Cuts without a price are dropped every so many rounds, and these many rounds have to lower the
# bound by this part of what is left.
_ROUNDS = 8
_WORTHWHILE = 0.02


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
    """

    def __init__(self, gains: Gains, price: Offsets, bound: int) -> None:
        self.whole = whole_of(gains)
        self.cuts = no_cuts()
        self.price, self.bound = price.copy(), bound
        self._gains = gains
        self._random = np.random.default_rng(0)
        self._averages = kernels.FractionalPlan(
            np.zeros(len(gains.gain)), np.zeros(int(gains.cell_offsets[-1]))
        )
        self._hope = _HOPE_FIRST
        self._rounds = 0
        self._before = 0
        self.settled = False

    def descend(self, goal: int) -> None:
        """Seek cuts, and take some steps towards a bound of ``goal``, some 20 ms.

        ``settled`` becomes whether more of these would hardly lower the bound.
        """
        if self._rounds == 0:
            self._adapt(goal, _FIRST_STEPS)
            self._before = self.bound
        self.add_cuts(self._averages)
        before = self.bound
        self._adapt(goal, _STEPS)
        if before - self.bound > _REACHED * self._hope * (before - goal):
            self._hope = min(_HOPE_GROWTH * self._hope, _HOPE_MOST)
        else:
            self._hope = max(_HOPE_FALL * self._hope, _HOPE_LEAST)
        self._rounds += 1
        if self._rounds % _ROUNDS == 0:
            self._drop_cuts()
            self.settled = self._before - self.bound < _WORTHWHILE * (self._before - goal)
            self._before = self.bound

    def add_cuts(self, averages: kernels.FractionalPlan) -> int:
        """Add cuts that a fractional solution violates, without a price; return how many."""
        found = separate(self._gains, self.whole.camera, averages, self._random)
        self.cuts = joined(self.cuts, found)
        self.price = np.concatenate([self.price, np.zeros_like(found.limit)])
        return len(found.limit)

    def _drop_cuts(self) -> None:
        samples = len(self._gains.most)
        kept = np.flatnonzero(self.price[samples:]).astype(np.int64)
        self.cuts = chosen(self.cuts, kept)
        self.price = np.concatenate([self.price[:samples], self.price[samples:][kept]])

    def _adapt(self, goal: int, steps: int) -> None:
        hope = self._hope * (self.bound - goal)
        high = (np.diff(self._gains.cell_offsets) - 1).astype(np.int32)
        adapted = kernels.Steps(steps, hope, _BEYOND, _PATIENCE, DAMPED)
        self.bound = kernels.adapt_all(
            kernels.CutNode(np.zeros_like(high), high, *self._parts()),
            self.cuts,
            self.whole,
            self.bound,
            goal,
            _REACH,
            adapted,
            self._averages,
        )

    def _parts(self) -> tuple[Offsets, Offsets]:
        samples = len(self._gains.most)
        return self.price[:samples], self.price[samples:]


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
