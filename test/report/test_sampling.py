# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a report says of each sample, against the paper's equations camera by camera."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.quality import weighted_mean
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_one_shot
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh
from focus_planner.report.content import ReportedPlan, SampledSurface
from focus_planner.report.sampling import depth_histograms, report_plan, sample_surface
from testing import reference
from testing.plans import away
from testing.problems import around, forward, mixed_lenses, plane, torus

DISTORTED = CameraIntrinsics(
    640, 480, 420.0, 420.0, 319.5, 239.5, "plumb_bob", (-0.2, 0.05, 0.0, 0.0)
)
MODEL = CostModel(0.3, 0.25, 0.4, 0.9, 0.6)
TORUS = torus(0.4, 0.15)
SAMPLES = 90


@dataclass(frozen=True)
class Shown:
    subject: PlannedSubject
    problem: Problem
    surface: SampledSurface
    plan: ReportedPlan


def shown(
    request: PlanRequest,
    rig: Rig,
    mesh: Mesh = TORUS,
    model: CostModel = MODEL,
    count: int = SAMPLES,
) -> Shown:
    scene = Scene(mesh)
    plan = plan_focus(scene, rig, request, model)
    subject = PlannedSubject(scene, rig, request, plan, model)
    problem = with_one_shot(subject.fresh_problem(count))
    surface = sample_surface(problem, model, request.depth_tolerance)
    return Shown(subject, problem, surface, report_plan("it", plan, problem, surface))


def rig_of_all_kinds() -> Rig:
    cameras = mixed_lenses(around(6, 1.1)).cameras
    cameras = (replace(cameras[0], intrinsics=DISTORTED), *cameras[1:], away())
    return Rig(cameras)


@pytest.fixture(scope="module", params=[(1, 0.0), (3, 0.0), (2, 0.004)], ids=str)
def case(request: Any) -> Shown:
    shots, tolerance = request.param
    planned = PlanRequest(samples=200, shots=shots, depth_tolerance=tolerance, fresh_samples=50)
    return shown(planned, rig_of_all_kinds())


def pairs(case: Shown) -> set[tuple[int, int]]:
    offsets = case.surface.pair_offsets
    sample = np.repeat(np.arange(SAMPLES), np.diff(offsets))
    return set(zip(sample.tolist(), case.surface.pair_camera.tolist(), strict=True))


def test_pairs_are_what_the_cameras_see(case: Shown) -> None:
    surface, rig = case.surface, case.subject.rig
    scene, seen = case.subject.scene, pairs(case)
    places = list(zip(surface.points, surface.normals, strict=True))
    for margin, holds in ((1e-6, set.issuperset), (-1e-6, set.issubset)):
        expected = {
            (p, c)
            for p, (point, normal) in enumerate(places)
            for c, camera in enumerate(rig.cameras)
            if reference.sees(TORUS, camera, point, normal, scene.stop_short, margin)
        }
        assert holds(seen, expected)
    assert not [pair for pair in seen if pair[1] == len(rig) - 1]
    assert {0, 1} < {camera for _, camera in seen}


def test_every_sample_is_what_the_equations_make_of_it(case: Shown) -> None:
    surface, told, rig = case.surface, case.plan, case.subject.rig
    tolerance = case.subject.request.depth_tolerance
    held_area = np.zeros(len(rig))
    q = 0
    for p, (point, normal) in enumerate(zip(surface.points, surface.normals, strict=True)):
        costs: dict[int, tuple[float, bool]] = {}
        views = 0
        for q in range(*surface.pair_offsets[p : p + 2]):
            c = int(surface.pair_camera[q])
            camera, shots = rig.cameras[c], case.subject.plan.cameras[c].shots
            depth = float((point - camera.position) @ reference.camera_axes(camera)[2])
            assert surface.pair_depth[q] == pytest.approx(depth)
            held = any(
                reference.holds(depth, s.focus_distance, camera.lens, tolerance) for s in shots
            )
            # Of a point that is in focus: all that is not about focus.
            base = reference.pointwise_cost(point, normal, camera, depth, MODEL)
            assert surface.pair_cost[q] == pytest.approx(base)
            assert told.pair_in_focus[q] == held
            costs[c] = base + MODEL.focus_weight * (not held), held
            views += held
            held_area[c] += held * surface.areas[p]
        best = min(costs, key=lambda c: costs[c][0], default=-1)
        assert told.camera[p] == best
        assert (told.cost[p], told.in_focus[p]) == pytest.approx(costs.get(best, (1.0, False)))
        assert told.sharp_views[p] == views
    np.testing.assert_allclose(told.held_area, held_area)
    assert told.held_area[-1] == 0
    assert 0 < told.in_focus.mean() < 1
    assert (told.camera.dtype, told.sharp_views.dtype) == (np.int32, np.int32)


def test_more_is_in_focus_somewhere_than_in_the_best_picture(case: Shown) -> None:
    assert (case.plan.sharp_views[case.plan.in_focus] > 0).all()


def test_costs_average_to_the_fresh_cost() -> None:
    request = PlanRequest(samples=200, fresh_samples=500)
    case = shown(request, rig_of_all_kinds(), count=500)
    plan, weights = case.subject.plan, case.surface.areas
    # Without importance, samples by area are those that the plan was estimated on.
    assert weighted_mean(weights, case.plan.cost).scaled(1000).value == plan.fresh_cost
    area = case.subject.scene.area
    assert weighted_mean(weights, case.plan.in_focus).scaled(area).value == pytest.approx(
        plan.in_focus_area, rel=1e-12
    )
    assert case.surface.importance is None
    assert case.surface.spacing == pytest.approx((area / 500) ** 0.5)
    assert (case.surface.model, case.surface.depth_tolerance) == (MODEL, 0.0)


def test_importance_is_relative_to_the_greatest() -> None:
    importance = 4.0 * (TORUS.vertices[:, 2] > 0)
    case = shown(
        PlanRequest(samples=200), around(6, 1.1), replace(TORUS, vertex_importance=importance)
    )
    told = case.surface.importance
    assert told is not None
    assert (told.min(), told.max()) == (0.0, 1.0)
    above = case.surface.points[:, 2]
    assert told[above > 0.1].min() == 1.0
    assert told[above < -0.1].max() == 0.0


def test_a_plan_for_other_lenses_is_told_on_the_same_pairs() -> None:
    rig = around(6, 1.1)
    case = shown(PlanRequest(samples=200), rig)
    cameras = [replace(camera, lens=Lens(0.05, 1.5)) for camera in rig.cameras]
    cameras[2] = replace(away(), name=cameras[2].name)
    other = Rig(tuple(cameras))
    problem = with_one_shot(replace(case.subject, rig=other).fresh_problem(SAMPLES))
    told = report_plan("other", case.subject.plan, problem, case.surface)
    assert len(told.pair_in_focus) == len(case.surface.pair_camera)
    assert not told.pair_in_focus[case.surface.pair_camera == 2].any()
    for q, (p, c) in enumerate(sorted(pairs(case))):
        if c != 2:
            depth = float(case.surface.pair_depth[q])
            s = case.subject.plan.cameras[c].focus_distance
            assert told.pair_in_focus[q] == reference.in_focus(depth, s, other.cameras[c].lens), p
    assert told.pair_in_focus.sum() > case.plan.pair_in_focus.sum() / 2


# --- histograms --------------------------------------------------------------------------------


def test_histograms_hold_all_that_each_camera_sees(case: Shown) -> None:
    histograms = depth_histograms(case.problem)
    assert len(histograms) == len(case.subject.rig)
    areas = case.surface.areas[case.problem.sample_index]
    for c, histogram in enumerate(histograms[:-1]):
        seen = case.problem.camera_index == c
        depths, of_each = case.problem.depth[seen], areas[seen]
        assert histogram.edges[0] <= depths.min() < histogram.edges[1]
        assert histogram.edges[-2] <= depths.max() <= histogram.edges[-1]
        assert 5 <= len(histogram.areas) <= 26
        expected, _ = np.histogram(depths, histogram.edges, weights=of_each)
        np.testing.assert_allclose(histogram.areas, expected, atol=1e-12)
    assert len(histograms[-1].edges) == len(histograms[-1].areas) == 0


def test_a_plane_has_one_depth() -> None:
    case = shown(PlanRequest("em", 50), Rig((forward(),)), plane(0.2, 0.2, 1.5))
    (histogram,) = depth_histograms(case.problem)
    assert histogram.areas.sum() == pytest.approx(0.04)
    assert len(histogram.areas) == 1
    assert histogram.edges == pytest.approx([1.4985, 1.5015])


def test_what_is_sharp_elsewhere_is_not_sharp_where_it_is_imaged_best() -> None:
    request = PlanRequest(samples=200, fresh_samples=50)
    case = shown(request, rig_of_all_kinds(), model=replace(MODEL, focus_weight=0.02))
    surface, told = case.surface, case.plan
    elsewhere = 0
    for p in np.flatnonzero(told.camera >= 0):
        low, high = surface.pair_offsets[p : p + 2]
        held = told.pair_in_focus[low:high]
        (there,) = held[surface.pair_camera[low:high] == told.camera[p]]
        assert told.in_focus[p] == there
        elsewhere += bool(held.any() and not there)
    assert elsewhere > 0
