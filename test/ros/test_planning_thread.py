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

import logging
import math
import threading
from functools import partial
from logging import getLogger
from multiprocessing.connection import Pipe

from focus_planner_msgs.srv import PlanFocus

from focus_planner.core.progress import STAGES, Progress
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.conversions import fields_from_ros
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.runtime import feedback
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Request
from testing.planning_workers import ThreadedWorker
from testing.ros.calls import until


def the(content, _):
    return content


def planning_with(start, publish=len):
    settings = Settings.from_values({})
    host = PlanningHost("/here", getLogger, lambda: settings, lambda: (1, 2), len, publish, start)
    return PlanningThread(host)


class Bench:
    """A planning thread whose process is a thread too, and a request."""

    def __init__(self, body, on_feedback=lambda fields: None):
        self.published, self.answers, self.answered = [], [], threading.Event()
        self.planning = planning_with(ThreadedWorker, self.published.append)
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


class Compiler:
    """A planning process that compiles until it is let go on."""

    pid = 0

    def __init__(self):
        self.connection, self._theirs = Pipe()
        self.go_on = threading.Event()
        threading.Thread(target=self._compile, daemon=True).start()

    def _compile(self):
        step = Progress("compiling", 1, math.nan, share=0.25, expected=170.0)
        self._theirs.send(orders.Compiling(step))
        self.go_on.wait(240)
        self._theirs.send(orders.Compiled("compiled 118 kernels in 171 s", True))
        self._theirs.send(orders.Done())

    def kill(self):
        self.connection.close()


def test_the_log_and_diagnostics_tell_that_it_compiles(caplog):
    caplog.set_level(logging.INFO)
    compiler = Compiler()
    planning = planning_with(lambda: compiler)
    loading = threading.Thread(target=planning.load)
    loading.start()
    until(lambda: planning.compiling)
    assert planning.compiling.startswith("compiling, once, about 3 min, 25%, ")
    assert [record.getMessage() for record in caplog.records] == ["compiling, once, about 3 min"]
    compiler.go_on.set()
    loading.join(240)
    assert planning.compiling == ""
    assert caplog.records[-1].getMessage() == "compiled 118 kernels in 171 s"
    planning.stop()
    assert planning.finish(60)
