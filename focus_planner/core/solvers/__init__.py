# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""One file per solver, one signature: ``solve(problem, options, on_progress) -> Solution``."""

from focus_planner.core.solvers import average, closest, em, greedy, k_view, optimal
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, Solver

#: Every method by its name in requests, on the command line and in plans.
SOLVERS: dict[str, Solver] = {
    "closest": closest.solve,
    "average": average.solve,
    "em": em.solve,
    "greedy": greedy.solve,
    "k_view": k_view.solve,
    "optimal": optimal.solve,
}

__all__ = ["SOLVERS", "Options", "Solution", "Solver"]
