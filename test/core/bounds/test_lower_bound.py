# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Bounds for plans of any method, against all plans there are."""

import numpy as np
import pytest

from focus_planner import Lens, cylinder_rig
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.problem.cells import UNITS
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.solvers import SOLVERS
from testing import reference
from testing.problems import body, problem_of, random_problem, ring_mask, tiny_problem

SHALLOW = Lens(0.05, 40.0)


class Log:
    """A callback that remembers, and stops the bound after some rounds."""

    def __init__(self, rounds=np.inf):
        self.progress, self.rounds = [], rounds

    def __call__(self, progress):
        self.progress.append(progress)
        return len(self.progress) < self.rounds


def least_cost(problem):
    gains = gains_of(problem)
    return 1000 * (gains.out - reference.largest_gain(gains)) / UNITS


def test_no_plan_costs_less_than_the_bound_of_any():
    near_best = 0
    for seed in range(400):
        problem, random = tiny_problem(seed), np.random.default_rng(seed)
        best = least_cost(problem)
        method = random.choice(sorted(SOLVERS))
        plan = SOLVERS[method](problem) if problem.camera_count > 1 else SOLVERS["em"](problem)
        near = random.choice([0.0, 0.9, 1.0, 1.1]) * plan.cost  # aiming anywhere
        steps = random.choice([None, 1, 30])
        bound = lower_bound(problem, plan.cost, near, most_steps=steps)
        assert 0 <= bound.lower_bound <= min(best + 1e-9, plan.cost)
        assert bound.prices.shape == (problem.sample_count,)
        assert (bound.prices >= 0).all()
        assert (bound.prices <= 1).all()
        near_best += bound.lower_bound > 0.99 * best
    assert near_best > 200


def test_it_rises_with_steps_and_settles():
    problem = problem_of(body("arms_out"), cylinder_rig(4, 9), 600)
    plan = SOLVERS["k_view"](problem)
    found = [
        lower_bound(problem, plan.cost, plan.cost, most_steps=steps).lower_bound
        for steps in (1, 60, 200, None)
    ]
    assert found == sorted(found)
    assert len(set(found)) == 4
    assert found[-1] > 0.995 * plan.cost
    assert found[-1] <= SOLVERS["optimal"](problem).cost


def test_the_gap_is_near_enough():
    problem = random_problem(0, 300, 20, visible=ring_mask(300, 20), lens=SHALLOW)
    plan = SOLVERS["k_view"](problem)
    rounds = []
    for gap in (0.0, 0.1, 0.3, 1.0):
        log = Log()
        bound = lower_bound(problem, plan.cost, plan.cost, gap, on_progress=log)
        rounds.append(len(log.progress))
        assert bound.lower_bound <= plan.cost
        if gap >= 0.1:
            assert bound.lower_bound >= (1 - gap) * plan.cost - 1e-7
    assert rounds == sorted(rounds, reverse=True)
    assert rounds[-1] == 1 < rounds[0]


def test_the_callback_gets_the_plans_cost_and_may_stop():
    problem = random_problem(1, 300, 20, visible=ring_mask(300, 20), lens=SHALLOW)
    plan = SOLVERS["em"](problem)
    whole = Log()
    full = lower_bound(problem, 123.0, plan.cost, on_progress=whole)
    assert len(whole.progress) > 3
    assert full.lower_bound <= 123.0
    for rounds in (1, 2, 3):
        log = Log(rounds)
        bound = lower_bound(problem, plan.cost, plan.cost, on_progress=log)
        assert [(p.stage, p.iteration, p.cost) for p in log.progress] == [
            ("prices", i + 1, plan.cost) for i in range(rounds)
        ]
        told = [p.lower_bound for p in log.progress]
        assert told == [p.lower_bound for p in whole.progress[:rounds]]
        assert bound.lower_bound == told[-1]
    assert {p.cost for p in whole.progress} == {123.0}
    told = [p.lower_bound for p in whole.progress]
    assert told == sorted(told)


def test_prices_that_proved_it_prove_it_again_at_once():
    problem = problem_of(body("arms_out"), cylinder_rig(4, 9), 600)
    plan = SOLVERS["k_view"](problem)
    cold_log, warm_log = Log(), Log()
    cold = lower_bound(problem, plan.cost, plan.cost, on_progress=cold_log)
    warm = lower_bound(problem, plan.cost, plan.cost, start=cold.prices, on_progress=warm_log)
    assert warm_log.progress[0].lower_bound >= cold.lower_bound - 1e-9
    assert warm.lower_bound >= cold.lower_bound - 1e-9
    assert len(warm_log.progress) < len(cold_log.progress)
    # Bad prices are a bad start, and no more.
    worse = lower_bound(problem, plan.cost, plan.cost, start=0 * cold.prices)
    assert 0.99 * cold.lower_bound < worse.lower_bound <= plan.cost


def test_with_one_camera_it_is_the_optimum():
    for seed in range(20):
        problem = random_problem(seed, 40, 1, share=0.8, lens=SHALLOW)
        plan = SOLVERS["em"](problem)
        bound = lower_bound(problem, plan.cost, plan.cost)
        assert bound.lower_bound == pytest.approx(least_cost(problem), rel=2e-3)


def test_where_nobody_sees_anything_it_is_the_cost():
    problem = random_problem(0, 30, 3, share=0.0)
    cost = problem.cost(np.ones(3))
    assert cost == pytest.approx(1000)
    bound = lower_bound(problem, cost, cost)
    assert bound.lower_bound == pytest.approx(1000)
    assert (bound.prices == 0).all()


def test_samples_without_weight_need_no_price():
    problem = random_problem(2, 14, 3, share=0.8, lens=SHALLOW)
    problem.samples.weights[8:] = 0
    plan = SOLVERS["em"](problem)
    bound = lower_bound(problem, plan.cost, plan.cost)
    assert np.isfinite(bound.prices).all()
    assert (bound.prices[8:] == 0).all()
    assert (bound.prices[:8] > 0).any()
    assert bound.lower_bound <= least_cost(problem) + 1e-9


def test_it_repeats_bit_for_bit():
    problem = random_problem(3, 300, 20, visible=ring_mask(300, 20), lens=SHALLOW)
    one, other = (lower_bound(problem, 400.0, 300.0) for _ in range(2))
    assert one.lower_bound == other.lower_bound
    assert one.prices.tobytes() == other.prices.tobytes()
