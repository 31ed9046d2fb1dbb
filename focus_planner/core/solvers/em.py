# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Expectation-minimisation, one camera at a time (paper, Sec. 3.3)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import IntArray
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers import closest
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, assign_samples, finish_cells, start_cells


def solve(
    problem: Problem, options: Options | None = None, on_progress: ProgressCallback = never_stop
) -> Solution:
    """Assign samples to their cheapest cameras, move cameras to their samples' best cells, repeat.

    Both steps are exact (Eq. 5, Eq. 8), so the cost never rises; O(pairs + cells) a step. The
    result depends on the start: of the closest, mean, median and farthest depths and each
    camera's own best distance, the closest gave the lowest cost on bodies.

    With several views the shots of a camera, which are one of them, move together.
    """
    options = options or Options()
    start = options.start
    if start is None or np.isnan(start).any():
        closest_depths = closest.closest_depths(problem)
        start = (
            closest_depths if start is None else np.where(np.isnan(start), closest_depths, start)
        )
    cell = start_cells(problem, start)
    best, units = assign_samples(problem, cell)
    move = _mover(problem)
    iteration = 0
    while True:
        iteration += 1
        moved = move(best, cell)
        best, units = assign_samples(problem, cell)
        keep_going = on_progress(Progress("em", iteration, cost_of_units(units)))
        if not (moved and keep_going):
            return finish_cells(problem, cell, iteration, not moved)


def _mover(problem: Problem) -> Callable[[IntArray, IntArray], int]:
    """Return what moves cameras to the best cells for their samples; it returns how many moved."""
    pairs, cells = problem.pairs_by_camera, problem.cells
    focus, offsets = cells.focus, cells.offsets
    if problem.views > 1 and problem.shots > 1:
        return partial(kernels.stab_brackets, pairs, focus, problem.camera_views, offsets)
    held = np.empty(len(cells.near), dtype=np.int64)
    kernels.held_weights(pairs, focus, offsets, held)
    return partial(kernels.stab, pairs, focus, offsets, held)
