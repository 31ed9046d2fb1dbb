# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Publishing plans, and restoring the last one, in this process."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from focus_planner_msgs.msg import CameraFocus, FocusPlan
from rclpy.publisher import Publisher

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import PLAN, serialize
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.run_writing import beginning_messages, plan_message
from focus_planner.ros import plan_publisher as module
from focus_planner.ros.camera_topics import CameraTopics
from focus_planner.ros.plan_publisher import PlanPublisher
from testing import made_up_runs as made_up
from testing.clock import StoppedTime
from testing.ros.log import recorded_log

RIG = cylinder_rig(rows=1, columns=2)
NAMES = [camera.name for camera in RIG.cameras]
TOPICS = ["/here/focus_plan", *(f"/here/cameras/{name}/focus" for name in NAMES)]


def plan(plan_id="a plan"):
    return FocusPlan(plan_id=plan_id, cameras=[CameraFocus(name=name) for name in NAMES])


@pytest.fixture
def clock(monkeypatch):
    clock = StoppedTime()
    monkeypatch.setattr(module, "time", clock)
    return clock


class Bench:
    """A publisher, and everything that it does, in order."""

    def __init__(self, node):
        self.node = node
        self.log = recorded_log(node)
        self.events = []
        self.cameras = CameraTopics(node)
        self.plans = PlanPublisher(node, self.cameras, self._on_plan)

    def _on_plan(self, plan, *, from_record=False, told=None):
        names = () if told is None else tuple(sorted(told))
        self.events.append(("noted", plan.plan_id, from_record, *names))

    def taken(self):
        """The events since the last call."""
        events = self.events.copy()
        self.events.clear()
        return events


@pytest.fixture
def bench(make_node, monkeypatch, clock):
    bench = Bench(make_node())

    def publish(publisher, message):
        bench.events.append(publisher.topic_name)

    monkeypatch.setattr(Publisher, "publish", publish)
    bench.plans.open()
    yield bench
    bench.plans.close()


def record(directory, number=1, **changed):
    """Record a run of this node whose plan was published; it was killed afterwards."""
    beginning = replace(made_up.beginning(number), planner="/here")
    fields = made_up.plan_fields(number, NAMES) | changed
    bag = BagWriter()
    bag.open(directory / made_up.run_id(number))
    for message in beginning_messages(beginning):
        bag.add(message)
    bag.add(plan_message(beginning, serialize(PLAN, fields), published=True))
    bag.flush()
    bag.abandon()


def test_a_plan_is_known_before_it_is_published(bench):
    bench.plans.follow([camera.name for camera in RIG.cameras])
    bench.plans.publish(plan())
    assert bench.taken() == [("noted", "a plan", False), *TOPICS]


def test_only_cameras_that_have_something_else_to_do_are_told_of_changes(bench):
    def plan_at(*distances, plan_id="a plan", **values):
        cameras = [
            CameraFocus(name=name, focus_distance=distance, bracket=[distance], **values)
            for name, distance in zip(NAMES, distances, strict=True)
        ]
        return FocusPlan(plan_id=plan_id, cameras=cameras)

    everything, first, second = TOPICS
    bench.plans.follow(NAMES)
    bench.plans.publish_changes(plan_at(0.5, 0.6))
    assert bench.taken() == [("noted", "a plan", False, *NAMES), *TOPICS]
    bench.plans.publish_changes(plan_at(0.5, 0.7, assigned_samples=3))
    assert bench.taken() == [("noted", "a plan", False, NAMES[1]), everything, second]
    bench.plans.publish_changes(plan_at(0.5, 0.7, device_value=math.nan))
    assert bench.taken() == [("noted", "a plan", False), everything]
    bench.plans.publish_changes(plan_at(0.5, 0.7, device_unit="steps", device_bracket=[7.0]))
    assert bench.taken() == [("noted", "a plan", False, *NAMES), *TOPICS]
    bench.plans.publish(plan_at(0.5, 0.7))  # somebody asked for it
    assert bench.taken() == [("noted", "a plan", False), *TOPICS]
    bench.plans.follow(NAMES[1:])
    bench.plans.follow(NAMES)  # its topic is new, and has nothing yet
    bench.plans.publish_changes(plan_at(0.5, 0.7))
    assert bench.taken() == [("noted", "a plan", False, NAMES[0]), everything, first]


def test_the_last_plan_is_restored_once_subscribers_have_been_discovered(bench, tmp_path, clock):
    record(tmp_path)
    bench.plans.restore(tmp_path)
    assert clock.slept == [0.3]
    assert bench.taken() == [("noted", made_up.run_id(1), True), *TOPICS]
    (text,) = bench.log.of("info")
    assert text.startswith(f"restored the last plan, {made_up.run_id(1)}, from its record ")
    assert str(tmp_path) in text


def test_a_restored_plan_is_repeated_for_subscribers_discovered_late(bench, tmp_path, clock):
    record(tmp_path)
    bench.plans.restore(tmp_path)
    bench.taken()
    repeated = []
    for _ in range(40):
        bench.plans.repeat_if_due()
        if events := bench.taken():
            assert events == TOPICS
            repeated.append(clock.now)
        clock.advance(0.1)
    assert [round(now - 1000.3, 1) for now in repeated] == [0.3, 0.7, 1.5]


@pytest.mark.parametrize(
    "end",
    [
        lambda plans: plans.publish(plan("a newer one")),
        lambda plans: plans.follow([camera.name for camera in RIG.cameras]),
        lambda plans: plans.close(),
    ],
)
def test_what_replaces_a_restored_plan_ends_its_repetition(bench, tmp_path, clock, end):
    record(tmp_path)
    bench.plans.restore(tmp_path)
    end(bench.plans)
    bench.taken()
    clock.advance(10.0)
    bench.plans.repeat_if_due()
    assert bench.taken() == []


def test_without_a_record_nothing_is_restored(bench, tmp_path, clock):
    bench.plans.restore(tmp_path)
    bench.plans.restore(tmp_path / "not there")
    assert (bench.taken(), bench.log.records, clock.slept) == ([], [], [])


def test_a_directory_that_cannot_be_read_is_logged(bench, tmp_path):
    bench.plans.restore(tmp_path / ("a" * 300))
    (text,) = bench.log.of("error")
    assert text.startswith("cannot look for the last plan: ")
    assert text.endswith("'" + "a" * 300 + "'") or "File name too long" in text
    assert bench.taken() == []


def restored(bench, directory):
    """What is put in force, in short."""
    bench.plans.restore(directory)
    return [event[1] for event in bench.taken() if event[0] == "noted"]


def test_before_a_plan_that_cannot_be_published_comes_the_one_before(bench, tmp_path):
    record(tmp_path)
    record(tmp_path, 2, plan_id="../etc")
    assert restored(bench, tmp_path) == [made_up.run_id(1)]
    ((name, why),) = bench.plans.skipped
    assert name == f"{made_up.run_id(2)}.partial"
    (text,) = bench.log.of("warning")
    assert text == f"skipped {name} in the search for the last plan: {why}"
    assert "'../etc'" in why


def test_a_name_that_makes_no_topic_here_is_skipped(bench, tmp_path, monkeypatch):
    record(tmp_path)

    def refuse(_, names):
        raise InputError("camera name", "part of a topic's name", names[0])

    monkeypatch.setattr(CameraTopics, "check_names", refuse)
    assert restored(bench, tmp_path) == []
    assert len(bench.plans.skipped) == 1


def test_what_fails_when_a_plan_is_restored_is_logged(bench, tmp_path, monkeypatch):
    record(tmp_path)

    def fail(*_):
        raise RuntimeError("no more topics")

    monkeypatch.setattr(CameraTopics, "follow", fail)
    assert restored(bench, tmp_path) == []
    monkeypatch.undo()
    (text,) = bench.log.of("error")
    assert text.endswith("RuntimeError('no more topics')")


def test_a_flood_of_bad_runs_does_not_flood_the_log(bench, tmp_path):
    for number in range(30):
        (tmp_path / made_up.run_id(number) / "folder").mkdir(parents=True)
    bench.plans.restore(tmp_path)
    assert len(bench.plans.skipped) == 30
    assert len(bench.log.of("warning")) == 21
    assert bench.log.of("warning")[-1] == "skipped 10 more in the search for the last plan"


def test_closed_it_leaves_no_topics(bench):
    bench.plans.follow([camera.name for camera in RIG.cameras])
    assert {p.topic_name for p in bench.node.publishers} >= set(TOPICS)
    bench.plans.close()
    assert not {p.topic_name for p in bench.node.publishers} & set(TOPICS)
