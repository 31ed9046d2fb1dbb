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
from focus_planner.core.bounds.lagrangian import (
    Prices,
    cost_below,
    pointwise_prices,
    prices_in_units,
)
from focus_planner.core.kernels import compiling
from focus_planner.core.problem.cells import UNITS, cost_of_units
from focus_planner.core.problem.gains import gains_of
from testing import reference
from testing.problems import body, problem_of, random_problem, ring_mask, tiny_problem, with_threads


def bound_at(gains, price):
    """What the prices prove before any step is taken from them."""
    prices = Prices(gains, price)
    prices.descend(2**62)
    assert prices.steps == 1
    np.testing.assert_array_equal(prices.price, price)
    return prices.bound


def test_a_bound_is_the_sum_of_prices_and_of_what_each_camera_takes():
    for seed in range(300):
        problem, random = tiny_problem(seed), np.random.default_rng(seed)
        gains, table = gains_of(problem), reference.table(problem)
        price = (random.random(len(gains.most)) * gains.most).astype(np.int64)
        some = np.where(random.random(len(price)) < 0.5, price, 0)
        for v in (price, gains.most, 0 * price, some):
            bound = bound_at(gains, v)
            assert bound == reference.confined_bound(gains, v)
            of_table = reference.price_bound(table, [1000 * int(x) / UNITS for x in v])
            assert 1000 * bound / UNITS == pytest.approx(of_table, abs=1e-8)
            assert bound >= reference.largest_gain(gains)


def test_bounds_fall_and_are_never_below_what_can_be_gained():
    tight = 0
    for seed in range(400):
        gains = gains_of(tiny_problem(seed))
        most = reference.largest_gain(gains)
        random = np.random.default_rng(seed)
        # Above, at, and far below what can be reached.
        goal = int(most * random.choice([0.0, 0.5, 0.99, 1.0]))
        prices, before = Prices(gains), 2**62
        for _ in range(4):
            prices.descend(goal)
            assert most <= prices.bound <= before
            before = prices.bound
            assert (prices.price >= 0).all()
            assert (prices.price <= gains.most).all()
            assert prices.bound == reference.confined_bound(gains, prices.price)
        tight += prices.bound <= 1.001 * most
    assert tight > 250


@pytest.mark.parametrize("goal", [0.0, 0.9, 1.0])
def test_what_is_left_out_for_some_steps_is_not_forgotten(goal):
    # Falls go back to the best prices, which may be lower than what is left out since.
    for seed in range(25):
        problem = random_problem(seed, 40, 6, share=0.6)
        gains = gains_of(problem)
        prices = Prices(gains)
        for _ in range(10):
            prices.descend(int(goal * 0.8 * gains.most.sum()))
            assert prices.bound == reference.confined_bound(gains, prices.price)


def test_on_bodies_the_bound_is_near_the_optimum():
    problem = problem_of(body("arms_out"), cylinder_rig(3, 8), 300)
    gains = gains_of(problem)
    best, proven = reference.optimum(reference.table(problem))
    assert best == pytest.approx(proven, rel=1e-6)
    prices = Prices(gains)
    while not prices.settled(gains.out - int(best / 1000 * UNITS)):
        prices.descend(gains.out - int(best / 1000 * UNITS))
    assert 0.998 * best <= cost_below(gains, prices.bound) <= best


def test_prices_settle():
    settled_above = 0
    for seed in range(60):
        gains = gains_of(tiny_problem(seed))
        goal = int(0.9 * reference.largest_gain(gains))
        prices = Prices(gains)
        assert not prices.settled(2**62)  # before there is a bound at all
        while not prices.settled(goal):
            prices.descend(goal)
            assert prices.steps < 5000
        assert prices.settled(prices.bound)
        settled_above += prices.bound > goal
        steps = prices.steps
        prices.descend(prices.bound)
        assert prices.steps == steps + 1
    assert settled_above


def test_at_the_goal_steps_end():
    gains = gains_of(random_problem(0, 200, 20, visible=ring_mask(200, 20)))
    prices = Prices(gains)
    goal = int(0.9 * gains.most.sum())
    while prices.bound > goal:
        prices.descend(goal)
    reached = prices.bound
    prices.descend(goal)
    assert 0.8 * goal < reached <= goal
    assert prices.settled(goal)


def test_the_most_frequent_cells_are_some_of_the_cameras():
    for seed in range(60):
        gains = gains_of(tiny_problem(seed))
        counts = np.diff(gains.cell_offsets)
        prices = Prices(gains)
        for _ in range(3):
            prices.descend(0)
            cell = prices.frequent_cells()
            assert cell.dtype == np.int32
            assert (cell[counts == 0] == -1).all()
            assert (cell[counts > 0] >= 0).all()
            assert (cell < np.maximum(counts, 1)).all()


def test_with_one_camera_the_most_frequent_cell_is_the_best():
    for seed in range(20):
        gains = gains_of(random_problem(seed, 40, 1, share=1.0))
        prices = Prices(gains, 0 * gains.most)
        prices.descend(0)
        assert reference.cells_gain(gains, prices.frequent_cells()) == prices.bound


def run(gains, steps=200):
    prices = Prices(gains)
    while prices.steps < steps:
        prices.descend(0)
    return prices.price, prices.bound, prices.steps, prices.frequent_cells()


def assert_same(one, other):
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


def test_steps_repeat_bit_for_bit_with_any_number_of_threads(monkeypatch):
    gains = gains_of(random_problem(1, 1500, 30, visible=ring_mask(1500, 30)))
    once = run(gains)
    assert_same(once, run(gains))
    monkeypatch.setattr(compiling, "_PARALLEL_PAIRS", 0)
    many = with_threads(2, lambda: run(gains))
    assert_same(once, many)
    monkeypatch.setattr(compiling.config, "NUMBA_NUM_THREADS", 1)
    assert_same(once, run(gains))


def test_steps_go_on_from_given_prices():
    gains = gains_of(random_problem(2, 400, 20, visible=ring_mask(400, 20)))
    cold = Prices(gains)
    while cold.steps < 300:
        cold.descend(0)
    warm = Prices(gains, cold.price)
    warm.descend(2**62)
    assert warm.bound == cold.bound
    assert warm.steps == 1


def test_prices_out_of_range_are_taken_as_the_nearest_in_range():
    gains = gains_of(random_problem(3, 60, 5))
    for given, meant in ((gains.most + 5, gains.most), (-gains.most - 1, 0 * gains.most)):
        np.testing.assert_array_equal(Prices(gains, given).price, meant)
    given = gains.most // 3
    kept = given.copy()
    prices = Prices(gains, given)
    for _ in range(3):
        prices.descend(0)
    np.testing.assert_array_equal(given, kept)


def test_prices_as_parts_of_weights_and_back():
    for seed in range(100):
        problem, random = tiny_problem(seed), np.random.default_rng(seed)
        gains = gains_of(problem)
        price = (random.random(len(gains.most)) * gains.most).astype(np.int64)
        parts = pointwise_prices(problem, price)
        assert (parts >= 0).all()
        assert (parts <= 1).all()
        weights = problem.samples.weights
        assert (parts[weights == 0] == 0).all()
        np.testing.assert_allclose(parts * weights / weights.sum(), price / UNITS, atol=1e-12)
        np.testing.assert_array_equal(prices_in_units(problem, parts), price)


def test_the_cost_below_allows_for_what_units_round_off():
    gains = gains_of(random_problem(4, 50, 5))
    assert cost_below(gains, 1000) == cost_of_units(gains.out - 1000 - 50)
    assert cost_below(gains, gains.out) == 0.0
