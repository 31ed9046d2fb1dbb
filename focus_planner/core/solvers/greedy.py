# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lazy greedy: camera after camera, each time the one that gains most (docs/algorithm.md)."""

from __future__ import annotations

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, assign_samples, finish_cells

# Pairs and cells looked at between two calls of the callback, a hundredth of a second's work.
_WORK_BETWEEN_CALLS = 2_000_000


def solve(
    problem: Problem, _: Options | None = None, on_progress: ProgressCallback = never_stop
) -> Solution:
    """Take the camera and the cell that gain most beside those taken before; repeat.

    What cameras gain is submodular: it only falls as others are taken. So a camera is looked at
    again only when its last gain is the largest of all (Minoux, 1978), and the plan gains at least
    half of what the best one does over a rig in which nothing is in focus (Fisher, Nemhauser and
    Wolsey, 1978). Each camera is taken once, and starts nowhere. Stopped, the cameras left go to
    the best cells that were found for them.
    """
    state = _start(problem)
    cells, units = problem.cells, assign_samples(problem, state.cell)[1]
    iteration = 0
    while True:
        iteration += 1
        units -= kernels.take_cameras(
            _WORK_BETWEEN_CALLS,
            problem.pairs_by_camera,
            problem.pairs_by_sample,
            cells.focus,
            problem.camera_views,
            cells.offsets,
            state,
        )
        left = bool((state.gain >= 0).any())
        keep_going = on_progress(Progress("greedy", iteration, cost_of_units(units)))
        if not (left and keep_going):
            return finish_cells(problem, state.where, iteration, not left)


def _start(problem: Problem) -> kernels.GreedyState:
    """Return the state in which no camera is taken, and what each would gain."""
    cells, views, cameras = problem.cells, problem.camera_views, problem.camera_count
    state = kernels.GreedyState(
        cell=np.full(cameras, -1, dtype=np.int32),
        ranking=np.empty((problem.sample_count, problem.views), dtype=np.int64),
        steps=np.empty(int(cells.offsets[-1]) + cameras, dtype=np.int64),
        gain=np.empty(cameras, dtype=np.int64),
        where=np.empty(cameras, dtype=np.int32),
        fresh=np.empty(cameras, dtype=np.bool_),
    )
    kernels.rank_views(problem.pairs_by_sample, cells.focus, views, state.cell, state.ranking)
    kernels.first_gains(problem.pairs_by_camera, cells.focus, views, cells.offsets, state)
    return state
