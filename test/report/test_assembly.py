# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""All that a report says, put together."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timezone
from importlib.metadata import version

import numpy as np
import pytest

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan import CameraStatus, FocusPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.resolution import metres_per_pixel
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from focus_planner.io.lens_sheet.content import lens_sheet
from focus_planner.report import assembly
from focus_planner.report.assembly import Provenance, assemble
from focus_planner.report.comparison import ComparedPlan, plans_to_compare
from focus_planner.report.content import Step
from focus_planner.report.pictures import Pictures, longest_side
from testing.plans import away
from testing.problems import around, torus

SCENE = Scene(torus(0.4, 0.15))
RIG = Rig((*around(6, 1.0, lens=Lens(0.085, 40.0)).cameras, away()))
REQUEST = PlanRequest(samples=200, fresh_samples=300, shots=2)
PLAN = plan_focus(SCENE, RIG, REQUEST)
SUBJECT = PlannedSubject(SCENE, RIG, REQUEST, PLAN)
COMPARED = tuple(plans_to_compare(SUBJECT, ["closest"]))
AT = datetime(2026, 11, 27, 7, 5, tzinfo=timezone.utc)


def spread(points: FloatArray) -> float:
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1)).mean())


def test_samples_are_fewer_where_many_cameras_see_each(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(assembly, "SAMPLES", 400)
    monkeypatch.setattr(assembly, "_TRIED", 100)
    monkeypatch.setattr(assembly, "_LEAST", 150)
    assert len(assemble(SUBJECT).surface.points) == 400
    monkeypatch.setattr(assembly, "_PAIRS", 300)
    surface = assemble(SUBJECT).surface
    assert 150 <= len(surface.points) < 400
    assert len(surface.pair_camera) < 450
    monkeypatch.setattr(assembly, "_PAIRS", 1)
    assert len(assemble(SUBJECT).surface.points) == 150


def test_everything_is_there_and_of_one_size() -> None:
    steps = (Step("em", 1, 300.0, None, 0.1),)
    given = Provenance(
        *("torus.ply", "rig.yaml", AT, "a run", "f_number=8", steps),
        parameters=(("method", "k_view"),),
        software=(("numpy", "2.0"),),
    )
    told: list[str] = []
    content = assemble(
        SUBJECT, COMPARED, given, samples=400, made=AT.replace(hour=9), tell=told.append
    )
    assert content.title == "Focus plan for torus.ply"
    assert content.rig is RIG
    assert content.notes == PLAN.notes
    assert content.steps == steps
    assert content.sheet == lens_sheet(PLAN, RIG, surface="torus.ply", rig_file="rig.yaml", made=AT)
    assert content.parameters == (("method", "k_view"),)
    made_with = f"focus_planner {version('focus_planner')}"
    assert content.software == (("numpy", "2.0"), ("report made with", made_with))
    facts = dict(content.facts)
    assert set(content.sheet.facts[1:]) <= set(content.facts)
    assert facts["surface"] == f"torus.ply, 576 triangles, {SCENE.area:.3g} m²"
    assert facts["planned"] == "2026-11-27 07:05"
    assert facts["report made"] == "2026-11-27 09:05"
    assert facts["recorded run"] == "a run"
    assert facts["changed"] == "f_number=8"
    assert facts["shown"].startswith("400 samples that no plan was made on, seed 0, ")
    assert f"{PLAN.cost:.1f} on these" in facts["cost"]
    assert len(content.surface.points) == 400
    assert len(content.histograms) == len(RIG)
    assert [each.title for each in content.plans] == ["k_view", "closest (autofocus)"]
    for each in content.plans:
        shapes = [len(a) for a in (each.cost, each.camera, each.in_focus, each.sharp_views)]
        assert shapes == [400] * 4
        assert len(each.held_area) == len(RIG)
        assert len(each.pair_in_focus) == len(content.surface.pair_camera)
        assert each.pictures == ()
        assert each.shares is not None
        areas = (each.plan.in_focus_area, each.plan.covered_area - each.plan.in_focus_area)
        assert (each.shares.sharp, each.shares.blurred) == pytest.approx(
            tuple(area / SCENE.area for area in areas)
        )
        assert each.shares.sharp + each.shares.blurred + each.shares.unseen == pytest.approx(1)
    assert content.plans[0].plan is PLAN
    assert content.plans[0].plan.cameras[-1].status is CameraStatus.SEES_NOTHING
    assert told == [
        "comparing plans on fresh samples",
        "finding what the cameras see of 400 samples",
    ]


def test_samples_are_the_same_for_all_and_none_was_planned_on() -> None:
    content = assemble(SUBJECT, COMPARED, samples=200)
    planned = PLAN.problem.samples.points
    assert not {tuple(p) for p in planned} & {tuple(p) for p in content.surface.points}
    assert spread(content.surface.points) == pytest.approx(spread(planned), rel=0.1)
    again = assemble(SUBJECT, samples=200)
    np.testing.assert_array_equal(content.surface.points, again.surface.points)
    np.testing.assert_array_equal(content.plans[0].cost, again.plans[0].cost)


def test_a_little_known_plan_has_a_report_too() -> None:
    content = assemble(SUBJECT, samples=100)
    assert content.title == "Focus plan for 7 cameras"
    assert content.steps == ()
    assert content.software[0][0] == "report made with"
    assert [row.title for row in content.costs] == ["k_view", "lower bound"]


@pytest.mark.parametrize("samples", [0, 99, 262_145, 1e3])
def test_too_few_or_too_many_samples_are_refused(samples: int) -> None:
    with pytest.raises(InputError, match="samples: expected a whole number of at least 100"):
        assemble(SUBJECT, samples=samples)


def test_the_plan_of_another_rig_is_refused() -> None:
    with pytest.raises(InputError, match="rig: expected the cameras that the plan is for"):
        assemble(replace(SUBJECT, rig=around(6, 1.0)), samples=100)


def test_a_plan_that_cannot_be_for_these_inputs_is_doubted() -> None:
    other = replace(SUBJECT, scene=Scene(torus(0.42, 0.15)))
    content = assemble(other, COMPARED, Provenance(certain=False), samples=100)
    assert content.notes[0].code == "other_inputs"
    assert "probably not the plan's" in content.verdict
    assert "No plan" not in content.verdict
    assert not {"fresh cost", "in focus", "cost"} & set(dict(content.facts))
    assert "lower bound" not in [row.title for row in content.costs]
    assert {row.cost for row in content.costs if row.reported} == {None}
    certain = assemble(SUBJECT, COMPARED, Provenance(certain=False), samples=100)
    assert certain.notes == PLAN.notes
    assert certain.verdict == assemble(SUBJECT, COMPARED, samples=100).verdict


def test_a_recorded_plan_with_other_lenses_stands_beside_it() -> None:
    cameras = tuple(replace(camera, lens=Lens(0.085, 15.0)) for camera in RIG.cameras)
    rig = Rig(cameras)
    recorded = plan_focus(SCENE, rig, replace(REQUEST, shots=1))
    beside = ComparedPlan("k_view, as recorded", "the recorded plan", recorded, rig)
    content = assemble(SUBJECT, (beside, *COMPARED), samples=200)
    assert "; the recorded plan holds " in content.verdict
    assert " and autofocus holds " in content.verdict
    with_these, with_those = content.plans[2], content.plans[1]
    assert with_those.in_focus.sum() > with_these.in_focus.sum()
    assert with_those.lenses == tuple(camera.lens for camera in rig.cameras)
    assert with_these.lenses == content.plans[0].lenses == ()
    assert all(each.sees_the_same for each in content.plans)


def test_a_recorded_plan_of_other_pictures_is_not_taken_to_see_the_same() -> None:
    rig = Rig(
        tuple(
            replace(each, intrinsics=replace(each.intrinsics, width=each.intrinsics.width // 3))
            for each in RIG.cameras
        )
    )
    recorded = plan_focus(SCENE, rig, replace(REQUEST, shots=1))
    beside = ComparedPlan("k_view, as recorded", "the recorded plan", recorded, rig)
    plans = assemble(SUBJECT, (beside,), samples=200).plans
    assert [each.sees_the_same for each in plans] == [True, False]


def test_what_other_plans_had_more_time_for_is_told() -> None:
    assert "other plans" not in dict(assemble(SUBJECT, COMPARED, samples=100).facts)
    hurried = replace(SUBJECT, request=replace(REQUEST, time_budget=60.0))
    told = dict(assemble(hurried, COMPARED, samples=100).facts)["other plans"]
    assert told == "had all the time they needed; this one had 60 s"
    assert "other plans" not in dict(assemble(hurried, samples=100).facts)


def test_a_plan_is_told_as_it_tells_itself_where_rays_fell_otherwise() -> None:
    elsewhere = replace(PLAN, fresh_cost=PLAN.fresh_cost + 0.03, in_focus_area=0.4)
    content = assemble(replace(SUBJECT, plan=elsewhere), COMPARED, samples=100)
    (row,) = (row for row in content.costs if row.reported)
    assert row.fresh_cost == elsewhere.fresh_cost
    assert content.plans[0].shares is not None
    assert content.plans[0].shares.sharp == 0.4 / SCENE.area


def test_a_bound_is_told_rounded_down() -> None:
    subject = replace(SUBJECT, plan=replace(PLAN, cost=300.3, lower_bound=299.99))
    fact = dict(assemble(subject, samples=100).facts)["cost"]
    assert fact == "300.3 on these, and no plan costs less than 299.9"
    best = replace(SUBJECT, plan=replace(PLAN, cost=300.3, lower_bound=300.3))
    assert dict(assemble(best, samples=100).facts)["cost"].endswith("no plan costs less")


def test_pictures_are_made_of_the_first_two_plans() -> None:
    asked: list[tuple[str, int, int]] = []

    def pictures(subject: PlannedSubject, plan: FocusPlan, side: int) -> list[bytes]:
        asked.append((plan.method, len(subject.rig), side))
        return [f"{plan.method} {c}".encode() for c in range(len(subject.rig))]

    compared = (*COMPARED, *plans_to_compare(SUBJECT, ["average"]))
    content = assemble(SUBJECT, compared, samples=100, pictures=Pictures(pictures, "a circle"))
    assert dict(content.facts)["pictures"] == "a circle"
    side = longest_side(len(RIG))
    assert asked == [("k_view", 7, side), ("closest", 7, side)]
    assert [len(each.pictures) for each in content.plans] == [7, 7, 0]
    assert content.plans[1].pictures[2] == b"closest 2"


def test_pictures_are_as_large_as_there_is_room_for() -> None:
    sides = [longest_side(cameras) for cameras in (1, 20, 168, 1000, 100_000)]
    assert sides == sorted(sides, reverse=True)
    assert sides[0] == 384
    assert 180 <= sides[2] <= 320
    assert sides[-1] == 64


def test_a_report_keeps_to_the_plans_views_and_its_limit_of_resolution() -> None:
    request = replace(REQUEST, views=3, max_mm_per_pixel=3.4, bound="none")
    plan = plan_focus(SCENE, RIG, request)
    subject = PlannedSubject(SCENE, RIG, request, plan)
    content = assemble(subject, tuple(plans_to_compare(subject, ["closest"])), samples=300)
    surface = content.surface
    assert (surface.max_mm_per_pixel, surface.views) == (3.4, 3)
    samples = np.repeat(np.arange(300), np.diff(surface.pair_offsets))
    lengths = metres_per_pixel(
        surface.points[samples], surface.normals[samples], RIG, surface.pair_camera
    )
    assert 3.2 < 1000 * lengths.max() <= 3.4
    assert [row.title for row in content.sharp] == ["k_view", "closest (autofocus)"]
    this, _ = content.sharp
    assert this.resolution == plan.resolution
    assert [share for _, share, _ in this.shares] == [
        each.area / SCENE.area for each in plan.sharp_areas
    ]
    for row in content.costs:
        assert not row.other_measure
    facts = dict(content.facts)
    assert facts["sharp"].endswith(" views or more, of the surface")
    assert facts["fresh cost"].startswith(f"{plan.fresh_cost:.1f} ± ")
    assert " of 1000 for 3 views " in facts["fresh cost"]
    assert " for 3 views, on 200 samples" in facts["method"]
    assert " is sharp in 3 views or more." in content.verdict
    assert "seen by no camera finely enough" in content.verdict
    # A cost is the mean of the three best views, of the report's own samples as well.
    held = content.plans[0].pair_in_focus
    pairs = surface.pair_cost + np.where(held, 0.0, surface.focus_weight)
    for p in range(0, 300, 23):
        least = sorted([*pairs[surface.pair_offsets[p] : surface.pair_offsets[p + 1]], 1, 1, 1])
        assert content.plans[0].cost[p] == pytest.approx(np.mean(least[:3]))
