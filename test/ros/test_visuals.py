# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Showing plans in 3D: when what shows them is made, and who receives it over DDS."""

from __future__ import annotations

import threading
from functools import partial
from logging import getLogger

import pytest
from focus_planner_msgs.srv import PlanFocus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.conversions import fields_from_ros
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.ros.qos import LATCHED
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.requests import Request
from testing.planning_workers import ThreadedWorker
from testing.ros.calls import FEW, until
from testing.visuals import check_markers, cloud_columns, shown

PATIENCE = 240
VOLATILE = QoSProfile(depth=5, durability=DurabilityPolicy.VOLATILE)


# --- when it is made: in this process ------------------------------------------------------------


def the(content, _):
    return content


class Bench:
    """A planning thread whose process is a thread; whether somebody watches can be set."""

    def __init__(self, body):
        self.watched, self.events, self.asked = False, [], []
        self.gate = threading.Event()
        self.gate.set()
        self._plans = 0
        host = PlanningHost(
            name="/here",
            get_logger=getLogger,
            settings=lambda: Settings.from_values({}),
            now=lambda: (1, 2),
            on_rig=lambda _: None,
            publish=lambda plan: self.events.append(("published", plan.plan_id)),
            start=self._start,
            is_watched=lambda: self.watched,
            show=lambda visuals: self.events.append(("shown", visuals)),
            hide=lambda *of: self.events.append(("hidden", *of)),
        )
        self.planning = PlanningThread(host)
        rig = cylinder_rig()
        mesh = Arrival("/mesh", "shape_msgs/msg/Mesh", b"a mesh", partial(the, body))
        self.planning.receive_surface(mesh)
        self.planning.receive_rig(
            Arrival("/rig", "a rig", b"\0\1\0\0" + bytes(8), partial(the, rig))
        )

    def _start(self):
        return ThreadedWorker(self._intercept)

    def _intercept(self, order):
        if isinstance(order, orders.Describe):
            self.asked.append(order.plan_id)
        if isinstance(order, orders.Plan):
            self.gate.wait(PATIENCE)

    def ask(self):
        """Ask for a plan; return what tells when it has been answered."""
        self._plans += 1
        answered = threading.Event()
        request = Request(
            fields_from_ros(PlanFocus.Request(method="closest", samples=300)),
            Settings.from_values({"fresh_samples": 300}),
            f"plan {self._plans}",
            lambda _: answered.set(),
        )
        self.planning.plan(request)
        return answered

    def plan(self):
        assert self.ask().wait(PATIENCE)
        self.settle()

    def show(self):
        self.planning.show()
        self.settle()

    def settle(self):
        """Wait until the planning thread has done all that was queued."""
        self.planning._thread.submit(lambda: None).result(PATIENCE)

    def taken(self):
        """What happened since the last call, in short."""
        events, self.events = self.events, []
        return [event[:2] if event[0] == "published" else event[0] for event in events]


@pytest.fixture
def bench(body):
    bench = Bench(body)
    yield bench
    bench.gate.set()
    bench.planning.stop()
    assert bench.planning.finish(PATIENCE)


def test_nothing_is_made_while_nobody_watches(bench):
    bench.plan()
    bench.plan()
    bench.show()
    assert bench.asked == []
    assert bench.taken() == [("published", "plan 1"), "hidden", ("published", "plan 2"), "hidden"]


def test_while_somebody_watches_every_plan_is_shown(bench):
    bench.watched = True
    bench.plan()
    bench.plan()
    assert bench.asked == ["plan 1", "plan 2"]
    assert bench.taken() == [("published", "plan 1"), "shown", ("published", "plan 2"), "shown"]


def test_the_plan_in_force_is_made_once_for_who_watches_later(bench):
    bench.plan()
    bench.watched = True
    bench.show()
    bench.show()
    assert bench.asked == ["plan 1"]
    assert bench.taken() == [("published", "plan 1"), "hidden", "shown"]


def test_without_a_plan_there_is_nothing_to_show(bench):
    bench.watched = True
    bench.show()
    assert (bench.asked, bench.taken()) == ([], [])


def test_no_plan_is_shown_after_the_next_one(bench):
    bench.watched = True
    bench.plan()
    bench.watched = False
    bench.plan()
    bench.watched = True
    bench.show()
    assert bench.asked == ["plan 1", "plan 2"]
    assert bench.taken() == [
        ("published", "plan 1"),
        "shown",
        ("published", "plan 2"),
        "hidden",
        "shown",
    ]


def test_requests_that_wait_come_before_who_begins_to_watch(bench):
    bench.plan()
    bench.gate.clear()
    first, second = bench.ask(), bench.ask()
    bench.watched = True
    bench.planning.show()
    third = bench.ask()
    bench.gate.set()
    assert all(each.wait(PATIENCE) for each in (first, second, third))
    until(lambda: len(bench.asked) == 3)
    bench.settle()
    # What was to be shown has been replaced by then.
    assert bench.asked == ["plan 2", "plan 3", "plan 4"]


def test_a_plan_whose_process_has_gone_is_not_shown_nor_is_the_one_before(bench):
    bench.watched = True
    bench.plan()
    bench.watched = False
    bench.plan()
    bench.planning._requests.planner.close()
    bench.watched = True
    bench.taken()
    bench.show()
    assert bench.taken() == ["hidden"]
    bench.plan()
    assert bench.taken() == [("published", "plan 3"), "shown"]


# --- who receives it: over DDS -------------------------------------------------------------------


class Watcher:
    """Somebody who has RViz open: collects what arrives."""

    def __init__(self, planner, qos=LATCHED):
        self.markers, self.clouds = [], []
        self._context = Context()
        self._context.init(args=[])
        self._node = Node("watcher", context=self._context, use_global_arguments=False)
        for kind, topic, collected in (
            (MarkerArray, "markers", self.markers),
            (PointCloud2, "quality_cloud", self.clouds),
        ):
            self._node.create_subscription(kind, f"{planner}/{topic}", collected.append, qos)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._spin)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        # An executor that is shut down from another thread may miss it, and wait for ever.
        self._ended.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def _spin(self):
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=0.05)

    def found(self):
        """Whether the planner knows of it, and it of the planner."""
        subscriptions = self._node.subscriptions
        return all(self._node.count_publishers(each.topic_name) for each in subscriptions)

    def received(self, plan):
        """Wait for what shows a plan, check it, and return its cloud's columns."""
        stamp = stamp_of(plan)
        until(lambda: self._last(self.markers, stamp) and self._last(self.clouds, stamp))
        check_markers(self.markers[-1].markers, "world", stamp)
        return cloud_columns(self.clouds[-1])

    def _last(self, messages, stamp):
        if not messages:
            return False
        header = getattr(messages[-1], "header", None) or messages[-1].markers[0].header
        held = len(getattr(messages[-1], "markers", ())) > 1 or getattr(messages[-1], "width", 0)
        return bool(held) and (header.stamp.sec, header.stamp.nanosec) == stamp

    def stamps(self):
        """The stamps of all that has arrived."""
        headers = [message.markers[0].header for message in self.markers]
        headers += [message.header for message in self.clouds]
        return {(header.stamp.sec, header.stamp.nanosec) for header in headers}


def stamp_of(plan):
    return plan.header.stamp.sec, plan.header.stamp.nanosec


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner(*FEW)


@pytest.fixture
def ready(client, body, rig):
    client.publish_mesh(body)
    client.publish_rig(rig)
    return client


def planned(client, **request):
    answer = client.plan(**{"method": "closest"} | request)
    assert answer.success, answer.message
    return answer.plan


@pytest.mark.processes
@pytest.mark.parametrize("shots", [1, 2])
def test_who_subscribes_receives_every_plan(ready, planner, shots):
    with Watcher(planner.name) as watcher:
        until(watcher.found)
        for seed in (1, 2):
            plan = planned(ready, seed=seed, shots=shots)
            cloud = watcher.received(plan)
            assert 1000 * cloud["cost"].mean(dtype=float) == pytest.approx(plan.fresh_cost)
            assert cloud["camera"].max() < len(plan.cameras)


@pytest.mark.processes
@pytest.mark.parametrize("qos", [LATCHED, VOLATILE])
def test_who_subscribes_after_the_plan_receives_it_too(ready, planner, qos):
    with Watcher(planner.name, qos) as before:
        until(before.found)
        old = planned(ready, seed=3)
        before.received(old)
    plan = planned(ready, seed=4)
    for _ in range(2):
        with Watcher(planner.name, qos) as watcher:
            watcher.received(plan)
            assert watcher.stamps() == {stamp_of(plan)}


@pytest.mark.processes
def test_nothing_is_left_of_a_larger_rig(ready, planner):
    with Watcher(planner.name) as watcher:
        until(watcher.found)
        watcher.received(planned(ready))
        small = cylinder_rig(rows=2, columns=5, radius=1.2)
        ready.publish_rig(small)
        watcher.received(planned(ready))
        everything = [marker for message in watcher.markers for marker in message.markers]
    names = [number for namespace, number in shown(everything) if namespace == "names"]
    assert sorted(names) == list(range(len(small)))


@pytest.mark.processes
def test_while_inactive_the_plan_in_force_is_shown_and_no_more_once_cleaned_up(start_planner, body):
    planner = start_planner(*FEW)
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(cylinder_rig(rows=4, columns=8, radius=1.2))
        plan = planned(client)
        assert client.change_state("deactivate")
        with Watcher(planner.name) as watcher:
            watcher.received(plan)
            assert client.change_state("cleanup")
            until(lambda: not watcher.found())
            assert client.change_state("configure")
            assert client.change_state("activate")
            until(watcher.found)
            assert watcher.stamps() == {stamp_of(plan)}
            client.publish_mesh(body)
            client.publish_rig(cylinder_rig(rows=4, columns=8, radius=1.2))
            watcher.received(planned(client))
