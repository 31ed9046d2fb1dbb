# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Goals of ``~/plan``: long ones, cancelled ones, and the feedback they send."""

from __future__ import annotations

import math
import threading
import time
from functools import partial
from itertools import groupby

import numpy as np
from action_msgs.msg import GoalStatus
from focus_planner_msgs.action import PlanFocus

from focus_planner.ros.calls import result_of
from focus_planner.ros.client import Goal
from focus_planner.runtime.reason import Reason
from testing.ros.planner_process import PATIENCE

# It would take minutes, on any machine: tests end it.
LONG = {"method": "optimal", "samples": 16_384, "gap": 1e-12}
SHORT = {"method": "closest"}
SUCCEEDED, CANCELED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED
ABORTED = GoalStatus.STATUS_ABORTED


class Feedback:
    """Records feedback as it arrives, with the time of each message."""

    def __init__(self):
        self.messages = []
        self._news = threading.Condition()

    def __call__(self, message):
        with self._news:
            self.messages.append((time.monotonic(), message))
            self._news.notify_all()

    def wait_for(self, condition):
        """Wait for a message that fulfils a condition."""

        def arrived():
            return any(condition(message) for _, message in self.messages)

        with self._news:
            assert self._news.wait_for(arrived, PATIENCE), "no such feedback"

    @property
    def stages(self):
        """Stages in the order in which they were reported."""
        return [stage for stage, _ in groupby(message.stage for _, message in self.messages)]

    def values(self, name):
        """Return a field of all messages."""
        return np.array([getattr(message, name) for _, message in self.messages])


def sent(client, on_feedback=None, **goal):
    """Send a goal, which is accepted."""
    goal = client.send_goal(on_feedback, **goal)
    assert goal.accepted
    return goal


def sent_unasked(client, on_feedback, **goal):
    """Send a goal; return what asks for its result.

    rclpy drops feedback that arrives after the result, and the result of a short plan overtakes it.
    """
    goal = PlanFocus.Goal(**goal)
    send = partial(
        client._plan.send_goal_async, goal, lambda message: on_feedback(message.feedback)
    )
    handle = result_of(client._send(send), PATIENCE, "send_goal")
    assert handle.accepted
    return partial(Goal, handle, client._send)


def has_plan(message):
    return math.isfinite(message.cost)


def planning(client, **goal):
    """Send a long goal; return it once it has a plan."""
    feedback = Feedback()
    goal = sent(client, feedback, **{**LONG, **goal})
    feedback.wait_for(has_plan)
    return goal


def ended(goal):
    """Wait for a goal's end; return its status, reason and result."""
    status, result = goal.result(PATIENCE)
    assert result.success == bool(result.plan.plan_id)
    return status, Reason(result.reason), result


def cancelled(goal):
    """Cancel a goal that is being planned; return its best plan."""
    assert goal.cancel()
    status, reason, result = ended(goal)
    assert (status, reason) == (CANCELED, Reason.CANCELLED)
    assert result.success
    return result.plan
