# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans that a time budget or a callback ended.

Time passes by a clock that moves on by 1 s whenever it is read, which is once per question whether
to go on and a few times more.
"""

import dataclasses
import math

import numpy as np
import pytest

from focus_planner import PlanRequest, Scene, cylinder_rig, plan_focus
from focus_planner.core.planning.request import METHODS
from testing.clock import Clock
from testing.plans import RIG, SCENE, distances, without_seconds
from testing.problems import body

each_method = pytest.mark.parametrize("method", METHODS)


@each_method
def test_a_time_budget_ends_the_solver_with_a_valid_plan(method):
    scene, rig = Scene(body()), cylinder_rig(3, 8, bottom=0.3, top=1.5)
    whole = plan_focus(scene, rig, PlanRequest(method, samples=500))
    request = PlanRequest(method, samples=500, time_budget=0.5)
    hasty = plan_focus(scene, rig, request, clock=Clock(1.0))
    assert whole.converged
    assert not hasty.converged
    assert np.isfinite(distances(hasty)).all()
    assert hasty.lower_bound is not None
    assert hasty.lower_bound <= hasty.cost
    closest = plan_focus(scene, rig, PlanRequest("closest", samples=500))
    if method != "average":
        assert whole.cost <= hasty.cost <= closest.cost


def test_a_callback_is_called_after_every_step_and_may_stop():
    heard = []

    def on_progress(progress):
        heard.append(progress)
        return progress.stage != "em" or progress.iteration < 2

    plan = plan_focus(SCENE, RIG, PlanRequest(samples=1000), on_progress=on_progress)
    assert [(p.stage, p.iteration) for p in heard[-2:]] == [("em", 1), ("em", 2)]
    stages = list(dict.fromkeys(p.stage for p in heard))
    assert stages == ["fresh", "visibility", "cells", "solving", "em"]
    assert all(math.isnan(p.cost) for p in heard[:-2])
    assert not plan.converged
    assert heard[-2].cost >= heard[-1].cost >= plan.cost - 1e-6  # whole units, rounded


class StopAfter:
    """A callback that returns False after so many calls."""

    def __init__(self, calls):
        self.left = calls
        self.stopped = False

    def __call__(self, progress):
        self.left -= 1
        self.stopped = self.left < 0
        return not self.stopped


@pytest.mark.parametrize(
    "request_",
    [
        PlanRequest(samples=3000, fresh_samples=3000),
        PlanRequest("optimal", samples=2000, bound="none", gap=0.0),
        PlanRequest("k_view", samples=800, k=3, shots=2, bound="tight"),
        PlanRequest("em", samples=0, standard_error=6.0),
        PlanRequest("closest", samples=2000, bound="tight"),
    ],
)
def test_a_plan_that_a_callback_ended_is_made_again_from_its_log(request_):
    stopped = 0
    rig = cylinder_rig(3, 6, bottom=0.3, top=1.5)
    scene = Scene(body())
    for calls in (0, 1, 2, 3, 5, 8, 13, 21, 34, 55):
        on_progress = StopAfter(calls)
        plan = plan_focus(scene, rig, request_, on_progress=on_progress)
        assert plan.converged or on_progress.stopped or request_.gap == 0
        assert_made_again(plan, scene, rig, request_)
        stopped += on_progress.stopped
        # A time budget that has run out changes nothing either.
        assert_made_again(plan, scene, rig, dataclasses.replace(request_, time_budget=1e-9))
    assert stopped >= 4


def assert_made_again(plan, scene, rig, request):
    again = plan_focus(scene, rig, request, stop_log=plan.stop_log)
    assert without_seconds(again) == without_seconds(plan)
    assert again.stop_log == plan.stop_log
    assert plan.prices is again.prices is None or plan.prices.tobytes() == again.prices.tobytes()


@pytest.mark.parametrize(
    ("seconds", "last"), [(2, "em"), (10, "em"), (19, "prices"), (30, "k_view"), (45, "branching")]
)
def test_a_plan_that_a_budget_ended_is_made_again_from_its_log(seconds, last):
    request = PlanRequest("optimal", samples=8192, gap=0.0, time_budget=seconds)
    rig, scene, heard = cylinder_rig(4, 9), Scene(body()), []
    plan = plan_focus(
        scene, rig, request, on_progress=lambda p: not heard.append(p.stage), clock=Clock(1.0)
    )
    assert heard[-1] == last
    assert not plan.converged
    assert (plan.samples < 8192) == (seconds <= 10)
    assert seconds < plan.total_seconds < seconds + 10
    assert_made_again(plan, scene, rig, request)


@each_method
def test_in_no_time_a_plan_is_made_on_what_was_seen(method):
    scene, rig = Scene(body()), cylinder_rig()
    plan = plan_focus(scene, rig, PlanRequest(method, 8192, time_budget=0.5), clock=Clock(1.0))
    whole = plan_focus(scene, rig, PlanRequest("em", 8192))
    assert 0 < plan.samples < 8192
    assert 1 < plan.fresh_samples < 4096
    assert not plan.converged
    assert np.isfinite(distances(plan)).all()
    assert (distances(plan) > 0).all()
    assert plan.lower_bound <= plan.cost
    assert plan.cost == pytest.approx(plan.problem.cost(plan.focus_distances), rel=1e-12)
    # What there is stands for all of the surface.
    assert plan.surface_area == whole.surface_area
    assert plan.covered_area == pytest.approx(whole.covered_area, rel=0.1)
    assert 0.2 * whole.in_focus_area < plan.in_focus_area <= plan.covered_area
    assert plan.problem.samples.weights.sum() == pytest.approx(
        whole.problem.samples.weights.sum(), rel=1e-9
    )


@each_method
def test_enough_time_changes_nothing(method):
    request = PlanRequest(method, 1500, seed=2)
    scene, rig = Scene(body("arms_out")), cylinder_rig(3, 8)
    ample = dataclasses.replace(request, time_budget=1000.0)
    plans = [plan_focus(scene, rig, r, clock=Clock(0.1)) for r in (request, ample)]
    assert without_seconds(plans[0]) == without_seconds(plans[1])
    assert plans[0].converged
    assert plans[0].prices.tobytes() == plans[1].prices.tobytes()


def test_a_deadline_is_kept_on_many_samples():
    scene, rig = Scene(body()), cylinder_rig()
    request = PlanRequest("optimal", 65_536, time_budget=20.0)
    plan = plan_focus(scene, rig, request, clock=Clock(1.0))
    assert 20 < plan.total_seconds <= 21
    assert not plan.converged
    assert plan.lower_bound <= plan.cost
    assert 512 < plan.samples < 65_536


def test_seconds_are_by_the_clock():
    clock = Clock(1.0)
    plan = plan_focus(SCENE, RIG, PlanRequest("closest", 100, bound="none"), clock=clock)
    assert 0 < plan.solve_seconds < plan.total_seconds == clock.now - 1001


STAGES = ("fresh", "visibility", "em", "k_view", "prices", "branching")


@pytest.mark.parametrize(
    ("stage", "step"),
    [(stage, step) for stage in STAGES for step in (1, 2) if (stage, step) != ("branching", 2)],
)
def test_a_callback_may_end_any_stage(stage, step):
    scene, rig = Scene(body("arms_out")), cylinder_rig(4, 9)
    request, heard = PlanRequest("optimal", 2000), []

    def on_progress(progress):
        heard.append(progress.stage)
        return heard.count(stage) < step

    plan = plan_focus(scene, rig, request, on_progress=on_progress)
    assert heard[-1] == stage
    assert heard.count(stage) == step
    assert not plan.converged
    assert (plan.samples < 2000) == (stage in {"fresh", "visibility"})
    assert np.isfinite(distances(plan)).all()
    assert (distances(plan) > 0).all()
    assert plan.lower_bound <= plan.cost


@pytest.mark.parametrize("method", ["closest", "average", "em", "k_view"])
def test_a_callback_may_end_the_bound(method):
    heard = []

    def on_progress(progress):
        heard.append(progress)
        return progress.stage != "prices"

    whole = plan_focus(SCENE, RIG, PlanRequest(method, 1000, bound="tight"))
    plan = plan_focus(SCENE, RIG, PlanRequest(method, 1000, bound="tight"), on_progress=on_progress)
    assert [p.stage for p in heard].count("prices") == 1
    assert heard[-1].cost == pytest.approx(plan.cost, rel=1e-9)
    assert heard[-1].lower_bound == plan.lower_bound <= whole.lower_bound
    assert plan.cameras == whole.cameras


def test_a_plan_without_some_fresh_samples_has_not_converged():
    def on_progress(progress):
        return progress.stage != "fresh"

    plan = plan_focus(SCENE, RIG, PlanRequest("closest", 300), on_progress=on_progress)
    assert plan.fresh_samples < 4096
    assert plan.samples == 300
    assert not plan.converged
