from __future__ import annotations

import math

import pytest

from focus_planner.core.progress import Progress
from focus_planner.runtime import feedback as module
from focus_planner.runtime.feedback import Feedback


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
    assert [feedback.fields(step(stage))["stage"] for stage in stages] == stages


def test_within_a_stage_ten_a_second_are_sent(clock):
    feedback, sent = Feedback(math.inf), 0
    for k in range(1001):
        clock.now = 100.0 + k / 500
        sent += feedback.fields(step()) is not None
    assert 19 <= sent <= 21


def test_alternating_stages_are_sent_ten_times_a_second(clock):
    feedback, sent = Feedback(math.inf), 0
    for k in range(1001):
        clock.now = 100.0 + k / 500
        sent += feedback.fields(step(("prices", "k_view", "branching")[k % 3])) is not None
    assert 19 <= sent <= 23


def test_steps_that_are_not_sent_count(clock):
    feedback = Feedback(math.inf)
    feedback.fields(step(cost=9.0, bound=1.0))
    assert feedback.fields(step(cost=5.0, bound=3.0)) is None
    assert feedback.fields(step(cost=7.0, bound=2.0)) is None
    clock.now += 0.1001
    fields = feedback.fields(step(cost=8.0))
    assert (fields["cost"], fields["lower_bound"]) == (5.0, 3.0)


def test_cost_and_bound_are_unknown_at_first(clock):
    fields = Feedback(math.inf).fields(step("visibility"))
    assert math.isnan(fields["cost"])
    assert math.isnan(fields["lower_bound"])


def test_a_step_without_a_cost_leaves_it(clock):
    feedback = Feedback(math.inf)
    feedback.fields(step(cost=4.0))
    assert feedback.fields(step("prices"))["cost"] == 4.0


def test_progress_is_the_elapsed_part_of_the_time_budget(clock):
    feedback = Feedback(4.0)
    parts = []
    for seconds in (0.0, 1.0, 3.0, 4.0, 9.0):
        clock.now = 100.0 + seconds
        parts.append(feedback.fields(step())["progress"])
    assert parts == [0.0, 0.25, 0.75, 1.0, 1.0]


def test_without_a_time_budget_progress_is_unknown(clock):
    feedback = Feedback(math.inf)
    clock.now += 5.0
    assert math.isnan(feedback.fields(step())["progress"])
