# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What a peer returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers.solution import distances_of_cells


@dataclass(frozen=True, eq=False)
class Found:
    """A plan, (C,) metres, and the cost that no plan is below, if the peer knows one."""

    focus_distances: FloatArray
    lower_bound: float | None = None


def found_at(problem: Problem, cell: IntArray, lower_bound: float | None = None) -> Found:
    """Return the plan of these cells, (C,) counted from each camera's first."""
    chosen = np.where(np.diff(problem.cells.offsets) > 0, cell, -1)
    return Found(distances_of_cells(problem, chosen), lower_bound)
