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
