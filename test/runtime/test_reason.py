# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Numbers that stand in message definitions and here."""

from __future__ import annotations

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from focus_planner_msgs.action import PlanFocus as PlanFocusAction
from focus_planner_msgs.msg import LensState
from focus_planner_msgs.srv import PlanFocus

from focus_planner.lenses.driver import LensStatus
from focus_planner.runtime.diagnostics import Level
from focus_planner.runtime.reason import Reason


def constants(message_type, prefix=""):
    """The constants of a message by name."""
    names = vars(type(message_type))[f"_Metaclass_{message_type.__name__}__constants"]
    return {
        name.removeprefix(prefix): getattr(message_type, name)
        for name in names
        if name.startswith(prefix)
    }


@pytest.mark.parametrize("answer", [PlanFocus.Response, PlanFocusAction.Result])
def test_reasons_are_those_of_the_service_and_of_the_action(answer):
    assert {reason.name: reason.value for reason in Reason} == constants(answer, "REASON_")


def test_lens_statuses_are_those_of_the_message():
    assert {lens.name: lens.value for lens in LensStatus} == constants(LensState, "STATUS_")


def test_levels_are_those_of_ros():
    levels = constants(DiagnosticStatus)
    assert {level.name: bytes([level]) for level in Level} == levels
