# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Messages of plans within a budget of pictures."""

import numpy as np
import pytest

from focus_planner import CameraStatus, InputError, PlanRequest, Rig, plan_focus
from focus_planner.messages.plan_checking import check_plan
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.messages.writing import plan_to_fields
from testing.messages import message
from testing.plans import RIG, SCENE, away


@pytest.fixture(scope="module")
def plan():
    rig = Rig((*RIG.cameras, away()))
    request = PlanRequest("em", 200, fresh_samples=100, shots=2, images=5)
    return plan_focus(SCENE, rig, request)


def received(plan):
    return message(plan_to_fields(plan, "world", (5, 6), "a name"))


def test_a_plan_comes_back_and_can_be_put_in_force(plan):
    told = received(plan)
    check_plan(told)
    again = plan_from_message(told)
    assert again.cameras == plan.cameras
    assert (again.images, again.pictures, again.shots) == (5, 5, plan.shots)
    np.testing.assert_array_equal(again.focus_distances, plan.focus_distances)
    idle = [camera for camera in told.cameras if camera.status == CameraStatus.DROPPED]
    assert idle
    for camera in idle:
        assert (len(camera.shots), len(camera.bracket), len(camera.device_bracket)) == (0, 0, 0)
        assert camera.near_limit <= camera.focus_distance <= camera.far_limit


def test_older_messages_have_no_limit(plan):
    told = received(plan)
    told.images = 0
    with pytest.raises(InputError, match="cameras: expected the same number of shots for all"):
        check_plan(told)
    told.cameras = [camera for camera in told.cameras if len(camera.shots) == plan.shots]
    check_plan(told)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda m, idle, busy: setattr(m, "images", 4), "at most 4 shots, as images says, got 5"),
        (lambda m, idle, busy: setattr(idle, "status", 2), "shots: expected at least one, got no"),
        (lambda m, idle, busy: setattr(idle, "status", 1), "shots: expected at least one, got no"),
        (lambda m, idle, busy: setattr(busy, "status", 4), "shots: expected none, as status says"),
        (lambda m, idle, busy: setattr(busy, "status", 5), "status: expected 1 to 4, got 5"),
        (lambda m, idle, busy: setattr(idle, "bracket", [1.0]), "bracket: expected the distances"),
        (lambda m, idle, busy: setattr(idle, "assigned_samples", 1), "assigned_samples"),
    ],
)
def test_what_contradicts_itself_is_refused(plan, change, why):
    told = received(plan)
    idle = next(camera for camera in told.cameras if camera.status == CameraStatus.DROPPED)
    busy = next(camera for camera in told.cameras if len(camera.shots))
    change(told, idle, busy)
    with pytest.raises(InputError, match=why):
        check_plan(told)
