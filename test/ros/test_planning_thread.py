from __future__ import annotations

import logging
import threading
from functools import partial
from logging import getLogger

from focus_planner_msgs.srv import PlanFocus

from focus_planner.core.progress import STAGES
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.conversions import fields_from_ros
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.ros.request_planner import PlanningHost
from focus_planner.runtime import feedback
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Request
from testing.planning_workers import ThreadedWorker


def the(content, _):
    return content


class Bench:
    """A planning thread whose process is a thread too, and a request."""

    def __init__(self, body, on_feedback=lambda fields: None):
        self.published, self.answers, self.answered = [], [], threading.Event()
        self.planning = PlanningThread(
            PlanningHost(
                "/here",
                getLogger,
                lambda: Settings.from_values({}),
                lambda: (1, 2),
                len,
                self.published.append,
                ThreadedWorker,
            )
        )
        surface = Arrival("/mesh", "shape_msgs/msg/Mesh", b"a mesh", partial(the, body))
        self.planning.receive_surface(surface)
        rig = Arrival("/rig", "a rig", b"\0\1\0\0" + bytes(8), partial(the, cylinder_rig()))
        self.planning.receive_rig(rig)
        self.request = Request(
            fields_from_ros(PlanFocus.Request(samples=500)),
            Settings.from_values({}),
            "a plan",
            lambda outcome: (self.answers.append(outcome), self.answered.set()),
            send_feedback=on_feedback,
        )

    def plan(self):
        """Plan, and return the answer; the thread is still to be ended."""
        self.planning.plan(self.request)
        assert self.answered.wait(240)
        (answer,) = self.answers
        return answer


def test_what_ends_with_the_node_is_not_published_however_late_the_request_is_ended(body):
    def stop(fields):
        if fields["stage"] == "solving":
            bench.planning.stop()

    bench = Bench(body, stop)
    answer = bench.plan()
    assert bench.planning.finish(60)
    assert (answer.reason, answer.plan) == (Reason.SHUTTING_DOWN, None)
    assert answer.message == "the node is shutting down"
    assert bench.published == []


def test_the_log_tells_where_a_long_plan_is(body, caplog, monkeypatch):
    monkeypatch.setattr(feedback, "_FIRST_ENTRY", 0.0)  # any plan is a long one
    caplog.set_level(logging.INFO)
    bench = Bench(body)
    assert bench.plan().reason is Reason.NONE
    bench.planning.stop()
    assert bench.planning.finish(60)
    said = [record.getMessage() for record in caplog.records]
    assert any(line.startswith("inputs: reading the inputs, ") for line in said)
    # That the plan was made is the other line.
    where, *_, made = (line for line in said if line.startswith("a plan: "))
    assert where.partition(",")[0].removeprefix("a plan: ") in STAGES.values()
    assert where.endswith(" s")
    assert "k_view, cost" in made
