# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import dataclasses

from focus_planner import CameraStatus, PlanRequest, plan_focus
from testing.plans import RIG, SCENE


def test_statuses_are_the_messages_constants():
    assert [(status.name, int(status)) for status in CameraStatus] == [
        ("UNKNOWN", 0),
        ("PLANNED", 1),
        ("UNASSIGNED", 2),
        ("SEES_NOTHING", 3),
        ("DROPPED", 4),
    ]


def test_a_plan_that_costs_nothing_is_the_best():
    plan = plan_focus(SCENE, RIG, PlanRequest("em", 100))
    free = dataclasses.replace(plan, cost=0.0, lower_bound=0.0)
    assert free.gap == 0.0
