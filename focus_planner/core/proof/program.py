"""What reduced costs leave of a small problem, as a mixed-integer program for HiGHS.

No plan above the goal uses a cell, or a gain, that costs more at the prices of a bound than lies
between bound and goal. What is left is facility location with one variable z per cell, "the camera
stands at this cell or an earlier one", so that "it stands between the cells that hold the sample"
is a difference of two: rows of three entries, however many cells hold the sample. HiGHS's cuts
close in tenths of a second the odd gap of a thousand samples that branching on prices
(core/proof/branching.py) only nibbles at; with tens of thousands of rows they do not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import highspy
import numpy as np
from scipy.sparse import coo_array

from focus_planner.core import kernels
from focus_planner.core.problem import UNITS, Offsets
from focus_planner.core.proof.gains import Gains
from focus_planner.core.types import FloatArray, IntArray

# HiGHS's tolerance, the tightest that it takes, and what its bound may be off by for that: the
# rows' prices sum to what the samples gain, give or take little.
_TOLERANCE = 1e-10
_ALLOWANCE = 1e-8
_OPTIONS: dict[str, bool | int | float] = {
    "output_flag": False,
    "threads": 1,
    "mip_rel_gap": 0.0,
    "mip_abs_gap": 0.0,
    "mip_feasibility_tolerance": _TOLERANCE,
    "primal_feasibility_tolerance": _TOLERANCE,
    "dual_feasibility_tolerance": _TOLERANCE,
}
# HiGHS is given cost as users see it.
_SCALE = 1000 / UNITS
_MOST = 2.0**62
# Where what HiGHS says of its bound holds; not after an error, such as that something else in the
# process uses it with another number of threads.
_TELLING = (highspy.HighsModelStatus.kOptimal, highspy.HighsModelStatus.kInterrupt)


class Program:
    """A mixed-integer program of what is left.

    Parameters
    ----------
    gains : Gains
    price : (N,) array of int64
        Of a bound.
    bound : int
        The bound at these prices, exactly.
    goal : int
        Plans that gain no more are of no interest.
    """

    def __init__(self, gains: Gains, price: Offsets, bound: int, goal: int) -> None:
        slack = bound - goal
        takings = np.empty(gains.cell_offsets[-1], dtype=np.int64)
        kernels.cell_takings(*gains.pairs, gains.cell_offsets, price, takings)
        self._gains = gains
        self._goal = goal
        self._kept = np.zeros(len(takings), dtype=np.bool_)
        for low, high in pairwise(gains.cell_offsets):
            if low < high:
                part = takings[low:high]
                self._kept[low:high] = part >= part.max() - slack
        # The cells that hold each pair, among those kept of all cameras.
        before = np.concatenate([[0], np.cumsum(self._kept)])
        of_camera = np.repeat(gains.cell_offsets[:-1], np.diff(gains.offsets))
        low, high = before[of_camera + gains.first], before[of_camera + gains.last + 1]
        self._pairs = np.flatnonzero((low < high) & (price[gains.sample] - gains.gain <= slack))
        self._low, self._high = low[self._pairs], high[self._pairs]
        self._cell_offsets = before[gains.cell_offsets]

    @property
    def size(self) -> int:
        """How many gains are left."""
        return len(self._pairs)

    def solve(self, go_on: Callable[[], bool]) -> tuple[int, IntArray | None]:
        """Return what no plan gains more than, if more than the goal, and the best plan's cells.

        There are no cells if there is no such plan, or none was found. ``go_on`` is asked now and
        then.
        """
        if not self.size:
            return self._goal, None
        highs = highspy.Highs()  # type: ignore[no-untyped-call]
        for option, value in _OPTIONS.items():
            highs.setOptionValue(option, value)
        # Plans that gain less than the goal need not be looked for, rounded so that none is lost.
        highs.setOptionValue("objective_bound", -self._goal * _SCALE * (1 - _ALLOWANCE))
        highs.passModel(self.model())

        def ask(event: Any) -> None:
            if not go_on():
                event.interrupt()

        highs.cbMipInterrupt.subscribe(ask)
        highs.cbSimplexInterrupt.subscribe(ask)
        highs.run()
        status, info = highs.getModelStatus(), highs.getInfo()
        if status == highspy.HighsModelStatus.kInfeasible:
            return self._goal, None
        if status not in _TELLING:
            return int(_MOST), None
        bound = -info.mip_dual_bound / _SCALE * (1 + _ALLOWANCE)
        bound = math.ceil(max(min(bound, _MOST), self._goal))
        found = info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible
        if not found or -info.objective_function_value <= self._goal * _SCALE:
            return bound, None
        standing = np.array(highs.getSolution().col_value)[self.size :]
        return bound, self._cells(standing)

    def model(self) -> highspy.HighsLp:
        """Return it for HiGHS.

        Maximise Σ gain·y, y ≤ z(high) − z(low), Σ y of a sample ≤ 1, z ascending to 1. The columns
        are y, one per pair, then z, one per cell kept.
        """
        gains, pairs, z = self._gains, self.size, self.size
        y = np.arange(pairs)
        cells = int(self._cell_offsets[-1])
        camera = np.repeat(np.arange(gains.camera_count), np.diff(self._cell_offsets))
        is_last = np.append(camera[1:] != camera[:-1], True)[:cells]
        pair_camera = np.repeat(np.arange(gains.camera_count), np.diff(gains.offsets))[self._pairs]
        after_first = np.flatnonzero(self._low > self._cell_offsets[pair_camera])
        samples, row_of_pair = np.unique(gains.sample[self._pairs], return_inverse=True)
        steps = np.flatnonzero(~is_last)
        rows, columns, values = [], [], []
        for row, column, value in (
            (y, y, 1.0),
            (y, z + self._high - 1, -1.0),
            (after_first, z + self._low[after_first] - 1, 1.0),
            (pairs + row_of_pair, y, 1.0),
            (pairs + len(samples) + np.arange(len(steps)), z + steps, 1.0),
            (pairs + len(samples) + np.arange(len(steps)), z + steps + 1, -1.0),
        ):
            rows.append(row)
            columns.append(column)
            values.append(np.full(len(row), value))
        shape = (pairs + len(samples) + len(steps), pairs + cells)
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        matrix = coo_array(entries, shape=shape).tocsc()
        model = highspy.HighsLp()
        model.num_row_, model.num_col_ = shape
        model.col_cost_ = np.concatenate([-_SCALE * gains.gain[self._pairs], np.zeros(cells)])
        model.col_lower_ = np.concatenate([np.zeros(pairs), is_last.astype(np.float64)])
        model.col_upper_ = np.ones(shape[1])
        model.row_lower_ = np.full(shape[0], -highspy.kHighsInf)
        model.row_upper_ = np.repeat([0.0, 1.0, 0.0], [pairs, len(samples), len(steps)])
        model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
        model.a_matrix_.start_ = matrix.indptr
        model.a_matrix_.index_ = matrix.indices
        model.a_matrix_.value_ = matrix.data
        continuous, whole = highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger
        model.integrality_ = [continuous] * pairs + [whole] * cells
        return model

    def _cells(self, standing: FloatArray) -> IntArray:
        """Return (C,) the first cell of each camera at which z is 1."""
        kept = np.flatnonzero(self._kept)
        cell = np.full(self._gains.camera_count, -1, dtype=np.int32)
        for c, (low, high) in enumerate(pairwise(self._cell_offsets)):
            if low < high:
                at = low + int(np.argmax(standing[low:high] > 0.5))
                cell[c] = kept[at] - self._gains.cell_offsets[c]
        return cell
