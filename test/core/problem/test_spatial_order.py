# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.


from dataclasses import replace

import numpy as np
import pytest

from focus_planner import PlanRequest, plan_focus
from focus_planner.core.bounds.lagrangian import Prices, cost_below, prices_in_units
from focus_planner.core.planning import solving
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.problem.joined import concatenate
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.spatial_order import sort_by_place
from focus_planner.core.solvers import SOLVERS, Options
from focus_planner.core.surface.scene import Scene
from testing.problems import around, random_problem, sphere


def scattered_problem(seed, **changes):
    """A random problem with its samples at random places."""
    problem = random_problem(seed, **changes)
    points = np.random.default_rng(seed).random((problem.sample_count, 3))
    return replace(problem, samples=replace(problem.samples, points=points))


def of_each_sample(problem: Problem) -> list[list[list[float]]]:
    """Everything that belongs to each sample, and to its pairs."""
    cells, samples = problem.cells, problem.samples
    of_samples = [samples.points, samples.weights, cells.focus, cells.unseen]
    of_pairs = [problem.camera_index, problem.depth, problem.base_cost, problem.focus_near]
    of_pairs += [problem.focus_far, cells.base, cells.first, cells.last]
    parts = [slice(*problem.sample_offsets[[p, p + 1]]) for p in range(problem.sample_count)]
    for p, part in enumerate(parts):
        assert (problem.sample_index[part] == p).all()
    return [
        [values[p].tolist() for values in of_samples] + [values[q].tolist() for values in of_pairs]
        for p, q in enumerate(parts)
    ]


def test_samples_keep_what_is_theirs():
    problem = scattered_problem(4)
    placed = sort_by_place(problem)
    before, after = of_each_sample(problem), of_each_sample(placed.problem)
    assert placed.order is not None
    assert (placed.order != np.arange(problem.sample_count)).any()
    assert [before[p] for p in placed.order] == after
    values = np.arange(problem.sample_count) * 0.5
    np.testing.assert_array_equal(placed.restored(placed.sorted(values)), values)


def test_the_pairs_of_each_camera_are_the_same_ones_samples_ascending():
    problem = scattered_problem(5)
    placed = sort_by_place(problem)
    assert placed.order is not None
    for c in range(problem.camera_count):
        part = slice(*problem.camera_offsets[[c, c + 1]])
        before, after = (
            np.array([cells.seen[part], cells.seen_base[part], cells.seen_first[part]])
            for cells in (problem.cells, placed.problem.cells)
        )
        assert (np.diff(after[0]) > 0).all()
        after[0] = placed.order[after[0]]
        np.testing.assert_array_equal(after[:, np.argsort(after[0])], before)


def test_neighbours_come_one_after_the_other():
    placed = sort_by_place(scattered_problem(6, samples=2000))
    steps = np.linalg.norm(np.diff(placed.problem.samples.points, axis=0), axis=1)
    assert steps.mean() < 0.2  # 0.66 between random points of a unit cube


def test_subjects_stay_together():
    parts = [scattered_problem(seed, samples=20 + seed) for seed in (7, 8)]
    problem = concatenate(parts)
    order = sort_by_place(problem).order
    assert order is not None
    for part in problem.subjects:
        assert sorted(order[part]) == list(range(part.start, part.stop))


@pytest.mark.parametrize("method", ["em", "k_view"])
@pytest.mark.parametrize(
    ("options", "shape"),
    [
        (Options(), {}),
        (Options(k=3), {}),
        (Options(scope="assigned"), {}),
        (Options(), {"views": 2, "shots": 2}),
    ],
)
def test_solvers_choose_the_same_distances(method, options, shape):
    for seed in range(10):
        problem = scattered_problem(seed, samples=60, cameras=6, ties=seed % 2 == 0, **shape)
        solved = SOLVERS[method](problem, options)
        placed = SOLVERS[method](sort_by_place(problem).problem, options)
        np.testing.assert_array_equal(placed.focus_distances, solved.focus_distances)
        assert placed.iterations == solved.iterations
        assert placed.cost == pytest.approx(solved.cost, rel=1e-12)


def test_large_plans_are_as_they_would_be_with_samples_as_drawn(monkeypatch):
    scene, rig = Scene(sphere(0.2)), around(6, 0.8)
    request = PlanRequest("k_view", 300, fresh_samples=300)
    plan = plan_focus(scene, rig, request)
    monkeypatch.setattr(solving, "_LARGE", 0)
    sorted_plan = plan_focus(scene, rig, request)
    assert sorted_plan.cameras == plan.cameras
    assert (sorted_plan.cost, sorted_plan.fresh_cost) == (plan.cost, plan.fresh_cost)
    np.testing.assert_array_equal(sorted_plan.problem.samples.points, plan.problem.samples.points)
    # Prices are those of the samples as drawn: there they prove the same bound.
    assert sorted_plan.prices is not None
    gains = gains_of(plan.problem)
    prices = Prices(gains, prices_in_units(plan.problem, sorted_plan.prices))
    prices.descend(2**62)
    assert cost_below(gains, prices.bound) == pytest.approx(sorted_plan.lower_bound, rel=1e-9)
