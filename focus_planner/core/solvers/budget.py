# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A budget of pictures: which are taken, and where they focus (docs/algorithm.md).

What pictures gain is submodular, so taking one after the other, each time the one that gains most,
is a good start, unless a warm start already says which to take. From there two searches take turns:
a method moves the pictures that are taken, and exchanges leave each one out in turn and take the
best of all others in its place. Both are exact and never raise the cost; together they end where
neither lowers it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import confined_to, with_pictures
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers import average, closest
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import (
    Solution,
    Solver,
    cells_at,
    distances_of_cells,
    finish,
    finish_cells,
    start_cells,
)

#: The stages, as the callback gets them.
CHOOSING, EXCHANGING = "pictures", "exchanges"
# The methods whose distances do not depend on which pictures are taken.
_FIXED = (closest.solve, average.solve)
# Searches take turns so often at most; on bodies and small parts they end after two to four.
_ROUNDS = 12


def within_budget(solver: Solver, images: int) -> Solver:
    """Return the solver of problems in which at most so many pictures are taken.

    Where it takes no picture, the focus distance is ``kernels.UNTAKEN``. It reports after every
    picture that it chooses or exchanges, and whenever the method does that moves them. O(images ·
    pairs) to choose, and as much for each round of exchanges.

    Parameters
    ----------
    solver : Solver
        The method that moves pictures.
    images : int
        Of all cameras together, at least 1.
    """

    def solve(
        problem: Problem,
        options: Options | None = None,
        on_progress: ProgressCallback = never_stop,
        /,
    ) -> Solution:
        return _Search(problem, solver, images, options or Options(), on_progress).run()

    return solve


class _Search:
    """Which pictures are taken, in which cells."""

    def __init__(
        self,
        problem: Problem,
        solver: Solver,
        images: int,
        options: Options,
        on_progress: ProgressCallback,
    ) -> None:
        self._fixed: FloatArray | None = None
        if solver in _FIXED:
            self._fixed = solver(problem, options).focus_distances
            problem = confined_to(problem, self._fixed)
        self._problem, self._solver, self._options = problem, solver, options
        self._images = min(images, problem.camera_count)
        self._on_progress = on_progress
        self._keep_going, self._iterations = True, 0
        cells = problem.cells
        self._views = problem.camera_views._replace(missing=cells.unseen)
        self._cell = self._first_cells()
        self._ranking = np.empty((problem.sample_count, problem.views + 1), dtype=np.int64)
        self._rank()
        self._gain = np.empty(len(self._views.offsets) - 1, dtype=np.int64)
        self._where = np.empty(len(self._gain), dtype=np.int32)

    def run(self) -> Solution:
        self._choose()
        converged = False
        for _ in range(_ROUNDS):
            settled = self._move()
            exchanged = self._exchange()
            if not self._choose() and not exchanged:
                converged = settled and self._keep_going
                break
        return self._finish(converged)

    def _first_cells(self) -> IntArray:
        """Return the cells of the pictures that the options say to start from, if so few."""
        start = self._options.start
        none = np.full(self._problem.camera_count, kernels.NO_PICTURE, dtype=np.int32)
        if start is None or np.isfinite(start).sum() > self._images:
            return none
        return np.where(np.isfinite(start), start_cells(self._problem, start), none)

    def _choose(self) -> bool:
        """Take pictures while there may be more and they gain; return whether any was taken."""
        before = self._taken
        while self._keep_going and self._taken < self._images and self._take():
            self._report(CHOOSING)
        return self._taken > before

    @property
    def _taken(self) -> int:
        return int((self._cell != kernels.NO_PICTURE).sum())

    @property
    def _units(self) -> int:
        return int(kernels.cost_of_rankings(self._ranking, self._views.needed, self._views.missing))

    def _report(self, stage: str) -> None:
        self._iterations += 1
        progress = Progress(stage, self._iterations, cost_of_units(self._units))
        self._keep_going = self._on_progress(progress)

    def _rank(self) -> None:
        kernels.rank_views(
            self._problem.pairs_by_sample,
            self._problem.cells.focus,
            self._views,
            self._cell,
            self._ranking,
        )

    def _take(self, least: int = 0) -> bool:
        """Take the picture that gains most, if it gains more than ``least``; return whether."""
        problem = self._problem
        # Of every view only the next picture is tried.
        with kernels.threads_for(len(problem.depth) // problem.shots):
            kernels.gains_of_pictures(
                problem.pairs_by_camera,
                problem.cells.focus,
                self._views,
                problem.cells.offsets,
                self._cell,
                self._ranking,
                self._gain,
                self._where,
            )
        view = int(np.argmax(self._gain))
        if self._gain[view] <= least:
            return False
        shots = np.arange(self._views.offsets[view], self._views.offsets[view + 1])
        free = shots[self._cell[shots] == kernels.NO_PICTURE]
        self._place(int(free[0]), int(self._where[view]))
        return True

    def _place(self, camera: int, cell: int) -> None:
        kernels.place(
            camera,
            cell,
            self._problem.pairs_by_camera,
            self._problem.pairs_by_sample,
            self._problem.cells.focus,
            self._views,
            self._cell,
            self._ranking,
        )

    def _move(self) -> bool:
        """Let the method move the pictures that are taken; return whether it has converged."""
        if self._fixed is not None or not self._keep_going:
            return self._keep_going
        taken = self._cell != kernels.NO_PICTURE
        problem = with_pictures(self._problem, taken)
        options = replace(self._options, start=distances_of_cells(problem, self._cell))

        def on_progress(progress: Progress) -> bool:
            self._iterations += 1
            self._keep_going = self._on_progress(replace(progress, iteration=self._iterations))
            return self._keep_going

        solution = self._solver(problem, options, on_progress)
        before, cell = self._units, self._cell
        self._cell = np.where(taken, cells_at(problem, solution.focus_distances), cell)
        self._rank()
        if self._units > before:
            # Methods settle what they found between cells, and go on from the nearest of them.
            self._cell = cell
            self._rank()
        return solution.converged

    def _exchange(self) -> bool:
        """Exchange every picture that is taken for the best of all others; return whether any was.

        A picture is left out, and the one that then gains most is taken if it gains more than the
        other did.
        """
        exchanged = False
        for camera in np.flatnonzero(self._cell != kernels.NO_PICTURE).tolist():
            if not self._keep_going:
                break
            before, cell = self._units, int(self._cell[camera])
            self._place(camera, kernels.NO_PICTURE)
            if self._take(self._units - before):
                exchanged = True
                self._report(EXCHANGING)
            else:
                self._place(camera, cell)
        return exchanged

    def _finish(self, converged: bool) -> Solution:
        taken = self._cell != kernels.NO_PICTURE
        if self._fixed is not None:
            focus = self._fixed
        else:
            cell = np.where(taken, self._cell, -1).astype(np.int32)
            problem = with_pictures(self._problem, taken)
            focus = finish_cells(problem, cell, 0, converged).focus_distances
        focus = np.where(taken, focus, kernels.UNTAKEN)
        return finish(self._problem, focus, self._iterations, converged)
