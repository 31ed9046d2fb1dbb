# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lagrangian bounds: a price per sample bounds what any plan can gain (docs/algorithm.md).

The bound counts every sample at its price v, and each camera's best cell at what its samples gain
above their prices:

    D(v) = Σ_p v_p + Σ_c max_j Σ_{p held by cell j of camera c} (g_pc − v_p)⁺

With several views per sample the bound has a term more, for views out of focus, and takes the
shots of one camera together: see kernels/lagrangian.py and docs/algorithm.md.

A sample's largest gain is at most v_p plus what all its cameras gain above v_p, so D(v) bounds
the gain of every plan, whatever v ≥ 0. It is the dual of the facility-location relaxation, with a
price per pair eliminated: at given v the best price of a pair is (g − v)⁺. One evaluation is a
weighted stabbing per camera, O(pairs + cells), and leaves a cell per camera from which a plan can
be made.

D is convex and piecewise linear. Subgradient steps with momentum and a falling target come to
within a few 1e-5 of its minimum in some hundred evaluations, in a tenth (1,000 samples) to a
hundredth (8,192) of the time that HiGHS's simplex or interior-point method takes for the same
relaxation; see `make bench ARGS=optimum`.
"""

from __future__ import annotations

import numpy as np
from numba import get_num_threads

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.gains import Gains
from focus_planner.core.problem.problem import Problem

# Pairs that gain less than the price by more than the sample's largest gain divided by this (first,
# and later on) are inactive: left out for some steps, since prices seldom fall as far, and are kept
# from falling farther.
_REACH_FIRST, _REACH = 16, 64
_STEPS_FIRST = 100
_STEPS_LEFT_OUT = 50
# Threads synchronise three times a step, which pays on large problems only.
_THREADED = 2
_WORK = 8_000_000  # pairs, samples and cells visited in one call of descend
_NONE = 2.0**62  # more than any bound
# When the hope is this part of the gap, further steps hardly lower the bound.
_HOPELESS = 0.005


class Prices:
    """A subgradient descent on the prices.

    Parameters
    ----------
    gains : Gains
    start : (N,) array of int64, optional
        In units, from 0 to each sample's largest gain; by default that over one
        more than it needs views, which of the starts tried on bodies came down soonest.

    Attributes
    ----------
    price : (N,) array of int64
        The prices that prove the least bound so far.
    steps : int
        Taken so far.
    """

    def __init__(self, gains: Gains, start: Offsets | None = None) -> None:
        samples = len(gains.most)
        price = gains.most // (gains.views + 1) if start is None else np.clip(start, 0, gains.most)
        self.price = price.copy()
        self.steps = 0
        self._gains = gains
        self._pairs = (gains.by_camera, gains.blurred, gains.seen)
        gained, blurred, self._seen = (
            kernels.GainsByCamera(*map(np.empty_like, pairs)) for pairs in self._pairs
        )
        self._active = gains.priced._replace(gains=gained, blurred=blurred)
        cells = int(gains.cell_offsets[-1])
        with kernels.threads_for(len(gains.gain) // _THREADED):
            threads = get_num_threads()
        self._state = kernels.PriceDescent(
            price=price.copy(),
            floor=np.zeros(samples, dtype=np.int64),
            most=gains.most,
            best_price=self.price,
            direction=np.zeros(samples),
            served=np.empty((threads, samples), dtype=np.int32),
            steps=np.empty(cells + gains.camera_count, dtype=np.int64),
            chosen=np.zeros(cells, dtype=np.int64),
            progress=np.array([_NONE, np.inf, np.inf, 0.0]),
        )

    @property
    def bound(self) -> int:
        """The least bound so far; exact, in units."""
        return int(self._state.progress[0])

    def settled(self, goal: int) -> bool:
        """Return whether more steps would hardly lower the bound."""
        if self.steps == 0:
            return False
        hope: float = self._state.progress[1]
        return self.bound <= goal or hope < _HOPELESS * (self.bound - goal)

    def descend(self, goal: int) -> None:
        """Take up to 50 steps, some 20 ms, towards a bound of ``goal``; stop when it is reached.

        The limit is on work, not time, so the steps do not depend on the machine.
        """
        gains, state = self._gains, self._state
        reach = gains.most // (_REACH_FIRST if self.steps < _STEPS_FIRST else _REACH)
        state.floor[:] = 0
        active_pairs = (self._active.gains, self._active.blurred, self._seen)
        for pairs, active in zip(self._pairs, active_pairs, strict=True):
            kernels.activate(pairs, state.price, reach, active, state.floor, len(state.served))
        work = int(self._active.gains.offsets[-1]) + len(gains.most) + int(gains.cell_offsets[-1])
        with kernels.threads_for(len(gains.gain) // _THREADED):
            self.steps += kernels.descend(
                *self._active,
                self._seen,
                gains.images,
                state,
                float(goal),
                max(5, min(_STEPS_LEFT_OUT, _WORK // work)),
            )

    def frequent_cells(self) -> IntArray:
        """Return (C,) the cell that was most often each camera's best since the last call.

        -1 for a camera without cells. Where the relaxation's solution is fractional, the steps
        alternate between cells; the most frequent has the largest share in it.
        """
        offsets = self._gains.cell_offsets
        cell = np.full(self._gains.camera_count, -1, dtype=np.int32)
        chosen = self._state.chosen
        kernels.most_frequent(offsets, chosen, cell)
        chosen //= 4
        return cell


def cost_below(gains: Gains, bound: int) -> float:
    """Return a lower bound on the cost of every plan, given that none gains more than ``bound``.

    It allows for rounding to whole units, see :func:`rounding`.
    """
    return cost_of_units(max(gains.out - bound - rounding(gains), 0))


def rounding(gains: Gains) -> int:
    """Return how many units a plan's cost may be off by: at most one per view of each sample."""
    return gains.views * len(gains.most)


def pointwise_prices(problem: Problem, price: Offsets) -> FloatArray:
    """Return (N,) prices as parts of each sample's weight, 0 to 1; 0 where it has none."""
    weights = problem.cells.unseen
    prices: FloatArray = price / np.maximum(weights, 1)
    return prices


def prices_in_units(problem: Problem, prices: FloatArray) -> Offsets:
    """Return the inverse of :func:`pointwise_prices`."""
    return np.rint(prices * problem.cells.unseen).astype(np.int64)
