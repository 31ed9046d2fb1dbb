# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a planner tells of itself over DDS: ~/status and /diagnostics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from focus_planner_msgs.msg import CameraRig, LensState
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from std_msgs.msg import Header

from focus_planner.core.rig.rig import Rig
from focus_planner.messages.writing import mesh_to_bytes, rig_to_fields
from focus_planner.ros.calls import result_of
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.inputs import without_unheard
from testing.ros.calls import FEW, having, until
from testing.ros.goals import SHORT, cancelled, planning
from testing.ros.planner_process import PATIENCE

pytestmark = pytest.mark.processes

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
NAMES = [
    *("planner", "surface", "rig", "last run", "cameras"),
    *("lens states", "recorder", "memory", "replanning"),
]
DRIVERS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner(*FEW, "-p", "status_period:=0.1")


@pytest.fixture
def ready(client, body, rig):
    client.publish_mesh(body)
    client.publish_rig(rig)
    return client


@pytest.fixture(scope="module")
def drivers(client, planner):
    """Publishes what became of the plan at lenses, as whoever drives them does."""
    publisher = client._node.create_publisher(LensState, f"{planner.name}/lens_states", DRIVERS)
    until(publisher.get_subscription_count)
    yield publisher
    client._destroy_soon(client._node.destroy_publisher, publisher)


def told(client, condition):
    """The status, once it is so."""

    def found():
        status = client.status()
        return status if condition(status) else None

    return until(found)


def diagnosed(client, planner, condition=lambda _: True):
    """What monitors hear of this planner, by name, once it is so."""
    heard = Future()

    def hear(array):
        statuses = [status for status in array.status if status.hardware_id == planner.name]
        by_name = {status.name.split(": ", 1)[1]: status for status in statuses}
        if statuses and condition(by_name) and not heard.done():
            assert array.header.stamp.sec > 0
            heard.set_result(by_name)

    subscription = client._node.create_subscription(DiagnosticArray, "/diagnostics", hear, 10)
    try:
        return result_of(heard, PATIENCE, "diagnostics")
    finally:
        client._destroy_soon(client._node.destroy_subscription, subscription)


def level_of(client, planner, name, level):
    """A status once it has a level."""
    return diagnosed(client, planner, lambda by_name: by_name[name].level == level)[name]


def values_of(status):
    return {value.key: value.value for value in status.values}


def seconds(time):
    return time.sec + time.nanosec * 1e-9


# --- before anything came ----------------------------------------------------------------------


def test_at_first_there_is_nothing_to_tell(client, planner):
    status = told(client, lambda status: status.state == "active")
    assert (status.planning, status.waiting, status.plan_id) == ("", 0, "")
    assert seconds(status.planned_at) == 0
    assert not status.from_record
    for one in (status.surface, status.rig):
        assert (one.topic, one.refused) == ("", "")
        assert math.isnan(one.age)
    for one in (status.plan_surface, status.plan_rig):
        assert one.topic == ""
        assert math.isnan(one.age)
    assert status.lenses == []


def test_without_inputs_monitors_are_warned(client, planner):
    by_name = diagnosed(client, planner, lambda by_name: by_name["planner"].level == OK)
    assert list(by_name) == NAMES
    for name, (level, message) in {
        "planner": (OK, "active, idle"),
        "surface": (WARN, "none yet"),
        "rig": (WARN, "none yet"),
        "last run": (OK, "none yet"),
        "cameras": (OK, "no plan yet"),
        "recorder": (OK, "off (parameter record_directory)"),
        "replanning": (OK, "off (parameter replan)"),
    }.items():
        assert (by_name[name].level, without_unheard(by_name[name].message)) == (level, message)
        assert by_name[name].name == f"{planner.name[1:]}: {name}"
    assert "MB" in by_name["memory"].message


def test_a_call_without_inputs_is_told(client, planner):
    response = client.plan(timeout=PATIENCE)
    run = level_of(client, planner, "last run", WARN)
    assert run.message == f"no plan: {response.message}"


# --- inputs ------------------------------------------------------------------------------------


def test_inputs_are_told_with_their_ages(ready, planner, body, rig):
    message = message_to_ros(CameraRig, rig_to_fields(rig))
    message.header.stamp.sec, message.header.stamp.nanosec = 12, 34
    ready.publish("rig", message)
    status = told(ready, lambda status: status.rig.stamp.sec == 12)
    assert (status.surface.topic, status.rig.topic) == (
        f"{planner.name}/mesh",
        f"{planner.name}/rig",
    )
    assert status.rig.stamp.nanosec == 34
    assert seconds(status.surface.stamp) == 0
    for one in (status.surface, status.rig):
        age = seconds(status.header.stamp) - seconds(one.received)
        assert one.age == pytest.approx(age, abs=0.5)
        assert 0 <= one.age < PATIENCE
    older = told(ready, lambda later: later.surface.age > status.surface.age)
    assert older.surface.received == status.surface.received
    plan = ready.plan(**SHORT).plan
    assert plan.surface.topic == f"{planner.name}/mesh"
    assert plan.rig.stamp.sec == 12
    assert 0 <= plan.rig.age < PATIENCE
    after = told(ready, lambda status: status.plan_id == plan.plan_id)
    assert (after.plan_surface, after.plan_rig) == (plan.surface, plan.rig)
    assert level_of(ready, planner, "surface", OK).message.startswith(f"from {planner.name}/mesh, ")


def test_what_was_refused_is_told_until_a_good_one_comes(ready, planner, body):
    ready.publish("mesh", mesh_to_bytes(body)[:-5])
    status = told(ready, lambda status: status.surface.refused)
    assert "the message is truncated" in status.surface.refused
    assert status.surface.topic == f"{planner.name}/mesh"
    surface = level_of(ready, planner, "surface", WARN)
    assert surface.message == f"a newer one was refused: {status.surface.refused}"
    ready.publish_mesh(body)
    assert told(ready, lambda status: not status.surface.refused)
    level_of(ready, planner, "surface", OK)


def test_an_old_input_is_told(ready, planner):
    with having(ready, max_input_age=0.01):
        surface = level_of(ready, planner, "surface", WARN)
        assert "s old, more than max_input_age (0.01 s)" in surface.message
        assert ready.plan(**SHORT).success
    level_of(ready, planner, "surface", OK)


# --- requests ----------------------------------------------------------------------------------


def test_what_is_planned_and_who_waits_is_told(ready, planner):
    goal = planning(ready)
    calls = [ready.plan_async(**SHORT) for _ in range(2)]
    status = told(ready, lambda status: status.waiting == 2)
    busy = diagnosed(ready, planner, lambda b: b["planner"].message.startswith("active, pl"))
    assert busy["planner"].message == f"active, planning {status.planning}"
    assert values_of(busy["planner"])["waiting requests"] == "2"
    assert cancelled(goal).plan_id == status.planning
    assert all(ready.wait_for(call).success for call in calls)
    told(ready, lambda status: (status.planning, status.waiting) == ("", 0))


def test_the_last_run_is_told(ready, planner):
    answer = ready.plan(method="em", bound="tight")
    run = diagnosed(ready, planner, lambda b: b["last run"].message == answer.message)["last run"]
    values = values_of(run)
    assert (run.level, values["plan_id"]) == (OK, answer.plan.plan_id)
    assert float(values["cost"]) == pytest.approx(answer.plan.cost, abs=1e-3)
    gap = 1 - answer.plan.lower_bound / answer.plan.cost
    assert float(values["gap"]) == pytest.approx(gap, abs=1e-6)
    assert 0 < float(values["solve seconds"]) < float(values["seconds"]) < PATIENCE
    refused = ready.plan(method="guess")
    run = level_of(ready, planner, "last run", WARN)
    assert run.message == f"no plan: {refused.message}"


def test_cameras_that_see_nothing_are_told(ready, planner, rig):
    first, *others = rig.cameras
    away = replace(first, position=tuple(np.add(first.position, (0.0, 0.0, 50.0))))
    ready.publish_rig(Rig((away, *others)))
    assert ready.plan(**SHORT).success
    cameras = level_of(ready, planner, "cameras", WARN)
    assert cameras.message == f"see nothing: {first.name}"
    ready.publish_rig(rig)
    assert ready.plan(**SHORT).success
    assert level_of(ready, planner, "cameras", OK).message == "all see the surface"


# --- lenses ------------------------------------------------------------------------------------


def state(plan, place, status, **said):
    """What an adapter says of a lens that is where it was sent."""
    camera = plan.cameras[place]
    fields = {"unit": "m", "planned_distance": camera.focus_distance}
    fields |= dict.fromkeys(("sent_value", "read_value", "read_distance"), camera.focus_distance)
    fields |= {"header": Header(stamp=Time(sec=7)), "sent_at": Time(sec=5), "read_at": Time(sec=6)}
    return LensState(name=camera.name, plan_id=plan.plan_id, status=status, **fields | said)


def client_name(client):
    return client._node.get_fully_qualified_name()


def counted(status):
    found = [status.unreported, status.sent, status.verified, status.differ, status.failed]
    return [*found, status.accepted]


def test_lenses_are_counted_by_what_became_of_them(ready, planner, drivers, rig):
    plan = ready.plan(**SHORT).plan
    status = told(ready, lambda status: status.plan_id == plan.plan_id)
    assert counted(status) == [len(rig), 0, 0, 0, 0, 0]
    assert [lens.name for lens in status.lenses] == [camera.name for camera in rig.cameras]
    for lens, camera in zip(status.lenses, plan.cameras, strict=True):
        assert lens.planned_distance == camera.focus_distance
        assert math.isnan(lens.sent_value)
    for place, code in enumerate((1, 1, 2, 2, 2, 3, 4, 5)):
        drivers.publish(state(plan, place, code, message=f"{code}", sent_value=5.0, unit="step"))
    status = told(ready, lambda status: status.accepted == 1)
    assert counted(status) == [len(rig) - 8, 2, 3, 1, 1, 1]
    lens = status.lenses[2]
    assert (lens.name, lens.status, lens.message) == (plan.cameras[2].name, 2, "2")
    assert (lens.sent_value, lens.unit) == (5.0, "step")
    assert lens.planned_distance == plan.cameras[2].focus_distance
    cameras = level_of(ready, planner, "cameras", ERROR)
    assert cameras.message == "lenses that failed: 1, that differ from the plan: 1"
    assert values_of(cameras)["verified"] == "3"
    for place in range(len(rig)):
        drivers.publish(state(plan, place, LensState.STATUS_VERIFIED))
    status = told(ready, lambda status: status.verified == len(rig))
    assert counted(status) == [0, 0, len(rig), 0, 0, 0]
    level_of(ready, planner, "cameras", OK)
    # Nothing is known of the next plan.
    plan = ready.plan(**SHORT).plan
    status = told(ready, lambda status: status.plan_id == plan.plan_id)
    assert counted(status) == [len(rig), 0, 0, 0, 0, 0]


def test_reports_of_other_plans_and_cameras_and_garbage_do_no_harm(ready, planner, drivers, rig):
    plan = ready.plan(**SHORT).plan
    for change in ({"plan_id": "another"}, {"plan_id": ""}, {"name": "nobody"}, {"name": ""}):
        report = state(plan, 0, LensState.STATUS_FAILED)
        for name, value in change.items():
            setattr(report, name, value)
        drivers.publish(report)
    drivers.publish(state(plan, 1, 200))
    for code in (LensState.STATUS_VERIFIED, LensState.STATUS_ACCEPTED):
        for distance in (math.nan, -500.0, 99.0):
            drivers.publish(state(plan, 1, code, read_distance=distance))
    drivers.publish(state(plan, 1, LensState.STATUS_VERIFIED, planned_distance=99.0))
    drivers.publish(state(plan, 1, LensState.STATUS_FAILED, message=5_000_000 * "x"))
    random = np.random.default_rng(3)
    for size in (1, 4, 40, 400):
        drivers.publish(b"\x00\x01\x00\x00" + random.bytes(size))
    drivers.publish(state(plan, 2, LensState.STATUS_SENT))
    status = told(ready, lambda status: status.sent == 1)
    assert counted(status) == [len(rig) - 1, 1, 0, 0, 0, 0]
    planner.wait_for_log("refused a lens state: ")
    told_of = level_of(ready, planner, "lens states", WARN)
    assert int(values_of(told_of)["refused"]) == 15
    assert values_of(told_of)["published by"] == client_name(ready)
    assert status.lens_state_publishers == [client_name(ready)]
    assert ready.plan(**SHORT).success


# --- the recorder ------------------------------------------------------------------------------


def test_a_folder_that_cannot_be_written_to_is_told(ready, planner, tmp_path):
    file = tmp_path / "a file"
    file.write_text("in the way")
    with having(ready, record_directory=str(file / "runs")):
        answer = ready.plan(**SHORT)
        assert answer.success
        recorder = level_of(ready, planner, "recorder", ERROR)
        assert recorder.message.startswith(f"not recorded: run {answer.plan.plan_id} in {file}/ru")
        assert recorder.message.endswith("Not a directory")
    with having(ready, record_directory=str(tmp_path / "runs")):
        assert ready.plan(**SHORT).success
        recorder = level_of(ready, planner, "recorder", OK)
        assert recorder.message == f"recording to {tmp_path / 'runs'}"
        assert int(values_of(recorder)["free bytes"]) > 0
    diagnosed(ready, planner, lambda by_name: by_name["recorder"].message.startswith("off"))


# --- states ------------------------------------------------------------------------------------


def test_who_subscribes_late_gets_the_status(ready, planner):
    plan_id = ready.plan(**SHORT).plan.plan_id
    with PlannerClient(planner.name) as late:
        assert told(late, lambda status: status.plan_id == plan_id).state == "active"


def test_inactive_it_is_told(ready, planner):
    plan_id = ready.plan(**SHORT).plan.plan_id
    assert ready.change_state("deactivate")
    status = told(ready, lambda status: status.state == "inactive")
    assert status.plan_id == plan_id
    told_of = level_of(ready, planner, "planner", WARN)
    assert told_of.message == "inactive: not planning"
    assert ready.change_state("activate")
    told(ready, lambda status: status.state == "active")
    level_of(ready, planner, "planner", OK)


def test_the_log_holds_no_traceback(ready, planner):
    assert ready.plan(**SHORT).success
    assert "Traceback" not in planner.log
