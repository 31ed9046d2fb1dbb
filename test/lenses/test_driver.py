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
from dataclasses import replace

import pytest

from focus_planner.core.rig.lens_table import DIOPTRES, METRES, LensTable
from focus_planner.core.validation import InputError
from focus_planner.lenses.driver import (
    LensCommand,
    LensReport,
    LensStatus,
    Tolerance,
    command_for,
    distance_of,
    report_to_fields,
)
from focus_planner.lenses.orders import FocusOrder
from focus_planner.lenses.profiles import PROFILES, DriverProfile
from focus_planner.messages.typestore import deserialize, serialize

CAMERA_ROS, V4L2 = PROFILES["camera_ros"], PROFILES["v4l2_camera"]
IN_METRES = DriverProfile("focus", METRES, False)
STEPS = LensTable("steps", distances=(0.5, 1.0, math.inf), values=(100.0, 50.0, 0.0))
CALIBRATED = LensTable("dioptres", distances=(0.5, math.inf), values=(2.2, 0.1))


@pytest.mark.parametrize(
    ("profile", "table", "value", "unit"),
    [
        (CAMERA_ROS, None, 1.25, DIOPTRES),
        (IN_METRES, None, 0.8, METRES),
        (V4L2, STEPS, 62, "steps"),  # 62.5: to the even one
        (replace(V4L2, whole=False), STEPS, 62.5, "steps"),
        (CAMERA_ROS, STEPS, 1.25, DIOPTRES),
        (CAMERA_ROS, CALIBRATED, 0.1 + 1.25 * 1.05, DIOPTRES),
    ],
)
def test_the_value_sent_for_a_distance(profile, table, value, unit):
    command = command_for(FocusOrder("a", 0.8), profile, table)
    assert command.value == pytest.approx(value)
    assert isinstance(command.value, int if profile.whole else float)
    assert command.unit == unit


@pytest.mark.parametrize(
    ("profile", "unit", "value", "expected"),
    [
        (V4L2, "focus_absolute", 61.7, (62, "focus_absolute")),
        (CAMERA_ROS, DIOPTRES, 1.3, (1.3, DIOPTRES)),
        (CAMERA_ROS, "steps", 62.5, (1.25, DIOPTRES)),
        (IN_METRES, METRES, 0.81, (0.81, METRES)),
        (IN_METRES, DIOPTRES, 1.3, (0.8, METRES)),
    ],
)
def test_the_planners_device_value_is_used_if_in_the_drivers_unit(profile, unit, value, expected):
    order = FocusOrder("a", 0.8, device_value=value, device_unit=unit)
    command = command_for(order, profile)
    assert (command.value, command.unit) == expected


def test_the_planners_value_precedes_the_adapters_table():
    order = FocusOrder("a", 0.8, device_value=63.0, device_unit="steps")
    assert command_for(order, V4L2, STEPS).value == 63


@pytest.mark.parametrize(
    ("order", "profile", "table", "error"),
    [
        (
            FocusOrder("", 0.0, planned=False),
            CAMERA_ROS,
            None,
            "status: expected a planned status, got STATUS_UNKNOWN; this is not from a plan",
        ),
        *(
            (
                FocusOrder("a", distance),
                CAMERA_ROS,
                None,
                (
                    f"focus_distance: expected a distance above 0 m, got {distance:g}; this is not"
                    " from a plan"
                ),
            )
            for distance in (0.0, -1.0, math.inf, math.nan)
        ),
        (
            FocusOrder("a", 0.8),
            V4L2,
            None,
            (
                "device_value: expected a value for focus_absolute in the driver's own unit, got"
                " none; give the planner or this adapter lens tables"
            ),
        ),
        (
            FocusOrder("a", 0.8, device_value=1.25, device_unit=DIOPTRES),
            V4L2,
            None,
            (
                "device_value: expected a value for focus_absolute in the driver's own unit, got"
                " one in dioptres; give the planner or this adapter lens tables"
            ),
        ),
        (
            FocusOrder("a", 0.8, device_value=62.0, device_unit="focus_absolute"),
            V4L2,
            STEPS,
            (
                "device_unit: expected 'steps', as in the adapter's lens tables, got"
                " 'focus_absolute'; give the planner and the adapter the same lens tables"
            ),
        ),
        (
            FocusOrder("a", 0.4),
            V4L2,
            STEPS,
            "focus distance: expected 0.5 to inf m, the range of the lens table, got 0.4",
        ),
    ],
)
def test_orders_that_have_no_value(order, profile, table, error):
    with pytest.raises(InputError) as raised:
        command_for(order, profile, table)
    assert str(raised.value) == error


@pytest.mark.parametrize(
    ("command", "value", "table", "distance"),
    [
        (LensCommand(2.0, DIOPTRES), 4.0, None, 0.25),
        (LensCommand(2.0, DIOPTRES), 0.0, None, math.inf),
        (LensCommand(2.0, DIOPTRES), -1.0, None, math.nan),
        (LensCommand(2.0, DIOPTRES, calibrated=True), 4.0, None, math.nan),
        (LensCommand(2.0, DIOPTRES), 2.2, CALIBRATED, 0.5),
        (LensCommand(2.0, METRES), 4.0, None, 4.0),
        (LensCommand(60, "steps"), 50, STEPS, 1.0),
        (LensCommand(60, "steps"), 101, STEPS, math.nan),
        (LensCommand(60, "steps"), 50, None, math.nan),
        (LensCommand(60, "steps"), 50, CALIBRATED, math.nan),
    ],
)
def test_the_distance_of_a_value_read_back(command, value, table, distance):
    assert distance_of(command, value, table) == pytest.approx(distance, nan_ok=True)


def test_a_table_in_dioptres_calibrates():
    order = FocusOrder("a", 0.8, device_value=1.3, device_unit=DIOPTRES)
    assert command_for(order, CAMERA_ROS).calibrated
    assert not command_for(replace(order, device_value=1 / 0.8), CAMERA_ROS).calibrated


@pytest.mark.parametrize(
    ("tolerance", "sent", "read", "accepted"),
    [
        (Tolerance(0.0, 0.0), 60, 60, True),
        (Tolerance(0.0, 0.0), 60, 61, False),
        (Tolerance(1.0, 0.0), 60, 61, True),
        (Tolerance(1.0, 0.0), 60, 58.9, False),
        (Tolerance(0.0, 0.01), -100, -101, True),
        (Tolerance(0.0, 0.01), -100, -101.1, False),
        (Tolerance(0.1, 0.01), 100, 101.05, True),
        (Tolerance(9.0, 1.0), 1.0, math.nan, False),
        (Tolerance(), 1.6, 1.600000023841858, True),  # as 32 bits have it
    ],
)
def test_values_within_the_tolerance_are_accepted(tolerance, sent, read, accepted):
    assert tolerance.accepts(sent, read) is accepted


def test_what_is_written_with_six_decimals_is_rounded():
    sent = 0.0123456789
    assert not Tolerance(0.0, 0.0).accepts(sent, round(sent, 6))
    assert Tolerance(0.0, 0.0).accepts(sent, round(sent, 6), 1e-6)
    assert not Tolerance(0.0, 0.0).accepts(sent, sent + 2e-6, 1e-6)


def test_reports_become_messages():
    report = LensReport(
        "a", LensStatus.DIFFERS, 0.8, "steps", 60.0, (3, 4), 61.0, (5, 6), 0.79, "off by one"
    )
    name = "focus_planner_msgs/msg/LensState"
    message = deserialize(name, serialize(name, report_to_fields(report, "cam", (7, 8))))
    assert (message.name, message.plan_id, message.status) == ("cam", "a", message.STATUS_DIFFERS)
    assert (message.planned_distance, message.unit, message.sent_value) == (0.8, "steps", 60.0)
    assert (message.read_value, message.read_distance) == (61.0, 0.79)
    assert message.message == "off by one"
    times = [message.header.stamp, message.sent_at, message.read_at]
    assert [(time.sec, time.nanosec) for time in times] == [(7, 8), (3, 4), (5, 6)]


def test_statuses_are_those_of_the_message():
    name = "focus_planner_msgs/msg/LensState"
    message = deserialize(name, serialize(name, {}))
    for status in LensStatus:
        assert getattr(message, f"STATUS_{status.name}") == status


def test_missing_values_are_nan_and_zero():
    fields = report_to_fields(LensReport("a", LensStatus.FAILED, 0.8), "cam", (1, 2))
    assert all(math.isnan(fields[name]) for name in ("sent_value", "read_value", "read_distance"))
    assert fields["sent_at"] == fields["read_at"] == {"sec": 0, "nanosec": 0}
