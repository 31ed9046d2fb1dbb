# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Bounds for several views per sample against all plans there are, and against HiGHS."""

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Lens, cylinder_rig
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.lagrangian import (
    Prices,
    cost_below,
    pointwise_prices,
    prices_in_units,
)
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.solvers import SOLVERS
from testing.problems import body, problem_of, random_problem, ring_mask, tiny_problem
from testing.several_views import (
    least_units,
    optimum,
    plan_units,
    priced_units,
    tiny_problem_in_views,
)

SHALLOW = Lens(0.05, 40.0)
VIEWS_AND_SHOTS = [(1, 1), (2, 1), (2, 2), (3, 1), (3, 2), (3, 3)]


def settle(gains, goal, start=None):
    prices = Prices(gains, start)
    while not prices.settled(goal):
        prices.descend(goal)
    return prices


def test_a_bound_is_what_the_prices_prove_by_definition():
    bracketed = 0
    for seed in range(250):
        problem, random = tiny_problem_in_views(seed), np.random.default_rng(seed)
        gains = gains_of(problem)
        least = least_units(problem)
        drawn = (random.random(len(gains.most)) * gains.most).astype(np.int64)
        some = np.where(random.random(len(drawn)) < 0.5, drawn, 0)
        for price in (drawn, some, gains.most, 0 * drawn):
            prices = Prices(gains, price)
            prices.descend(2**62)
            assert prices.steps == 1
            assert gains.out - prices.bound <= least
            if problem.views > 1 or problem.shots == 1:
                assert gains.out - prices.bound == priced_units(problem, price)
                bracketed += problem.shots > 1
    assert bracketed > 100


def test_bounds_fall_and_no_plan_is_below():
    tight = several = 0
    for seed in range(300):
        problem = tiny_problem_in_views(1000 + seed)
        gains, least = gains_of(problem), least_units(problem)
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
        if problem.views > 1:
            several += 1
            tight += gains.out - prices.bound >= 0.999 * min(least, gains.out - goal)
    assert tight > 0.7 * several


@pytest.mark.parametrize(("views", "shots"), VIEWS_AND_SHOTS)
def test_the_least_bound_is_that_of_the_linear_relaxation(views, shots):
    for seed in range(3):
        problem = random_problem(seed, 60, 8, share=0.6, lens=SHALLOW, views=views, shots=shots)
        gains, relaxed = gains_of(problem), optimum(problem, relaxed=True)
        best = optimum(problem)
        goal = gains.out - int(0.999999 * best / 1000 * 2**43)
        bound = cost_below(gains, settle(gains, goal).bound)
        assert bound <= relaxed + 1e-6
        assert bound >= relaxed * (1 - 1e-3)
        assert relaxed <= best + 1e-6


def test_branching_proves_the_optimum():
    branched = 0
    for seed in range(300):
        problem = tiny_problem_in_views(2000 + seed)
        gains = gains_of(problem)
        most = gains.out - least_units(problem)
        for goal in (most, most - 1, int(0.9 * most) - 1):
            prices = Prices(gains)
            prices.descend(goal)
            open_nodes, found = Branching(gains, prices.price, prices.bound, goal), -1
            for _ in range(3000):
                if open_nodes.exhausted:
                    break
                branched += 1
                open_nodes.step(goal)
                if open_nodes.leaf is not None:
                    found = max(found, gains.out - plan_units(problem, open_nodes.leaf))
                    open_nodes.leaf = None
                # The best plan is in an open node, or was come down to.
                assert goal >= most or max(open_nodes.bound, found) >= most
            assert open_nodes.exhausted
            assert found == most or goal >= most
    assert branched > 1000


def test_plans_and_leaves_know_the_cameras_without_cells():
    seen = 0
    for seed in range(30):
        problem = random_problem(seed, 14, 3, share=0.9, lens=SHALLOW, views=2)
        blind = problem.camera_index == seed % 3
        problem.focus_near[blind], problem.focus_far[blind] = np.inf, -np.inf
        problem = with_shots(problem, 1 + seed % 2)
        gains = gains_of(problem)
        without = np.diff(gains.cell_offsets) == 0
        assert without.any()
        prices = Prices(gains)
        prices.descend(0)
        open_nodes = Branching(gains, prices.price, prices.bound, 0)
        chosen = [prices.frequent_cells()]
        for _ in range(20):
            if open_nodes.exhausted:
                break
            chosen += open_nodes.plans(1)
            open_nodes.step(0)
        for cell in chosen:
            assert (cell[without] == -1).all()
            assert (cell[~without] >= 0).all()
            seen += 1
    assert seen > 60


def test_shots_of_a_view_are_ascending():
    problem = random_problem(0, 60, 6, lens=SHALLOW, views=2, shots=3)
    gains = gains_of(problem)
    prices = Prices(gains)
    prices.descend(0)
    open_nodes, several = Branching(gains, prices.price, prices.bound, 0), 0
    for _ in range(40):
        open_nodes.step(0)
        for node in open_nodes._first(5):
            for ends in (node.low, node.high, node.cell):
                brackets = ends.reshape(-1, 3)
                assert (np.diff(brackets) >= 0).all()
            several += (node.low.reshape(-1, 3)[:, 0] < node.low.reshape(-1, 3)[:, 2]).any()
    assert several > 20


@pytest.mark.parametrize(("views", "shots"), [(2, 1), (2, 2), (3, 1)])
def test_the_bound_of_any_plan_is_below_the_optimum_and_near(views, shots):
    for seed in range(4):
        problem = random_problem(seed, 60, 8, share=0.6, lens=SHALLOW, views=views, shots=shots)
        plan, best = SOLVERS["k_view"](problem), optimum(problem)
        for start in (None, np.zeros(60), np.ones(60), np.random.default_rng(seed).random(60)):
            bound = lower_bound(problem, plan.cost, plan.cost, start=start)
            assert 0.97 * best <= bound.lower_bound <= best + 1e-6
            assert (bound.prices >= 0).all()
            assert (bound.prices <= 1).all()
        assert best <= plan.cost + 1e-6


def test_prices_that_proved_it_prove_it_again_at_once():
    for views, shots in ((2, 1), (3, 2)):
        problem = problem_of(body("arms_out"), cylinder_rig(4, 9), 600)
        problem = replace(with_shots(problem, shots), views=views)
        plan = SOLVERS["k_view"](problem)
        rounds = []

        def count(_, rounds=rounds):
            rounds[-1] += 1
            return True

        rounds.append(0)
        cold = lower_bound(problem, plan.cost, plan.cost, on_progress=count)
        rounds.append(0)
        warm = lower_bound(problem, plan.cost, plan.cost, start=cold.prices, on_progress=count)
        assert warm.lower_bound >= cold.lower_bound - 1e-9
        assert rounds[1] < rounds[0]
        assert cold.lower_bound > 0.99 * plan.cost


def test_prices_as_parts_of_a_views_weight_and_back():
    for seed in range(100):
        problem, random = tiny_problem_in_views(seed), np.random.default_rng(seed)
        gains = gains_of(problem)
        price = (random.random(len(gains.most)) * gains.most).astype(np.int64)
        parts = pointwise_prices(problem, price)
        assert (parts >= 0).all()
        assert (parts <= 1).all()
        np.testing.assert_array_equal(prices_in_units(problem, parts), price)


def test_the_cost_below_allows_a_unit_per_view():
    gains = gains_of(random_problem(4, 50, 5, views=3))
    assert cost_below(gains, 1000) == cost_of_units(gains.out - 1000 - 150)


def test_one_view_is_bounded_as_ever():
    for seed in range(100):
        problem = tiny_problem(seed)
        gains = gains_of(problem)
        np.testing.assert_array_equal(Prices(gains).price, gains.most // 2)
        assert cost_below(gains, 0) == cost_of_units(gains.out - len(gains.most))


@pytest.mark.parametrize("views", [2, 3, 5])
def test_on_a_body_a_plan_is_near_its_bound(views):
    problem = replace(problem_of(body("arms_out"), cylinder_rig(), 1000), views=views)
    plan = SOLVERS["k_view"](problem)
    bound = lower_bound(problem, plan.cost, plan.cost)
    assert bound.lower_bound > 0.998 * plan.cost
    quick = lower_bound(problem, plan.cost, plan.cost, most_steps=60)
    assert 0.995 * plan.cost < quick.lower_bound <= bound.lower_bound


def test_steps_repeat_bit_for_bit():
    visible = ring_mask(400, 20)
    problem = random_problem(1, 400, 20, visible=visible, lens=SHALLOW, views=2, shots=2)
    one, other = (lower_bound(problem, 500.0, 400.0) for _ in range(2))
    assert one.lower_bound == other.lower_bound
    assert one.prices.tobytes() == other.prices.tobytes()
