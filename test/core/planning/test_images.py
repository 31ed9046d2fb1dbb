# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans within a budget of pictures."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import (
    CameraStatus,
    InputError,
    Lens,
    LensTable,
    PlanRequest,
    Rig,
    Scene,
    cylinder_rig,
    plan_focus,
    plan_presets,
)
from focus_planner.core import kernels
from focus_planner.core.planning.plan_text import plan_text
from focus_planner.core.planning.request import METHODS, SCOPES, TUPLES
from focus_planner.core.planning.subject import requested
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.problem.shots import with_pictures
from testing.clock import Clock
from testing.plans import RIG, SCENE, away, without_seconds
from testing.problems import body

BODY = Scene(body("arms_out"))
BODY_RIG = cylinder_rig(4, 9)
SMALL = PlanRequest("k_view", samples=200, seed=3, fresh_samples=150)

each_method = pytest.mark.parametrize("method", METHODS)


def check(plan, request, rig):
    """What holds of every plan within a budget."""
    counts = [len(camera.shots) for camera in plan.cameras]
    assert plan.pictures == sum(counts) <= request.images
    assert max(counts) == plan.shots <= request.shots
    assert plan.images == request.images
    focus = plan.focus_distances
    assert focus.shape == (len(rig) * plan.shots,)
    taken = focus != kernels.UNTAKEN
    assert taken.sum() == plan.pictures
    assert np.isfinite(focus[taken]).all()
    # Costs and areas are those of a rig with the pictures that are taken and no others.
    for problem, cost in ((plan.problem, plan.cost), (plan.fresh_problem, plan.fresh_cost)):
        left = with_pictures(problem, taken)
        somewhere = np.where(taken, focus, 1.0)
        assert left.cost(somewhere) == pytest.approx(cost, rel=1e-12)
        costs, best = problem.evaluate(focus)
        np.testing.assert_array_equal((costs, best), left.evaluate(somewhere))
        assert taken[best[best >= 0]].all()
    _, best = plan.fresh_problem.evaluate(focus)
    sharp = plan.fresh_problem.in_focus(focus, best)
    # Samples are drawn by area, so that all have the same part of it.
    assert plan.in_focus_area == pytest.approx(plan.surface_area * sharp.mean())
    assert plan.covered_area == pytest.approx(plan.surface_area * (best >= 0).mean())
    _, best = plan.problem.assign(focus)
    assert sum(camera.assigned_samples for camera in plan.cameras) == (best >= 0).sum()
    for camera, count in zip(plan.cameras, counts, strict=True):
        assert 0 < camera.near_limit <= camera.focus_distance <= camera.far_limit
        each = [shot.focus_distance for shot in camera.shots]
        assert each == sorted(each)
        assert (camera.status is CameraStatus.PLANNED) == (camera.assigned_samples > 0)
        if count == 0:
            assert camera.status in {CameraStatus.DROPPED, CameraStatus.SEES_NOTHING}
            assert camera.assigned_samples == camera.in_focus_samples == 0
        else:
            assert camera.focus_distance in each
            assert camera.status is not CameraStatus.DROPPED
    assert plan.lower_bound is None or plan.lower_bound <= plan.cost


@each_method
@pytest.mark.parametrize(
    ("images", "shots", "views"), [(1, 1, 1), (4, 1, 1), (4, 1, 3), (5, 3, 1), (9, 2, 2)]
)
def test_a_plan_within_a_budget_adds_up(method, images, shots, views):
    rig = Rig((*RIG.cameras, away()))
    request = replace(SMALL, method=method, images=images, shots=shots, views=views, bound="quick")
    plan = plan_focus(SCENE, rig, request)
    check(plan, request, rig)
    # These set all shots of a camera alike, so that a second one shows nothing new.
    most = 6 if method in {"closest", "average"} else images
    assert plan.pictures == min(images, most)
    assert plan.lower_bound > 0.8 * plan.cost
    assert plan.cameras[-1].status is CameraStatus.SEES_NOTHING
    assert plan.cameras[-1].shots == ()
    idle = [c.name for c in plan.cameras if c.status is CameraStatus.DROPPED]
    used = sum(bool(camera.shots) for camera in plan.cameras)
    assert len(idle) == 6 - used
    title, *rows = plan_text(plan).splitlines()
    assert f", {plan.pictures} picture{'s' * (plan.pictures > 1)}" in title
    if idle:
        assert any(f"{len(idle)} taking no picture" in row for row in rows)
    # The same again, bit for bit.
    again = plan_focus(SCENE, rig, request)
    assert without_seconds(again) == without_seconds(plan)
    # A request made of the plan gives problems of the same pictures.
    assert requested(plan, SCENE).images == images


@pytest.mark.parametrize("scope", SCOPES)
@pytest.mark.parametrize("tuples", TUPLES)
@pytest.mark.parametrize("k", [2, 3])
def test_every_way_to_search_keeps_within_the_budget(scope, tuples, k):
    for shots, views in ((1, 1), (2, 3)):
        asked = {"scope": scope, "tuples": tuples, "k": k, "shots": shots, "views": views}
        request = replace(SMALL, images=10, **asked)
        plan = plan_focus(BODY, BODY_RIG, request)
        check(plan, request, BODY_RIG)
        assert plan.pictures == 10
        assert plan.converged
        worse = plan_focus(BODY, BODY_RIG, replace(request, method="closest"))
        assert plan.cost < worse.cost


def test_a_limit_that_is_none_changes_nothing_else():
    for method, shots in itertools.product(METHODS, (1, 2)):
        request = replace(SMALL, method=method, shots=shots, gap=0.02)
        plan = plan_focus(SCENE, RIG, request)
        for images in (6 * shots, 6 * shots + 1, 1000):
            limited = plan_focus(SCENE, RIG, replace(request, images=images))
            assert replace(limited, images=0).cameras == plan.cameras
            assert without_seconds(limited) == without_seconds(plan) | {"images": images}


def test_more_pictures_cost_less_and_are_bounded_lower():
    plans = [
        plan_focus(BODY, BODY_RIG, replace(SMALL, samples=600, images=images, bound="tight"))
        for images in (6, 12, 24, 36)
    ]
    costs, bounds = [plan.cost for plan in plans], [plan.lower_bound for plan in plans]
    assert costs == sorted(costs, reverse=True)
    assert bounds == sorted(bounds, reverse=True)
    assert all(plan.gap < 0.02 for plan in plans)


def test_optimal_converges_where_its_gap_is_reached():
    request = replace(SMALL, method="optimal", images=4)
    met = plan_focus(SCENE, RIG, replace(request, gap=0.3))
    missed = plan_focus(BODY, BODY_RIG, replace(request, gap=1e-9, images=12))
    assert met.converged
    assert met.gap <= 0.3
    assert not missed.converged
    assert missed.gap > 1e-9
    assert "not proven to be within the gap" in plan_text(missed)
    # Also where cameras take so few shots that the limit would be none for them.
    few = plan_focus(BODY, BODY_RIG, replace(request, gap=1e-12, shots=8, images=250))
    assert few.shots * len(BODY_RIG) < 250
    assert few.gap > 1e-12
    assert not few.converged


@pytest.mark.parametrize("method", ["k_view", "closest", "optimal"])
def test_plans_ended_early_keep_within_the_budget_and_are_made_again(method):
    request = replace(SMALL, method=method, samples=300, images=9, shots=2, bound="quick")
    steps = []
    whole = plan_focus(BODY, BODY_RIG, request, on_progress=lambda p: steps.append(p.stage) or True)
    assert {"pictures", "exchanges"} & set(steps)
    early = 0
    for stop in range(1, len(steps), max(len(steps) // 12, 1)):
        left = itertools.count(1)
        plan = plan_focus(
            BODY, BODY_RIG, request, on_progress=lambda _, left=left, stop=stop: next(left) < stop
        )
        check(plan, replace(request, samples=plan.samples), BODY_RIG)
        again = plan_focus(BODY, BODY_RIG, request, stop_log=plan.stop_log)
        assert without_seconds(again) == without_seconds(plan)
        early += not plan.converged
    assert early > 5
    for seconds in (0.01, 5.0, 40.0):
        timed = replace(request, time_budget=seconds)
        plan = plan_focus(BODY, BODY_RIG, timed, clock=Clock(0.05))
        check(plan, replace(request, samples=plan.samples), BODY_RIG)
        again = plan_focus(BODY, BODY_RIG, timed, stop_log=plan.stop_log)
        assert without_seconds(again) == without_seconds(plan)
    assert whole.pictures == 9


def test_warm_starts_from_and_to_other_budgets():
    plans = {
        images: plan_focus(BODY, BODY_RIG, replace(SMALL, shots=2, images=images))
        for images in (0, 8, 12)
    }
    for (before, earlier), images in itertools.product(plans.items(), (0, 6, 8, 12)):
        request = replace(SMALL, shots=2, images=images)
        plan = plan_focus(BODY, BODY_RIG, request, warm_start=earlier.warm_start)
        assert plan.converged
        if images:
            check(plan, request, BODY_RIG)
            assert plan.pictures == images
        else:
            assert all(len(camera.shots) == 2 for camera in plan.cameras)
        if before and before <= images:
            assert plan.cost <= earlier.cost + 1e-9
    # With the same budget it has nothing to choose.
    stages = set()
    plan_focus(
        BODY,
        BODY_RIG,
        replace(SMALL, shots=2, images=8),
        warm_start=plans[8].warm_start,
        on_progress=lambda progress: stages.add(progress.stage) or True,
    )
    assert "k_view" in stages
    assert "pictures" not in stages


def test_with_tolerances_limits_tables_and_resolutions():
    listed = Lens(focus_distances=(0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.3))
    cameras = Rig(tuple(replace(camera, lens=listed) for camera in BODY_RIG.cameras))
    table = Lens(table=LensTable("steps", True, (0.3, 1.0, 3.0), (0.0, 100.0, 180.0)))
    tabled = Rig(tuple(replace(camera, lens=table) for camera in BODY_RIG.cameras))
    for rig, changes in (
        (cameras, {}),
        (tabled, {}),
        (BODY_RIG, {"depth_tolerance": 0.003}),
        (BODY_RIG, {"max_mm_per_pixel": 0.6}),
        (BODY_RIG, {"samples": 0, "standard_error": 3.0}),
    ):
        request = replace(SMALL, images=10, **changes)
        plan = plan_focus(BODY, rig, request)
        check(plan, request, rig)
        if rig is cameras:
            taken = {shot.focus_distance for camera in plan.cameras for shot in camera.shots}
            assert taken <= set(listed.focus_distances)
        if rig is tabled:
            for camera in plan.cameras:
                assert camera.device_value is not None
        if "standard_error" in changes:
            assert plan.fresh_standard_error < 1.3 * request.standard_error


@pytest.mark.parametrize("worst", [False, True])
def test_one_budget_for_many_subjects(worst):
    subjects = tuple(Subject(Scene(body(name)), name=name) for name in ("arms_out", "arms_down"))
    request = replace(SMALL, images=12, worst=worst, bound="quick")
    plan = plan_focus(subjects, BODY_RIG, request)
    assert plan.pictures == 12
    assert len(plan.subjects) == 2
    focus = plan.focus_distances
    costs, _ = plan.problem.evaluate(focus)
    each = [costs[part].mean() * 1000 for part in plan.problem.subjects]
    assert [subject.cost for subject in plan.subjects] == pytest.approx(each)
    assert plan.cost == pytest.approx(max(each) if worst else sum(each) / 2)
    assert 0.85 * plan.cost < plan.lower_bound <= plan.cost


def test_each_preset_has_the_budget():
    subjects = tuple(Subject(Scene(body(name)), name=name) for name in ("arms_out", "arms_down"))
    presets = plan_presets(subjects, BODY_RIG, 2, replace(SMALL, method="em", images=10))
    for plan in presets.plans:
        assert plan.pictures == 10


def test_values_that_cannot_be_are_named():
    with pytest.raises(InputError, match="images: expected a whole number of at least 0, got -1"):
        PlanRequest(images=-1)
    with pytest.raises(InputError, match=r"images.*250000.*250001"):
        PlanRequest(images=250_001)
    with pytest.raises(InputError, match=r"images.*whole.*1\.5"):
        PlanRequest(images=1.5)


def test_a_camera_without_a_picture_rests_where_others_focus():
    plan = plan_focus(BODY, BODY_RIG, replace(SMALL, images=8))
    distances = [shot.focus_distance for camera in plan.cameras for shot in camera.shots]
    idle = [camera for camera in plan.cameras if not camera.shots]
    assert len(idle) == 28
    for camera in idle:
        assert camera.focus_distance == pytest.approx(np.median(distances))
        assert math.isfinite(camera.near_limit)
