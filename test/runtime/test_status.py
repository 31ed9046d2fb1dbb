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
from dataclasses import fields, replace
from datetime import datetime, timedelta, timezone

import pytest

from focus_planner.core.planning.plan import CameraStatus, FocusPlan, SolvedPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.surface.scene import Scene
from focus_planner.messages.typestore import deserialize, serialize
from focus_planner.runtime.inputs import InputState
from focus_planner.runtime.status import LastRun, age_of, input_to_fields, without_problem
from testing.made_up_runs import ending
from testing.problems import around, torus

RECEIVED = datetime(1970, 1, 1, 0, 1, 40, 250_000, tzinfo=timezone.utc)
NOW = RECEIVED + timedelta(seconds=3)
STATE = InputState("rig", "/planner/rig", RECEIVED, (7, 8), "a bad one", "a deaf one")


def test_the_age_of_an_input_is_since_it_was_received():
    assert age_of(STATE, NOW) == 3.0
    assert math.isnan(age_of(InputState("rig"), NOW))


def test_an_input_is_reported_with_its_times():
    fields = input_to_fields(STATE, NOW)
    assert fields == {
        "topic": "/planner/rig",
        "received": {"sec": 100, "nanosec": 250_000_000},
        "stamp": {"sec": 7, "nanosec": 8},
        "age": 3.0,
        "refused": "a bad one",
        "unheard": "a deaf one",
    }


@pytest.mark.parametrize("state", [STATE, InputState("rig"), InputState("rig", refused="all")])
def test_the_report_of_an_input_fits_the_message(state):
    kind = "focus_planner_msgs/msg/InputStatus"
    message = deserialize(kind, serialize(kind, input_to_fields(state, NOW)))
    assert (message.topic, message.refused) == (state.topic, state.refused)
    assert message.age == pytest.approx(age_of(state, NOW), nan_ok=True)


def test_a_plan_is_kept_without_its_problem():
    plan = plan_focus(Scene(torus()), around(4, 2.5), PlanRequest("closest", 200))
    assert isinstance(plan, SolvedPlan)
    kept = without_problem(plan)
    assert type(kept) is FocusPlan
    for field in fields(FocusPlan):
        assert getattr(kept, field.name) == getattr(plan, field.name)


def test_cameras_seeing_nothing_are_those_of_the_plan():
    plan = ending().plan
    assert LastRun("a name", "", plan, 1.0).cameras_seeing_nothing == []
    assert LastRun("a name", "", None, 1.0).cameras_seeing_nothing == []
    first, *others = plan.cameras
    some = replace(plan, cameras=(replace(first, status=CameraStatus.SEES_NOTHING), *others))
    assert LastRun("a name", "", some, 1.0).cameras_seeing_nothing == [first.name]
