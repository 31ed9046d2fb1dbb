# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import InputError, Mesh, PlanRequest, Scene, Subject, plan_focus
from focus_planner.core.planning.formulation import formulate_problem, subsample
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.planning.request import MAX_SUBJECTS, METHODS
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.problem.joined import join_problems, separated
from testing import reference
from testing.clock import Clock
from testing.plans import RIG, SCENE, without_seconds
from testing.problems import looking_at, plane, sphere

REQUEST = PlanRequest(samples=300, fresh_samples=300, bound="tight")
SMALL = Scene(sphere(0.14))
BOTH = (Subject(SCENE, "large"), Subject(SMALL, "small"))


def parts(*scenes, **changes):
    return [formulate_problem(scene, RIG, replace(REQUEST, **changes)) for scene in scenes]


def every_choice(of_each):
    """Focus distances for every choice of cells of all cameras."""
    table = reference.table(join_problems(of_each, [1] * len(of_each)))
    trials = [reference.camera_candidates(table, c) or [1.0] for c in range(table.cameras)]
    return map(np.array, itertools.product(*trials))


# --- the problem ---------------------------------------------------------------------------------


def test_a_joined_problem_costs_the_weighted_mean_of_its_parts():
    of_each = parts(SCENE, SMALL)
    joined = join_problems(of_each, [1, 3])
    focus = np.linspace(0.3, 0.6, len(RIG))
    assert joined.cost(focus) == pytest.approx(
        0.25 * of_each[0].cost(focus) + 0.75 * of_each[1].cost(focus), rel=1e-12
    )


def test_a_joined_problem_has_the_pairs_of_its_parts():
    of_each = parts(SCENE, SMALL, shots=2, views=2)
    joined = join_problems(of_each, [1, 1])
    assert (joined.shots, joined.views) == (2, 2)
    assert joined.subject_offsets == (0, 300, 600)
    assert np.array_equal(
        np.repeat(np.arange(600), np.diff(joined.sample_offsets)), joined.sample_index
    )
    for part, again in zip(of_each, separated(joined), strict=True):
        for name in (
            "camera_index",
            "sample_index",
            "depth",
            "base_cost",
            "focus_near",
            "focus_far",
        ):
            assert np.array_equal(getattr(part, name), getattr(again, name))


def test_a_subsample_keeps_what_each_subject_counts():
    joined = join_problems(parts(SCENE, SMALL), [1, 4])
    few = subsample(joined, 100, 0)
    assert [part.stop - part.start for part in few.subjects] == [50, 50]
    weights = [few.samples.weights[part].sum() for part in few.subjects]
    assert weights == pytest.approx([0.2, 0.8])


def test_errors_of_several_subjects_are_those_of_each():
    of_each = parts(SCENE, SMALL)
    focus = np.full(len(RIG), 0.5)
    each = [estimate_quality(part, focus).cost for part in of_each]
    both = estimate_quality(join_problems(of_each, [1, 3]), focus).cost
    assert both.value == pytest.approx(0.25 * each[0].value + 0.75 * each[1].value)
    assert both.standard_error == pytest.approx(
        math.hypot(0.25 * each[0].standard_error, 0.75 * each[1].standard_error)
    )


# --- plans ---------------------------------------------------------------------------------------


def test_one_scene_is_planned_for_as_ever_however_it_is_given():
    alone = plan_focus(SCENE, RIG, REQUEST)
    for given in ([SCENE], Subject(SCENE, "it", 7.0), [Subject(SCENE)]):
        assert without_seconds(plan_focus(given, RIG, REQUEST)) == without_seconds(alone)
    assert alone.subjects == ()
    assert alone.worst is None


@pytest.mark.parametrize("method", METHODS)
def test_a_plan_for_several_is_evaluated_on_each(method):
    plan = plan_focus(BOTH, RIG, replace(REQUEST, method=method))
    assert [each.surface for each in plan.subjects] == ["large", "small"]
    for each, part in zip(plan.subjects, parts(SCENE, SMALL), strict=True):
        assert each.cost == pytest.approx(part.cost(plan.focus_distances), rel=1e-9)
    assert plan.cost == pytest.approx(np.mean([each.cost for each in plan.subjects]))
    assert plan.lower_bound <= plan.cost + 1e-9


def test_shots_and_views_are_those_of_every_subject():
    request = replace(REQUEST, shots=2, views=2)
    plan = plan_focus(BOTH, RIG, request)
    for each, part in zip(plan.subjects, parts(SCENE, SMALL, shots=2, views=2), strict=True):
        assert each.cost == pytest.approx(part.cost(plan.focus_distances), rel=1e-9)
    assert plan.lower_bound is None or plan.lower_bound <= plan.cost


def test_a_warm_start_never_costs_more():
    cold = plan_focus(BOTH, RIG, REQUEST)
    warm = plan_focus(BOTH, RIG, REQUEST, warm_start=cold.warm_start)
    assert warm.cost <= cold.cost + 1e-9


def test_what_a_subject_has_in_focus_is_what_a_fresh_estimate_tells():
    plan = plan_focus(BOTH, RIG, REQUEST)
    for subject, each in zip(BOTH, plan.subjects, strict=True):
        fresh = formulate_problem(subject.scene, RIG, REQUEST, fresh=True)
        told = estimate_quality(fresh, plan.focus_distances)
        assert each.fresh_cost == pytest.approx(told.cost.value)
        assert each.in_focus_area == pytest.approx(told.in_focus_area.value)
        assert each.in_focus_standard_error == pytest.approx(told.in_focus_area.standard_error)
        assert each.covered_area == pytest.approx(told.covered_area.value)
        assert each.surface_area == subject.scene.area
    means = [
        np.mean([getattr(each, name) for each in plan.subjects])
        for name in ("fresh_cost", "surface_area", "covered_area", "in_focus_area")
    ]
    assert [
        plan.fresh_cost,
        plan.surface_area,
        plan.covered_area,
        plan.in_focus_area,
    ] == pytest.approx(means)


def test_a_plan_for_several_is_the_best_for_their_mean():
    two_cameras = replace(RIG, cameras=RIG.cameras[:2], grid=None)
    request = replace(REQUEST, samples=20, method="optimal", gap=0.0)
    plan = plan_focus(BOTH, two_cameras, request)
    of_each = [formulate_problem(each.scene, two_cameras, request) for each in BOTH]
    best = min(np.mean([part.cost(focus) for part in of_each]) for focus in every_choice(of_each))
    assert plan.cost == pytest.approx(best, rel=1e-9)


def test_weights_decide_whom_a_plan_serves():
    for_large = plan_focus((Subject(SCENE, "a", 99.0), Subject(SMALL, "b")), RIG, REQUEST)
    for_small = plan_focus((Subject(SCENE, "a"), Subject(SMALL, "b", 99.0)), RIG, REQUEST)
    assert for_large.subjects[0].cost < for_small.subjects[0].cost
    assert for_large.subjects[1].cost > for_small.subjects[1].cost


def test_subjects_do_not_hide_each_other():
    # One stands in front of the other as the camera sees them.
    rig = replace(RIG, cameras=(looking_at("a", (0, 0, -1), (0, 0, 0), up=(1, 0, 0)),), grid=None)
    near, far = Scene(plane(0.2, 0.2, 0.0)), Scene(plane(0.2, 0.2, 0.5))
    plan = plan_focus([near, far], rig, REQUEST)
    alone = plan_focus(far, rig, REQUEST)
    assert plan.subjects[1].covered_area == pytest.approx(alone.covered_area)
    assert plan.subjects[1].covered_area > 0


def test_the_worst_is_the_one_of_the_highest_fresh_cost():
    plan = plan_focus(BOTH, RIG, REQUEST)
    assert plan.worst.fresh_cost == max(each.fresh_cost for each in plan.subjects)
    assert plan.worst.surface in str(plan)
    assert plan.worst.surface in plan.summary()


def test_a_time_budget_leaves_something_of_every_subject():
    request = replace(REQUEST, samples=200_000, fresh_samples=200_000, time_budget=0.5)
    plan = plan_focus(BOTH, RIG, request, clock=Clock(0.05))
    assert all(0 < each.samples < 200_000 for each in plan.subjects)
    note = next(note for note in plan.notes if note.code == "budget")
    assert "2 times 200000" in note.text
    again = plan_focus(BOTH, RIG, request, stop_log=plan.stop_log)
    assert without_seconds(again) == without_seconds(plan)


# --- the worst -----------------------------------------------------------------------------------


def test_the_worst_subject_costs_less_if_it_is_planned_for():
    mean = plan_focus(BOTH, RIG, REQUEST)
    worst = plan_focus(BOTH, RIG, replace(REQUEST, worst=True))
    assert max(each.cost for each in worst.subjects) < max(each.cost for each in mean.subjects)
    assert worst.cost == max(each.cost for each in worst.subjects)
    assert worst.fresh_cost == worst.worst.fresh_cost
    assert sum(each.multiplier for each in worst.subjects) == pytest.approx(1)


@pytest.mark.parametrize("method", METHODS)
def test_no_plan_has_a_worst_subject_that_costs_less_than_the_bound(method):
    two_cameras = replace(RIG, cameras=RIG.cameras[:2], grid=None)
    request = replace(REQUEST, samples=20, method=method, worst=True)
    plan = plan_focus(BOTH, two_cameras, request)
    of_each = [formulate_problem(each.scene, two_cameras, request) for each in BOTH]
    best = min(max(part.cost(focus) for part in of_each) for focus in every_choice(of_each))
    assert plan.lower_bound <= best + 1e-9
    assert best <= plan.cost + 1e-9
    if method == "optimal":
        assert plan.converged == (plan.gap <= request.gap)


def test_a_plan_for_the_worst_can_be_stopped_and_made_again():
    request = replace(REQUEST, worst=True, time_budget=0.6)
    plan = plan_focus(BOTH, RIG, request, clock=Clock(0.01))
    assert plan.stop_log.stopped
    again = plan_focus(BOTH, RIG, request, stop_log=plan.stop_log)
    assert without_seconds(again) == without_seconds(plan)


# --- what is refused, and noted ------------------------------------------------------------------


def test_errors_name_the_subject():
    elsewhere = Scene(sphere(200.0))
    with pytest.raises(InputError, match=r"^away\.ply: surface and camera poses: expected"):
        plan_focus([Subject(SCENE, "here.ply"), Subject(elsewhere, "away.ply")], RIG, REQUEST)


def test_notes_name_the_subject():
    importance = np.linspace(0, 1, len(SCENE.surface.vertices))
    mesh = SCENE.surface
    weighted = Scene(Mesh(mesh.vertices, mesh.triangles, vertex_importance=importance))
    plan = plan_focus([Subject(SMALL, "a"), Subject(weighted, "b")], RIG, REQUEST)
    assert [note.text[:2] for note in plan.notes if note.code == "importance"] == ["b:"]


@pytest.mark.parametrize(
    ("subjects", "message"),
    [
        ([], f"subjects: expected 1 to {MAX_SUBJECTS}, got 0"),
        ([SCENE] * (MAX_SUBJECTS + 1), f"expected 1 to {MAX_SUBJECTS}, got {MAX_SUBJECTS + 1}"),
        ([Subject(SCENE, "a"), Subject(SMALL, "a")], "a name of its own for each, got 'a' twice"),
    ],
)
def test_subjects_that_cannot_be_told_apart_or_counted_are_refused(subjects, message):
    with pytest.raises(InputError, match=message):
        plan_focus(subjects, RIG, REQUEST)


@pytest.mark.parametrize("weight", [0.0, -1.0, math.nan, math.inf])
def test_a_subject_counts_for_something(weight):
    with pytest.raises(InputError, match="weight of a subject"):
        Subject(SCENE, "a", weight)


def test_limits_count_all_subjects():
    limits = ResourceLimits(max_problem_size=300 * len(RIG) * 2 - 1)
    with pytest.raises(InputError, match=rf"at most 299 for {len(RIG)} cameras and each of 2 subj"):
        plan_focus(BOTH, RIG, REQUEST, limits=limits)
    with pytest.raises(InputError, match=r"and each of 2 subjects .*max_memory"):
        plan_focus(BOTH, RIG, REQUEST, limits=ResourceLimits(max_memory=1e5))
