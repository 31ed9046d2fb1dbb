# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Planning for new surfaces without being asked."""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import partial
from logging import getLogger

import numpy as np
import pytest
from focus_planner_msgs.srv import PlanFocus

from focus_planner import cylinder_rig
from focus_planner.core.validation import InputError
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.messages.typestore import RIG as RIG_TYPE
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.folders import runs_newest_first
from focus_planner.recording.run_reading import read_run
from focus_planner.ros import replanner as module
from focus_planner.ros.conversions import fields_from_ros
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.ros.replanner import Replanner
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.replanning import Replanned
from focus_planner.runtime.requests import Request, unasked
from testing.clock import StoppedTime
from testing.planning_workers import ThreadedWorker
from testing.ros.calls import FEW, until
from testing.ros.recorded import assert_reproduced

RIG = cylinder_rig(rows=2, columns=6, radius=1.2)
HEADER = b"\0\1\0\0" + bytes(8)


def the(content, _):
    return content


def refuse(got, _):
    raise InputError("mesh", "a good one", got)


def bad_surface(got):
    return Arrival("/mesh", "shape_msgs/msg/Mesh", got.encode(), partial(refuse, got))


class Bench:
    """A planning thread whose process is a thread too, and what it publishes."""

    def __init__(self, body, **parameters):
        self.body = body
        values = {"samples": 300, "fresh_samples": 300, "replan": "on_surface", **parameters}
        self.settings = Settings.from_values(values)
        self.published, self.changes, self.orders = [], [], []
        self.gate = threading.Event()
        self.gate.set()
        host = PlanningHost(
            name="/here",
            get_logger=getLogger,
            settings=lambda: self.settings,
            now=lambda: (1, 2),
            on_rig=lambda _: None,
            publish=self.published.append,
            publish_changes=self.changes.append,
            start=partial(ThreadedWorker, self._intercept),
        )
        self.planning = PlanningThread(host)

    def _intercept(self, order):
        if isinstance(order, orders.Plan):
            self.orders.append(order)
            assert self.gate.wait(240)

    def send(self, moved=0.0):
        """Have a surface arrive, with what the node does then."""
        vertices = self.body.vertices + [moved, 0.0, 0.0]
        read = partial(the, replace(self.body, vertices=vertices))
        arrival = Arrival("/mesh", "shape_msgs/msg/Mesh", f"moved {moved}".encode(), read)
        self.receive(arrival)
        return arrival

    def receive(self, arrival):
        self.planning.receive_surface(arrival, to_replan=True)
        self.replan()

    def replan(self):
        self.planning.replan(unasked(self.settings, f"plan {len(self.orders)}"))

    def send_rig(self):
        self.planning.receive_rig(Arrival("/rig", RIG_TYPE, HEADER, partial(the, RIG)))

    def ask(self, **request):
        """Return the answer to somebody who asks."""
        answers, answered = [], threading.Event()
        request = Request(
            fields_from_ros(PlanFocus.Request(**request)),
            self.settings,
            "asked",
            lambda outcome: (answers.append(outcome), answered.set()),
        )
        self.planning.plan(request)
        return lambda: answered.wait(240) and answers[0]

    def counts(self, **expected):
        """Wait until there is this account of surfaces."""
        until(lambda: self.planning.replanned == Replanned(**expected))

    def end(self):
        self.gate.set()
        self.planning.stop()
        assert self.planning.finish(60)


@pytest.fixture
def make_bench(body):
    benches = []

    def make(**parameters):
        benches.append(Bench(body, **parameters))
        return benches[-1]

    yield make
    for bench in benches:
        bench.end()


@pytest.fixture
def bench(make_bench):
    return make_bench()


# --- which surfaces ------------------------------------------------------------------------------


def test_a_surface_is_planned_for_once_there_is_a_rig(bench):
    bench.send()
    bench.counts(waiting=1)
    assert bench.published == []
    bench.send_rig()
    bench.replan()
    bench.counts(planned=1)
    (plan,) = bench.published
    assert [note.code for note in plan.notes][-1:] == ["replanned"]
    assert bench.planning.snapshot.last_run.message.startswith(
        "replanned on the surface received on /mesh at "
    )


def test_while_a_plan_is_made_the_newest_takes_the_place_of_those_before(bench):
    bench.send_rig()
    bench.gate.clear()
    bench.send(0.0)
    until(lambda: bench.orders)
    for moved in (0.01, 0.02, 0.03):
        newest = bench.send(moved)
    assert bench.planning.replanning == "plan 0"
    bench.gate.set()
    bench.counts(planned=2, stale=2)
    assert len(bench.published) == len(bench.orders) == 2
    assert bench.planning.snapshot.surface.received == newest.at
    cold, warm = bench.orders
    assert cold.warm_start is None
    distances = [camera.focus_distance for camera in bench.published[0].cameras]
    np.testing.assert_array_equal(warm.warm_start.focus_distances, distances)


def test_nothing_is_planned_twice_for_the_same_surface(bench):
    bench.send_rig()
    bench.send()
    bench.counts(planned=1)
    bench.replan()
    answer = bench.ask()()
    assert answer.plan is not None
    bench.replan()
    assert bench.ask()().plan is not None
    assert [plan.plan_id for plan in bench.published] == ["plan 0", "asked", "asked"]


def test_a_bad_surface_costs_nothing_and_who_asks_next_is_told_once(bench):
    bench.send_rig()
    bench.send()
    bench.counts(planned=1)
    bench.receive(bad_surface("a bad one"))
    bench.counts(planned=1, refused=1)
    bench.send(0.01)
    bench.receive(bad_surface("a worse one"))
    bench.counts(planned=2, refused=2)
    assert len(bench.published) == 2
    refusal = bench.ask()()
    assert refusal.reason is Reason.NOT_READY
    assert "a worse one" in refusal.message
    assert bench.ask()().plan is not None


def test_why_there_is_no_plan_is_told_until_there_is_one(make_bench):
    bench = make_bench(max_problem_size=10)
    bench.send_rig()
    bench.send()
    until(lambda: bench.planning.replanned.failed == 1)
    assert "max_problem_size" in bench.planning.replanned.failure
    assert bench.published == []
    bench.settings = Settings.from_values(dict(bench.settings.values) | {"max_problem_size": 0})
    bench.send(0.01)
    bench.counts(planned=1, failed=1)


# --- beside who asks -----------------------------------------------------------------------------


def test_who_asks_does_not_wait_for_what_nobody_asked_for(bench):
    bench.send_rig()
    bench.gate.clear()
    bench.send()
    until(lambda: bench.planning.replanning)
    answer = bench.ask(method="em")
    bench.gate.set()
    assert answer().plan.method == "em"
    # That plan is for the newest surface, so none is left to plan for.
    bench.counts(planned=1)
    assert [plan.plan_id for plan in bench.published] == ["asked"]
    assert bench.ask()().plan is not None


def test_who_asks_gets_a_plan_that_depends_on_no_other(bench):
    bench.send_rig()
    bench.send()
    bench.counts(planned=1)
    bench.ask()()
    assert [order.warm_start is None for order in bench.orders] == [True, True]
    bench.send(0.01)
    bench.counts(planned=2)
    assert bench.orders[-1].warm_start is not None


def test_a_pause_ends_what_nobody_asked_for(bench):
    bench.send_rig()
    bench.gate.clear()
    bench.send()
    until(lambda: bench.planning.replanning)
    bench.planning.pause()
    bench.gate.set()
    until(lambda: not bench.planning.replanning)
    bench.planning.resume()
    bench.replan()
    bench.counts(planned=1)
    assert len(bench.published) == 1
    assert len(bench.orders) == 2


# --- lenses, records -----------------------------------------------------------------------------


def test_lenses_stay_whose_change_is_too_small(make_bench):
    bench = make_bench(min_change=1.0)
    bench.send_rig()
    bench.send()
    bench.counts(planned=1)
    bench.send(0.002)
    bench.counts(planned=2)
    before, after = map(plan_from_message, bench.changes)
    moved = before.focus_distances != after.focus_distances
    assert not moved.all()
    assert "held" in [note.code for note in after.notes]
    assert bench.published == []
    bench.ask()()  # who asks is told all, and by all lenses
    (asked,) = map(plan_from_message, bench.published)
    assert "held" not in [note.code for note in asked.notes]


def test_of_many_plans_few_are_recorded(make_bench, tmp_path):
    bench = make_bench(record_directory=str(tmp_path), record_replan_period=3600.0)
    bench.send_rig()
    for number in range(3):
        bench.send(0.01 * number)
        bench.counts(planned=number + 1)
    assert [order.is_recorded for order in bench.orders] == [True, False, False]
    bench.end()
    assert len(list(tmp_path.iterdir())) == 1


# --- when ----------------------------------------------------------------------------------------


class Planning:
    """What a replanner hands over."""

    def __init__(self):
        self.surfaces_wait = False
        self.read, self.replanned = [], 0

    def receive_surface(self, arrival, *, to_replan):
        self.read.append((arrival, to_replan))
        self.surfaces_wait = self.surfaces_wait or to_replan

    def receive_rig(self, arrival):
        self.read.append(arrival)

    def replan(self, request):
        assert not request.is_asked
        self.replanned += 1
        self.surfaces_wait = False


@pytest.fixture
def clock(monkeypatch):
    clock = StoppedTime()
    monkeypatch.setattr(module, "time", clock)
    return clock


@pytest.fixture
def make_replanner(make_node, clock):
    node = make_node()

    def make(**parameters):
        planning = Planning()
        settings = Settings.from_values(parameters)
        return Replanner(node, planning, lambda: settings), planning

    return make


def test_by_default_surfaces_are_only_read(make_replanner):
    replanner, planning = make_replanner()
    replanner.receive_surface("a surface")
    replanner.receive_rig("a rig")
    assert planning.read == [("a surface", False), "a rig"]
    assert planning.replanned == 0


def test_each_surface_is_planned_for_at_once(make_replanner):
    replanner, planning = make_replanner(replan="on_surface")
    for _ in range(3):
        replanner.receive_surface("a surface")
    assert planning.replanned == 3
    planning.surfaces_wait = True  # for a rig
    replanner.receive_rig("a rig")
    replanner.receive_rig("another rig")
    assert planning.replanned == 4


def test_a_rate_is_kept_and_the_last_surface_is_not_forgotten(make_replanner, clock):
    replanner, planning = make_replanner(replan="rate", replan_rate=4.0)
    for _ in range(3):
        replanner.receive_surface("a surface")
        clock.advance(0.05)
    assert planning.replanned == 1
    assert not replanner._timer.is_canceled()
    assert replanner._timer.timer_period_ns == pytest.approx(0.15e9, abs=2)
    clock.advance(0.11)
    replanner.plan_if_due()  # as the timer does
    assert planning.replanned == 2
    assert replanner._timer.is_canceled()
    replanner.plan_if_due()
    assert planning.replanned == 2


# --- a node of its own ---------------------------------------------------------------------------


@pytest.mark.processes
def test_a_node_plans_for_what_it_receives(start_planner, tmp_path, body, rig):
    from focus_planner.ros.client import PlannerClient  # noqa: PLC0415

    record = ("-p", f"record_directory:={tmp_path}", "-p", "record_replan_period:=0.0")
    held = ("-p", "min_change:=0.5", "-p", "replan:=on_surface")
    planner = start_planner(*FEW, *record, *held)
    with PlannerClient(planner.name) as client:
        client.wait_for_node()
        client.publish_mesh(body)
        client.publish_rig(rig)
        first = until(lambda: client.status().plan_id)
        client.publish_mesh(replace(body, vertices=body.vertices + [0.002, 0.0, 0.0]))
        status = until(lambda: (s := client.status()).plan_id != first and s)
        assert status.plan_surface.topic == f"{planner.name}/mesh"
        told = {lens.plan_id for lens in status.lenses}
        assert told <= {first, status.plan_id}
        assert first in told
        assert client.plan().success
    planner.stop()
    runs = [run for run in runs_newest_first(tmp_path) if run.is_whole()]
    assert len(runs) == 3
    for run in runs:
        assert_reproduced(read_run(run.path))
