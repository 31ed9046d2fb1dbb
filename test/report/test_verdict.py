# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is said of a plan: no more than was observed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.quality import Estimate
from focus_planner.core.planning.sharp_views import SharpArea
from focus_planner.core.rig.rig import Rig
from focus_planner.report.comparison import ComparedPlan, Worth
from focus_planner.report.verdict import verdict
from testing.problems import around

RIG = around(2, 1.0)
PLAN = FocusPlan(
    method="k_view",
    cost=300.0,
    lower_bound=298.5,
    converged=True,
    samples=4096,
    seed=0,
    depth_tolerance=0.0,
    fresh_cost=310.0,
    fresh_standard_error=3.5,
    fresh_samples=4096,
    surface_area=2.0,
    covered_area=1.94,
    in_focus_area=1.72,
    in_focus_standard_error=0.01,
    solve_seconds=0.1,
    total_seconds=0.2,
    notes=(),
    cameras=(),
)
SHARP = "of the surface is sharp in the picture that images it best"
BLURRED = "11 % is seen but blurred there, and 3 % is seen by no camera."


def of(called: str, plan: FocusPlan = PLAN, rig: Rig = RIG) -> ComparedPlan:
    return ComparedPlan(called, called, plan, rig)


def worth(
    sharp: float = 1.72, seen: float = 1.94, counted: float = 2.0, error: float = 0.01
) -> Worth:
    return Worth(Estimate(310.0, 3.5), Estimate(sharp, error), seen, counted)


WORTHS = worth(), worth(0.94)


def said(
    plan: FocusPlan = PLAN,
    worths: tuple[Worth, ...] = WORTHS,
    others: tuple[str, ...] = ("autofocus",),
    notes: tuple[Note, ...] = (),
    own: str = "k_view",
    *,
    foreign: bool = False,
) -> str:
    plans = [of(own, plan), *map(of, others)]
    return verdict(plans, worths, notes, 2.0, foreign=foreign)


def test_what_is_seen_too_coarsely_is_not_said_to_be_unseen() -> None:
    assert "3 % is seen by no camera." in said()
    limited = replace(PLAN, max_mm_per_pixel=0.5)
    assert "3 % is seen by no camera finely enough." in said(limited)
    assert "3 % is seen by no camera finely enough, and" in said(
        limited, (worth(1.94), worth(0.94))
    )


def test_of_a_plan_for_several_views_it_is_said_how_much_is_sharp_in_as_many() -> None:
    areas = tuple(SharpArea(views, 2.0 / (1 + views), 0.01) for views in (1, 2, 3, 5))
    worths = replace(WORTHS[0], sharp_areas=areas), WORTHS[1]
    assert "views or more" not in said(worths=worths)
    for views, told in (
        (2, "33 % is sharp in 2"),
        (3, "25 % is sharp in 3"),
        (4, "25 % is sharp in 3"),
    ):
        text = said(replace(PLAN, views=views), worths)
        assert f"autofocus holds 47 %. {told} views or more. {BLURRED}" in text
    assert "views or more" not in said(replace(PLAN, views=3))


def test_the_owner_reads_what_is_gained_left_out_and_left_to_gain() -> None:
    assert said() == (
        f"With this plan 86 % {SHARP}; autofocus holds 47 %. {BLURRED} No plan for its samples can"
        " cost more than 0.5 % less."
    )


def test_what_it_stands_beside_is_named_too() -> None:
    text = said(
        worths=(worth(), worth(1.6), worth(0.94)), others=("the recorded plan", "autofocus")
    )
    assert "; the recorded plan holds 80 % and autofocus holds 47 %." in text
    text = said(worths=(worth(), worth(0.94), worth(1.0)), others=("autofocus", "average"))
    assert "; autofocus holds 47 %. 11 %" in text


def test_alone_it_is_compared_with_nothing() -> None:
    assert said(worths=(worth(),), others=()).startswith(f"With this plan 86 % {SHARP}. 11 %")


def test_autofocus_itself_is_called_by_its_name() -> None:
    text = said(worths=(worth(0.94), worth()), others=("k_view",), own="autofocus")
    assert text.startswith(f"With autofocus 47 % {SHARP}; k_view holds 86 %.")


def test_a_coarse_estimate_tells_its_error() -> None:
    assert said(worths=(worth(error=0.045), worth())).startswith(
        f"With this plan 86 % (± 2) {SHARP}"
    )


@pytest.mark.parametrize(
    ("bound", "sentence"),
    [
        (None, None),
        (300.0, "No plan for its samples costs less."),
        (299.999, "No plan for its samples can cost more than 0.01 % less."),
        (298.03, "No plan for its samples can cost more than 0.66 % less."),
        (264.0, "No plan for its samples can cost more than 12 % less."),
        (0.0, None),
    ],
)
def test_a_bound_is_rounded_to_the_safe_side(bound: float | None, sentence: str | None) -> None:
    text = said(replace(PLAN, lower_bound=bound))
    assert ("No plan" in text) == (sentence is not None)
    assert (sentence or "") in text


@pytest.mark.parametrize(
    ("method", "sentence"),
    [
        ("em", "Its search was ended early: given more time, it may find a better plan."),
        ("optimal", "It could not be proven to be as close to the best as was asked for."),
    ],
)
def test_a_plan_that_ended_early_says_so(method: str, sentence: str) -> None:
    assert sentence in said(replace(PLAN, method=method, converged=False))
    assert sentence not in said(replace(PLAN, method=method))


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (worth(2.0, 2.0), "None of it was found blurred or unseen."),
        (worth(1.72, 2.0), "14 % is seen but blurred there, and none was found unseen."),
        (worth(1.72, 1.72), "14 % is seen by no camera, and none was found seen but blurred."),
        (
            worth(1.0, 1.2, 1.5),
            (
                "10 % is seen but blurred there, and 15 % is seen by no camera; 25 % has no"
                " importance and was not planned for."
            ),
        ),
        (worth(1.72, 1.9999), "14 % is seen but blurred there, and 0.005 % is seen by no camera."),
    ],
)
def test_what_is_left_out_and_why(values: Worth, sentence: str) -> None:
    assert f" {sentence} " in said(worths=(values, worth()))


def test_suspicious_notes_are_referred_to() -> None:
    harmless = (Note("importance", ""), Note("budget", ""), Note("a_new_one", ""))
    assert "notes" not in said(notes=harmless)
    notes = (Note("default_lens", ""), Note("default_image", ""), Note("up_axis", ""), *harmless)
    assert said(notes=notes).endswith(
        " Read the notes first: the surface and the cameras probably do not fit each other; lenses"
        " or images are assumed."
    )


def test_on_other_inputs_nothing_is_said_of_bounds() -> None:
    text = said(replace(PLAN, converged=False), notes=(Note("other_inputs", ""),), foreign=True)
    assert text == (
        "With this plan 86 % of the surface is sharp here in the picture that images it best;"
        f" autofocus holds 47 %. {BLURRED} Read the notes first: the surface or the rig is probably"
        " not the plan's."
    )


def test_what_is_sharp_with_depth_to_spare_says_so() -> None:
    text = said(replace(PLAN, depth_tolerance=0.012))
    assert f"With this plan 86 % {SHARP}, with 12 mm of depth to spare; autofocus" in text
    assert "11 % is seen but blurred there, or could be, and 3 %" in text


def test_the_best_plan_for_fewer_samples_is_not_said_to_lack_proof() -> None:
    best = replace(PLAN, method="optimal", converged=False, lower_bound=PLAN.cost)
    text = said(best)
    assert "No plan for its samples costs less." in text
    assert "There was no time for all the samples that were asked for." in text
    assert "proven" not in text
