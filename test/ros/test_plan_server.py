# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Serving requests while something else plans, in this process."""

from __future__ import annotations

from dataclasses import replace

import pytest
from focus_planner_msgs.msg import FocusPlan
from focus_planner_msgs.srv import PlanFocus
from rclpy.action.server import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor

from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.lifecycle import ManagedNode
from focus_planner.ros.plan_server import PlanServer
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome
from testing.ros.log import recorded_log


class Bench:
    """A server, its node, and everything that it does, in order."""

    def __init__(self, context):
        self.node = ManagedNode("here", context=context, use_global_arguments=False)
        self.log = recorded_log(self.node)
        self.settings = Settings.from_values({})
        self.events = []
        self.planned = []
        self.server = PlanServer(
            self.node,
            ReentrantCallbackGroup(),
            lambda: self.settings,
            lambda: self.events.append("changed"),
        )
        self.server.open(self, self)

    def serve(self, **serving):
        self.settings = replace(self.settings, serving=replace(self.settings.serving, **serving))

    # What the server is opened with.

    def take_all(self):
        self.events.append("inputs")

    def plan(self, request):
        self.events.append("queued")
        self.planned.append(request)

    # What is asked of it.

    def call(self, **fields):
        return Call(self.server._plan_focus(PlanFocus.Request(**fields), PlanFocus.Response()))

    def goal(self, answers):
        return self.server.submit_goal({}, answers.append, lambda _: None, b"")


class Call:
    """A call, as the executor runs it."""

    def __init__(self, coroutine):
        self._coroutine = coroutine
        self.response = None
        self.resume()

    def resume(self):
        try:
            self._coroutine.send(None)
        except StopIteration as end:
            self.response = end.value


@pytest.fixture
def bench(context):
    bench = Bench(context)
    yield bench
    bench.server.close()
    bench.node.destroy_node()


@pytest.fixture
def active(bench):
    bench.server.activate()
    return bench


def answer_of(response):
    return response.success, response.reason, response.message


def test_inactive_it_says_how_to_activate_it(bench):
    answer = answer_of(bench.call().response)
    message = "the planner is inactive; activate it: ros2 lifecycle set /here activate"
    assert answer == (False, Reason.INACTIVE, message)
    assert bench.planned == []
    assert not bench.server.admit_goal(b"")
    assert bench.log.of("info") == ["rejected a goal: the planner is not active"]


def test_shut_down_it_says_so(bench):
    bench.node.shut_down()
    answer = answer_of(bench.call().response)
    assert answer == (
        False,
        Reason.INACTIVE,
        "the planner has been shut down; start it again",
    )


def test_a_call_is_planned_with_what_was_sent_before_it(active):
    call = active.call(method="em", samples=7)
    assert active.events == ["inputs", "changed", "queued"]
    (request,) = active.planned
    assert (request.asked["method"], request.asked["samples"]) == ("em", 7)
    assert not request.is_goal
    assert call.response is None
    assert active.server.is_busy


def test_a_call_is_answered_with_its_outcome(active):
    call, sent = active.call(), []
    plan = FocusPlan(plan_id="a plan")
    active.planned[0].finish(Outcome(Reason.NONE, "done", plan, lambda: sent.append(True)))
    call.resume()
    assert answer_of(call.response) == (True, Reason.NONE, "done")
    assert call.response.plan is plan
    assert not active.server.is_busy
    # What is left is done when the response has been sent.
    assert sent == []
    active.server.finish_answered()
    active.server.finish_answered()
    assert sent == [True]


def test_what_is_left_is_done_by_the_executor(active, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(active.node)
    call, sent = active.call(), []
    active.planned[0].finish(Outcome(Reason.NOT_READY, "none", on_sent=lambda: sent.append(True)))
    call.resume()
    while not sent:
        executor.spin_once(timeout_sec=1.0)
    executor.shutdown()
    assert sent == [True]


def test_deactivated_it_answers_everybody(active):
    calls, answers = [active.call() for _ in range(2)], []
    active.goal(answers)
    active.server.deactivate(Reason.INACTIVE)
    for call in calls:
        call.resume()
        assert answer_of(call.response) == (False, Reason.INACTIVE, "the planner was deactivated")
    assert [outcome.reason for outcome in answers] == [Reason.INACTIVE]
    assert active.call().response.reason == Reason.INACTIVE
    assert len(active.planned) == 3


def test_a_call_too_many_is_not_planned(active):
    active.serve(max_waiting=1)
    active.call()
    call = active.call()
    assert call.response.reason == Reason.BUSY
    assert call.response.message.startswith("busy: reading inputs, other requests waiting: 1;")
    assert len(active.planned) == 1


def test_a_call_waits_as_long_as_the_parameter_says(active):
    active.serve(service_max_wait=0.0)
    call = active.call()
    active.server.requests.reject_overdue()
    call.resume()
    assert call.response.reason == Reason.BUSY


def test_a_goal_that_overlaps_is_rejected_where_the_parameter_says_so(active):
    active.serve(overlap="refuse")
    assert active.server.admit_goal(b"")
    active.goal([])
    assert not active.server.admit_goal(b"")
    assert active.log.of("info") == ["rejected a goal: overlap is refuse, unanswered requests: 1"]


def test_closed_it_serves_nothing(bench):
    def served():
        names = {service.srv_name.rpartition("/")[2] for service in bench.node.services}
        actions = [each for each in bench.node.waitables if isinstance(each, ActionServer)]
        return "plan_focus" in names, len(actions)

    assert served() == (True, 1)
    bench.server.close()
    assert served() == (False, 0)
