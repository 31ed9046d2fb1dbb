# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What ``~/status`` and ``/diagnostics`` contain and when they are published, in this process."""

from __future__ import annotations

import math
from copy import deepcopy
from datetime import datetime, timezone

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from focus_planner_msgs.msg import CameraFocus, FocusPlan, LensState
from rclpy.publisher import Publisher

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError
from focus_planner.io.lens_tables import LensTables
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.typestore import LENS_STATE, deserialize, serialize
from focus_planner.ros import diagnostics, status
from focus_planner.ros.diagnostics import DiagnosticsPublisher
from focus_planner.ros.status import StatusPublisher
from focus_planner.runtime.diagnostics import Diagnosis, Level
from focus_planner.runtime.inputs import InputState
from focus_planner.runtime.status import PlannerReport, Snapshot
from testing.clock import StoppedTime

IDLE = PlannerReport("active")
PERIOD = 1.0


@pytest.fixture
def clock(monkeypatch):
    clock = StoppedTime()
    monkeypatch.setattr(status, "time", clock)
    monkeypatch.setattr(diagnostics, "time", clock)
    return clock


@pytest.fixture
def published(monkeypatch):
    """All messages that any publisher has been given."""
    messages = []
    monkeypatch.setattr(Publisher, "publish", lambda _, message: messages.append(deepcopy(message)))
    return messages


@pytest.fixture
def publisher(make_node, clock, published):
    publisher = StatusPublisher(make_node())
    published.clear()
    return publisher


TOLERANCE = 0.1


def plan(plan_id="a plan"):
    cameras = [CameraFocus(name=f"cam_{k}", focus_distance=1.0 + k) for k in range(3)]
    return FocusPlan(plan_id=plan_id, cameras=cameras)


def report_of(camera="cam_1", plan_id="a plan", code=LensStatus.VERIFIED, **values):
    distance = 1.0 + int(camera[-1]) if camera[-1:].isdigit() else 1.0
    fields = {
        "header": {"stamp": {"sec": 7, "nanosec": 0}},
        "name": camera,
        "plan_id": plan_id,
        "status": int(code),
        "planned_distance": distance,
        "unit": "m",
        "sent_value": distance,
        "read_value": distance,
        "read_distance": distance,
        "read_at": {"sec": 6, "nanosec": 0},
    }
    fields |= values
    return deserialize(LENS_STATE, serialize(LENS_STATE, fields))


def newest(publisher, published, clock, report=IDLE):
    clock.advance(PERIOD)
    publisher.publish_if_due(report, PERIOD)
    return published[-1]


# --- when --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change",
    [
        lambda publisher: publisher.changed(),
        lambda publisher: publisher.planned(plan("another")),
        lambda publisher: publisher.reported(report_of(), TOLERANCE),
        lambda publisher: publisher.clear(),
        lambda publisher: publisher.published_by(["/a"]),
    ],
)
def test_a_change_is_published_soon(publisher, published, clock, change):
    publisher.planned(plan())
    newest(publisher, published, clock)
    clock.advance(0.5)
    publisher.publish_if_due(IDLE, PERIOD)
    assert len(published) == 1
    change(publisher)
    publisher.publish_if_due(IDLE, PERIOD)
    assert len(published) == 2
    clock.advance(0.5)
    publisher.publish_if_due(IDLE, PERIOD)
    assert len(published) == 2


def test_changes_are_published_ten_times_a_second_at_most(publisher, published, clock):
    for _ in range(100):
        publisher.changed()
        publisher.publish_if_due(IDLE, PERIOD)
        clock.advance(1 / 64)
    assert 14 <= len(published) <= 16


def test_another_state_is_published_soon(publisher, published, clock):
    newest(publisher, published, clock)
    clock.advance(0.1)
    publisher.publish_if_due(PlannerReport("deactivating"), PERIOD)
    publisher.publish_if_due(PlannerReport("inactive"), PERIOD)
    clock.advance(0.1)
    publisher.publish_if_due(PlannerReport("inactive"), PERIOD)
    states = [message.state for message in published]
    assert states == ["active", "deactivating", "inactive"]


# --- what --------------------------------------------------------------------------------------


def test_the_report_is_in_it(publisher, published, clock):
    received = datetime(2025, 1, 1, tzinfo=timezone.utc)
    surface = InputState("surface", "/here/mesh", received, (12, 34))
    snapshot = Snapshot(surface, InputState("rig", refused="a bad one"))
    report = PlannerReport("active", "a request", 2, snapshot)
    message = newest(publisher, published, clock, report)
    assert (message.state, message.planning, message.waiting) == ("active", "a request", 2)
    assert (message.surface.topic, message.surface.stamp.sec) == ("/here/mesh", 12)
    assert message.surface.age > 0
    assert (message.rig.topic, message.rig.refused) == ("", "a bad one")
    assert math.isnan(message.rig.age)
    assert message.header.stamp.sec > 0


def test_lenses_of_a_new_plan_have_not_reported(publisher, published, clock):
    publisher.planned(plan(), from_record=True)
    message = newest(publisher, published, clock)
    assert (message.plan_id, message.from_record) == ("a plan", True)
    assert [lens.name for lens in message.lenses] == ["cam_0", "cam_1", "cam_2"]
    assert [lens.planned_distance for lens in message.lenses] == [1.0, 2.0, 3.0]
    assert all(math.isnan(lens.sent_value) for lens in message.lenses)
    assert (message.unreported, message.verified) == (3, 0)


def test_reports_of_lenses_are_counted(publisher, published, clock):
    publisher.planned(plan())
    assert publisher.reported(report_of("cam_1", sent_value=5.0), TOLERANCE)
    assert publisher.reported(report_of("cam_2", code=LensStatus.FAILED), TOLERANCE)
    message = newest(publisher, published, clock)
    counts = (message.unreported, message.sent, message.verified, message.differ, message.failed)
    assert counts == (1, 0, 1, 0, 1)
    assert message.accepted == 0
    assert publisher.reported(report_of("cam_0", code=LensStatus.ACCEPTED), TOLERANCE)
    message = newest(publisher, published, clock)
    assert (message.unreported, message.accepted, message.verified) == (0, 1, 1)
    assert (message.lenses[1].sent_value, message.lenses[1].planned_distance) == (5.0, 2.0)
    assert publisher.lens_summary.counts[LensStatus.VERIFIED] == 1
    publisher.planned(plan("another"))
    assert publisher.lens_summary.counts == {LensStatus.UNREPORTED: 3}


@pytest.mark.parametrize("other", [{"plan_id": "another"}, {"plan_id": ""}])
def test_reports_about_another_plan_are_ignored(publisher, other):
    publisher.planned(plan())
    assert not publisher.reported(report_of(**other), TOLERANCE)
    assert publisher.lens_summary.counts == {LensStatus.UNREPORTED: 3}


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"camera": "nobody"}, "name: expected a camera of the plan in force, got 'nobody'"),
        ({"camera": ""}, "name: expected a camera of the plan in force, got ''"),
        ({"code": 6}, "status: expected 1 to 5, as LensState names them, got 6"),
        ({"read_distance": math.nan}, "read_distance: expected a number above 0"),
        ({"read_distance": -500.0}, "read_distance: expected a number above 0"),
    ],
)
def test_what_does_not_fit_the_plan_is_refused(publisher, values, error):
    publisher.planned(plan())
    with pytest.raises(InputError) as raised:
        publisher.reported(report_of(**values), TOLERANCE)
    assert str(raised.value).startswith(error)
    assert publisher.lens_summary.counts == {LensStatus.UNREPORTED: 3}


def test_values_are_checked_by_the_planners_tables(publisher):
    table = LensTable("steps", distances=(0.5, 3.0), values=(200.0, 50.0))
    focus = CameraFocus(name="cam_1", focus_distance=2.0, device_unit="steps")
    focus.device_value = table.value_at(2.0)
    publisher.planned(FocusPlan(plan_id="a plan", cameras=[focus]))
    said = {"unit": "steps", "planned_distance": 2.0, "read_distance": math.nan}
    said |= {"sent_value": focus.device_value}
    tables = LensTables({"cam_1": table})
    with pytest.raises(InputError, match="read_value: expected what is within"):
        publisher.reported(report_of(**said, read_value=50.0), TOLERANCE, tables)
    assert publisher.reported(report_of(**said, read_value=focus.device_value), TOLERANCE, tables)


def test_texts_of_reports_are_cut(publisher, published, clock):
    publisher.planned(plan())
    said = {"code": LensStatus.FAILED, "unit": 500 * "u", "message": "\x1b[2J" + 9000 * "x"}
    assert publisher.reported(report_of(**said), TOLERANCE)
    lens = newest(publisher, published, clock).lenses[1]
    assert len(lens.unit) < 100
    assert len(lens.message) < 500
    assert lens.message.startswith(r"\x1b[2J")


def test_refused_ones_are_counted_until_the_next_plan(publisher):
    publisher.planned(plan())
    for reason in ("one", "two"):
        publisher.refused(reason)
    publisher.published_by(["/a", "/b"])
    found = publisher.lens_summary
    assert (found.refused, found.refusal, found.publishers) == (2, "two", "/a, /b")
    publisher.planned(plan("another"))
    assert publisher.lens_summary.refused == 0
    publisher.refused("three")
    publisher.clear()
    assert (publisher.lens_summary.refused, publisher.lens_summary.refusal) == (0, "")


def test_who_publishes_them_is_in_it(publisher, published, clock):
    publisher.published_by(["/a", "/b"])
    assert newest(publisher, published, clock).lens_state_publishers == ["/a", "/b"]
    publisher.published_by(())
    assert newest(publisher, published, clock).lens_state_publishers == []


def test_cleared_it_knows_no_plan(publisher, published, clock):
    publisher.planned(plan(), from_record=True)
    publisher.clear()
    assert not publisher.reported(report_of(), TOLERANCE)
    message = newest(publisher, published, clock)
    assert (message.plan_id, message.from_record, message.lenses) == ("", False, [])
    for one in (message.plan_surface, message.plan_rig, message.surface, message.rig):
        assert one.topic == ""
        assert math.isnan(one.age)


def test_the_statuses_are_those_of_the_message():
    for code in LensStatus:
        assert getattr(LensState, f"STATUS_{code.name}") == code


# --- diagnostics -------------------------------------------------------------------------------


def test_diagnostics_are_published_periodically(make_node, clock, published):
    found = [Diagnosis("rig", Level.WARN, "none yet", {"topic": ""})]
    publisher = DiagnosticsPublisher(make_node(), lambda: found)
    published.clear()
    for _ in range(5):
        publisher.publish_if_due(PERIOD)
        clock.advance(0.5)
    assert len(published) == 3
    (entry,) = published[-1].status
    assert (entry.level, entry.name, entry.message) == (
        DiagnosticStatus.WARN,
        "here: rig",
        "none yet",
    )


# --- lenses that stay where they are -------------------------------------------------------------


def test_of_lenses_that_are_not_told_what_was_reported_is_still_so(publisher, published, clock):
    publisher.planned(plan())
    publisher.reported(report_of("cam_1"), TOLERANCE)
    publisher.planned(plan("a newer one"), told={"cam_0"})
    message = newest(publisher, published, clock)
    assert message.plan_id == "a newer one"
    assert [lens.plan_id for lens in message.lenses] == ["a newer one", "a plan", "a plan"]
    statuses = [LensStatus.UNREPORTED, LensStatus.VERIFIED, LensStatus.UNREPORTED]
    assert [lens.status for lens in message.lenses] == statuses
    assert (message.unreported, message.verified) == (2, 1)


def test_what_lenses_report_that_are_not_told_still_counts(publisher, published, clock):
    publisher.planned(plan())
    publisher.planned(plan("a newer one"), told={"cam_0"})
    assert publisher.reported(report_of("cam_1"), TOLERANCE)
    assert publisher.reported(report_of("cam_0", "a newer one"), TOLERANCE)
    assert not publisher.reported(report_of("cam_0"), TOLERANCE)
    assert not publisher.reported(report_of("cam_2", "a newer one"), TOLERANCE)
    assert newest(publisher, published, clock).verified == 2
    publisher.planned(plan("the newest"))
    assert not publisher.reported(report_of("cam_1"), TOLERANCE)
    assert newest(publisher, published, clock).unreported == 3
