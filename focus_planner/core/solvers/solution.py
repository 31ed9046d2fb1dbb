# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The result of every solver, and the steps from chosen cells to focus distances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.problem.cells import middle, settable
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.solvers.options import Options


@dataclass(frozen=True, eq=False)
class Solution:
    """Focus distances for a problem.

    Attributes
    ----------
    focus_distances : (C,) array
        Metres; NaN for a camera that sees no sample or cannot bring any into focus.
    cost : float
        1000 × the weighted mean over the samples (Eq. 3).
    iterations : int
    converged : bool
        False if the callback stopped it, or ``optimal`` could not prove its gap.
    lower_bound : float, optional
        No plan for these samples costs less; only ``optimal`` returns one.
    prices : (N,) array, optional
        Of the samples, 0 to 1; they prove the lower bound, or nearly.
    """

    focus_distances: FloatArray
    cost: float
    iterations: int
    converged: bool
    lower_bound: float | None = None
    prices: FloatArray | None = None

    __repr__ = brief_repr


class Solver(Protocol):
    """The signature of ``solve`` in every solver's file."""

    def __call__(
        self,
        problem: Problem,
        options: Options | None = None,
        on_progress: ProgressCallback = never_stop,
        /,
    ) -> Solution:
        """Return focus distances for a problem."""


def finish(problem: Problem, focus: FloatArray, iterations: int, converged: bool) -> Solution:
    """Return the solution at these focus distances."""
    return Solution(focus, problem.cost(focus), iterations, converged)


def finish_cells(problem: Problem, cell: IntArray, iterations: int, converged: bool) -> Solution:
    """Return the solution at the chosen cells, each camera centred on the samples it is best for.

    A camera's focus distance goes to the middle of the range that keeps all those samples in
    focus that are assigned to it and in focus (the paper's mid-point, Sec. 3.4.1, taken over the
    assigned samples). No sample costs more for that, and the surface between the samples, which
    no solver sees, is more likely to be in focus too. For a lens with a list of distances the
    range ends at listed ones, and the listed one nearest to its middle is taken.
    """
    focus = distances_of_cells(problem, cell)
    _, best = problem.assign(focus)
    near, far = np.full((2, len(focus)), np.nan)
    kernels.focus_room(
        problem.sample_offsets,
        problem.camera_index,
        problem.focus_near,
        problem.focus_far,
        focus,
        best,
        near,
        far,
    )
    every_camera = np.arange(problem.camera_count)
    centred = settable(problem.lenses, every_camera, middle(near, far))
    centred = np.where(np.isnan(near), focus, centred)
    return finish(problem, centred, iterations, converged)


def distances_of_cells(problem: Problem, cell: IntArray) -> FloatArray:
    """Return (C,) the middle of each camera's cell, metres; NaN for a camera without a cell."""
    cells = problem.cells
    focus = np.full(problem.camera_count, np.nan)
    chosen = cell >= 0
    focus[chosen] = cells.distances()[cells.offsets[:-1][chosen] + cell[chosen]]
    return focus


def assign_samples(problem: Problem, cell: IntArray) -> tuple[IntArray, int]:
    """Return (N, views) each sample's cheapest cameras at these cells, and the total (Eq. 5).

    The total is in units. Each of a sample's cameras is of another view; -1 for views that are
    missing.
    """
    cells, views = problem.cells, problem.camera_views
    best = np.empty((problem.sample_count, problem.views), dtype=np.int32)
    seen = kernels.assign(problem.pairs_by_sample, cells.focus, views, cell, best)
    missing = (best == kernels.UNSEEN).sum(axis=1)
    return best, int(seen) + int((cells.unseen * missing).sum())


def start_cells(problem: Problem, start: FloatArray) -> IntArray:
    """Return (C,) each camera's cell at or nearest to its focus distance; -1 if it has no cells."""
    cells, counts = problem.cells, np.diff(problem.cells.offsets)
    able = counts > 0
    first = cells.offsets[:-1][able]
    at = np.repeat(start, counts)
    beyond = np.maximum(cells.near - at, at - cells.far)
    least = np.repeat(np.minimum.reduceat(beyond, first) if able.any() else first, counts[able])
    nearest = np.flatnonzero(~(beyond > least))  # all of a camera's, if its start is NaN
    cell = np.full(problem.camera_count, -1, dtype=np.int32)
    cell[able] = nearest[np.searchsorted(nearest, first)] - first
    return cell


def cells_at(problem: Problem, focus: FloatArray) -> IntArray:
    """Return (C,) a cell of each camera that holds all its focus distance holds; -1 for no cells.

    Between two cells, intervals first end, and hold on to the one before, then begin, and reach to
    the one behind. So one of the two holds whatever is held there, and is not always the nearer.
    """
    cells = problem.cells
    cell = np.full(problem.camera_count, -1, dtype=np.int32)
    counts = np.diff(cells.offsets)
    for c in np.flatnonzero(counts):
        near = cells.near[cells.offsets[c] : cells.offsets[c + 1]]
        cell[c] = np.searchsorted(near, focus[c], side="right") - 1
    at, before = focus[problem.camera_index], cell[problem.camera_index]
    held = (problem.focus_near <= at) & (at <= problem.focus_far)
    ended = held & ~((cells.first <= before) & (before <= cells.last))
    cell[np.unique(problem.camera_index[ended])] += 1
    # Before the first cell something is held, or nothing: the first holds as much.
    return np.where(counts > 0, np.maximum(cell, 0), cell)


def within_limits(problem: Problem, focus: FloatArray) -> FloatArray:
    """Return the focus distances, each moved to the nearest that its lens can be set to."""
    return settable(problem.lenses, np.arange(problem.camera_count), focus)


def fill_missing_distances(problem: Problem, focus: FloatArray) -> FloatArray:
    """Return the focus distances with NaNs replaced by the median of those that were found.

    Each is moved to the nearest that its lens can be set to. These cameras see nothing, or
    nothing that they can focus on, so any distance would do, but their lenses will be set to it.
    """
    found = np.isfinite(focus)
    missing = ~found & (focus != kernels.UNTAKEN)
    if not missing.any():
        return focus.copy()
    wanted = np.array([lens.hyperfocal_distance for lens in problem.lenses])
    if found.any():
        wanted[:] = np.median(focus[found])
    wanted = np.maximum(wanted, [2 * lens.focal_length for lens in problem.lenses])
    settled = settable(problem.lenses, np.arange(problem.camera_count), wanted)
    return np.where(missing, settled, focus)
