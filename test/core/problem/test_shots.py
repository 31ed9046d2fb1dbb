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

from focus_planner import Lens, Problem, cylinder_rig
from focus_planner.core.problem.shots import sort_shots, spread_start, with_one_shot, with_shots
from focus_planner.core.solvers import SOLVERS, Options, em, k_view
from testing import reference
from testing.problems import TABLE_LENSES, body, problem_of, random_problem, ring_mask

LENSES = {
    "any": Lens(),
    "limits": Lens(min_focus=0.58, max_focus=0.7),
    "list": Lens(focus_distances=(0.52, 0.58, 0.6, 0.63, 0.67, 0.72, 0.78)),
    "steps": Lens(min_focus=0.5, max_focus=3.0, focus_steps=30),
    "table": TABLE_LENSES[0],
    "whole": TABLE_LENSES[1],
}
each_lens = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES.keys())
each_tolerance = pytest.mark.parametrize("tolerance", [0.0, 0.012])


def small_problem(seed, samples, cameras, lens, tolerance):
    return random_problem(seed, samples, cameras, share=0.8, lens=lens, tolerance=tolerance)


def arrays(problem):
    return {
        name: value
        for name in Problem.__dataclass_fields__
        if isinstance(value := getattr(problem, name), np.ndarray)
    }


def test_a_sample_costs_the_least_of_all_shots():
    one, random = random_problem(0, 40, 4), np.random.default_rng(0)
    three = with_shots(one, 3)
    for _ in range(10):
        focus = random.uniform(0.45, 0.9, (4, 3))
        costs, best = three.evaluate(focus.ravel())
        each = [
            one.evaluate(np.array([focus[c, i] for c, i in enumerate(choice)]))[0]
            for choice in np.ndindex(3, 3, 3, 3)
        ]
        np.testing.assert_array_equal(costs, np.min(each, axis=0))
        expected = reference.assign(reference.table(three), focus.ravel())
        assert best.tolist() == [-1 if c is None else c for c in expected]


@pytest.mark.parametrize("shots", [1, 2, 5])
def test_the_way_back(shots):
    one = problem_of(body(), cylinder_rig(2, 5), 100)
    many = with_shots(one, shots)
    assert (many.shots, many.camera_count) == (shots, 10 * shots)
    assert many.names[:: max(shots, 1)] == one.names
    back = with_one_shot(many)
    assert (back.names, back.lenses, back.shots) == (one.names, one.lenses, 1)
    for name, array in arrays(one).items():
        np.testing.assert_array_equal(getattr(back, name), array)
        # What kernels were compiled for.
        assert getattr(many, name).dtype == array.dtype
        assert getattr(many, name).flags.c_contiguous


@each_lens
@each_tolerance
@pytest.mark.parametrize(("cameras", "shots"), [(1, 2), (1, 3), (2, 1), (3, 1)])
def test_as_many_shots_as_move_together_reach_the_optimum(lens, tolerance, cameras, shots):
    for seed in range(6):
        one = small_problem(seed, 10, cameras, lens, tolerance)
        solution = k_view.solve(with_shots(one, shots), Options(k=max(2, cameras * shots)))
        best = reference.bracket_optimum(one, shots, tolerance)
        assert solution.cost == pytest.approx(best, abs=1e-9)


@each_lens
@each_tolerance
@pytest.mark.parametrize(("cameras", "shots"), [(2, 2), (2, 3), (3, 2)])
def test_more_shots_come_near_the_optimum_and_never_below(lens, tolerance, cameras, shots):
    excess = []
    for seed in range(5):
        one = small_problem(seed, 9, cameras, lens, tolerance)
        best = reference.bracket_optimum(one, shots, tolerance)
        # The model itself is exact: its optimum is that of the brackets.
        proven, _ = reference.optimum(reference.table(with_shots(one, shots)))
        assert proven == pytest.approx(best, abs=1e-6)
        for k in (2, 3):
            cost = k_view.solve(with_shots(one, shots), Options(k=k)).cost
            assert cost >= best - 1e-9
            excess.append(cost / best - 1)
    assert np.mean(excess) < 0.01


@pytest.mark.parametrize("method", ["em", "k_view"])
def test_every_further_shot_helps(method):
    one = problem_of(body("arms_out"), cylinder_rig(), 1000)
    costs = []
    for shots in (1, 2, 3, 4):
        problem = with_shots(one, shots)
        options = Options(start=spread_start(problem))
        costs.append(SOLVERS[method](problem, options).cost)
    assert (np.diff(costs) < -0.004 * costs[0]).all()
    assert costs[1] < 0.97 * costs[0]


def test_em_needs_its_shots_apart():
    one = problem_of(body("arms_out"), cylinder_rig(), 1000)
    problem = with_shots(one, 3)
    spread = spread_start(problem)
    together = np.repeat(spread[::3], 3)
    apart, idle = (em.solve(problem, Options(start=start)).cost for start in (spread, together))
    assert apart < 0.98 * idle


def test_shots_start_between_the_closest_and_the_farthest_depth():
    one = random_problem(3, 60, 5, visible=np.arange(60)[:, None] % 7 < np.arange(5))
    assert spread_start(one) is None
    start = spread_start(with_shots(one, 3)).reshape(5, 3)
    assert np.isnan(start[0]).all()
    for c in range(1, 5):
        depths = one.depth[one.camera_index == c]
        assert start[c].tolist() == [depths.min(), np.median(depths), depths.max()]


def test_two_depths_take_two_shots():
    one = random_problem(0, 40, 1, share=1.0)
    one.depth[:] = np.where(np.arange(40) % 3, 0.6, 0.8)
    one.focus_near[:] = one.depth * 10.05 / (10 + one.depth)
    one.focus_far[:] = one.depth * 9.95 / (10 - one.depth)
    problem = with_shots(one, 2)
    for method in ("em", "k_view"):
        solution = SOLVERS[method](problem, Options(start=spread_start(problem)))
        costs, best = problem.evaluate(solution.focus_distances)
        np.testing.assert_array_equal(costs, one.base_cost)
        assert set(best.tolist()) == {0, 1}


def test_the_tuples_of_shots_hold_on_any_graph():
    one = random_problem(2, 200, 12, visible=ring_mask(200, 12))
    for scope in ("all", "assigned"):
        costs = [
            k_view.solve(with_shots(one, shots), Options(scope=scope)).cost for shots in (1, 2, 3)
        ]
        assert costs == sorted(costs, reverse=True)


def test_shots_are_sorted_within_their_cameras():
    problem = with_shots(random_problem(0, 20, 2), 3)
    focus = np.array([3.0, 1, 2, 0.9, 0.8, 0.7])
    assert sort_shots(problem, focus).tolist() == [1, 2, 3, 0.7, 0.8, 0.9]
    assert problem.cost(sort_shots(problem, focus)) == problem.cost(focus)
