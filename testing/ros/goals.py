"""Goals of ~/plan: long and cancelled ones, and their feedback."""

from __future__ import annotations

import math
import threading
import time
from itertools import groupby

import numpy as np
from action_msgs.msg import GoalStatus

from focus_planner.runtime.reason import Reason

# It would take minutes.
LONG = {"method": "optimal", "samples": 16_384, "gap": 1e-12}
SHORT = {"method": "closest"}
SUCCEEDED, CANCELED = GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED
ABORTED = GoalStatus.STATUS_ABORTED
# Tells what hangs from what works on a busy machine; how long it takes is measured elsewhere.
SOON = 20.0


class Heard:
    """Feedback as it arrives, with times."""

    def __init__(self):
        self.messages = []
        self._news = threading.Condition()

    def __call__(self, message):
        with self._news:
            self.messages.append((time.monotonic(), message))
            self._news.notify_all()

    def wait_for(self, condition):
        def come():
            return any(condition(message) for _, message in self.messages)

        with self._news:
            assert self._news.wait_for(come, SOON), "no such feedback"

    @property
    def stages(self):
        return [stage for stage, _ in groupby(message.stage for _, message in self.messages)]

    def of(self, name):
        return np.array([getattr(message, name) for _, message in self.messages])


def sent(client, on_feedback=None, **goal):
    goal = client.send_goal(on_feedback, **goal)
    assert goal.accepted
    return goal


def has_plan(message):
    return math.isfinite(message.cost)


def planning(client, **goal):
    """A long goal that has a plan already."""
    heard = Heard()
    goal = sent(client, heard, **{**LONG, **goal})
    heard.wait_for(has_plan)
    return goal


def ended(goal):
    """The status, reason and result of a goal that ends soon."""
    status, result = goal.result(SOON)
    assert result.success == bool(result.plan.plan_id)
    return status, Reason(result.reason), result


def cancelled(goal):
    """Cancel a goal that is being planned; return its plan."""
    assert goal.cancel()
    status, reason, result = ended(goal)
    assert (status, reason) == (CANCELED, Reason.CANCELLED)
    assert result.success
    return result.plan
