# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import itertools

import numpy as np
import pytest

from focus_planner.core import kernels
from focus_planner.core.progress import never_stop
from focus_planner.core.solvers import SOLVERS, Options
from focus_planner.core.solvers.budget import within_budget
from focus_planner.core.solvers.solution import cells_at, start_cells
from testing.problems import random_problem

CASES = [(1, 1, 2), (2, 1, 3), (1, 2, 3), (2, 2, 3)]


def solve(problem, images, method="k_view", on_progress=never_stop, start=None):
    solver = within_budget(SOLVERS[method], images)
    return solver(problem, Options(start=start), on_progress)


def is_taken(solution):
    return solution.focus_distances != kernels.UNTAKEN


def best_of_all(problem, images):
    """The least cost of all choices of pictures and cells."""
    cells = problem.cells
    distances, offsets = cells.distances(), cells.offsets
    choices = [
        [kernels.UNTAKEN, *distances[offsets[c] : offsets[c + 1]]]
        for c in range(problem.camera_count)
    ]
    return min(
        problem.cost(np.array(focus))
        for focus in itertools.product(*choices)
        if sum(s != kernels.UNTAKEN for s in focus) <= images
    )


@pytest.mark.parametrize(("views", "shots", "images"), CASES)
def test_it_comes_close_to_the_best_of_all_choices(views, shots, images):
    best = []
    for seed in range(8):
        problem = random_problem(seed, 8, 4 // shots, share=0.7, views=views, shots=shots)
        solution, least = solve(problem, images), best_of_all(problem, images)
        assert solution.converged
        assert is_taken(solution).sum() <= images
        assert least - 1e-9 <= solution.cost <= 1.05 * least
        assert solution.cost == pytest.approx(problem.cost(solution.focus_distances))
        best.append(solution.cost <= least + 1e-9)
    assert sum(best) >= 6


@pytest.mark.parametrize("method", ["closest", "average", "em", "k_view"])
@pytest.mark.parametrize(("views", "shots"), [(1, 1), (3, 2)])
def test_no_exchange_of_a_picture_pays(views, shots, method):
    problem = random_problem(4, 60, 8, share=0.4, views=views, shots=shots)
    solution = solve(problem, 6, method)
    taken = is_taken(solution)
    assert taken.sum() == 6
    distances, offsets = problem.cells.distances(), problem.cells.offsets
    fixed = SOLVERS[method](problem, Options()).focus_distances
    if method in {"closest", "average"}:
        np.testing.assert_array_equal(solution.focus_distances[taken], fixed[taken])
    for out, into in itertools.product(np.flatnonzero(taken), np.flatnonzero(~taken)):
        choices = distances[offsets[into] : offsets[into + 1]]
        for distance in [fixed[into]] if method in {"closest", "average"} else choices:
            focus = solution.focus_distances.copy()
            focus[out], focus[into] = kernels.UNTAKEN, distance
            assert problem.cost(focus) >= solution.cost - 1e-9


def test_each_picture_gains_most_of_all_and_no_step_costs_more():
    for method, seed in itertools.product(("closest", "em", "k_view"), range(6)):
        problem = random_problem(seed, 40, 6, share=0.5, views=1 + seed % 3, shots=1 + seed % 2)
        told = []
        solution = solve(problem, 5, method, lambda p, told=told: told.append(p) or True)
        costs = [p.cost for p in told if p.stage in {"pictures", "exchanges"}]
        assert all(after < before for before, after in itertools.pairwise(costs))
        assert solution.cost <= costs[-1] + 1e-9
        gains = -np.diff([1000.0, *(p.cost for p in told[:5])])
        assert all(after <= before + 1e-6 for before, after in itertools.pairwise(gains))


def test_it_goes_on_from_the_pictures_that_a_start_takes():
    problem = random_problem(6, 60, 8, share=0.4, shots=2)
    first = solve(problem, 6)
    seen = []
    again = solve(
        problem, 6, start=first.focus_distances, on_progress=lambda p: seen.append(p) or True
    )
    assert "pictures" not in {progress.stage for progress in seen}
    assert again.cost <= first.cost + 1e-9
    more = solve(problem, 8, start=first.focus_distances)
    assert more.cost <= first.cost
    assert 6 <= is_taken(more).sum() <= 8
    # A start with more pictures than there may be says nothing.
    fewer = solve(problem, 4, start=first.focus_distances)
    np.testing.assert_array_equal(fewer.focus_distances, solve(problem, 4).focus_distances)


def test_more_pictures_cost_less_and_all_cost_what_they_do_without_a_budget():
    problem = random_problem(2, 200, 12, share=0.3)
    costs = [solve(problem, images).cost for images in (2, 4, 8, 12)]
    assert costs == sorted(costs, reverse=True)
    unlimited = SOLVERS["k_view"](problem, Options()).cost
    assert costs[-1] == pytest.approx(unlimited, rel=0.01)


def test_a_stop_leaves_a_plan_within_the_budget():
    problem = random_problem(2, 200, 12, share=0.3, shots=2)
    seen = []
    solve(problem, 9, on_progress=lambda progress: seen.append(progress) or True)
    assert {progress.stage for progress in seen} >= {"pictures", "em", "k_view"}
    costs = [progress.cost for progress in seen]
    assert all(after <= before + 1e-9 for before, after in itertools.pairwise(costs[:9]))
    for stop in range(1, len(seen)):
        left = itertools.count(1)
        solution = solve(problem, 9, on_progress=lambda _, left=left, stop=stop: next(left) < stop)
        assert not solution.converged
        assert 1 <= is_taken(solution).sum() <= 9
        assert solution.cost == pytest.approx(problem.cost(solution.focus_distances))


def test_the_same_problem_gives_the_same_pictures():
    problem = random_problem(5, 300, 15, share=0.3, ties=True, views=2)
    first, second = solve(problem, 7), solve(problem, 7)
    np.testing.assert_array_equal(first.focus_distances, second.focus_distances)


def test_the_cell_at_a_distance_holds_all_that_the_distance_does():
    between = 0
    for seed in range(30):
        problem = random_problem(seed, 40, 5, share=0.7, ties=seed % 2 == 0)
        cells, random = problem.cells, np.random.default_rng(seed)
        for _ in range(10):
            depth = problem.depth[random.integers(0, len(problem.depth), 5)]
            focus = depth * random.uniform(0.8, 1.3, 5)
            cell = cells_at(problem, focus)
            at = focus[problem.camera_index]
            held = (problem.focus_near <= at) & (at <= problem.focus_far)
            chosen = cell[problem.camera_index]
            assert ((cells.first <= chosen) & (chosen <= cells.last))[held].all()
            between += (cell != start_cells(problem, focus)).any()
    assert between > 10
