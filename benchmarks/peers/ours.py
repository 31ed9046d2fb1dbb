# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""The planner's own methods, as peers of the others."""

from __future__ import annotations

import time
from functools import partial

from benchmarks.peers.found import Found
from focus_planner.core import kernels
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import SOLVERS, Options

_GAP = 1e-6


def _solve(method: str, problem: Problem, seconds: float, seed: int) -> Found:  # noqa: ARG001
    """Return a method's plan, and a tight bound: what there is when the time is over."""
    until = time.perf_counter() + seconds

    def in_time(_: Progress) -> bool:
        return time.perf_counter() < until

    with kernels.threads_for(len(problem.depth)):
        solution = SOLVERS[method](problem, Options(gap=_GAP), in_time)
        bound = solution.lower_bound
        if bound is None:
            cost = solution.cost
            bound = lower_bound(problem, cost, cost, on_progress=in_time).lower_bound
    return Found(solution.focus_distances, bound)


em = partial(_solve, "em")
k_view = partial(_solve, "k_view")
optimal = partial(_solve, "optimal")
