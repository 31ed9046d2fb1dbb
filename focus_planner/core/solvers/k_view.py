# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""k-view optimisation: exact joint steps of two or three cameras (paper, Sec. 3.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numba import get_num_threads

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.problem.camera_tuples import Abandoned, camera_tuples, tuples_one_by_one
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.derived import derived
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers import em
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import (
    Solution,
    assign_samples,
    cells_at,
    finish_cells,
    start_cells,
)
from focus_planner.core.validation import InputError

# Shared samples between two calls of the callback, a fiftieth of a second's work. For triples a
# sample counts once per block of cells of the third camera: bounds rule out most of them.
_SAMPLES_BETWEEN_CALLS = 200_000
_THIRD_CELLS_AT_ONCE = 40
# Tuples, and shared samples, per batch below which tuples take their steps one after the other.
# Where views overlap so much, or there is so little to do, half a millisecond's work, a second
# thread would only wait after every batch: for a time slice, if another program has its core.
_TUPLES_AT_ONCE = 1.5
_SAMPLES_AT_ONCE = 5_000
#: The stages of pairs and of triples, as the callback gets them.
STAGES = {2: "k_view", 3: "k_view, triples"}


def solve(
    problem: Problem, options: Options | None = None, on_progress: ProgressCallback = never_stop
) -> Solution:
    """Start from EM's solution and move every tuple to its best cells until no move pays.

    With k = 3 triples start where pairs end: pairs take a tenth of the time and leave little to
    gain. Of fewer than k cameras all move together; of a single one EM's solution is the best.

    With scope "all" each step is exact block-coordinate descent on the total cost. With
    "assigned", the paper's, a step re-assigns the tuple's own samples among its cameras, and
    after each pass every sample goes to its cheapest camera. The cost never rises.
    """
    options = options or Options()
    keep_going, cost = True, 0.0

    def on_step(progress: Progress) -> bool:
        nonlocal keep_going, cost
        keep_going, cost = on_progress(progress), progress.cost
        return keep_going

    solution = em.solve(problem, options, on_step)
    for k in range(2, min(options.k, problem.camera_count) + 1):
        # Setting up the tuples takes longer than a step, so ask before, even if the stage before
        # has converged.
        if not (keep_going and on_progress(Progress(STAGES[k], 0, cost))):
            return replace(solution, converged=False)
        setting_up = partial(_keep_setting_up, on_step, STAGES[k], cost)
        try:
            descent = Descent(problem, replace(options, k=k), setting_up)
        except Abandoned:
            return replace(solution, converged=False)
        cell = start_cells(problem, solution.focus_distances)
        iterations, converged = descent.run(cell, on_step)
        iterations += solution.iterations
        solution = finish_cells(problem, descent.cell, iterations, converged)
    return solution


def prepare(problem: Problem, options: Options) -> None:
    """Find the pairs of cameras that :func:`solve` will ask for, for a problem that keeps them."""
    if problem.camera_count > 1:
        _tuples(problem, replace(options, k=2), lambda: True)


def gains_of_pairs(
    problem: Problem, focus: FloatArray, pairs: IntArray, scope: str = "all"
) -> FloatArray:
    """Return how much each pair of cameras gains by its exact best step, all others fixed.

    Parameters
    ----------
    problem : Problem
    focus : (C,) array
        Metres. Every pair starts from them, and every camera holds all that the cell at its
        distance holds.
    pairs : (T, 2) array of int
        Different cameras, each of which can hold some sample in focus.
    scope : {"all", "assigned"}
        As in :class:`Options`.

    Returns
    -------
    (T,) array
        By how much the cost falls, each sample being assigned to its cheapest camera before and
        after.

    Raises
    ------
    InputError
        If a pair is not one.
    """
    able = np.diff(problem.cells.offsets)[pairs] > 0
    unable = ~able.all(axis=1) | (pairs[:, 0] == pairs[:, 1])
    if unable.any():
        a, b = (problem.names[c] for c in pairs[np.argmax(unable)])
        expected = "two different cameras that can each hold a sample in focus"
        raise InputError("pairs", expected, f"{a!r} and {b!r}", "leave the pair out")
    tuples = tuples_one_by_one(problem, pairs)
    descent = Descent(problem, Options(k=2, scope=scope), tuples=tuples)
    cell = cells_at(problem, focus)
    gains = [cost_of_units(descent.gain_alone(cell, t)) for t in range(len(pairs))]
    return np.array(gains)


class Descent:
    """Descends on a problem's tuples from any choice of cells.

    Parameters
    ----------
    problem : Problem
    options : Options
    keep_going : callable, optional
        Called while the tuples are set up; return False to raise :class:`Abandoned`.
    tuples : CameraTuples, optional
        Instead of those that the options call for.

    Attributes
    ----------
    cell : (C,) array of int32
        The chosen cell of each camera.
    units : int
        The cost in units at these cells; with scope "assigned", at the end of the last whole
        pass, which no step since has raised.
    in_turn : bool
        Whether tuples take their steps one after the other; else those that may do so at once,
        where there are several threads.
    """

    cell: IntArray
    units: int

    def __init__(
        self,
        problem: Problem,
        options: Options,
        keep_going: Callable[[], bool] = lambda: True,
        tuples: kernels.CameraTuples | None = None,
    ) -> None:
        cells = problem.cells
        self._problem = problem
        self._stage = STAGES[options.k]
        self._assigned = options.scope == "assigned"
        if tuples is None:
            tuples = _tuples(problem, options, keep_going)
        self._tuples = tuples
        work = _work(problem, self._tuples)
        self._stops = _stops(self._tuples, work)
        batches = len(self._tuples.batch_offsets) - 1
        self.in_turn = bool(
            len(work) < _TUPLES_AT_ONCE * batches or work.sum() < _SAMPLES_AT_ONCE * batches
        )
        # Only one of them tells the kernels what stands around a tuple: see kernels/k_view.py.
        ranked = 0 if self._assigned else problem.sample_count
        cameras = problem.camera_count
        self._state = kernels.DescentState(
            cell=np.empty(cameras, dtype=np.int32),
            ranking=np.empty((ranked, problem.views + options.k), dtype=np.int64),
            best=np.empty((problem.sample_count, problem.views), dtype=np.int32),
            steps=np.empty(len(cells.near) + cameras, dtype=np.int64),
            touched=np.empty(cameras, dtype=np.int64),
            summed=np.empty(cameras, dtype=np.int64),
            solved=np.empty(len(self._tuples.cameras), dtype=np.int64),
            clock=np.empty(1, dtype=np.int64),
        )

    def run(self, cell: IntArray, on_progress: ProgressCallback) -> tuple[int, bool]:
        """Descend from these cells; return the number of steps and whether it has converged."""
        iteration = 0
        for steps in self.passes(cell):
            for units in steps:
                iteration += 1
                if not on_progress(Progress(self._stage, iteration, cost_of_units(units))):
                    return iteration, False
        return iteration, True

    def passes(self, cell: IntArray) -> Iterator[Iterator[int]]:
        """Descend from these cells pass by pass, up to the first pass that gains nothing.

        In a pass every tuple takes its best step. It is taken by iterating over it, to its end,
        before the next pass is asked for.

        Yields
        ------
        iterator of int
            The cost in units every now and then, and at the end of the pass.
        """
        self._start(cell)
        gained = True
        while gained:
            before_pass = self.units
            yield self._take_pass()
            gained = self.units != before_pass

    def run_from(self, cameras: IntArray, to: IntArray) -> None:
        """Move cameras, whatever that costs, and descend from there; with scope "all" only.

        After a descent that has converged; only tuples around what moves are solved.

        Parameters
        ----------
        cameras : (k,) array of int32
        to : (k,) array of int32
            A cell for each.
        """
        problem, cells = self._problem, self._problem.cells
        kernels.move_cameras(
            cameras,
            to,
            problem.pairs_by_camera,
            problem.pairs_by_sample,
            cells.focus,
            problem.camera_views,
            self._state,
        )
        while self._improve(0, self._stops[-1], in_turn=True):
            pass
        ranking = self._state.ranking
        self.units = int(kernels.cost_of_rankings(ranking, problem.views, cells.unseen))

    def standing(self) -> tuple[kernels.DescentState, int]:
        """Return a copy of where the descent stands, for :meth:`stand`."""
        return _copy(self._state), self.units

    def stand(self, state: kernels.DescentState, units: int) -> None:
        """Go back to where the descent stood."""
        self._state = _copy(state)
        self.cell, self.units = self._state.cell, units

    @property
    def neighbours(self) -> list[IntArray]:
        """Each camera's neighbours: those that it forms tuples with, ascending."""
        tuples, cameras = self._tuples.cameras, self._problem.camera_count
        near = np.zeros((cameras, cameras), dtype=bool)
        for a in range(tuples.shape[1]):
            for b in range(tuples.shape[1]):
                near[tuples[:, a], tuples[:, b]] = a != b
        return [np.flatnonzero(row).astype(np.int32) for row in near]

    def gain_alone(self, cell: IntArray, batch: int) -> int:
        """Return by how many units the cost falls if only this batch takes its best step."""
        self._start(cell.copy())
        before = self.units
        self._improve(batch, batch + 1)
        return before - assign_samples(self._problem, self.cell)[1]

    def _start(self, cell: IntArray) -> None:
        problem, self.cell = self._problem, cell
        best, self.units = assign_samples(problem, cell)
        self._state = state = self._state._replace(cell=cell, best=best)
        kernels.rank_views(
            problem.pairs_by_sample,
            problem.cells.focus,
            problem.camera_views,
            cell,
            state.ranking,
        )
        state.summed[:], state.touched[:], state.solved[:], state.clock[:] = 0, 1, 0, 1

    def _take_pass(self) -> Iterator[int]:
        """Let every tuple take its best step; yield the cost in units every now and then."""
        for low, high in pairwise(self._stops):
            if low:
                yield self.units
            gain = self._improve(low, high)
            if not self._assigned:
                self.units -= gain
        if self._assigned:
            # A step counts its gain from the best assignment within its tuple, not the present.
            problem = self._problem
            kernels.reassign(
                problem.pairs_by_sample, problem.cells.focus, problem.camera_views, self._state
            )
            self.units = assign_samples(problem, self.cell)[1]
        yield self.units

    def _improve(self, low: int, high: int, *, in_turn: bool = False) -> int:
        problem, cells = self._problem, self._problem.cells
        in_turn = in_turn or self.in_turn or get_num_threads() == 1
        improve = kernels.improve_in_turn if in_turn else kernels.improve_tuples
        gain = improve(
            self._tuples,
            low,
            high,
            problem.pairs_by_camera,
            problem.pairs_by_sample,
            cells.focus,
            problem.camera_views,
            cells.offsets,
            self._state,
        )
        return int(gain)


@dataclass(frozen=True, eq=False)
class _FoundTuples:
    """Tuples, and how often it was asked whether to go on while they were found."""

    tuples: kernels.CameraTuples
    questions: int


def _tuples(
    problem: Problem, options: Options, keep_going: Callable[[], bool]
) -> kernels.CameraTuples:
    """Return the tuples that the options call for, asking as often if they are known."""
    asked = 0

    def ask() -> bool:
        nonlocal asked
        asked += 1
        return keep_going()

    def find() -> _FoundTuples:
        tuples = camera_tuples(problem, options.k, options.scope, options.grid, ask, options.rings)
        return _FoundTuples(tuples, asked)

    key = ("tuples", options.k, options.scope, options.grid, options.rings)
    found = derived(problem, key, find)
    while asked < found.questions:
        if not ask():
            raise Abandoned
    return found.tuples


def _copy(state: kernels.DescentState) -> kernels.DescentState:
    arrays: list[Any] = [array.copy() for array in state]
    return kernels.DescentState(*arrays)


def _keep_setting_up(on_progress: ProgressCallback, stage: str, cost: float) -> bool:
    """Ask the callback whether to go on setting up a stage."""
    return on_progress(Progress(stage, 0, cost))


def _work(problem: Problem, tuples: kernels.CameraTuples) -> FloatArray:
    """Return (T,) the work of every tuple's step, in shared samples."""
    work = np.diff(tuples.shared_offsets).astype(np.float64)
    if tuples.cameras.shape[1] == 3:
        cell_counts = np.diff(problem.cells.offsets)
        work *= np.maximum(1.0, cell_counts[tuples.cameras[:, 2]] / _THIRD_CELLS_AT_ONCE)
    return work


def _stops(tuples: kernels.CameraTuples, work: FloatArray) -> list[int]:
    """Return the batches before which to report progress, and the end, spaced by work.

    Work, not time, so that the steps reported do not depend on the machine.
    """
    done = np.concatenate([[0.0], np.cumsum(work)])[tuples.batch_offsets]
    stops, at = [0], 0.0
    for batch, total in enumerate(done[1:], start=1):
        if total - at >= _SAMPLES_BETWEEN_CALLS or batch == len(done) - 1:
            stops.append(batch)
            at = total
    return stops
