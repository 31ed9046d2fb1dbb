# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The autofocus baseline: each camera on the nearest surface that it sees (paper, Sec. 4.3)."""

from __future__ import annotations

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, finish, within_limits


def solve(
    problem: Problem, _: Options | None = None, on_progress: ProgressCallback = never_stop
) -> Solution:
    """Focus each camera at the least depth of the samples of some weight that it sees."""
    solution = finish(problem, within_limits(problem, closest_depths(problem)), 1, True)
    on_progress(Progress("closest", 1, solution.cost))
    return solution


def closest_depths(problem: Problem) -> FloatArray:
    """Return (C,) each camera's least depth, metres; NaN where it sees no sample of any weight."""
    depths = np.empty(problem.camera_count)
    kernels.least_depths(
        problem.camera_offsets,
        problem.camera_pairs,
        problem.sample_index,
        problem.depth,
        problem.samples.weights,
        depths,
    )
    return depths
