# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Proven optima of several views against all plans there are, and against HiGHS."""

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Lens, cylinder_rig
from focus_planner.core.problem.cells import UNITS, cost_of_units
from focus_planner.core.solvers import Options, em, k_view, optimal
from testing.problems import body, problem_of, random_problem
from testing.several_views import least_units, optimum, tiny_problem_in_views

SHALLOW = Lens(0.05, 40.0)
EXACT = Options(gap=0.0)


def rounding(problem):
    """What the units of a plan's cost may round off."""
    return 2000 * problem.views * problem.sample_count / UNITS


def test_whatever_the_problem_the_optimum_is_found_and_proven():
    stages, several = set(), 0
    for seed in range(400):
        problem, told = tiny_problem_in_views(seed), []
        solution = optimal.solve(problem, EXACT, lambda step, told=told: not told.append(step))
        best = cost_of_units(least_units(problem))
        assert solution.converged
        assert solution.cost == problem.cost(solution.focus_distances)
        assert solution.cost == pytest.approx(best, abs=rounding(problem) + 1e-9)
        assert solution.lower_bound <= best + 1e-9
        assert solution.lower_bound >= solution.cost - rounding(problem) - 1e-9
        stages |= {step.stage for step in told}
        several += problem.views > 1
    assert {"prices", "branching"} <= stages
    assert several > 200


def test_stopped_at_any_step_plan_and_bound_are_valid():
    random, unproven = np.random.default_rng(0), 0
    for seed in range(300):
        problem, left = tiny_problem_in_views(5000 + seed), [int(random.integers(1, 12))]

        def keep_going(_, left=left):
            left[0] -= 1
            return left[0] > 0

        solution = optimal.solve(problem, EXACT, keep_going)
        best = cost_of_units(least_units(problem))
        assert solution.lower_bound <= best + 1e-9 <= solution.cost + rounding(problem) + 2e-9
        unproven += not solution.converged
    assert unproven > 10


@pytest.mark.parametrize("views", [2, 3])
@pytest.mark.parametrize("shots", [1, 2])
def test_the_optimum_is_that_of_highs(views, shots):
    for seed in range(3):
        problem = random_problem(seed, 30, 5, share=0.6, lens=SHALLOW, views=views, shots=shots)
        solution = optimal.solve(problem, Options(gap=1e-9))
        assert solution.converged
        assert solution.cost == pytest.approx(optimum(problem), abs=1e-5)


@pytest.mark.parametrize("views", [2, 3])
def test_on_a_body_the_optimum_is_that_of_highs(views):
    problem = replace(problem_of(body("arms_out"), cylinder_rig(3, 8), 200), views=views)
    solution, best = optimal.solve(problem), optimum(problem)
    assert solution.converged
    assert solution.cost == pytest.approx(best, rel=2e-6)
    assert solution.lower_bound <= best + 1e-5
    assert solution.cost <= k_view.solve(problem).cost


def test_of_three_views_on_a_body_the_optimum_is_proven():
    problem = replace(problem_of(body("arms_down"), cylinder_rig(), 1000), views=3)
    told = []
    solution = optimal.solve(problem, Options(gap=1e-4), lambda step: not told.append(step))
    assert solution.converged
    assert solution.cost < em.solve(problem).cost
    options, told_warm = Options(gap=1e-4, prices=solution.prices), []
    warm = optimal.solve(problem, options, lambda step: not told_warm.append(step))
    assert warm.converged
    rounds = [[step.stage for step in steps].count("prices") for steps in (told, told_warm)]
    assert rounds[1] < rounds[0]


def test_more_views_cost_more_and_more_shots_less():
    for seed in range(10):
        costs = {
            (views, shots): optimal.solve(
                random_problem(seed, 12, 3, share=0.8, lens=SHALLOW, views=views, shots=shots),
                Options(gap=1e-9),
            ).cost
            for views, shots in ((1, 1), (2, 1), (3, 1), (2, 2), (3, 2))
        }
        assert costs[1, 1] <= costs[2, 1] <= costs[3, 1]
        assert costs[2, 2] <= costs[2, 1]
        assert costs[3, 2] <= costs[3, 1]
