# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner import cylinder_rig
from focus_planner.core.solvers import Options, em, k_view
from focus_planner.core.solvers.solution import distances_of_cells, start_cells
from focus_planner.evaluation.measuring.passes import em_passes, k_view_passes
from testing import reference
from testing.problems import body, problem_of, random_problem

OPTIONS = [Options(k, scope) for k in (2, 3) for scope in ("assigned", "all")]


def passes(problem, options):
    """Those of the solver's last stage, as the solver chains its stages."""
    start = em.solve(problem).focus_distances
    for k in range(2, options.k + 1):
        found = k_view_passes(problem, Options(k, options.scope), start)
        start = found.solution.focus_distances
    return found


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_pass_by_pass_k_view_finds_what_it_finds_at_once(options):
    for seed in range(5):
        problem = random_problem(seed, 60, 8, share=0.4)
        found, solution = passes(problem, options), k_view.solve(problem, options)
        assert found.solution.cost == solution.cost
        np.testing.assert_array_equal(found.solution.focus_distances, solution.focus_distances)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_every_pass_gains_but_the_last(options):
    problem, log = problem_of(body(), cylinder_rig(), 1000), []
    found = passes(problem, options)
    assert len(found.seconds) == len(found.costs) - 1 > 1
    assert all(np.diff(found.costs)[:-1] < 0)
    assert found.costs[-1] == found.costs[-2]
    solution = k_view.solve(problem, options, lambda progress: not log.append(progress.cost))
    assert found.costs[-1] == log[-1]
    cost = reference.cost(reference.table(problem), found.solution.focus_distances)
    assert cost == pytest.approx(solution.cost)
    assert cost <= found.costs[-1] + 1e-6


def test_ems_passes_go_from_the_closest_depths_to_its_solution():
    for seed in range(5):
        problem = random_problem(seed, 60, 8, share=0.4)
        table = reference.table(problem)
        closest = np.array([problem.depth[problem.camera_index == c].min() for c in range(8)])
        start = distances_of_cells(problem, start_cells(problem, closest))
        found = em_passes(problem, Options())
        assert found.costs[0] == pytest.approx(reference.cost(table, start), abs=1e-6)
        solution = em.solve(problem)
        assert found.solution.cost == solution.cost <= found.costs[-1] + 1e-6
        assert len(found.seconds) == len(found.costs) - 1 == solution.iterations
