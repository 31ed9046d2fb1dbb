# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Bounds for limited pictures against all plans there are, and against HiGHS."""

import math
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Lens, cylinder_rig
from focus_planner.core.bounds.lagrangian import Prices, cost_below
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.solvers import SOLVERS
from focus_planner.core.solvers.budget import within_budget
from testing.limited_pictures import cell_counts, least_units, optimum, priced_units
from testing.problems import body, problem_of, random_problem, ring_mask, with_threads
from testing.several_views import tiny_problem_in_views

SHALLOW = Lens(0.05, 40.0)
VIEWS_AND_SHOTS = [(1, 1), (1, 3), (2, 1), (2, 2), (3, 1), (3, 3)]


def tiny_problem(seed):
    """A problem that is small enough to enumerate, and a limit of pictures below all shots."""
    random = np.random.default_rng([seed, 23])
    while True:
        problem = tiny_problem_in_views(int(random.integers(2**31)))
        brackets = [
            sum(math.comb(max(count, 1) + k - 1, k) for k in range(problem.shots + 1))
            for count in cell_counts(problem)
        ]
        if problem.camera_count > 1 and math.prod(brackets) <= 800:
            return problem, int(random.integers(1, problem.camera_count))


def least_bound(gains, goal):
    """The bound after more steps than one would wait for."""
    prices = Prices(gains)
    while prices.bound > goal and prices.steps < 6000:
        prices.descend(goal)
    return prices.bound


def test_a_bound_is_what_the_prices_prove_by_definition():
    kinds = set()
    for seed in range(200):
        (problem, images), random = tiny_problem(seed), np.random.default_rng(seed)
        gains, least = gains_of(problem, images), least_units(problem, images)
        drawn = (random.random(len(gains.most)) * gains.most).astype(np.int64)
        some = np.where(random.random(len(drawn)) < 0.5, drawn, 0)
        for price in (drawn, some, gains.most, 0 * drawn):
            prices = Prices(gains, price)
            prices.descend(2**62)
            assert prices.steps == 1
            assert gains.out - prices.bound == priced_units(problem, images, price) <= least
        kinds.add((problem.views, problem.shots, images > 1, 0 in cell_counts(problem)))
    assert len(kinds) > 20


def test_bounds_fall_and_no_plan_is_below():
    tight = 0
    for seed in range(200):
        problem, images = tiny_problem(1000 + seed)
        gains, least = gains_of(problem, images), least_units(problem, images)
        random = np.random.default_rng(seed)
        goal = gains.out - int(least * random.choice([0.5, 0.99, 1.0, 1.1]))
        prices, before = Prices(gains), 2**62
        for _ in range(4):
            prices.descend(goal)
            assert gains.out - least <= prices.bound <= before
            before = prices.bound
            assert (prices.price >= 0).all()
            assert (prices.price <= gains.most).all()
            # What is left out for some steps is not forgotten.
            again = Prices(gains, prices.price)
            again.descend(2**62)
            assert again.bound == prices.bound
        tight += gains.out - prices.bound >= 0.999 * min(least, gains.out - goal)
    assert tight > 100


@pytest.mark.parametrize(("views", "shots"), VIEWS_AND_SHOTS)
def test_the_least_bound_is_that_of_the_linear_relaxation(views, shots):
    for seed, images in ((0, 1), (1, 4), (2, 7)):
        problem = random_problem(seed, 60, 8, share=0.6, lens=SHALLOW, views=views, shots=shots)
        gains, relaxed = gains_of(problem, images), optimum(problem, images, relaxed=True)
        best = optimum(problem, images)
        goal = gains.out - int(0.999999 * best / 1000 * 2**43)
        bound = cost_below(gains, least_bound(gains, goal))
        assert bound <= relaxed + 1e-6
        assert bound >= relaxed * (1 - 3e-3)
        assert relaxed <= best + 1e-6


@pytest.mark.parametrize(("views", "shots"), VIEWS_AND_SHOTS)
def test_plans_are_near_the_optimum_and_bounds_below(views, shots):
    for seed, images in ((0, 2), (1, 5), (2, 7)):
        problem = random_problem(seed, 60, 8, share=0.6, lens=SHALLOW, views=views, shots=shots)
        best = optimum(problem, images)
        plan = within_budget(SOLVERS["k_view"], images)(problem)
        assert best - 1e-6 <= plan.cost <= 1.02 * best
        for start in (None, np.zeros(60), np.ones(60), np.random.default_rng(seed).random(60)):
            bound = lower_bound(problem, plan.cost, plan.cost, start=start, images=images)
            assert 0.96 * best <= bound.lower_bound <= best + 1e-6
            assert (bound.prices >= 0).all()
            assert (bound.prices <= 1).all()


def test_fewer_pictures_bound_higher_and_all_of_them_as_ever():
    problem = random_problem(3, 80, 8, share=0.5, lens=SHALLOW, shots=2)
    bounds = [
        lower_bound(problem, 1000.0, optimum(problem, images), images=images).lower_bound
        for images in (1, 2, 4, 8, 16)
    ]
    assert bounds == sorted(bounds, reverse=True)
    assert bounds[0] > 1.05 * bounds[-1]
    best = optimum(problem, 16)
    assert bounds[-1] == pytest.approx(lower_bound(problem, 1000.0, best).lower_bound, rel=2e-3)


@pytest.mark.parametrize(("views", "images"), [(1, 12), (3, 18)])
def test_on_a_body_a_plan_is_near_its_bound(views, images):
    problem = replace(problem_of(body("arms_out"), cylinder_rig(4, 9), 1000), views=views)
    plan = within_budget(SOLVERS["k_view"], images)(problem)
    bound = lower_bound(problem, plan.cost, plan.cost, images=images)
    assert 0.98 * plan.cost < bound.lower_bound <= plan.cost
    quick = lower_bound(problem, plan.cost, plan.cost, most_steps=60, images=images)
    assert 0.95 * plan.cost < quick.lower_bound <= bound.lower_bound + 1e-9


def test_steps_repeat_bit_for_bit_on_any_number_of_threads():
    visible = ring_mask(400, 20)
    problem = random_problem(1, 400, 20, visible=visible, lens=SHALLOW, views=2, shots=2)

    def bound():
        return lower_bound(problem, 500.0, 400.0, images=15)

    one, other, two = bound(), bound(), with_threads(2, bound)
    assert one.lower_bound == other.lower_bound == two.lower_bound
    assert one.prices.tobytes() == other.prices.tobytes() == two.prices.tobytes()
