"""Lagrangian bounds: a price per sample, and what no plan can gain at these prices.

Every sample gets its price v, and a camera that holds it in focus only what it gains above:

    D(v) = Σ_p v_p + Σ_c max_j Σ_{p held by cell j of camera c} (g_pc − v_p)⁺

A sample's largest gain is at most v_p plus what all its cameras gain above v_p, so D(v) bounds
the gain of every plan, whatever v ≥ 0. It is the dual of the facility-location relaxation, with a
price per pair eliminated: at given v the best price of a pair is (g − v)⁺. One evaluation is a
weighted stabbing per camera, O(pairs + cells), and leaves a cell per camera from which a plan can
be made.

D is convex and piecewise linear. Subgradient steps with momentum and a falling target come to
within a few 1e-5 of its least value in some hundred evaluations, in a tenth (1,000 samples) to a
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

# Pairs that gain less than the price by this part of the sample's most, at first and later on, are
# left out for so many steps: prices seldom fall as far, and are kept from falling farther.
_REACH_FIRST, _REACH = 16, 64
_STEPS_FIRST = 100
_STEPS_LEFT_OUT = 50
# Threads meet four times a step: only large problems are worth it.
_THREADED = 10
_WORK = 8_000_000  # pairs, samples and cells looked at
_NONE = 2.0**62  # more than any bound
# Hope that is so small a part of the gap changes nothing any more.
_HOPELESS = 0.005


class Prices:
    """Prices on their way to the least bound.

    Parameters
    ----------
    gains : Gains
    start : (N,) array of int64, optional
        In units, from 0 to each sample's most; half of the most when absent.

    Attributes
    ----------
    price : (N,) array of int64
        Those of the least bound found.
    steps : int
        Taken so far.
    """

    def __init__(self, gains: Gains, start: Offsets | None = None) -> None:
        samples = len(gains.most)
        price = gains.most // 2 if start is None else np.clip(start, 0, gains.most)
        self.price = price.copy()
        self.steps = 0
        self._gains = gains
        self._active = kernels.GainsByCamera(*map(np.empty_like, gains.by_camera))
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
        """The least bound found; in units, exact."""
        return int(self._state.progress[0])

    def settled(self, goal: int) -> bool:
        """Return whether more steps would hardly lower the bound."""
        if self.steps == 0:
            return False
        hope: float = self._state.progress[1]
        return self.bound <= goal or hope < _HOPELESS * (self.bound - goal)

    def descend(self, goal: int) -> None:
        """Lower the bound, until it is at ``goal``, by up to 50 steps or a fiftieth of a second.

        Work counts, not time: the steps do not depend on the machine.
        """
        gains, state = self._gains, self._state
        reach = gains.most // (_REACH_FIRST if self.steps < _STEPS_FIRST else _REACH)
        kernels.activate(gains.by_camera, state.price, reach, self._active, state.floor)
        work = int(self._active.offsets[-1]) + len(gains.most) + int(gains.cell_offsets[-1])
        with kernels.threads_for(len(gains.gain) // _THREADED):
            self.steps += kernels.descend(
                self._active,
                gains.cell_offsets,
                state,
                float(goal),
                max(5, min(_STEPS_LEFT_OUT, _WORK // work)),
            )

    def frequent_cells(self) -> IntArray:
        """Return (C,) the cell that was most often each camera's best since the last call.

        -1 for a camera without cells. Where the relaxation is torn between cells, the steps
        alternate between them; the most frequent is where it leans to.
        """
        offsets = self._gains.cell_offsets
        cell = np.full(self._gains.camera_count, -1, dtype=np.int32)
        chosen = self._state.chosen
        kernels.most_frequent(offsets, chosen, cell)
        chosen //= 4
        return cell


def cost_below(gains: Gains, bound: int) -> float:
    """Return the cost that no plan goes below if none gains more than ``bound``.

    What the units round off, at most one per sample, is allowed for.
    """
    return cost_of_units(max(gains.out - bound - len(gains.most), 0))


def pointwise_prices(problem: Problem, price: Offsets) -> FloatArray:
    """Return (N,) prices as parts of each sample's weight, 0 to 1; 0 where it has none."""
    weights = problem.cells.unseen
    prices: FloatArray = price / np.maximum(weights, 1)
    return prices


def prices_in_units(problem: Problem, prices: FloatArray) -> Offsets:
    """Return the inverse of :func:`pointwise_prices`."""
    return np.rint(prices * problem.cells.unseen).astype(np.int64)
