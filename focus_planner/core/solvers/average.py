# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The averaging baseline: each camera on the mean depth of what it sees (paper, Sec. 4.3)."""

from __future__ import annotations

import numpy as np

from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, finish, within_limits


def solve(
    problem: Problem, _: Options | None = None, on_progress: ProgressCallback = never_stop
) -> Solution:
    """Focus each camera at the mean depth of the samples that it sees, weighted."""
    weights = problem.samples.weights[problem.sample_index]
    count = problem.camera_count
    total = np.bincount(problem.camera_index, weights=weights, minlength=count)
    depth = np.bincount(problem.camera_index, weights=weights * problem.depth, minlength=count)
    mean = np.where(total > 0, depth / np.where(total > 0, total, 1.0), np.nan)
    solution = finish(problem, within_limits(problem, mean), 1, True)
    on_progress(Progress("average", 1, solution.cost))
    return solution
