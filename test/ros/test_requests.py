"""Requests for plans under threads, without a node."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import replace

import pytest
from focus_planner_msgs.msg import FocusPlan

from focus_planner.parameters.planner import OVERLAPS, Serving, Settings
from focus_planner.recording.naming import new_run_id
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome, Request, Requests

PLANNED = Outcome(Reason.NONE, "a plan", FocusPlan())
SETTINGS = Settings.from_values({})
QUEUE, PREEMPT, REFUSE = (Serving(overlap=overlap) for overlap in OVERLAPS)


class Asked(Request):
    """A request, with all that it was answered."""

    def __init__(self, **how):
        self.answers = []
        serving = how.pop("serving", QUEUE)
        settings = replace(SETTINGS, serving=serving)
        super().__init__({}, settings, new_run_id(), self.answers.append, **how)

    @property
    def reasons(self):
        return [outcome.reason for outcome in self.answers]


def goal(**how):
    return Asked(**how)


def call(seconds=3600.0, **how):
    return Asked(waits_until=time.perf_counter() + seconds, **how)


def added(requests, *asked):
    assert all(requests.add(each) for each in asked)
    return asked


def begun(request):
    assert request.begin()
    return request


# --- one request -------------------------------------------------------------------------------


def test_planned_it_is_answered_once():
    request = begun(goal())
    assert request.goes_on
    assert request.settle() is Reason.NONE
    assert request.finish(PLANNED)
    assert not request.finish(PLANNED)
    assert request.answers == [PLANNED]
    assert request.answered


@pytest.mark.parametrize(
    ("reason", "message"),
    [
        (Reason.CANCELLED, "cancelled before its turn"),
        (Reason.PREEMPTED, "a newer goal took its place before its turn"),
        (Reason.INACTIVE, "the planner was deactivated"),
        (Reason.SHUTTING_DOWN, "the node is shutting down"),
    ],
)
def test_ended_before_its_turn_it_is_answered_at_once(reason, message):
    request = goal()
    assert request.stop(reason)
    assert request.answers == [Outcome(reason, message)]
    assert not request.begin()
    assert not request.begun
    assert not request.stop(Reason.CANCELLED)
    request.drop(Reason.SHUTTING_DOWN)
    assert len(request.answers) == 1


def test_ended_while_it_is_planned_it_waits_for_its_best_plan():
    request = begun(goal())
    assert request.stop(Reason.CANCELLED)
    assert not request.goes_on
    assert request.stop(Reason.PREEMPTED)
    assert request.answers == []
    assert request.settle() is Reason.CANCELLED
    assert not request.stop(Reason.CANCELLED)
    assert request.finish(replace(PLANNED, reason=Reason.CANCELLED))
    assert request.reasons == [Reason.CANCELLED]


def test_dropped_while_it_is_planned_it_waits_for_nothing():
    request = begun(goal())
    request.stop(Reason.CANCELLED)
    request.drop(Reason.INACTIVE)
    assert request.answers == [Outcome(Reason.INACTIVE, "the planner was deactivated")]
    assert request.settle() is Reason.INACTIVE
    assert not request.finish(PLANNED)
    assert len(request.answers) == 1


def test_a_plan_that_is_about_to_be_published_is_answered():
    request = begun(goal())
    assert request.settle() is Reason.NONE
    assert not request.stop(Reason.CANCELLED)
    request.drop(Reason.SHUTTING_DOWN)
    assert request.answers == []
    assert request.finish(PLANNED)
    assert request.answers == [PLANNED]


def test_ended_after_its_answer_it_stays_as_it_is():
    request = begun(goal())
    request.finish(PLANNED)
    assert not request.stop(Reason.CANCELLED)
    request.drop(Reason.INACTIVE)
    assert request.goes_on
    assert request.answers == [PLANNED]


def test_feedback_goes_to_who_asked():
    told = []
    goal(tell=told.append).tell({"stage": "em"})
    assert told == [{"stage": "em"}]
    call().tell({"stage": "em"})


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
        reason = request.settle()
        if reason not in {Reason.INACTIVE, Reason.SHUTTING_DOWN}:
            published.append(request)
        request.finish(replace(PLANNED, reason=reason))


@pytest.mark.parametrize(
    "end",
    [
        lambda request: request.stop(Reason.CANCELLED),
        lambda request: request.stop(Reason.BUSY, Outcome(Reason.BUSY, "busy")),
        lambda request: request.drop(Reason.INACTIVE),
    ],
)
def test_at_the_same_moment_it_is_answered_once_and_as_it_was_published(end):
    for _ in range(200):
        request, published = goal(), []
        race(lambda r=request, p=published: plan(r, p), *[lambda r=request: end(r)] * 2)
        (outcome,) = request.answers
        assert (outcome.plan is not None) == (published == [request])


# --- many --------------------------------------------------------------------------------------


def test_who_is_planned_and_who_waits_is_known():
    requests = Requests()
    assert (requests.planned, requests.waiting, requests.open) == (None, 0, [])
    first, second, third = added(requests, goal(), call(), goal())
    assert (requests.planned, requests.waiting) == (None, 3)
    begun(first)
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


def test_goals_make_way_for_the_next_and_calls_do_not():
    requests = Requests()
    planned, waiting, waiting_call = added(requests, goal(), goal(), call())
    begun(planned)
    assert requests.admit_goal(PREEMPT)
    assert not planned.goes_on
    assert planned.answers == []
    assert waiting.reasons == [Reason.PREEMPTED]
    assert waiting_call.goes_on
    assert planned.settle() is Reason.PREEMPTED


def test_a_call_that_is_planned_goes_on_when_a_goal_comes():
    requests = Requests()
    (planned,) = added(requests, call())
    begun(planned)
    assert requests.admit_goal(PREEMPT)
    assert planned.goes_on


def test_none_makes_way_for_a_goal_that_has_no_room():
    requests, serving = Requests(), replace(PREEMPT, max_waiting=1)
    (planned,) = added(requests, goal())
    begun(planned)
    (waiting,) = added(requests, call(serving=serving))
    assert not requests.admit_goal(serving)
    assert planned.goes_on
    waiting.finish(PLANNED)
    assert requests.admit_goal(serving)
    assert not planned.goes_on


def test_goals_that_make_way_leave_room():
    requests, serving = Requests(), replace(PREEMPT, max_waiting=1)
    planned, waiting = added(requests, goal(), goal())
    begun(planned)
    assert requests.admit_goal(serving)
    assert waiting.answered


@pytest.mark.parametrize("other", [goal, call])
def test_a_goal_is_refused_while_there_is_another_request(other):
    requests = Requests()
    assert requests.admit_goal(REFUSE)
    (one,) = added(requests, other())
    assert not requests.admit_goal(REFUSE)
    begun(one)
    assert not requests.admit_goal(REFUSE)
    assert one.goes_on
    one.finish(PLANNED)
    assert requests.admit_goal(REFUSE)


def test_a_call_too_many_is_told_at_once_that_the_planner_is_busy():
    requests, serving = Requests(), Serving(max_waiting=1)
    (planned,) = added(requests, goal())
    begun(planned)
    (waiting,) = added(requests, call(serving=serving))
    another = call(serving=serving)
    assert not requests.add(another)
    (outcome,) = another.answers
    assert outcome.reason is Reason.BUSY
    assert outcome.plan is None
    assert re.fullmatch(
        rf"busy: planning {planned.plan_id} since \d+\.\d s, waiting before this one: 1; call"
        r" again, or send a goal to ~/plan, which waits for its turn",
        outcome.message,
    )
    assert requests.open == [planned, waiting]


def test_a_call_that_waits_too_long_is_told_that_the_planner_is_busy():
    requests = Requests()
    planned, late, patient, waiting = added(requests, call(0.0), call(0.0), call(60.0), goal())
    begun(planned)
    requests.turn_away_late()
    assert late.reasons == [Reason.BUSY]
    assert "waiting before this one: 0;" in late.answers[0].message
    assert requests.open == [planned, patient, waiting]
    assert not late.begin()


def test_between_two_plans_a_late_call_is_told_of_others():
    requests = Requests()
    _, late = added(requests, goal(), call(0.0))
    requests.turn_away_late()
    assert late.answers[0].message.startswith("busy: planning others, waiting before this one: 1;")


def test_all_are_dropped_at_once():
    requests = Requests()
    asked = added(requests, goal(), call(), goal())
    begun(asked[0])
    requests.drop(Reason.SHUTTING_DOWN)
    assert [each.reasons for each in asked] == [[Reason.SHUTTING_DOWN]] * 3
    assert requests.open == []
    assert asked[0].settle() is Reason.SHUTTING_DOWN
