# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The passes of EM and of k-view, one by one."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import pairwise

from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import Options, Solution, em
from focus_planner.core.solvers.closest import closest_depths
from focus_planner.core.solvers.k_view import Descent
from focus_planner.core.solvers.solution import assign_samples, finish_cells, start_cells


@dataclass(frozen=True, eq=False)
class Passes:
    """What a solver did, pass by pass, until a pass gained nothing.

    Attributes
    ----------
    solution : Solution
        What the solver returns.
    costs : tuple of float
        Before the first pass, and after every pass.
    seconds : tuple of float
        Of every pass.
    """

    solution: Solution
    costs: tuple[float, ...]
    seconds: tuple[float, ...]


def em_passes(problem: Problem, options: Options) -> Passes:
    """Return EM's passes from the closest depths: each assigns samples and moves every camera."""
    cell = start_cells(problem, closest_depths(problem))
    costs = [cost_of_units(assign_samples(problem, cell)[1])]
    times = [time.perf_counter()]

    def on_pass(progress: Progress) -> bool:
        costs.append(progress.cost)
        times.append(time.perf_counter())
        return True

    solution = em.solve(problem, options, on_pass)
    return Passes(solution, tuple(costs), _differences(times))


def k_view_passes(problem: Problem, options: Options, start: FloatArray) -> Passes:
    """Return the passes of k-view: in each of them every tuple of k cameras takes its best step.

    Parameters
    ----------
    problem : Problem
    options : Options
    start : (C,) array
        Focus distances to start from, metres: :mod:`focus_planner.core.solvers.k_view` starts
        pairs from EM's, and triples from those of the pairs.
    """
    descent, cell = Descent(problem, options), start_cells(problem, start)
    costs = [cost_of_units(assign_samples(problem, cell)[1])]
    times, taken = [time.perf_counter()], 0
    for steps in descent.passes(cell):
        taken += sum(1 for _ in steps)
        times.append(time.perf_counter())
        costs.append(cost_of_units(descent.units))
    solution = finish_cells(problem, descent.cell, taken, True)
    return Passes(solution, tuple(costs), _differences(times))


def _differences(times: list[float]) -> tuple[float, ...]:
    return tuple(after - before for before, after in pairwise(times))
