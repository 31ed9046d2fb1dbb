"""The action ``~/plan``: goals become requests, their outcomes results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from focus_planner_msgs.action import PlanFocus
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse, ServerGoalHandle
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from focus_planner.messages.writing import Fields
from focus_planner.ros.conversions import fields_from_ros, message_to_ros
from focus_planner.ros.qos import ALL_CALLS
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome, Request

# Results take much room, and whoever waits for one has asked for it by then.
_SECONDS_TO_KEEP_RESULTS = 30


class GoalHandler(Protocol):
    """Where goals are brought to be planned; the node."""

    def admits_goal(self) -> bool:
        """Return whether a goal may come."""

    def submit_goal(
        self, asked: Fields, answer: Callable[[Outcome], None], tell: Callable[[Fields], None]
    ) -> Request:
        """Have a goal planned when its turn comes."""

    def answered(self, outcome: Outcome) -> None:
        """Do what is left to do once an answer is sent."""


class PlanAction:
    """Serves the action.

    Parameters
    ----------
    node : Node
    group : CallbackGroup
        A reentrant one: many goals may wait.
    desk : GoalHandler
    """

    def __init__(self, node: Node, group: CallbackGroup, desk: GoalHandler) -> None:
        self._desk = desk
        self._requests: dict[bytes, Request] = {}
        self._answers: dict[bytes, Future] = {}
        self._server = ActionServer(
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
            result_timeout=_SECONDS_TO_KEEP_RESULTS,
        )

    @property
    def busy(self) -> bool:
        """Whether there is a goal without a result."""
        return bool(self._requests)

    def destroy(self) -> None:
        """Serve no more."""
        self._server.destroy()

    def _admit(self, _: PlanFocus.Goal) -> GoalResponse:
        return GoalResponse.ACCEPT if self._desk.admits_goal() else GoalResponse.REJECT

    def _accept(self, goal: ServerGoalHandle) -> None:
        answer = Future()
        key = bytes(goal.goal_id.uuid)
        self._answers[key] = answer
        self._requests[key] = self._desk.submit_goal(
            fields_from_ros(goal.request),
            answer.set_result,
            lambda fields: self._tell(goal, fields),
        )
        goal.execute()

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        request = self._requests.get(bytes(goal.goal_id.uuid))
        # A second one does nothing more, and is granted as the first was.
        in_time = request is not None and (not request.goes_on or request.stop(Reason.CANCELLED))
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
        self._desk.answered(outcome)
        return result_of(outcome)

    def _tell(self, goal: ServerGoalHandle, fields: Fields) -> None:
        if goal.is_active:
            goal.publish_feedback(message_to_ros(PlanFocus.Feedback, fields))


def result_of(outcome: Outcome) -> PlanFocus.Result:
    """Return the result of a goal."""
    result = PlanFocus.Result()
    write_outcome(result, outcome)
    return result


def write_outcome(answer: Any, outcome: Outcome) -> None:
    """Write an outcome into a result or a response."""
    answer.success, answer.message = outcome.plan is not None, outcome.message
    answer.reason = int(outcome.reason)
    if outcome.plan is not None:
        answer.plan = outcome.plan
