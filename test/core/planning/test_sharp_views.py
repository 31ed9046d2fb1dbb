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

from focus_planner import PlanRequest, Rig, Scene, plan_focus
from focus_planner.core.planning.quality import estimate_quality, weighted_quantiles
from focus_planner.core.planning.sampled_quality import sampled_quality
from focus_planner.core.planning.sharp_views import TOLD_VIEWS, sharp_views
from focus_planner.core.problem.shots import with_shots
from testing import reference
from testing.problems import around, forward, plane, random_problem, sphere, torus


def counted(problem, focus):
    """How many of the rig's cameras hold each sample, by looking at every pair."""
    names = [set() for _ in range(problem.sample_count)]
    for p, c, near, far in zip(
        problem.sample_index,
        problem.camera_index,
        problem.focus_near,
        problem.focus_far,
        strict=True,
    ):
        if near <= focus[c] <= far:
            names[p].add(problem.names[c])
    return [len(each) for each in names]


@pytest.mark.parametrize("shots", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_shots_of_one_camera_are_one_view(seed, shots):
    problem = with_shots(random_problem(seed, samples=40, cameras=6, share=0.7), shots)
    random = np.random.default_rng(seed)
    focus = random.choice(problem.focus_near[np.isfinite(problem.focus_near)], len(problem.names))
    expected = counted(problem, focus)
    assert sharp_views(problem, focus).tolist() == expected
    assert sampled_quality(problem, focus).views.tolist() == expected
    assert max(expected) > 1


def test_a_camera_without_a_distance_holds_nothing():
    problem = random_problem(1, samples=20, cameras=3)
    assert sharp_views(problem, np.full(3, np.nan)).tolist() == [0] * 20


@pytest.mark.parametrize("shots", [1, 2])
def test_every_plan_tells_the_area_sharp_in_so_many_views(shots):
    request = PlanRequest("em", samples=300, fresh_samples=500, shots=shots)
    plan = plan_focus(Scene(torus(0.4, 0.15)), around(8, 1.0), request)
    fresh = plan.fresh_problem
    areas = fresh.samples.areas
    views = np.array(counted(fresh, plan.focus_distances))
    assert [each.views for each in plan.sharp_areas] == [1, 2, 3, 5] == list(TOLD_VIEWS)
    for each in plan.sharp_areas:
        enough = views >= each.views
        share = (areas * enough).sum() / areas.sum()
        residuals = areas * (enough - share)
        error = np.sqrt((residuals**2).sum() * 500 / 499)
        assert each.area == pytest.approx(share * areas.sum(), rel=1e-12)
        assert each.standard_error == pytest.approx(error, rel=1e-12)
    told = [each.area for each in plan.sharp_areas]
    assert told == sorted(told, reverse=True)
    assert told[0] > told[1] > 0
    # Of a view that is sharp, the camera need not be that which images the surface best.
    assert plan.in_focus_area <= told[0] <= plan.covered_area


def test_sharp_in_a_view_counts_cameras_that_do_not_image_the_surface_best():
    # Of two cameras the nearer one images the plane best, although only the other holds it, from
    # afar and off its axis.
    scene = Scene(plane(0.1, 0.1, 0.6))
    rig = Rig((forward("near", (0, 0, 0)), forward("far", (0.45, 0, -1.5))))
    problem = plan_focus(scene, rig, PlanRequest("closest", samples=50)).fresh_problem
    quality = estimate_quality(problem, np.array([3.0, 2.1]), rig)
    near_cost, far_cost = problem.base_cost[:2]
    assert near_cost + problem.focus_weight < far_cost  # of a sample in the middle, as of all
    assert quality.in_focus_area.value == 0
    assert quality.resolution is None
    assert quality.sharp_areas[0].area == pytest.approx(scene.area)
    assert [each.area for each in quality.sharp_areas[1:]] == [0, 0, 0]


def test_before_a_plane_the_resolution_is_depth_over_focal_length():
    scene, rig = Scene(plane(0.3, 0.3, 0.75)), Rig((forward(),))
    plan = plan_focus(scene, rig, PlanRequest("k_view", samples=200))
    assert plan.resolution.median == pytest.approx(1000 * 0.75 / 300, rel=1e-12)
    assert plan.resolution.percentile_90 == pytest.approx(plan.resolution.median, rel=1e-12)
    assert plan.sharp_areas[0].area == pytest.approx(0.09)


@pytest.mark.parametrize("shots", [1, 2])
def test_the_resolution_is_that_of_the_best_camera_where_it_is_in_focus(shots):
    scene, rig = Scene(sphere(0.3)), around(6, 0.9)
    request = PlanRequest("em", samples=200, fresh_samples=300, shots=shots)
    plan = plan_focus(scene, rig, request)
    fresh, focus = plan.fresh_problem, plan.focus_distances
    _, best = fresh.evaluate(focus)
    held = fresh.in_focus(focus, best)
    lengths = np.array(
        [
            1000 * reference.metres_per_pixel(rig.cameras[best[p] // shots], point, normal)
            for p, (point, normal) in enumerate(
                zip(fresh.samples.points, fresh.samples.normals, strict=True)
            )
            if held[p]
        ]
    )
    areas = fresh.samples.areas[held]
    assert 100 < len(lengths) < 300
    for told, share in ((plan.resolution.median, 0.5), (plan.resolution.percentile_90, 0.9)):
        at_most = areas[lengths <= told * 1.003].sum() / areas.sum()
        less = areas[lengths < told * 0.997].sum() / areas.sum()
        assert less < share <= at_most


class TestWeightedQuantiles:
    def test_of_equal_weights_they_are_order_statistics(self):
        values = np.random.default_rng(0).permutation(np.arange(1.0, 11.0))
        told = weighted_quantiles(np.full(10, 0.1), values, (0.1, 0.5, 0.9, 1.0))
        assert told == (1.0, 5.0, 9.0, 10.0)

    def test_heavy_values_count_more(self):
        values, weights = np.array([3.0, 1.0, 2.0]), np.array([8.0, 1.0, 1.0])
        assert weighted_quantiles(weights, values, (0.1, 0.2, 0.21)) == (1.0, 2.0, 3.0)

    def test_values_without_weight_do_not_count(self):
        values, weights = np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0])
        assert weighted_quantiles(weights, values, (0.5, 1.0)) == (2.0, 2.0)


def test_a_plan_for_several_views_is_judged_for_as_many():
    scene, rig = Scene(torus(0.4, 0.15)), around(8, 1.0)
    one = PlanRequest("em", samples=200, bound="none")
    plans = [plan_focus(scene, rig, replace(one, views=views)) for views in (1, 3)]
    assert [plan.views for plan in plans] == [1, 3]
    for plan in plans:
        fresh, focus = plan.fresh_problem, plan.focus_distances
        held = (fresh.focus_near <= focus[fresh.camera_index]) & (
            focus[fresh.camera_index] <= fresh.focus_far
        )
        pairs = fresh.base_cost + np.where(held, 0.0, fresh.focus_weight)
        costs = []
        for low, high in zip(fresh.sample_offsets, fresh.sample_offsets[1:], strict=False):
            least = sorted([*pairs[low:high], *[1.0] * plan.views])[: plan.views]
            costs.append(np.mean(least))
        weights = fresh.samples.weights
        expected = 1000 * (weights * costs).sum() / weights.sum()
        assert plan.fresh_cost == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("shots", "images"), [(1, 0), (2, 0), (2, 7)])
def test_what_is_one_of_the_views_that_a_sample_needs_is_assigned_to_it(shots, images):
    scene, rig = Scene(torus(0.4, 0.15)), around(8, 1.0)
    request = PlanRequest("k_view", samples=200, bound="none", views=3, shots=shots, images=images)
    plan = plan_focus(scene, rig, request)
    problem, focus = plan.problem, plan.focus_distances
    table = reference.table(problem)
    for seen in table.seen:
        for c in np.flatnonzero(focus == -np.inf):
            seen.pop(c, None)
    assigned, sharp = np.zeros((2, len(focus)), dtype=int)
    for seen, cameras in zip(table.seen, reference.assign_views(table, focus), strict=True):
        for c in cameras:
            assigned[c] += 1
            sharp[c] += seen[c].near <= focus[c] <= seen[c].far
    told = [(0, 0) if s is None else (s.assigned_samples, s.in_focus_samples) for s in plan.slots]
    assert told == list(zip(assigned, sharp, strict=True))
    # So what has no samples may be left out: that changes no cost.
    idle = np.where(assigned == 0, -np.inf, focus)
    assert problem.cost(idle) == pytest.approx(plan.cost, rel=1e-12)
