# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The action ``~/plan``: turns goals into requests, and outcomes into results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from focus_planner_msgs.action import PlanFocus
from rclpy.action.server import CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from focus_planner.messages.writing import Fields
from focus_planner.ros.callers import CallerTellingActionServer
from focus_planner.ros.conversions import fields_from_ros, message_to_ros
from focus_planner.ros.qos import ALL_CALLS
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome, Request

# Results take much memory, and clients ask for theirs as soon as the goal is accepted.
_RESULT_TIMEOUT = 30


class GoalHandler(Protocol):
    """Accepts goals and plans them."""

    def admit_goal(self, caller: bytes) -> bool:
        """Return whether to accept a caller's goal."""

    def submit_goal(
        self,
        asked: Fields,
        answer: Callable[[Outcome], None],
        send_feedback: Callable[[Fields], None],
        caller: bytes,
    ) -> Request:
        """Queue an accepted goal."""

    def on_outcome(self, outcome: Outcome) -> None:
        """Take note that a goal's result is about to be sent."""


class PlanAction:
    """Serves the action.

    Parameters
    ----------
    node : Node
    group : CallbackGroup
        A reentrant one: many goals may wait.
    handler : GoalHandler
    """

    def __init__(self, node: Node, group: CallbackGroup, handler: GoalHandler) -> None:
        self._handler = handler
        self._requests: dict[bytes, Request] = {}
        self._answers: dict[bytes, Future] = {}
        self._server = CallerTellingActionServer(
            node,
            PlanFocus,
            "~/plan",
            self._execute,
            callback_group=group,
            goal_callback=self._admit,
            handle_accepted_callback=self._accept,
            cancel_callback=self._cancel,
            goal_service_qos_profile=ALL_CALLS,
            result_service_qos_profile=ALL_CALLS,
            cancel_service_qos_profile=ALL_CALLS,
            result_timeout=_RESULT_TIMEOUT,
        )

    @property
    def is_busy(self) -> bool:
        """Whether a goal has no result yet."""
        return bool(self._requests)

    def destroy(self) -> None:
        """Stop serving."""
        self._server.destroy()

    def _admit(self, _: PlanFocus.Goal) -> GoalResponse:
        return (
            GoalResponse.ACCEPT
            if self._handler.admit_goal(self._server.caller)
            else GoalResponse.REJECT
        )

    def _accept(self, goal: ServerGoalHandle) -> None:
        answer = Future()
        key = bytes(goal.goal_id.uuid)
        self._answers[key] = answer
        self._requests[key] = self._handler.submit_goal(
            fields_from_ros(goal.request),
            answer.set_result,
            lambda fields: self._send_feedback(goal, fields),
            self._server.caller,
        )
        goal.execute()

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        request = self._requests.get(bytes(goal.goal_id.uuid))
        # A repeated cancel request has no further effect, and is accepted like the first.
        in_time = request is not None and (request.stop_requested or request.stop(Reason.CANCELLED))
        return CancelResponse.ACCEPT if in_time else CancelResponse.REJECT

    async def _execute(self, goal: ServerGoalHandle) -> PlanFocus.Result:
        key = bytes(goal.goal_id.uuid)
        try:
            outcome: Outcome = await self._answers[key]
        finally:
            del self._requests[key], self._answers[key]
        if outcome.reason is Reason.NONE:
            goal.succeed()
        elif outcome.reason is Reason.CANCELLED and goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        self._handler.on_outcome(outcome)
        return result_of(outcome)

    def _send_feedback(self, goal: ServerGoalHandle, fields: Fields) -> None:
        if goal.is_active:
            goal.publish_feedback(message_to_ros(PlanFocus.Feedback, fields))


def result_of(outcome: Outcome) -> PlanFocus.Result:
    """Return the result of a goal with this outcome."""
    result = PlanFocus.Result()
    write_outcome(result, outcome)
    return result


def write_outcome(answer: Any, outcome: Outcome) -> None:
    """Write an outcome into a result or a response."""
    answer.success, answer.message = outcome.plan is not None, outcome.message
    answer.reason = int(outcome.reason)
    if outcome.plan is not None:
        answer.plan = outcome.plan
