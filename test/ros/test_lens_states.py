# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""States of lenses from anybody: what does not fit the plan is counted, and costs nothing."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from focus_planner_msgs.msg import CameraFocus, FocusPlan, LensState
from std_msgs.msg import String

from focus_planner.lenses.claims import MAX_STATE_BYTES
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.typestore import LENS_STATE, serialize
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.lens_states import LensStates
from focus_planner.ros.status import StatusPublisher
from testing.hostile_lenses import states
from testing.ros.calls import until

SETTINGS = Settings.from_values({})
GOOD = {
    "header": {"stamp": {"sec": 7, "nanosec": 0}},
    "name": "cam",
    "plan_id": "a plan",
    "status": int(LensStatus.VERIFIED),
    "planned_distance": 0.5,
    "unit": "dioptres",
    "sent_value": 2.0,
    "sent_at": {"sec": 5, "nanosec": 0},
    "read_value": 2.0,
    "read_at": {"sec": 6, "nanosec": 0},
    "read_distance": 0.5,
    "message": "",
}
THERE = {LensStatus.VERIFIED, LensStatus.ACCEPTED}


@pytest.fixture
def node(make_node):
    return make_node()


@pytest.fixture
def status(node):
    status = StatusPublisher(node)
    cameras = [CameraFocus(name="cam", focus_distance=0.5)]
    status.planned(FocusPlan(plan_id="a plan", cameras=cameras))
    return status


@pytest.fixture
def lens_states(node, status):
    lens_states = LensStates(node, status, lambda: SETTINGS)
    lens_states.open(node.default_callback_group)
    yield lens_states
    lens_states.close()


def lens_of(status):
    return status._message.lenses[0]


def test_a_good_one_is_noted(lens_states, status):
    lens_states.receive(serialize(LENS_STATE, GOOD))
    assert status.lens_summary.counts == {LensStatus.VERIFIED: 1}
    assert status.lens_summary.refused == 0


def test_a_long_one_is_refused_before_it_is_read(lens_states, status):
    lens_states.receive(serialize(LENS_STATE, GOOD))
    lens_states.receive(serialize(LENS_STATE, GOOD | {"message": 5_000_000 * "x"}))
    found = status.lens_summary
    assert found.refused == 1
    assert found.refusal.startswith(
        f"LensState message: expected at most {MAX_STATE_BYTES:,} bytes, got 5,000,"
    )
    assert lens_of(status).message == ""


def test_whatever_comes_a_lens_is_there_only_where_the_plan_says(lens_states, status):
    random = np.random.default_rng(11)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for payload in states(random, 1500, GOOD):
            lens_states.receive(payload)
            lens = lens_of(status)
            assert len(lens.message) < 500
            assert len(lens.unit) < 100
            assert (lens.message + lens.unit).isprintable()
            if lens.status in THERE:
                assert abs(1 / lens.read_distance - 2.0) <= SETTINGS.serving.lens_tolerance
    assert status.lens_summary.refused > 100
    assert len(status.lens_summary.refusal) < 5000
    lens_states.receive(serialize(LENS_STATE, GOOD))
    assert status.lens_summary.counts == {LensStatus.VERIFIED: 1}


def test_who_publishes_them_is_named(lens_states, status, node, named):
    lens_states.check_publishers()
    assert status.lens_summary.publishers == ""
    for name in ("/rig/adapter", "/stranger"):
        named(name).create_publisher(LensState, "/here/lens_states", 1)
    named("/not_him").create_publisher(String, "/lens_states", 1)

    def both():
        lens_states.check_publishers()
        return status.lens_summary.publishers == "/rig/adapter, /stranger"

    until(both)
    lens_states.close()
    assert status.lens_summary.publishers == ""
