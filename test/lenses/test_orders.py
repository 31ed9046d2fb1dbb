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
from types import SimpleNamespace

import pytest

from focus_planner.core.validation import InputError
from focus_planner.lenses.orders import FocusOrder, order_from_message


def message(**values):
    fields = {
        "name": "cam",
        "plan_id": "a",
        "status": 1,
        "focus_distance": 0.8,
        "dioptres": 1.25,
        "device_value": math.nan,
        "device_unit": "",
        "header": SimpleNamespace(stamp=SimpleNamespace(sec=3, nanosec=4)),
    }
    return SimpleNamespace(**fields | values)


@pytest.mark.parametrize(
    ("value", "unit", "order"),
    [
        (62.0, "steps", FocusOrder("a", 0.8, device_value=62.0, device_unit="steps")),
        (math.nan, "", FocusOrder("a", 0.8)),
        (0.0, "", FocusOrder("a", 0.8)),  # a message of an older definition
    ],
)
def test_orders_from_messages(value, unit, order):
    said = message(device_value=value, device_unit=unit)
    assert order_from_message(said, "cam") == order
    assert order_from_message(said).planned_at == (3, 4)
    assert not order_from_message(message(status=0)).planned


@pytest.mark.parametrize("status", [1, 2, 3, 4])
def test_every_status_of_a_plan_is_obeyed(status):
    assert order_from_message(message(status=status), "cam").planned


def test_an_order_by_hand_need_not_repeat_the_distance():
    assert order_from_message(message(dioptres=0.0), "cam") == FocusOrder("a", 0.8)


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"name": "other"}, "name: expected 'cam', got 'other'"),
        ({"name": ""}, "name: expected 'cam', got ''"),
        ({"status": 5}, "status: expected 0 to 4, as CameraFocus names them, got 5"),
        ({"status": 255}, "status: expected 0 to 4, as CameraFocus names them, got 255"),
        ({"dioptres": 2.0}, "dioptres: expected 1.25, as focus_distance says, got 2"),
        ({"dioptres": math.nan}, "dioptres: expected 1.25, as focus_distance says, got nan"),
        ({"dioptres": -1.25}, "dioptres: expected 1.25, as focus_distance says, got -1.25"),
        *(
            (
                {"device_unit": "steps", "device_value": value},
                (
                    "device_value: expected a number up to 9.0072e+15 with a device_unit, got"
                    f" {value:g}"
                ),
            )
            for value in (math.nan, math.inf, -1e300)
        ),
        ({"plan_id": 300 * "a"}, "plan_id: expected at most 256 printable characters, got '"),
        (
            {"plan_id": "a\x1b[2J"},
            r"plan_id: expected at most 256 printable characters, got 'a\x1b",
        ),
        ({"device_unit": 65 * "u"}, "device_unit: expected at most 64 printable characters"),
    ],
)
def test_what_no_planner_sends_is_no_order(values, error):
    with pytest.raises(InputError) as raised:
        order_from_message(message(**values), "cam")
    assert str(raised.value).startswith(error)


OLD = FocusOrder("old", 0.8, planned_at=(5, 0))
NEW = FocusOrder("new", 0.9, planned_at=(7, 500_000_000))


def test_a_plan_older_than_the_one_in_force_is_told():
    with pytest.raises(InputError) as raised:
        OLD.check_newer(NEW, lambda: (8, 0))
    assert str(raised.value) == (
        "header.stamp: expected a plan made after 'new', which is in force here, got one made"
        " 2.500 s before; plan again, or restart this adapter"
    )


@pytest.mark.parametrize(
    ("order", "in_force", "now"),
    [
        (NEW, OLD, (8, 0)),
        (OLD, replace(NEW, planned_at=OLD.planned_at), (8, 0)),
        (replace(OLD, plan_id="new"), NEW, (8, 0)),  # the same plan
        (replace(OLD, planned_at=(0, 0)), NEW, (8, 0)),  # by hand
        (OLD, replace(NEW, planned_at=(0, 0)), (8, 0)),
        (OLD, NEW, (6, 0)),  # a clock that was set back
    ],
)
def test_what_may_be_newer_is_obeyed(order, in_force, now):
    order.check_newer(in_force, lambda: now)
