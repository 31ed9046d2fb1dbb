# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How simulated drivers take parameters, beside what their sources say."""

from __future__ import annotations

import pytest

from focus_planner.lenses.profiles import DEVICE, PROFILES, DriverProfile
from focus_planner.lenses.simulated_devices import (
    DEVICES,
    PerFrameDevice,
    SequentialDevice,
    SimulatedDevice,
    StoredValuesDevice,
)
from focus_planner.lenses.simulation import LensMechanics

RING = DriverProfile("ring", DEVICE, False, (("af", False), ("mode", 0), ("who", "me")))


def device(kind, profile, *, autofocus=True, stuck=False, **mechanics):
    return kind(profile, LensMechanics(0.0, 250.0, **mechanics), autofocus, stuck)


def camera_ros(**options):
    return device(PerFrameDevice, PROFILES["camera_ros"], **options)


def v4l2_camera(**options):
    return device(SequentialDevice, PROFILES["v4l2_camera"], **options)


def depthai(**options):
    return device(StoredValuesDevice, PROFILES["depthai"].of("cam"), **options)


def position(made):
    return made.position(1e6)


def test_every_driver_has_its_kind():
    assert {name: kind.__name__ for name, kind in DEVICES.items()} == {
        "camera_ros": "PerFrameDevice",
        "v4l2_camera": "SequentialDevice",
        "depthai": "StoredValuesDevice",
    }


def test_initial_values_are_those_of_autofocus():
    assert dict(camera_ros().initial) == {"AfMode": 2, "LensPosition": 0.0}
    assert dict(camera_ros(autofocus=False).initial)["AfMode"] == 0
    assert dict(v4l2_camera().initial) == {"focus_automatic_continuous": True, "focus_absolute": 0}
    assert dict(depthai().initial) == {"rgb.r_set_man_focus": False, "rgb.r_focus": 0}
    on = dict(device(SimulatedDevice, RING).initial)
    assert (on["af"], on["mode"], on["who"]) == (True, 2, "not me")


def test_camera_ros_takes_parameters_with_the_next_frame():
    made = camera_ros()
    assert made.take([("AfMode", 0), ("LensPosition", 2.0)], 0.0) is None
    assert made.has_autofocus
    assert position(made) == 0.0
    made.begin_frame(1.0)
    assert not made.has_autofocus
    assert position(made) == 2.0


def test_camera_ros_drops_what_no_frame_has_taken_up_when_more_is_set():
    made = camera_ros()
    made.take([("AfMode", 0)], 0.0)
    made.take([("LensPosition", 2.0)], 0.001)
    made.begin_frame(0.03)
    assert made.has_autofocus
    assert position(made) == 0.0
    made.begin_frame(0.06)
    assert position(made) == 0.0


def test_camera_ros_takes_both_where_a_frame_comes_between():
    made = camera_ros()
    made.take([("AfMode", 0)], 0.0)
    made.begin_frame(0.03)
    made.take([("LensPosition", 2.0)], 0.04)
    made.begin_frame(0.06)
    assert position(made) == 2.0


def test_camera_ros_ends_autofocus_first_whatever_the_order():
    made = camera_ros()
    made.take([("LensPosition", 2.0), ("AfMode", 0)], 0.0)
    made.begin_frame(0.03)
    assert position(made) == 2.0


def test_v4l2_camera_refuses_a_position_during_autofocus_and_keeps_what_came_before():
    made = v4l2_camera()
    assert made.take([("focus_absolute", 60)], 0.0) == ""
    assert made.take([("focus_automatic_continuous", False), ("focus_absolute", 60)], 0.0) is None
    assert position(made) == 60
    made.take([("focus_automatic_continuous", True)], 0.0)
    assert made.take([("focus_absolute", 9), ("focus_automatic_continuous", False)], 0.0) == ""
    assert not made.has_autofocus  # half of a call that was refused
    assert position(made) == 60


def test_v4l2_camera_rounds_to_its_step_and_does_not_say():
    made = v4l2_camera(autofocus=False, step=5.0)
    assert made.take([("focus_absolute", 62)], 0.0) is None
    assert position(made) == 60


def test_depthai_heeds_only_what_was_set_before_the_call():
    together = depthai()
    together.take([("rgb.r_set_man_focus", True), ("rgb.r_focus", 120)], 0.0)
    assert position(together) == 0.0  # where r_focus was
    one_by_one = depthai()
    one_by_one.take([("rgb.r_set_man_focus", True)], 0.0)
    one_by_one.take([("rgb.r_focus", 120)], 0.0)
    assert position(one_by_one) == 120
    stored = depthai()
    stored.take([("rgb.r_focus", 120)], 0.0)
    assert position(stored) == 0.0
    stored.take([("rgb.r_set_man_focus", True)], 0.0)
    assert position(stored) == 120


def test_others_take_parameters_at_once_and_need_all_that_ends_autofocus():
    made = device(SimulatedDevice, RING)
    made.take([("af", False), ("mode", 0), ("ring", 9.0)], 0.0)
    assert position(made) == 0.0
    made.take([("who", "me"), ("ring", 9.0), ("ring of another lens", 1.0)], 0.0)
    assert position(made) == 9.0


@pytest.mark.parametrize("make", [camera_ros, v4l2_camera, depthai])
def test_the_profile_moves_the_lens(make):
    made = make()
    first = [entry for entry in made.profile.first if entry[0] in dict(made.initial)]
    values = [*first, (made.profile.parameter, 42)]
    for call in [values] if made.profile.together else [[each] for each in values]:
        assert made.take(call, 0.0) is None
    if isinstance(made, PerFrameDevice):
        made.begin_frame(0.0)
    assert not made.has_autofocus
    assert position(made) == 42


def test_a_stuck_lens_takes_everything_and_stays():
    made = camera_ros(stuck=True)
    made.take([("AfMode", 0), ("LensPosition", 2.0)], 0.0)
    made.begin_frame(0.0)
    assert not made.has_autofocus
    assert position(made) == 0.0
