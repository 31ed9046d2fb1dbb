# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Goals of ~/plan over DDS: feedback, cancelling, and what becomes of those that overlap."""

from __future__ import annotations

import math
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from action_msgs.srv import CancelGoal

from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.run_reading import read_run
from focus_planner.runtime.reason import Reason
from testing.forked import PIPE, ForkedProcess
from testing.ros.bits import bits
from testing.ros.calls import FEW, having, until, what_counts
from testing.ros.goals import (
    ABORTED,
    CANCELED,
    LONG,
    SHORT,
    SUCCEEDED,
    Feedback,
    cancelled,
    ended,
    has_plan,
    planning,
    sent,
    sent_unasked,
)
from testing.ros.planner_process import PATIENCE
from testing.ros.recorded import assert_reproduced, whole

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recorded")


@pytest.fixture(scope="module")
def planner(start_planner, folder):
    return start_planner(*FEW, "-p", f"record_directory:={folder}")


@pytest.fixture(scope="module")
def ready(client, body, rig):
    client.publish_mesh(body)
    client.publish_rig(rig)
    assert client.plan(**SHORT).success  # so that all is read
    return client


def assert_fits(plan, rig):
    """Check that a plan can be given to the lenses."""
    for focus, camera in zip(plan.cameras, rig.cameras, strict=True):
        assert focus.name == camera.name
        assert camera.lens.min_focus <= focus.focus_distance <= camera.lens.max_focus
        assert math.isfinite(focus.focus_distance)


def run_of(folder, plan):
    return read_run(until(lambda: whole(folder).get(plan.plan_id)))


# --- goals that are planned --------------------------------------------------------------------


@pytest.mark.parametrize(
    "request_",
    [
        SHORT,
        {"method": "k_view", "k": 3, "bound": "tight"},
        {"shots": 2, "time_budget": 60.0},
        {"shots": 2, "images": 6},
    ],
)
def test_a_goals_plan_is_the_services_bit_for_bit(ready, folder, request_):
    status, reason, result = ended(sent(ready, **request_))
    assert (status, reason) == (SUCCEEDED, Reason.NONE)
    assert ready.latched_plan().plan_id == result.plan.plan_id
    response = ready.plan(**request_)
    assert (response.success, response.reason) == (True, Reason.NONE)
    assert what_counts(result.plan) == what_counts(response.plan)
    assert result.plan.cost == response.plan.cost
    assert_reproduced(run_of(folder, result.plan))


def test_a_bad_goal_is_told(ready):
    before = ready.latched_plan()
    status, reason, result = ended(sent(ready, method="guess"))
    assert (status, reason) == (ABORTED, Reason.BAD_REQUEST)
    assert "method: expected one of closest" in result.message
    assert ready.latched_plan().plan_id == before.plan_id


def test_a_refused_surface_is_told_to_a_goal(ready, body):
    ready.publish("mesh", b"\x00\x01\x00\x00")
    status, reason, result = ended(sent(ready, **SHORT))
    assert (status, reason) == (ABORTED, Reason.NOT_READY)
    assert "stays in force: call again" in result.message
    ready.publish_mesh(body)
    assert ended(sent(ready, **SHORT))[1] is Reason.NONE


# --- feedback ----------------------------------------------------------------------------------


def test_feedback_tells_the_stages_in_order(ready):
    heard = Feedback()
    ask = sent_unasked(ready, heard, method="k_view", bound="tight")
    heard.wait_for(lambda m: m.stage == "prices")
    assert ended(ask())[0] == SUCCEEDED
    assert heard.stages == ["cells", "solving", "em", "k_view", "prices"]
    assert np.isnan(heard.values("progress")).all()


def test_feedback_tells_how_far_a_plan_is(ready):
    heard, budget, began = Feedback(), 600.0, time.monotonic()
    goal = sent(ready, heard, **{**LONG, "seed": 77, "time_budget": budget})

    def bounds_and_costs(_):
        costs = {m.cost for _, m in heard.messages if math.isfinite(m.cost)}
        return len(costs) > 1 and heard.messages[-1][1].lower_bound > 0

    heard.wait_for(bounds_and_costs)
    assert goal.cancel()
    result = ended(goal)[2]
    progress, cost, bound = (heard.values(name) for name in ("progress", "cost", "lower_bound"))
    arrived = np.array([at for at, _ in heard.messages])
    assert (np.diff(progress) > 0).all()
    assert progress[0] >= 0
    # Part of the budget, measured before it arrives; the node's planning began after the sending.
    assert (progress <= (arrived - began) / budget).all()
    stages = ["visibility", "cells", "solving", "em"]
    assert heard.stages[: len(stages)] == stages
    cost, bound = cost[np.isfinite(cost)], bound[np.isfinite(bound)]
    assert len(cost) > 1
    assert (np.diff(cost) <= 0).all()
    assert (np.diff(bound) >= 0).all()
    assert bound[-1] <= result.plan.lower_bound <= result.plan.cost <= cost[0]
    assert len(heard.messages) <= 3 + len(heard.stages) + 10 * (arrived[-1] - began)


def test_feedback_has_all_figures(ready):
    heard, budget = Feedback(), 600.0
    goal = sent(ready, heard, **{**LONG, "seed": 78, "time_budget": budget})
    heard.wait_for(lambda m: math.isfinite(m.gap) and m.iteration > 3)
    assert goal.cancel()
    ended(goal)
    elapsed = heard.values("elapsed")
    assert (np.diff(elapsed) > 0).all()
    np.testing.assert_allclose(heard.values("progress"), elapsed / budget, rtol=1e-6)
    assert set(heard.values("time_budget")) == {budget}
    cost, bound = heard.values("cost"), heard.values("lower_bound")
    np.testing.assert_allclose(heard.values("gap"), (cost - bound) / cost, rtol=1e-12)


def test_without_a_budget_feedback_says_so(ready):
    heard = Feedback()
    ask = sent_unasked(ready, heard, method="em")
    heard.wait_for(lambda m: m.stage == "em")
    assert ended(ask())[0] == SUCCEEDED
    assert set(heard.values("time_budget")) == {0.0}
    assert (heard.values("elapsed") >= 0).all()


def test_a_goal_that_waits_for_its_inputs_is_told_so(ready, body):
    first, heard = planning(ready), Feedback()
    ready.publish_mesh(replace(body, vertices=body.vertices + 1e-4))
    ask = sent_unasked(ready, heard, **SHORT, time_budget=60.0)
    cancelled(first)
    heard.wait_for(lambda m: m.stage == "preparing")
    assert ended(ask())[0] == SUCCEEDED
    assert heard.stages[:2] == ["reading", "preparing"]
    for name, value in (("elapsed", 0.0), ("progress", 0.0), ("time_budget", 60.0)):
        assert heard.values(name)[0] == value
    ready.publish_mesh(body)
    assert ready.plan(**SHORT).success  # so that it is read


# --- cancelling --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "moment",
    [lambda _: True, lambda m: m.stage == "solving", has_plan, lambda m: m.lower_bound > 0],
)
def test_cancelled_it_has_its_best_plan_which_is_in_force(ready, folder, rig, moment):
    heard = Feedback()
    goal = sent(ready, heard, **LONG)
    heard.wait_for(moment)
    assert goal.cancel()
    status, reason, result = ended(goal)
    assert (status, reason) == (CANCELED, Reason.CANCELLED)
    assert result.message.startswith(
        f"cancelled, the best plan found by then; {LONG['method']}, cost"
    )
    assert not result.plan.converged
    assert_fits(result.plan, rig)
    assert bits(ready.latched_plan()) == bits(result.plan)
    assert bits(ready.latched_focus(rig.cameras[3].name)) == bits(result.plan.cameras[3])
    run = run_of(folder, result.plan)
    assert run.ending.message == result.message
    assert_reproduced(run)


def test_cancelled_twice_it_ends_once(ready):
    goal = planning(ready)
    with ThreadPoolExecutor(3) as threads:
        answers = list(threads.map(lambda _: goal.cancel(), range(3)))
    assert any(answers)
    assert ended(goal)[:2] == (CANCELED, Reason.CANCELLED)
    assert not goal.cancel()
    assert ready.plan(**SHORT).success


def test_cancelled_before_its_turn_it_has_no_plan(ready):
    first, second = planning(ready), sent(ready, **LONG)
    assert second.cancel()
    status, reason, result = ended(second)
    assert (status, reason, result.success) == (CANCELED, Reason.CANCELLED, False)
    assert result.message == "cancelled before planning began"
    cancelled(first)


def test_what_has_ended_cannot_be_cancelled(ready):
    goal = sent(ready, **SHORT)
    ended(goal)
    assert not goal.cancel()
    assert ended(goal)[0] == SUCCEEDED


def test_all_goals_are_cancelled_at_once(ready):
    goals = [planning(ready), *(sent(ready, **LONG) for _ in range(3))]
    client = ready._plan._client_handle
    ready._send(lambda: client.send_cancel_request(CancelGoal.Request()))  # names none: all
    assert [ended(goal)[0] for goal in goals] == [CANCELED] * 4


# --- overlapping -------------------------------------------------------------------------------


def test_goals_queue(ready):
    first = planning(ready)
    others = [sent(ready, method="em", seed=1 + k) for k in range(3)]
    call = ready.plan_async(**SHORT)
    assert not any(goal._result.done() for goal in (first, *others))
    plan = cancelled(first)
    plans = [plan, *(ended(goal)[2].plan for goal in others), ready.wait_for(call).plan]
    stamps = [(p.header.stamp.sec, p.header.stamp.nanosec) for p in plans]
    assert stamps == sorted(stamps)
    assert ready.latched_plan().plan_id == plans[-1].plan_id
    assert [p.seed for p in plans[1:]] == [1, 2, 3, 0]


def test_a_goal_makes_way_for_the_next(ready, planner, folder, rig):
    with having(ready, overlap="preempt"):
        first, second = planning(ready), sent(ready, **LONG)
        status, reason, result = ended(first)
        assert (status, reason, result.success) == (ABORTED, Reason.PREEMPTED, True)
        assert "preempted by a newer goal, the best plan found by then, not published; opt" in (
            result.message
        )
        assert_fits(result.plan, rig)
        third, fourth = sent(ready, **LONG), sent(ready, **SHORT)
        assert ended(second)[1] is Reason.PREEMPTED
        assert ended(third)[1] is Reason.PREEMPTED
        status, _, newest = ended(fourth)
    assert status == SUCCEEDED
    assert ready.latched_plan().plan_id == newest.plan.plan_id
    assert_reproduced(run_of(folder, result.plan))
    run_of(folder, newest.plan)
    assert last_plan(folder, planner.name).plan.message.plan_id == newest.plan.plan_id


def test_a_call_does_not_make_way(ready):
    with having(ready, overlap="preempt"):
        call = ready.plan_async(**{**LONG, "time_budget": 1.0})
        goal = sent(ready, **SHORT)
        assert ready.wait_for(call, PATIENCE).reason == Reason.NONE
        assert ended(goal)[0] == SUCCEEDED


def test_a_goal_is_refused_while_another_is_planned(ready, planner):
    with having(ready, overlap="refuse"):
        first = planning(ready)
        assert not ready.send_goal(**SHORT).accepted
        planner.wait_for_log("rejected a goal: overlap is refuse, unanswered requests: 1")
        cancelled(first)
        assert ended(sent(ready, **SHORT))[0] == SUCCEEDED


def test_a_call_is_told_that_the_planner_is_busy(ready):
    with having(ready, service_max_wait=0.3):
        goal = planning(ready)
        response = ready.plan(timeout=PATIENCE, **SHORT)
        assert (response.success, response.reason) == (False, Reason.BUSY)
        assert response.message.startswith("busy: planning ")
        assert response.plan.plan_id == ""
        cancelled(goal)
    assert ready.plan(**SHORT).reason == Reason.NONE


def test_one_request_too_many_is_turned_away(ready):
    with having(ready, max_waiting=1):
        goal, waiting = planning(ready), ready.plan_async(**SHORT)
        until(lambda: ready.status().waiting == 1)
        response = ready.plan(timeout=PATIENCE, **SHORT)
        assert response.reason == Reason.BUSY
        assert "other requests waiting: 1;" in response.message
        assert not ready.send_goal(**SHORT).accepted
        cancelled(goal)
        assert ready.wait_for(waiting, PATIENCE).success


# --- who asked is gone -------------------------------------------------------------------------


def test_who_is_killed_meanwhile_does_no_harm(ready, planner):
    victim = ForkedProcess("testing.ros.vanishing_client", planner.name, stdout=PIPE)
    with victim.stdout:
        while "asked" not in victim.stdout.readline():
            assert victim.poll() is None
        victim.kill()
    assert victim.wait(PATIENCE) == -signal.SIGKILL
    assert ready.plan(timeout=PATIENCE, **SHORT).success
    until(lambda: ready.status().planning == "")
    assert ended(sent(ready, **SHORT))[0] == SUCCEEDED


def test_the_log_holds_no_traceback(ready, planner):
    assert ended(sent(ready, **SHORT))[0] == SUCCEEDED
    assert "Traceback" not in planner.log
