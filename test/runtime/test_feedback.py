# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import math

import pytest

from focus_planner.core.progress import Progress, Standing
from focus_planner.runtime import feedback as module
from focus_planner.runtime.feedback import Feedback, Teller, feedback_fields


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""

    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(module, "time", clock)
    return clock


def step(stage="em", cost=math.nan, bound=None):
    return Progress(stage, 1, cost, bound)


def test_every_new_stage_is_sent_at_once(clock):
    feedback = Feedback(math.inf)
    stages = ["fresh", "visibility", "solving", "em"]
    assert [feedback.standing(step(stage)).stage for stage in stages] == stages


def test_within_a_stage_ten_a_second_are_sent(clock):
    feedback, sent = Feedback(math.inf), 0
    for k in range(1001):
        clock.now = 100.0 + k / 500
        sent += feedback.standing(step()) is not None
    assert 19 <= sent <= 21


def test_alternating_stages_are_sent_ten_times_a_second(clock):
    feedback, sent = Feedback(math.inf), 0
    for k in range(1001):
        clock.now = 100.0 + k / 500
        sent += feedback.standing(step(("prices", "k_view", "branching")[k % 3])) is not None
    assert 19 <= sent <= 23


def test_steps_that_are_not_sent_count(clock):
    feedback = Feedback(math.inf)
    feedback.standing(step(cost=9.0, bound=1.0))
    assert feedback.standing(step(cost=5.0, bound=3.0)) is None
    assert feedback.standing(step(cost=7.0, bound=2.0)) is None
    clock.now += 0.1001
    standing = feedback.standing(step(cost=8.0))
    assert (standing.cost, standing.lower_bound) == (5.0, 3.0)


def fields(feedback, progress):
    return feedback_fields(feedback.standing(progress))


def test_cost_bound_and_gap_are_unknown_at_first(clock):
    first = fields(Feedback(math.inf), step("visibility"))
    assert all(math.isnan(first[name]) for name in ("cost", "lower_bound", "gap"))


def test_a_step_without_a_cost_leaves_it(clock):
    feedback = Feedback(math.inf)
    feedback.standing(step(cost=4.0))
    assert fields(feedback, step("prices"))["cost"] == 4.0


def test_all_fields_are_filled(clock):
    feedback = Feedback(8.0)
    clock.now += 2.0
    assert fields(feedback, Progress("prices", 7, 4.0, 3.0)) == {
        "stage": "prices",
        "iteration": 7,
        "progress": 0.25,
        "cost": 4.0,
        "lower_bound": 3.0,
        "gap": 0.25,
        "elapsed": 2.0,
        "time_budget": 8.0,
    }


def test_progress_is_the_elapsed_part_of_the_time_budget(clock):
    feedback = Feedback(4.0)
    parts = []
    for seconds in (0.0, 1.0, 3.0, 4.0, 9.0):
        clock.now = 100.0 + seconds
        parts.append(fields(feedback, step())["progress"])
    assert parts == [0.0, 0.25, 0.75, 1.0, 1.0]


def test_without_a_time_budget_progress_is_unknown(clock):
    feedback = Feedback(math.inf)
    clock.now += 5.0
    told = fields(feedback, step())
    assert math.isnan(told["progress"])
    assert (told["elapsed"], told["time_budget"]) == (5.0, 0.0)


# --- between steps, and in the log -------------------------------------------------------------


class Told:
    """A teller, and what it told."""

    def __init__(self, clock):
        self.clock, self.sent, self.log = clock, [], []
        self.teller = Teller(self.log.append, "a plan", self.sent.append)

    def wait(self, seconds):
        """Let time pass, looked at a hundred times a second."""
        end = self.clock.now + seconds
        while self.clock.now < end:
            self.clock.now += 0.01
            self.teller.look()


def test_a_caller_hears_of_a_long_step_once_a_second(clock):
    told = Told(clock)
    told.wait(3.0)
    assert told.sent == []  # nothing is known yet
    told.teller.note(Standing("em", 1, elapsed=2.5))
    told.wait(3.5)
    assert [each.elapsed for each in told.sent] == pytest.approx([2.5, 3.5, 4.5, 5.5], abs=0.03)
    told.teller.note(Standing("em", 2, elapsed=6.0))
    assert [each.iteration for each in told.sent] == [1, 1, 1, 1, 2]


def test_the_log_is_told_of_long_plans_ever_less_often(clock):
    told = Told(clock)
    told.teller.note(Standing("visibility", 1, 0.5, time_budget=600.0))
    told.wait(4.9)
    assert told.log == []
    told.wait(295.0)
    assert told.log[0] == "a plan: casting rays to plan on, 50%, 5.0 s of 600 s"
    times = [round(float(line.rpartition(", ")[2].partition(" ")[0])) for line in told.log]
    assert times == [5, 15, 35, 75, 135, 195, 255]
