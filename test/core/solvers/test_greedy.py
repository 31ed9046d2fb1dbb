# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Greedy: the camera and cell that gain most, one after the other."""

import numpy as np
import pytest

from focus_planner import Lens, cylinder_rig
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.solvers import SOLVERS, greedy
from focus_planner.core.solvers.budget import within_budget
from focus_planner.core.solvers.solution import assign_samples, finish_cells
from testing.problems import body, problem_of, random_problem

KINDS = {
    "plain": {},
    "ties": {"ties": True, "equal": True},
    "views": {"views": 2},
    "views and ties": {"views": 3, "ties": True, "equal": True},
    "shots": {"shots": 3},
    "shots and views": {"shots": 2, "views": 2},
    "many views": {"shots": 2, "views": 5, "share": 0.3},
    "limits": {"lens": Lens(0.05, 10.0, 0.58, 2.0)},
    "list": {"lens": Lens(focus_distances=(0.5, 0.57, 0.6, 0.66, 0.7, 8.0)), "views": 2},
}
each_kind = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())


def plain_greedy(problem, most=None):
    """Return the cells, trying every cell of every camera that is left at every step."""
    counts = np.diff(problem.cells.offsets)
    cell = np.full(problem.camera_count, -1, dtype=np.int32)
    for _ in range(int((counts > 0).sum()) if most is None else most):
        tried = []
        for c in np.flatnonzero((cell < 0) & (counts > 0)):
            for i in range(counts[c]):
                cell[c] = i
                tried.append((assign_samples(problem, cell)[1], c, i))
            cell[c] = -1
        _, c, i = min(tried)
        cell[c] = i
    return cell


@each_kind
def test_it_is_greedy_that_tries_everything(kind):
    for seed in range(12):
        problem = random_problem(seed, 25, 5, **kind)
        cell = plain_greedy(problem)
        costs = []
        found = greedy.solve(
            problem, None, lambda progress, costs=costs: costs.append(progress.cost) or True
        )
        expected = finish_cells(problem, cell, 1, True)
        np.testing.assert_array_equal(found.focus_distances, expected.focus_distances)
        assert costs[-1] == cost_of_units(assign_samples(problem, cell)[1])


@each_kind
@pytest.mark.parametrize("steps", [1, 2, 5, 9])
def test_stopped_it_has_taken_some_and_the_others_are_somewhere(kind, steps, monkeypatch):
    monkeypatch.setattr(greedy, "_WORK_BETWEEN_CALLS", 1)
    for seed in range(3):
        problem = random_problem(seed, 25, 6, **kind)
        costs = []

        def stop(progress, costs=costs):
            costs.append(progress.cost)
            return len(costs) < steps

        found = greedy.solve(problem, None, stop)
        assert found.iterations == len(costs)
        able = np.diff(problem.cells.offsets) > 0
        np.testing.assert_array_equal(np.isfinite(found.focus_distances), able)
        assert found.cost == problem.cost(found.focus_distances) <= costs[-1] * (1 + 1e-9)
        plans = [plain_greedy(problem, count) for count in range(1, able.sum() + 1)]
        of_plans = [cost_of_units(assign_samples(problem, cell)[1]) for cell in plans]
        told = list(dict.fromkeys(costs))
        assert told == list(dict.fromkeys(of_plans))[: len(told)]
        if found.converged:
            assert told[-1] == of_plans[-1]


@each_kind
def test_how_often_it_reports_changes_no_bit(kind, monkeypatch):
    problem = random_problem(3, 300, 12, **kind)
    whole = greedy.solve(problem)
    monkeypatch.setattr(greedy, "_WORK_BETWEEN_CALLS", 1)
    steps = greedy.solve(problem)
    assert steps.iterations > 12 > whole.iterations
    assert steps.focus_distances.tobytes() == whole.focus_distances.tobytes()
    assert steps.converged


@each_kind
@pytest.mark.parametrize("images", [1, 4])
def test_within_a_budget_it_is_no_worse_than_the_pictures_chosen_one_by_one(kind, images):
    problem = random_problem(7, 80, 6, **kind)
    costs = []

    def choosing(progress):
        if progress.stage == "pictures":
            costs.append(progress.cost)
        return True

    found = within_budget(greedy.solve, images)(problem, None, choosing)
    assert (found.focus_distances >= 0).sum() <= images
    assert found.cost <= costs[-1] + 1e-9
    assert found.converged


@pytest.mark.parametrize("name", ["arms_down", "arms_out"])
@pytest.mark.parametrize("samples", [1000, 4096])
def test_on_bodies_it_costs_less_than_em_and_more_than_pairs(name, samples):
    problem = problem_of(body(name), cylinder_rig(), samples)
    cost = {method: SOLVERS[method](problem).cost for method in ("em", "greedy", "k_view")}
    assert cost["k_view"] < cost["greedy"] < 0.985 * cost["em"]
