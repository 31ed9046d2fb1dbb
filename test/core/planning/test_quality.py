# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from focus_planner import InputError, PlanRequest, PointCloud, Rig, Scene, plan_focus
from focus_planner.core.planning import formulation
from focus_planner.core.planning.formulation import choose_samples, formulate_problem
from focus_planner.core.planning.quality import estimate_quality, weighted_mean
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.sampling import sample_mesh
from testing.problems import (
    around,
    body,
    forward,
    looking_at,
    merged,
    plane,
    random_problem,
    sphere,
    torus,
)

SCENE, RIG = Scene(torus(0.4, 0.15)), around(6, 1.0)
WALL, EYE = Scene(plane(0.6, 0.6, 0.8)), Rig((forward(),))
# Eq. 3 before a plane all in focus: the mean distance from the middle of a square is known.
WALL_COST = 1000 * (0.64 + 0.6 * (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 6 / 0.75) / 3


def distances(plan):
    return np.array([camera.focus_distance for camera in plan.cameras])


def two_walls():
    """Two squares side by side, at 0.6 m and at 0.9 m: no focus distance holds both."""
    left, right = plane(0.3, 0.3, 0.6), plane(0.3, 0.3, 0.9)
    return merged(
        type(left)(left.vertices - [0.2, 0, 0], left.triangles),
        type(right)(right.vertices + [0.2, 0, 0], right.triangles),
    )


class TestWeightedMean:
    def test_with_equal_weights_it_is_the_mean_and_its_textbook_error(self):
        values = np.random.default_rng(0).random(100)
        estimate = weighted_mean(np.full(100, 0.3), values)
        assert estimate.value == pytest.approx(values.mean())
        assert estimate.standard_error == pytest.approx(values.std(ddof=1) / 10)

    def test_two_samples_are_enough(self):
        estimate = weighted_mean(np.ones(2), np.array([1.0, 3.0]))
        assert (estimate.value, estimate.standard_error) == pytest.approx((2.0, 1.0))

    def test_a_constant_has_no_error(self):
        estimate = weighted_mean(np.array([1.0, 2.0, 5.0]), np.full(3, 0.25))
        assert (estimate.value, estimate.standard_error) == (0.25, 0.0)

    def test_the_weights_unit_does_not_matter(self):
        weights, values = np.random.default_rng(1).random((2, 50))
        one, other = weighted_mean(weights, values), weighted_mean(1e-6 * weights, values)
        assert other.value == pytest.approx(one.value)
        assert other.standard_error == pytest.approx(one.standard_error)

    def test_the_error_is_the_spread_when_weights_and_values_go_together(self):
        # Weights of 1 and 9, heavy ones with larger values: E[wv]/E[w] = 0.7·0.9 + 0.3·0.1.
        random = np.random.default_rng(2)
        estimates = []
        for _ in range(2000):
            heavy = random.random(200) < 0.1
            values = (random.random(200) < np.where(heavy, 0.8, 0.3)).astype(float)
            estimates.append(weighted_mean(np.where(heavy, 9.0, 1.0), values))
        truth = (0.9 * 0.3 + 0.9 * 0.8) / 1.8
        off = np.array([estimate.value for estimate in estimates]) - truth
        errors = np.array([estimate.standard_error for estimate in estimates])
        assert off.std() == pytest.approx(np.sqrt((errors**2).mean()), rel=0.06)
        assert abs(off.mean()) < 0.1 * off.std()


def test_a_problem_is_judged_by_its_costs():
    problem = random_problem(3, samples=40, cameras=3, share=0.4)
    focus = np.array([0.6, 0.7, np.nan])
    quality = estimate_quality(problem, focus)
    costs, best = problem.evaluate(focus)
    areas = problem.samples.areas
    assert quality.cost.value == pytest.approx(problem.cost(focus))
    assert (best < 0).any()
    assert quality.covered_area.value == pytest.approx(areas[best >= 0].sum())
    # In focus a pair costs its base, out of focus a third more.
    base = {
        (p, c): cost
        for p, c, cost in zip(
            problem.sample_index, problem.camera_index, problem.base_cost, strict=True
        )
    }
    sharp = [b >= 0 and costs[p] == base[p, b] for p, b in enumerate(best)]
    assert 0 < sum(sharp) < 40
    assert quality.in_focus_area.value == pytest.approx(areas[sharp].sum())


def test_what_nobody_sees_costs_1000_without_doubt():
    problem = random_problem(0, samples=5, cameras=2, visible=np.zeros((5, 2), dtype=bool))
    quality = estimate_quality(problem, np.full(2, 0.5))
    assert (quality.cost.value, quality.cost.standard_error) == (1000.0, 0.0)
    assert quality.covered_area.value == quality.in_focus_area.value == 0.0


@pytest.mark.parametrize("count", [32, 300])
def test_the_standard_error_is_honest(count):
    # The spread of the estimates over many seeds is what each of them says, and their mean is the
    # closed form. Of 400 the spread is known to 3.5 %.
    qualities = [
        estimate_quality(
            formulate_problem(
                WALL, EYE, PlanRequest("em", fresh_samples=count, seed=seed), fresh=True
            ),
            np.array([0.8]),
        )
        for seed in range(400)
    ]
    off = np.array([quality.cost.value for quality in qualities]) - WALL_COST
    errors = np.array([quality.cost.standard_error for quality in qualities])
    assert off.std() == pytest.approx(np.sqrt((errors**2).mean()), rel=0.12)
    assert abs(off.mean()) < 3 * off.std() / 20
    within = np.abs(off) <= 1.96 * errors
    assert 0.91 <= within.mean() <= 0.98


def test_areas_are_in_square_metres_with_an_honest_error():
    # Half of 2 · 0.09 m² can be in focus. Of 300 the spread is known to 4 %.
    scene, rig = Scene(two_walls()), EYE
    plans = [
        plan_focus(scene, rig, PlanRequest("em", 100, seed, fresh_samples=200))
        for seed in range(300)
    ]
    assert plans[0].surface_area == pytest.approx(0.18)
    assert all(plan.covered_area == pytest.approx(0.18) for plan in plans)
    # Which wall is in focus, chance decides; half of the area it is.
    off = np.array([plan.in_focus_area - 0.09 for plan in plans])
    errors = np.array([plan.in_focus_standard_error for plan in plans])
    assert errors == pytest.approx(0.18 * 0.5 / math.sqrt(199), rel=0.05)
    assert off.std() == pytest.approx(errors.mean(), rel=0.12)
    assert abs(off.mean()) < 3 * off.std() / math.sqrt(300)


def test_fresh_costs_have_no_bias_and_own_ones_flatter():
    plans = [plan_focus(SCENE, RIG, PlanRequest("k_view", 60, seed)) for seed in range(12)]
    dense = formulate_problem(SCENE, RIG, PlanRequest(seed=999, fresh_samples=60_000), fresh=True)
    true = np.array([dense.cost(distances(plan)) for plan in plans])
    fresh = np.array([plan.fresh_cost for plan in plans])
    errors = np.array([plan.fresh_standard_error for plan in plans])
    own = np.array([plan.cost for plan in plans])
    assert (np.abs(fresh - true) < 3.5 * errors).all()
    assert abs((fresh - true).mean()) < 3 * errors.mean() / math.sqrt(12)
    assert (true - own).mean() > 5 * errors.mean()


def test_fresh_samples_are_no_seeds_samples():
    # NumPy takes a number beyond 2^32, and a list of numbers, for the same words.
    seeds = [0, 1, 5, 2**32, 2**32 + 5, 2 * 2**32 + 5, 2**64 + 5, 2**128 + 5]
    drawn = [SCENE.sample(500, seed).points for seed in seeds]
    drawn += [SCENE.fresh_samples(500, seed).points for seed in seeds]
    points = np.concatenate(drawn)
    assert len(np.unique(points, axis=0)) == len(points)
    np.testing.assert_array_equal(SCENE.fresh_samples(500, 5).points, drawn[len(seeds) + 2])


def test_fresh_samples_are_on_the_surface_and_uniform():
    mesh = plane(1.0, 2.0, 0.5)
    samples = Scene(mesh).fresh_samples(20_000, 0)
    x, y, z = samples.points.T
    assert z == pytest.approx(0.5)
    counts = np.histogram2d(x, y, bins=(4, 8), range=[(-0.5, 0.5), (-1, 1)])[0]
    assert ((counts - 625) ** 2 / 625).sum() / 31 < 2
    np.testing.assert_array_equal(samples.normals, np.tile([0.0, 0.0, -1.0], (20_000, 1)))
    assert samples.weights.sum() == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("count", "seed", "message"),
    [
        (1, 0, "fresh_samples: expected a whole number of at least 2, got 1"),
        (2, -1, "seed: expected a whole number of at least 0, got -1"),
    ],
)
def test_too_few_fresh_samples_are_an_error(count, seed, message):
    with pytest.raises(InputError, match=message):
        SCENE.fresh_samples(count, seed)


def test_plans_of_one_seed_are_judged_on_the_same_samples():
    fresh = formulate_problem(SCENE, RIG, PlanRequest(seed=4, fresh_samples=300), fresh=True)
    for method, count in (("closest", 50), ("em", 200)):
        plan = plan_focus(SCENE, RIG, PlanRequest(method, count, 4, fresh_samples=300))
        assert plan.fresh_cost == fresh.cost(distances(plan))
        assert plan.samples == count


def test_the_number_of_fresh_samples_changes_no_plan():
    plans = [
        plan_focus(SCENE, RIG, PlanRequest(samples=300, fresh_samples=count))
        for count in (2, 3, 5000)
    ]
    assert plans[0].cameras == plans[1].cameras == plans[2].cameras
    assert plans[0].cost == plans[1].cost == plans[2].cost
    assert [plan.fresh_samples for plan in plans] == [2, 3, 5000]
    assert all(math.isfinite(plan.fresh_standard_error) for plan in plans)


def test_fresh_samples_that_nobody_sees_cost_1000():
    # One camera sees a corner of a large surface: of two fresh samples it misses both.
    rig = Rig((looking_at("c", (0.0, 0.0, 0.8), (0.2, 0.0, 0.0)),))
    scene = Scene(merged(sphere(0.2), sphere(2.0, (0.0, 0.0, -5.0))))
    for seed in range(20):
        plan = plan_focus(scene, rig, PlanRequest("em", 4000, seed, fresh_samples=2))
        if plan.covered_area == 0:
            assert (plan.fresh_cost, plan.fresh_standard_error) == (1000.0, 0.0)
            assert plan.in_focus_area == plan.in_focus_standard_error == 0.0
            return
    raise AssertionError("some seed misses what the camera sees")


class TestClouds:
    """Where there is nothing but points, fresh samples lie around them."""

    @staticmethod
    def cloud(count=2000, normals=True, mesh=None):
        drawn = sample_mesh(mesh or torus(0.4, 0.15), count, 7)
        return PointCloud(drawn.points, drawn.normals if normals else None)

    def test_fresh_samples_lie_in_the_points_own_squares(self):
        cloud = self.cloud()
        scene = Scene(cloud)
        fresh = scene.fresh_samples(5000, 0)
        assert fresh.weights.sum() == pytest.approx(scene.area)
        nearest, _ = cKDTree(cloud.points).query(fresh.points)
        assert (nearest > 0).all()
        spacing = math.sqrt(scene.area / 2000)
        assert 0.2 * spacing < np.median(nearest) < 0.6 * spacing
        # On the torus, but for its curvature across a square.
        x, y, z = fresh.points.T
        tube = np.hypot(np.hypot(x, y) - 0.4, z)
        assert np.abs(tube - 0.15).max() < 0.03

    def test_flat_they_fill_the_plane(self):
        grid = (np.arange(40) + 0.5) / 40
        x, y = (axis.ravel() for axis in np.meshgrid(grid, grid))
        points = np.stack([x, y, np.zeros(1600)], axis=1)
        scene = Scene(PointCloud(points, np.tile([0.0, 0.0, 1.0], (1600, 1))))
        fresh = scene.fresh_samples(50_000, 1)
        assert (fresh.points[:, 2] == 0).all()
        inner = (np.abs(fresh.points[:, :2] - 0.5) < 0.3).all(axis=1)
        counts = np.histogram2d(*fresh.points[inner, :2].T, bins=12)[0]
        assert ((counts - counts.mean()) ** 2 / counts.mean()).sum() / 143 < 3

    def test_they_do_not_depend_on_what_is_planned_on(self):
        scene = Scene(self.cloud())
        own = scene.sample(500, 3)
        fresh = scene.fresh_samples(500, 3)
        assert not (own.points[:, None] == fresh.points[None]).all(axis=2).any()

    @pytest.mark.parametrize("normals", [True, False])
    @pytest.mark.parametrize("samples", [0, 300])
    def test_a_cloud_judges_like_its_mesh(self, normals, samples):
        mesh = merged(sphere(0.2, (0.25, 0, 0), 4), sphere(0.3, (-0.3, 0.1, 0), 4))
        rig = around(8, 1.2)
        dense = formulate_problem(Scene(mesh), rig, PlanRequest(fresh_samples=50_000), fresh=True)
        scene = Scene(self.cloud(2000, normals, mesh))
        plan = plan_focus(scene, rig, PlanRequest(samples=samples, fresh_samples=20_000))
        truth = dense.cost(distances(plan))
        assert plan.fresh_cost == pytest.approx(truth, rel=0.02)
        if samples:
            assert plan.cost < truth - 2 * abs(plan.fresh_cost - truth)


class TestChoosingSamples:
    @pytest.mark.parametrize("asked", [2.0, 3.5])
    def test_the_standard_error_is_what_was_asked_for(self, asked):
        scene, rig = Scene(body()), cylinder_rig()
        plan = plan_focus(scene, rig, PlanRequest(samples=0, standard_error=asked))
        assert plan.samples == plan.fresh_samples > 3000
        # The pilot's own error is 3 %, and EM, which it takes, leaves costs 2 % wider spread.
        assert 0.92 * asked < plan.fresh_standard_error < 1.04 * asked
        assert abs(plan.fresh_cost - plan.cost) < 8 * asked

    def test_it_is_the_plan_on_that_many(self):
        request = PlanRequest("em", samples=0, seed=2, standard_error=1.5)
        chosen = choose_samples(SCENE, RIG, request)
        assert chosen == PlanRequest(
            "em", chosen.samples, 2, fresh_samples=chosen.samples, standard_error=1.5
        )
        plans = [plan_focus(SCENE, RIG, r) for r in (request, request, chosen)]
        assert plans[0].cost == plans[1].cost == plans[2].cost
        assert plans[0].cameras == plans[1].cameras == plans[2].cameras
        assert plans[0].fresh_cost == plans[2].fresh_cost

    def test_a_quarter_of_the_error_takes_16_times_as_many(self):
        counts = [
            choose_samples(SCENE, RIG, PlanRequest(samples=0, standard_error=error)).samples
            for error in (0.8, 0.2)
        ]
        assert counts[1] == pytest.approx(16 * counts[0], rel=1e-3)

    def test_the_pilots_number_is_the_least(self):
        request = PlanRequest(samples=0, standard_error=1e6)
        assert choose_samples(SCENE, RIG, request).samples == formulation._PILOT_SAMPLES

    def test_where_all_costs_the_same_the_pilot_is_enough(self):
        model = formulation.CostModel(0, 0, 0)
        chosen = choose_samples(WALL, EYE, PlanRequest("em", samples=0), model)
        assert chosen.samples == formulation._PILOT_SAMPLES

    def test_the_error_that_a_refusal_names_is_accepted(self):
        with pytest.raises(InputError, match=r"at least \d") as refusal:
            choose_samples(SCENE, RIG, PlanRequest(samples=0, standard_error=1e-3))
        named = float(refusal.value.expected.split()[2])
        count = choose_samples(SCENE, RIG, PlanRequest(samples=0, standard_error=named)).samples
        assert 0.98 * formulation.MAX_SAMPLES < count <= formulation.MAX_SAMPLES

    def test_other_requests_are_left_alone(self):
        request = PlanRequest(samples=77, standard_error=1e-9)
        assert choose_samples(SCENE, RIG, request) is request
        cloud = Scene(TestClouds.cloud(100))
        request = PlanRequest(samples=0, standard_error=1e-9)
        assert choose_samples(cloud, RIG, request) is request
        assert plan_focus(cloud, RIG, request).samples == 100

    def test_a_callback_may_end_the_pilot_too(self):
        heard = []

        def on_progress(progress):
            heard.append((progress.stage, progress.iteration))
            return False

        plan = plan_focus(
            SCENE, RIG, PlanRequest(samples=0, standard_error=4.0), on_progress=on_progress
        )
        assert heard == [("em", 1)]
        assert not plan.converged
