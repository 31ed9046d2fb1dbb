# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which solver a request asks for."""

from __future__ import annotations

from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers import SOLVERS, Solver
from focus_planner.core.solvers.budget import within_budget


def picture_limit(problem: Problem, request: PlanRequest) -> int | None:
    """Return how many pictures may be taken; None if all that there are may."""
    return request.images if 0 < request.images < problem.camera_count else None


def proves_itself(problem: Problem, request: PlanRequest) -> bool:
    """Return whether the method proves its own bound: ``optimal``, of problems without a limit."""
    return request.method == "optimal" and picture_limit(problem, request) is None


def solver_of(problem: Problem, request: PlanRequest) -> Solver:
    """Return the solver of the request's method, within its budget of pictures.

    There, ``optimal`` moves pictures as ``k_view`` does, and its bound is that of prices.
    """
    limit = picture_limit(problem, request)
    if limit is None:
        return SOLVERS[request.method]
    method = "k_view" if request.method == "optimal" else request.method
    return within_budget(SOLVERS[method], limit)
