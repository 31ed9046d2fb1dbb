# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Which surface is planned for next, and the account of the others."""

from __future__ import annotations

import random
from dataclasses import asdict, replace

import pytest

from focus_planner.parameters.planner_settings import Settings
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.replanning import Pace, Replanned, Surfaces
from focus_planner.runtime.requests import NewestOnly, unasked
from focus_planner.runtime.seldom import Seldom
from testing.clock import StoppedTime


def counted(**counts):
    return replace(Replanned(), **counts)


def test_a_surface_is_waiting_until_it_was_planned_for():
    surfaces = Surfaces()
    surfaces.receive(5)
    assert surfaces.are_waiting
    assert surfaces.read({5}, ())
    assert surfaces.counts == counted(waiting=1)
    surfaces.end({5})
    assert not surfaces.are_waiting
    assert not surfaces.read({5}, ())
    assert surfaces.counts == counted(planned=1)


def test_the_newest_takes_the_place_of_older_ones():
    surfaces = Surfaces()
    for number in (1, 3, 4, 7):
        surfaces.receive(number)
    assert surfaces.read({4}, ())
    assert surfaces.counts == counted(stale=2, waiting=2)
    surfaces.end({4})
    assert surfaces.counts == counted(stale=2, planned=1, waiting=1)


def test_what_is_refused_is_no_reason_to_plan_again():
    surfaces = Surfaces()
    surfaces.receive(1)
    surfaces.read({1}, ())
    surfaces.end({1})
    surfaces.receive(2)
    assert not surfaces.read({1}, (2,))
    assert surfaces.counts == counted(planned=1, refused=1)


def test_several_are_planned_for_together():
    surfaces = Surfaces()
    for number in range(5):
        surfaces.receive(number)
    surfaces.read({2, 4}, (1,))
    surfaces.end({2, 4})
    assert surfaces.counts == counted(planned=2, refused=1, stale=2)


def test_a_failure_is_told_until_there_is_a_plan():
    surfaces = Surfaces()
    surfaces.receive(1)
    surfaces.end({1}, "too many samples")
    assert surfaces.counts == counted(failed=1, failure="too many samples")
    surfaces.receive(2)
    surfaces.end({2})
    assert surfaces.counts == counted(failed=1, planned=1)


@pytest.mark.parametrize("seed", range(20))
def test_every_surface_is_one_of_these(seed):
    draw = random.Random(seed)
    surfaces, refused, in_force, sent = Surfaces(), set(), set(), 0
    for _ in range(200):
        match draw.randrange(3):
            case 0:
                surfaces.receive(sent)
                sent += 1
            case 1 if sent:
                newest = draw.randrange(max(in_force, default=0), sent)
                refused = set(draw.sample(range(sent), min(sent, 2))) - {newest} - in_force
                in_force = {newest}
                surfaces.read(in_force, refused)
            case 2:
                surfaces.end(in_force, draw.choice(["", "bad"]))
        counts = asdict(surfaces.counts)
        counts.pop("failure")
        assert sum(counts.values()) == sent


# --- requests that nobody made -------------------------------------------------------------------


def a_request(plan_id):
    return unasked(Settings.from_values({}), plan_id)


def test_of_requests_that_wait_the_newest_is_taken():
    newest = NewestOnly()
    assert newest.put(a_request("1"))
    assert not newest.put(a_request("2"))
    assert newest.take().plan_id == "2"
    assert newest.take() is None
    assert newest.put(a_request("3"))


def test_one_that_is_planned_can_be_stopped_and_one_that_waits_stays():
    newest = NewestOnly()
    newest.put(a_request("1"))
    taken = newest.take()
    assert newest.planned == ""
    newest.stop(Reason.PREEMPTED)
    assert not taken.stop_requested  # it has not begun, and costs nobody time
    taken.begin()
    assert newest.planned == "1"
    newest.put(a_request("2"))
    newest.stop(Reason.PREEMPTED)
    assert taken.commit() is Reason.PREEMPTED
    newest.done()
    assert newest.planned == ""
    assert newest.take().plan_id == "2"


def test_all_end_with_the_planner():
    newest = NewestOnly()
    newest.put(a_request("1"))
    taken = newest.take()
    newest.put(a_request("2"))
    newest.clear(Reason.INACTIVE)
    assert taken.is_answered
    assert taken.commit() is Reason.INACTIVE
    assert newest.take() is None


def test_what_nobody_asked_for_is_planned_from_the_last_plan_on():
    settings = Settings.from_values({"replan": "on_surface"})
    request = unasked(settings, "1")
    assert (request.is_asked, request.starts_warm, request.keeps_warm) == (False, True, True)
    asked = replace(request, is_asked=True)
    assert (asked.starts_warm, asked.keeps_warm) == (False, True)
    alone = replace(asked, settings=Settings.from_values({}))
    assert (alone.starts_warm, alone.keeps_warm) == (False, False)


# --- how often -----------------------------------------------------------------------------------


def test_plans_begin_a_period_apart():
    pace = Pace()
    assert pace.seconds_left(10.0, 0.5) == 0.0
    pace.begin(10.0)
    assert pace.seconds_left(10.25, 0.5) == 0.25
    assert pace.seconds_left(10.25, 0.0) == 0.0
    assert pace.seconds_left(10.5, 0.5) == 0.0


def test_what_is_done_seldom_is_done_at_first_and_after_its_period():
    clock = StoppedTime()
    seldom = Seldom(clock.monotonic)
    assert seldom.take("a", 5.0)
    assert not seldom.is_due("a", 5.0)
    assert seldom.take("b", 5.0)
    clock.advance(4.0)
    assert not seldom.take("a", 5.0)
    assert seldom.take("b", 0.0)
    clock.advance(1.0)
    assert seldom.is_due("a", 5.0)
    assert seldom.take("a", 5.0)
    assert not seldom.take("b", 5.0)
