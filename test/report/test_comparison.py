# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which plans a report compares, and what it says of each as a whole."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.core.planning.subject import PlannedSubject, requested
from focus_planner.core.progress import Progress
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.core.validation import InputError
from focus_planner.report.comparison import (
    ComparedPlan,
    check_methods,
    cost_rows,
    find_autofocus,
    other_inputs,
    own_worth,
    plans_to_compare,
    sharp_rows,
    usual_comparisons,
    worth_of,
)
from testing.problems import around, torus

TORUS = torus(0.4, 0.15)
SCENE = Scene(TORUS)
RIG = around(6, 1.0, lens=Lens(0.085, 40.0))
REQUEST = PlanRequest(samples=200, fresh_samples=300)


def subject_of(
    request: PlanRequest = REQUEST, scene: Scene = SCENE, rig: Rig = RIG
) -> PlannedSubject:
    return PlannedSubject(scene, rig, request, plan_focus(scene, rig, request))


def of(subject: PlannedSubject, plan: FocusPlan | None = None) -> ComparedPlan:
    return ComparedPlan("it", "it", plan or subject.plan, subject.rig)


SUBJECT = subject_of()


def clouded() -> Scene:
    samples = SCENE.sample(900, 3)
    return Scene(PointCloud(samples.points, samples.normals))


def important() -> Scene:
    return Scene(replace(TORUS, vertex_importance=1.0 * (TORUS.vertices[:, 2] > 0)))


# --- which plans -------------------------------------------------------------------------------


def test_the_usual_comparisons_show_the_gain() -> None:
    assert usual_comparisons("k_view") == ("closest", "average", "em")
    assert usual_comparisons("em") == ("closest", "average")
    assert usual_comparisons("closest") == ("k_view", "average", "em")
    for method in METHODS:
        assert method not in usual_comparisons(method)


def test_plans_are_made_for_the_same_request() -> None:
    asked: list[str] = []

    def on_progress(method: str) -> Any:
        def step(_: Progress) -> bool:
            asked.append(method)
            return True

        return step

    request = replace(REQUEST, shots=2, depth_tolerance=0.003, seed=4, bound="tight")
    subject = subject_of(request)
    plans = list(plans_to_compare(subject, None, on_progress))
    assert [each.plan.method for each in plans] == ["closest", "average", "em"]
    assert [each.title for each in plans] == ["closest (autofocus)", "average", "em"]
    assert list(dict.fromkeys(asked)) == ["closest", "average", "em"]
    for each in plans:
        plan = each.plan
        assert (plan.samples, plan.seed, plan.shots, plan.depth_tolerance) == (200, 4, 2, 0.003)
        same = plan_focus(SCENE, RIG, replace(request, method=plan.method))
        assert (plan.cameras, plan.fresh_cost) == (same.cameras, same.fresh_cost)


def test_plans_to_compare_with_have_all_the_time_they_need() -> None:
    subject = replace(SUBJECT, request=replace(REQUEST, time_budget=1e-9))
    (each,) = plans_to_compare(subject, ["em"])
    assert each.plan.converged
    assert each.plan.samples == 200
    assert each.plan.lower_bound is None


def test_the_plans_own_method_is_none_to_compare_with() -> None:
    with pytest.raises(InputError, match="--compare: expected methods other than the plan's own"):
        list(plans_to_compare(SUBJECT, ["closest", "k_view"], argument="--compare"))
    assert list(plans_to_compare(SUBJECT, [])) == []
    assert len(list(plans_to_compare(SUBJECT, ["em", "em"]))) == 1


def test_what_is_no_method_is_refused() -> None:
    check_methods("--compare", None)
    check_methods("--compare", METHODS)
    with pytest.raises(InputError, match=r"--compare: expected one of closest, .*, got 'best'"):
        check_methods("--compare", ["em", "best"])


# --- what they are worth -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_", "scene"),
    [
        (REQUEST, SCENE),
        (replace(REQUEST, shots=2, depth_tolerance=0.003), SCENE),
        (REQUEST, important()),
        (replace(REQUEST, samples=0), clouded()),
        (PlanRequest("em", 0, standard_error=6.0), SCENE),
    ],
    ids=["plain", "shots", "importance", "cloud", "standard error"],
)
def test_a_plan_is_worth_what_it_says(request_: PlanRequest, scene: Scene) -> None:
    subject = subject_of(request_, scene)
    plans = [of(subject), *plans_to_compare(subject)]
    for each, worth in zip(plans, worth_of(plans, subject), strict=True):
        assert own_worth(each.plan, worth) == worth
        assert worth.counted_area <= scene.area * (1 + 1e-9)
        # As far as a plan.json tells.
        again = replace(subject, request=requested(subject.plan, scene))
        (now,) = worth_of([of(subject)], again)
        assert other_inputs(subject.plan, RIG, now) is None


@pytest.mark.parametrize(
    ("scene", "rig"),
    [
        (Scene(torus(0.41, 0.15)), RIG),
        (Scene(Mesh(TORUS.vertices + [0.0, 0.0, 0.05], TORUS.triangles)), RIG),
        (important(), RIG),
        (SCENE, around(6, 1.0, lens=Lens(0.085, 20.0))),
        (SCENE, around(6, 1.1, lens=Lens(0.085, 40.0))),
    ],
    ids=["size", "place", "importance", "lens", "poses"],
)
def test_a_plan_of_other_inputs_is_told(scene: Scene, rig: Rig) -> None:
    subject = replace(SUBJECT, scene=scene, rig=rig)
    (now,) = worth_of([of(subject)], subject)
    note = other_inputs(SUBJECT.plan, rig, now)
    assert note is not None
    assert note.code == "other_inputs"
    assert f"is {SUBJECT.plan.fresh_cost:.1f}," in note.text
    assert f"is {now.cost.value:.1f}:" in note.text
    assert "lens tables or the importance" in note.text


def test_an_estimate_on_part_of_the_fresh_samples_is_not_held_against_a_plan() -> None:
    part = plan_focus(SCENE, RIG, replace(REQUEST, fresh_samples=120))
    (now,) = worth_of([of(SUBJECT)], SUBJECT)
    assert other_inputs(part, RIG, now) is not None
    cut = replace(part, notes=(Note("budget", "the time budget left room for less"),))
    assert other_inputs(cut, RIG, now) is None
    assert other_inputs(replace(cut, fresh_cost=cut.fresh_cost + 200), RIG, now) is not None


def test_all_plans_are_judged_on_the_fresh_samples_of_one_that_ran_out_of_time() -> None:
    calls = 0

    def clock() -> float:
        nonlocal calls
        calls += 1
        return 0.1 * calls

    request = replace(REQUEST, samples=4000, fresh_samples=4000, time_budget=2.0)
    plan = plan_focus(SCENE, RIG, request, clock=clock)
    assert plan.fresh_samples < 4000
    subject = PlannedSubject(SCENE, RIG, request, plan)
    own, same = worth_of([of(subject), of(subject)], subject)
    assert own == same == own_worth(plan, own)


def test_areas_by_number_of_sharp_views_are_those_of_all_that_is_seen() -> None:
    subject = subject_of(replace(REQUEST, shots=2), rig=around(6, 1.0, lens=Lens(0.085, 10.0)))
    (worth,) = worth_of([of(subject)], subject)
    fresh = subject.plan.fresh_problem
    focus = subject.plan.focus_distances
    cameras: list[set[int]] = [set() for _ in range(fresh.sample_count)]
    for p, picture, near, far in zip(
        *(fresh.sample_index, fresh.camera_index, fresh.focus_near, fresh.focus_far), strict=True
    ):
        if near <= focus[picture] <= far:
            cameras[p].add(int(picture) // 2)
    seen = np.unique(fresh.sample_index)
    expected = [
        sum(fresh.samples.areas[p] for p in seen if min(len(cameras[p]), 5) == views)
        for views in range(6)
    ]
    assert worth.view_areas == pytest.approx(expected)
    assert sum(worth.view_areas) == pytest.approx(worth.covered_area)
    assert min(expected[:3]) > 0


def test_a_plan_of_other_lens_tables_is_told() -> None:
    (now,) = worth_of([of(SUBJECT)], SUBJECT)
    table = LensTable("steps", True, (0.2, 5.0), (0, 20_000))
    tabled = Rig(
        tuple(replace(c, lens=replace(c.lens, table=table)) for c in RIG.cameras), RIG.frame_id
    )
    note = other_inputs(SUBJECT.plan, tabled, now)
    assert note is not None
    assert "lens tables" in note.text
    with_tables = plan_focus(SCENE, tabled, REQUEST)
    (now,) = worth_of([of(SUBJECT, with_tables)], replace(SUBJECT, rig=tabled, plan=with_tables))
    assert other_inputs(with_tables, RIG, now) is not None
    assert other_inputs(with_tables, tabled, own_worth(with_tables, now)) is None


def test_plans_for_other_lenses_are_judged_with_these() -> None:
    deep = around(6, 1.0, lens=Lens(0.085, 10.0))
    other = plan_focus(SCENE, deep, REQUEST)
    plans = [of(SUBJECT), ComparedPlan("deep", "the recorded plan", other, deep)]
    worths = worth_of(plans, SUBJECT)
    assert worths[1] == own_worth(other, worths[1])
    assert worths[1].cost.value < worths[0].cost.value


# --- rows --------------------------------------------------------------------------------------


def test_rows_are_sorted_and_relative_to_autofocus() -> None:
    plans = [replace(of(SUBJECT), title="this"), *plans_to_compare(SUBJECT)]
    worths = worth_of(plans, SUBJECT)
    rows = cost_rows(plans, worths, SCENE.area, foreign=False)
    named = {row.title: row for row in rows}
    assert set(named) == {"closest (autofocus)", "average", "em", "this", "lower bound"}
    assert rows[-1].title == "lower bound"
    assert rows[-1].cost == SUBJECT.plan.lower_bound
    assert (rows[-1].fresh_cost, rows[-1].change) == (None, None)
    fresh = [row.fresh_cost for row in rows[:-1]]
    assert fresh == sorted(fresh, key=lambda cost: -(cost or 0.0))
    this, autofocus = named["this"], named["closest (autofocus)"]
    assert (this.reported, autofocus.reported) == (True, False)
    assert (this.cost, this.fresh_cost) == (SUBJECT.plan.cost, SUBJECT.plan.fresh_cost)
    assert this.standard_error == SUBJECT.plan.fresh_standard_error
    assert this.in_focus_share == SUBJECT.plan.in_focus_area / SCENE.area
    assert autofocus.change is None
    assert autofocus.fresh_cost is not None
    assert this.change == SUBJECT.plan.fresh_cost / autofocus.fresh_cost - 1


def test_rows_tell_which_plans_are_on_other_samples() -> None:
    other = replace(SUBJECT.plan, seed=SUBJECT.plan.seed + 1)
    plans = [of(SUBJECT), ComparedPlan("other", "the recorded plan", other, RIG)]
    rows = cost_rows(plans, worth_of(plans, SUBJECT), SCENE.area, foreign=False)
    assert {row.title for row in rows if row.other_samples} == {"other"}


def test_plans_for_other_views_are_judged_by_the_same_measure_and_said_to_differ() -> None:
    subject = subject_of(replace(REQUEST, views=3, max_mm_per_pixel=6.0, bound="none"))
    once = plan_focus(SCENE, RIG, REQUEST)
    plans = [of(subject), ComparedPlan("once", "the recorded plan", once, RIG)]
    worths = worth_of(plans, subject)
    assert worths[0].cost.value == pytest.approx(subject.plan.fresh_cost)
    fresh = subject.plan.fresh_problem  # for three views
    assert worths[1].cost.value == pytest.approx(fresh.cost(once.focus_distances))
    assert worths[1].cost.value > once.fresh_cost + 50
    rows = cost_rows(plans, worths, SCENE.area, foreign=False)
    assert {row.title for row in rows if row.other_measure} == {"once"}


def test_rows_tell_what_is_sharp_in_how_many_views() -> None:
    plans = [of(SUBJECT), *plans_to_compare(SUBJECT, ["closest"])]
    worths = worth_of(plans, SUBJECT)
    this, autofocus = sharp_rows(plans, [own_worth(SUBJECT.plan, worths[0]), worths[1]], SCENE.area)
    assert (this.title, this.reported, autofocus.reported) == (plans[0].title, True, False)
    for row, plan in ((this, SUBJECT.plan), (autofocus, plans[1].plan)):
        assert row.resolution == plan.resolution
        for (views, share, error), told in zip(row.shares, plan.sharp_areas, strict=True):
            assert views == told.views
            assert share == pytest.approx(told.area / SCENE.area)
            assert error == pytest.approx(told.standard_error / SCENE.area)


def test_a_plan_that_does_not_tell_what_is_sharp_is_told_what_was_found() -> None:
    (found,) = worth_of([of(SUBJECT)], SUBJECT)
    older = replace(SUBJECT.plan, sharp_areas=(), resolution=None)
    assert own_worth(older, found).sharp_areas == found.sharp_areas != ()
    assert own_worth(older, found).resolution == found.resolution


def test_what_holds_elsewhere_is_not_in_the_rows() -> None:
    rows = cost_rows([of(SUBJECT)], worth_of([of(SUBJECT)], SUBJECT), SCENE.area, foreign=True)
    assert [(row.title, row.cost, row.change) for row in rows] == [("it", None, None)]


def test_autofocus_is_found_by_what_it_is_called() -> None:
    subject = subject_of(replace(REQUEST, method="closest"))
    recorded = ComparedPlan("closest, as recorded", "the recorded plan", subject.plan, RIG)
    made_anew = list(plans_to_compare(SUBJECT, ["average", "closest"]))
    assert find_autofocus([of(SUBJECT), recorded]) is None
    assert find_autofocus([of(SUBJECT), recorded, *made_anew]) == 3


def test_fresh_samples_to_show_are_as_many_as_asked_for() -> None:
    # Although a request without a number of samples chooses that of fresh ones too.
    subject = subject_of(PlanRequest("em", 0, standard_error=6.0))
    assert subject.plan.fresh_samples != 150
    assert subject.fresh_problem(150).sample_count == 150
    assert np.ptp(subject.fresh_problem(150).samples.areas) == 0
