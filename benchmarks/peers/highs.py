# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""HiGHS: plans with a bound."""

from __future__ import annotations

import time

import highspy
import numpy as np
from numpy.typing import NDArray

from benchmarks.compact import compact_program
from benchmarks.peers.choices import Choices, choices_of, stood_at, taken_pairs
from benchmarks.peers.found import Found, found_at
from benchmarks.peers.heuristics import greedy_cells
from focus_planner.core.arrays import IntArray
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.problem import Problem

_WORKERS = 2
_GAP = 1e-6


def highs(problem: Problem, seconds: float, seed: int) -> Found:
    """Return HiGHS's plan for the compact form of the problem, told greedy's to begin with."""
    began = time.perf_counter()
    choices, gains = choices_of(problem)
    start = greedy_cells(choices)
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("mip_rel_gap", _GAP)
    solver.setOptionValue("threads", _WORKERS)
    solver.setOptionValue("random_seed", seed)
    solver.passModel(compact_program(gains))
    known = highspy.HighsSolution()
    values = np.concatenate([taken_pairs(choices, start), stood_at(choices, start)])
    known.col_value = values.astype(np.float64).tolist()
    solver.setSolution(known)
    solver.setOptionValue("time_limit", max(seconds - (time.perf_counter() - began), 0.1))
    solver.run()
    stands = np.array(solver.getSolution().col_value)[len(choices.gain) :] > 0.5
    bound = cost_of_units(gains.out) + solver.getInfo().mip_dual_bound
    return found_at(
        problem,
        _cells(choices, stands) if len(stands) else start,
        bound if np.isfinite(bound) else None,  # there was no time for one
    )


def _cells(choices: Choices, stands: NDArray[np.bool_]) -> IntArray:
    """Return each camera's first cell at or before which it stands."""
    ends = np.cumsum(choices.cells)[:-1]
    each = np.split(stands, ends)
    return np.array([of_camera.argmax() if len(of_camera) else -1 for of_camera in each])
