# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""CP-SAT: plans with a bound.

Not for a process that has HiGHS: OR-Tools comes with its own, of the same name.
"""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np
from ortools.sat.python import cp_model

from benchmarks.peers.choices import Choices, choices_of, taken_pairs
from benchmarks.peers.found import Found, found_at
from benchmarks.peers.heuristics import greedy_cells
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.problem import Problem

_WORKERS = 2
_GAP = 1e-6
# Shorter numbers than ours suit CP-SAT's arithmetic: rounded up, gains and their bound only grow,
# of all samples together by less than a millionth of the cost.
_SHORTER = 2**10


def cp_sat(problem: Problem, seconds: float, seed: int) -> Found:
    """Return CP-SAT's plan, told greedy's to begin with.

    Facility location with a literal z per cell, "the camera stands at this cell or an earlier
    one", so that "it stands between the cells that hold the sample" is a difference of two.
    """
    began = time.perf_counter()
    choices, gains = choices_of(problem)
    model = cp_model.CpModel()
    stands = _standing(model, choices)
    takes = [model.new_bool_var("") for _ in choices.gain]
    for take, c, first, last in zip(
        takes, choices.camera.tolist(), choices.first.tolist(), choices.last.tolist(), strict=True
    ):
        later = stands[c][last] if last < choices.cells[c] - 1 else 1
        model.add(take <= later - (stands[c][first - 1] if first > 0 else 0))
    for low, high in pairwise(choices.sample_offsets):
        if high - low > 1:
            model.add_at_most_one(takes[i] for i in choices.by_sample[low:high])
    worth = (-(-choices.gain // _SHORTER)).tolist()
    model.maximize(cp_model.LinearExpr.weighted_sum(takes, worth))
    start = greedy_cells(choices)
    for take, taken in zip(takes, taken_pairs(choices, start).tolist(), strict=True):
        model.add_hint(take, taken)
    for c, each in enumerate(stands):
        for j, variable in enumerate(each):
            model.add_hint(variable, bool(start[c] <= j))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = _WORKERS
    # Presolving makes clauses of the differences, and the linear relaxation then proves nothing.
    solver.parameters.cp_model_presolve = False
    solver.parameters.random_seed = seed
    solver.parameters.relative_gap_limit = _GAP / 10  # of gains, which exceed costs
    solver.parameters.max_time_in_seconds = max(seconds - (time.perf_counter() - began), 0.1)
    if solver.solve(model) not in {cp_model.OPTIMAL, cp_model.FEASIBLE}:
        return found_at(problem, start)  # there was no time for a bound
    cell = np.array([_first(solver, each) for each in stands], dtype=np.int32)
    bound = gains.out - int(np.ceil(solver.best_objective_bound)) * _SHORTER
    return found_at(problem, cell, cost_of_units(bound))


def _standing(model: cp_model.CpModel, choices: Choices) -> list[list[cp_model.IntVar]]:
    """Return each camera's z, but for that of its last cell, which is always true."""
    stands = []
    for count in choices.cells.tolist():
        each = [model.new_bool_var("") for _ in range(count - 1)]
        for earlier, later in pairwise(each):
            model.add(earlier <= later)
        stands.append(each)
    return stands


def _first(solver: cp_model.CpSolver, stands: list[cp_model.IntVar]) -> int:
    """Return the first cell at or before which the camera stands."""
    true = (j for j, variable in enumerate(stands) if solver.boolean_value(variable))
    return next(true, len(stands))
