# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Requests for plans, from several threads."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from focus_planner.parameters.planner import OVERLAPS
from focus_planner.parameters.planner_settings import Serving, Settings
from focus_planner.recording.naming import new_run_id
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome, Request, Requests, Turns

PLANNED = Outcome(Reason.NONE, "a plan", SimpleNamespace(cost=1.0))
SETTINGS = Settings.from_values({})
QUEUE, PREEMPT, REFUSE = (Serving(overlap=overlap) for overlap in OVERLAPS)


class RecordedRequest(Request):
    """A request that keeps its answers."""

    def __init__(self, **options):
        self.answers = []
        serving = options.pop("serving", QUEUE)
        settings = replace(SETTINGS, serving=serving)
        super().__init__({}, settings, new_run_id(), self.answers.append, **options)

    @property
    def reasons(self):
        return [outcome.reason for outcome in self.answers]


def goal(**options):
    return RecordedRequest(**options)


def call(seconds=3600.0, **options):
    return RecordedRequest(waits_until=time.perf_counter() + seconds, **options)


def added(requests, *asked):
    assert all(requests.add(each) for each in asked)
    return asked


def started(request):
    assert request.begin()
    return request


# --- one request -------------------------------------------------------------------------------


def test_a_planned_request_is_answered_once():
    request = started(goal())
    assert not request.stop_requested
    assert request.commit() is Reason.NONE
    assert request.finish(PLANNED)
    assert not request.finish(PLANNED)
    assert request.answers == [PLANNED]
    assert request.is_answered


@pytest.mark.parametrize(
    ("reason", "message"),
    [
        (Reason.CANCELLED, "cancelled before planning began"),
        (Reason.PREEMPTED, "preempted by a newer goal before planning began"),
        (Reason.INACTIVE, "the planner was deactivated"),
        (Reason.SHUTTING_DOWN, "the node is shutting down"),
    ],
)
def test_stopped_before_planning_began_it_is_answered_at_once(reason, message):
    request = goal()
    assert request.stop(reason)
    assert request.answers == [Outcome(reason, message)]
    assert not request.begin()
    assert not request.has_begun
    assert not request.stop(Reason.CANCELLED)
    request.abort(Reason.SHUTTING_DOWN)
    assert len(request.answers) == 1


def test_stopped_while_it_is_planned_it_waits_for_the_best_plan():
    request = started(goal())
    assert request.stop(Reason.CANCELLED)
    assert request.stop_requested
    assert request.stop(Reason.PREEMPTED)
    assert request.answers == []
    assert request.commit() is Reason.CANCELLED
    assert not request.stop(Reason.CANCELLED)
    assert request.finish(replace(PLANNED, reason=Reason.CANCELLED))
    assert request.reasons == [Reason.CANCELLED]


def test_aborted_while_it_is_planned_it_is_answered_at_once():
    request = started(goal())
    request.stop(Reason.CANCELLED)
    request.abort(Reason.INACTIVE)
    assert request.answers == [Outcome(Reason.INACTIVE, "the planner was deactivated")]
    assert request.commit() is Reason.INACTIVE
    assert not request.finish(PLANNED)
    assert len(request.answers) == 1


def test_a_committed_plan_is_answered():
    request = started(goal())
    assert request.commit() is Reason.NONE
    assert not request.stop(Reason.CANCELLED)
    request.abort(Reason.SHUTTING_DOWN)
    assert request.answers == []
    assert request.finish(PLANNED)
    assert request.answers == [PLANNED]


def test_after_its_answer_it_cannot_be_stopped():
    request = started(goal())
    request.finish(PLANNED)
    assert not request.stop(Reason.CANCELLED)
    request.abort(Reason.INACTIVE)
    assert not request.stop_requested
    assert request.answers == [PLANNED]


def test_feedback_goes_to_the_caller():
    sent = []
    goal(send_feedback=sent.append).send_feedback({"stage": "em"})
    assert sent == [{"stage": "em"}]
    call().send_feedback({"stage": "em"})


def race(*jobs):
    """Do jobs in threads at the same moment."""
    together = threading.Barrier(len(jobs))

    def do(job):
        together.wait()
        job()

    threads = [threading.Thread(target=do, args=(job,)) for job in jobs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def plan(request, published):
    """What the planning thread does with a request."""
    if request.begin():
        reason = request.commit()
        if reason not in {Reason.INACTIVE, Reason.SHUTTING_DOWN}:
            published.append(request)
        request.finish(replace(PLANNED, reason=reason))


@pytest.mark.parametrize(
    "end",
    [
        lambda request: request.stop(Reason.CANCELLED),
        lambda request: request.stop(Reason.BUSY, Outcome(Reason.BUSY, "busy")),
        lambda request: request.abort(Reason.INACTIVE),
    ],
)
def test_concurrently_ended_it_is_answered_once_and_as_it_was_published(end):
    for _ in range(200):
        request, published = goal(), []
        race(lambda r=request, p=published: plan(r, p), *[lambda r=request: end(r)] * 2)
        (outcome,) = request.answers
        assert (outcome.plan is not None) == (published == [request])


# --- many --------------------------------------------------------------------------------------


def test_planned_and_waiting_requests_are_known():
    requests = Requests()
    assert (requests.planned, requests.waiting, requests.open) == (None, 0, [])
    first, second, third = added(requests, goal(), call(), goal())
    assert (requests.planned, requests.waiting) == (None, 3)
    started(first)
    assert (requests.planned, requests.waiting) == (first, 2)
    second.stop(Reason.CANCELLED)
    assert (requests.waiting, requests.open) == (1, [first, third])
    first.finish(PLANNED)
    assert (requests.planned, requests.open) == (None, [third])


def test_goals_queue_up_to_the_limit():
    requests, serving = Requests(), replace(QUEUE, max_waiting=2)
    for _ in range(3):
        assert requests.admit_goal(serving)
        requests.add(goal())
        requests.open[0].begin()
    assert requests.waiting == 2
    assert not requests.admit_goal(serving)
    requests.open[0].finish(PLANNED)
    assert not requests.admit_goal(serving)
    requests.open[0].begin()
    assert requests.admit_goal(serving)


def test_goals_are_preempted_by_the_next_and_calls_are_not():
    requests = Requests()
    planned, waiting, waiting_call = added(requests, goal(), goal(), call())
    started(planned)
    assert requests.admit_goal(PREEMPT)
    assert planned.stop_requested
    assert planned.answers == []
    assert waiting.reasons == [Reason.PREEMPTED]
    assert not waiting_call.stop_requested
    assert planned.commit() is Reason.PREEMPTED


def test_a_call_being_planned_is_not_stopped_by_a_goal():
    requests = Requests()
    (planned,) = added(requests, call())
    started(planned)
    assert requests.admit_goal(PREEMPT)
    assert not planned.stop_requested


def test_a_callers_requests_leave_others_their_places():
    requests, serving = Requests(), replace(QUEUE, max_waiting=1)
    added(requests, goal(caller=b"a"))
    assert not requests.admit_goal(serving, b"a")
    assert requests.admit_goal(serving, b"b")
    refused, waiting = (call(serving=serving, caller=caller) for caller in (b"a", b"b"))
    assert not requests.add(refused)
    assert refused.answers[0].reason is Reason.BUSY
    assert requests.add(waiting)


def test_preempted_goals_make_room():
    requests, serving = Requests(), replace(PREEMPT, max_waiting=1)
    planned, waiting = added(requests, goal(), goal())
    started(planned)
    assert requests.admit_goal(serving)
    assert waiting.is_answered


@pytest.mark.parametrize("other", [goal, call])
def test_with_overlap_refuse_a_goal_is_rejected_beside_any_request(other):
    requests = Requests()
    assert requests.admit_goal(REFUSE)
    (one,) = added(requests, other())
    assert not requests.admit_goal(REFUSE)
    started(one)
    assert not requests.admit_goal(REFUSE)
    assert not one.stop_requested
    one.finish(PLANNED)
    assert requests.admit_goal(REFUSE)


def test_a_call_too_many_is_rejected_at_once():
    requests, serving = Requests(), Serving(max_waiting=1)
    (planned,) = added(requests, goal())
    started(planned)
    (waiting,) = added(requests, call(serving=serving))
    another = call(serving=serving)
    assert not requests.add(another)
    (outcome,) = another.answers
    assert outcome.reason is Reason.BUSY
    assert outcome.plan is None
    assert re.fullmatch(
        rf"busy: planning {planned.plan_id} \(requested \d+\.\d s ago\), other requests"
        r" waiting: 1; call again later, or send a goal to ~/plan, which waits for its turn",
        outcome.message,
    )
    assert requests.open == [planned, waiting]


def test_a_call_that_waits_too_long_is_rejected():
    requests = Requests()
    planned, late, patient, waiting = added(requests, call(0.0), call(0.0), call(60.0), goal())
    started(planned)
    requests.reject_overdue()
    assert late.reasons == [Reason.BUSY]
    assert "other requests waiting: 2;" in late.answers[0].message
    assert requests.open == [planned, patient, waiting]
    assert not late.begin()


def test_before_a_plan_an_overdue_call_is_told_that_inputs_are_read():
    requests = Requests()
    _, late = added(requests, goal(), call(0.0))
    requests.reject_overdue()
    assert late.answers[0].message.startswith("busy: reading inputs, other requests waiting: 1;")


def test_all_are_aborted_at_once():
    requests = Requests()
    asked = added(requests, goal(), call(), goal())
    started(asked[0])
    requests.abort_all(Reason.SHUTTING_DOWN)
    assert [each.reasons for each in asked] == [[Reason.SHUTTING_DOWN]] * 3
    assert requests.open == []
    assert asked[0].commit() is Reason.SHUTTING_DOWN


def test_callers_take_turns():
    turns = Turns()
    many = [goal(caller=b"a") for _ in range(3)]
    few = [call(caller=b"b") for _ in range(2)]
    one = call(caller=b"c")
    for request in (*many, *few, one):
        turns.add(request)
    order = [turns.next() for _ in range(6)]
    assert order == [many[0], few[0], one, many[1], few[1], many[2]]
    assert turns.next() is None


def test_who_comes_late_waits_for_one_request_of_each():
    turns = Turns()
    many = [goal(caller=b"a") for _ in range(40)]
    for request in many:
        turns.add(request)
    assert turns.next() is many[0]
    modest = call(caller=b"b")
    turns.add(modest)
    assert [turns.next(), turns.next()] == [many[1], modest]


def test_who_has_been_answered_has_no_turn():
    turns = Turns()
    answered, waiting = call(), call()
    turns.add(answered)
    turns.add(waiting)
    answered.stop(Reason.CANCELLED)
    assert turns.waiting() == [waiting]
    assert turns.next() is waiting
    assert turns.waiting() == []
    assert turns.next() is None
