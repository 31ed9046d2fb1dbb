# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far a plan is, in figures and in words."""

from __future__ import annotations

import math

import pytest

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.core.progress import (
    STAGES,
    Progress,
    Standing,
    Tracker,
    percent,
    roughly,
    time_spent,
)
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.solvers.k_view import STAGES as TUPLES
from focus_planner.core.surface.scene import Scene
from testing.clock import Clock
from testing.problems import box

SCENE = Scene(box((0.3, 0.3, 0.3)))
RIG = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)


def steps_of(request: PlanRequest) -> list[Progress]:
    steps: list[Progress] = []
    plan_focus(SCENE, RIG, request, on_progress=lambda step: steps.append(step) or True)
    return steps


@pytest.mark.parametrize("method", METHODS)
def test_every_stage_has_words(method):
    stages = {step.stage for step in steps_of(PlanRequest(method, 2000, k=3, bound="tight"))}
    assert stages <= STAGES.keys()
    assert {*TUPLES.values(), "branching"} <= STAGES.keys()


def test_stages_with_a_known_end_tell_their_share():
    steps = steps_of(PlanRequest("em", 2000, bound="quick", fresh_samples=2000))
    for stage in ("fresh", "visibility", "prices"):
        shares = [step.share for step in steps if step.stage == stage]
        assert shares
        assert shares == sorted(shares)
        assert shares[0] > 0
        assert shares[-1] <= 1
    assert {step.share for step in steps if step.stage in {"cells", "solving", "em"}} == {None}


def test_steps_do_not_differ_by_their_share():
    assert Progress("fresh", 1, 2.0, share=0.5, expected=3.0) == Progress("fresh", 1, 2.0)


def test_the_best_so_far_counts_and_time_goes_on():
    clock = Clock()
    tracker = Tracker(60.0, clock)
    clock.now += 2.0
    first = tracker.note(Progress("em", 3, 9.0))
    assert (first.stage, first.iteration, first.cost) == ("em", 3, 9.0)
    assert math.isnan(first.lower_bound)
    assert (first.elapsed, first.time_budget) == (2.0, 60.0)
    tracker.note(Progress("prices", 1, 8.0, 5.0, 0.25))
    clock.now += 1.5
    now = tracker.note(Progress("prices", 2, 8.5, 4.0))
    assert (now.cost, now.lower_bound, now.gap) == (8.0, 5.0, 3 / 8)
    clock.now += 1.0
    assert tracker.now().elapsed == 4.5


def test_steps_are_counted_by_stage():
    told = list(map(Tracker().note, steps_of(PlanRequest("em", 2000, fresh_samples=2000))))
    for stage in ("fresh", "visibility", "cells", "em"):
        numbers = [each.iteration for each in told if each.stage == stage]
        assert numbers == list(range(1, len(numbers) + 1))


@pytest.mark.parametrize(
    ("cost", "bound", "gap"),
    [(8.0, 6.0, 0.25), (8.0, 8.1, 0.0), (0.0, 0.0, 0.0)],
)
def test_the_gap(cost, bound, gap):
    assert Standing("em", cost=cost, lower_bound=bound).gap == gap


@pytest.mark.parametrize(
    ("cost", "bound"), [(math.nan, 3.0), (3.0, math.nan), (0.0, math.nan), (8.0, -math.inf)]
)
def test_there_is_no_gap_without_both(cost, bound):
    assert math.isnan(Standing("em", cost=cost, lower_bound=bound).gap)


@pytest.mark.parametrize(
    ("standing", "words"),
    [
        (Standing("visibility", 7, 0.459, elapsed=3.21), "casting rays to plan on, 45%, 3.2 s"),
        (
            Standing("k_view", 120, None, 231.9, 231.2, 12.34, 60.0),
            "searching in pairs, step 120, cost 231.90, gap 0.30%, 12.3 s of 60 s",
        ),
        (
            Standing("solving", elapsed=0.04, time_budget=0.5),
            "setting up the search, 0.0 s of 0.5 s",
        ),
        (
            Standing("branching", 550, None, 294.99, 294.98),
            "closing the gap, step 550, cost 294.99, gap < 0.01%, 0.0 s",
        ),
        (
            Standing("branching", 551, None, 294.99, 294.99),
            "closing the gap, step 551, cost 294.99, gap 0.00%, 0.0 s",
        ),
        (Standing("of a later version", 2), "of a later version, step 2, 0.0 s"),
        (
            Standing("compiling", 34, 0.26, elapsed=21.5, expected=84.0),
            "compiling, once, about 90 s, 26%, 21.5 s",
        ),
        (
            Standing("compiling, not kept", 1, 0.01, expected=84.0),
            "compiling, not kept, about 90 s, 1%, 0.0 s",
        ),
    ],
)
def test_in_words(standing, words):
    assert str(standing) == words


def test_the_time_of_a_plan_begins_when_all_is_compiled():
    clock = Clock()
    tracker = Tracker(60.0, clock)
    clock.now += 4.0
    compiling = tracker.note(Progress("compiling", 1, math.nan, share=0.2, expected=90.0))
    assert (compiling.elapsed, compiling.time_budget, compiling.expected) == (4.0, math.inf, 90.0)
    clock.now += 80.0
    assert tracker.now().elapsed == 84.0
    first = tracker.note(Progress("fresh", 1, math.nan))
    assert (first.elapsed, first.time_budget, first.expected) == (0.0, 60.0, None)
    clock.now += 3.0
    assert str(tracker.now()).endswith("3.0 s of 60 s")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.0, "10 s"), (10.0, "10 s"), (31.0, "40 s"), (119.0, "2 min"), (200.0, "4 min")],
)
def test_an_estimate_claims_no_more_than_it_knows(seconds, words):
    assert roughly(seconds) == words


def test_times():
    assert time_spent(99.94) == "99.9 s"
    assert time_spent(125.4) == "2 min 05 s"
    assert time_spent(125.4, 600.0) == "125.4 s of 600 s"
    assert time_spent(7384.0) == "2 h 03 min"


def test_all_is_100_percent_and_nothing_less():
    assert [percent(share) for share in (0.0, 0.29, 0.999, 1.0)] == ["0%", "29%", "99%", "100%"]
