# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Serves ``~/plan_focus`` and ``~/plan``: queues requests for the planning thread, and answers."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from focus_planner_msgs.srv import PlanFocus
from rclpy.callback_groups import CallbackGroup
from rclpy.service import Service
from rclpy.task import Future

from focus_planner.messages.writing import Fields
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.naming import new_run_id
from focus_planner.ros.action import PlanAction, write_outcome
from focus_planner.ros.callers import UNKNOWN
from focus_planner.ros.conversions import fields_from_ros
from focus_planner.ros.lifecycle import ManagedNode
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.ros.qos import ALL_CALLS
from focus_planner.ros.subscriptions import Subscriptions
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome, Request, Requests

# The executor takes a few steps to send an answer, and clients ask for results once goals ended.
_TICKS_TO_SEND = 10


class PlanServer:
    """Serves requests for plans.

    It belongs to the executor's thread. A call is a coroutine that waits for the planning thread,
    in a reentrant callback group so that calls can queue up. rclpy looks at waiting coroutines only
    when something wakes the executor, so waiting costs nothing.

    Parameters
    ----------
    node : ManagedNode
    group : CallbackGroup
        A reentrant one.
    settings : callable
        Returns the current parameters.
    on_change : callable
        Called when requests arrive and when they have been answered.

    Attributes
    ----------
    requests : Requests
        The unanswered ones.
    answered : float
        When the last one was answered, by :func:`time.monotonic`.
    """

    def __init__(
        self,
        node: ManagedNode,
        group: CallbackGroup,
        settings: Callable[[], Settings],
        on_change: Callable[[], None],
    ) -> None:
        self.requests = Requests()
        self.answered = -math.inf
        self._node = node
        self._group = group
        self._settings = settings
        self._on_change = on_change
        self._is_active = False
        self._planning: PlanningThread | None = None
        self._inputs: Subscriptions | None = None
        self._service: Service | None = None
        self._action: PlanAction | None = None
        self._calls: set[Future] = set()
        self._ticks_to_close = 0
        self._unfinished: deque[Callable[[], object]] = deque()

    def open(self, planning: PlanningThread, inputs: Subscriptions) -> None:
        """Create the service and the action; until :meth:`activate` no request is accepted.

        Parameters
        ----------
        planning : PlanningThread
            Plans.
        inputs : Subscriptions
            Emptied before each request, which is to be planned with what was sent before it.
        """
        self._planning, self._inputs = planning, inputs
        self._ticks_to_close = 0
        if self._service:
            return
        self._service = self._node.create_service(
            PlanFocus,
            "~/plan_focus",
            self._plan_focus,
            qos_profile=ALL_CALLS,
            callback_group=self._group,
        )
        self._action = PlanAction(self._node, self._group, self)

    def close_when_answered(self) -> None:
        """Destroy the service and the action once all callers have their answers.

        The executor, which sends those, may be busy with a transition now.
        """
        self._planning = self._inputs = None
        self._ticks_to_close = _TICKS_TO_SEND

    def close_if_answered(self) -> None:
        """Do what is left of :meth:`close_when_answered`; to be called now and then."""
        if self._ticks_to_close and not self.is_busy:
            self._ticks_to_close -= 1
            if not self._ticks_to_close:
                self.close()

    def close(self) -> None:
        """Destroy the service and the action."""
        self._ticks_to_close = 0
        if self._service:
            self._node.destroy_service(self._service)
        if self._action:
            self._action.destroy()
        self._service = self._action = None
        self._planning = self._inputs = None

    def activate(self) -> None:
        """Accept requests."""
        self._is_active = True

    def deactivate(self, reason: Reason) -> None:
        """Answer all requests without a plan, and accept no more."""
        self._is_active = False
        self.requests.abort_all(reason)

    @property
    def is_busy(self) -> bool:
        """Whether a call or a goal is still to be answered."""
        return bool(self._calls) or (self._action is not None and self._action.is_busy)

    def admit_goal(self, caller: bytes) -> bool:
        """Return whether a caller's goal is accepted; if so, stop those that it preempts."""
        if not self._is_active:
            self._node.get_logger().info("rejected a goal: the planner is not active")
            return False
        serving = self._settings().serving
        if not self.requests.admit_goal(serving, caller):
            unanswered = len(self.requests.open)
            self._node.get_logger().info(
                f"rejected a goal: overlap is {serving.overlap}, unanswered requests: {unanswered}"
            )
            return False
        return True

    def submit_goal(
        self,
        asked: Fields,
        answer: Callable[[Outcome], None],
        send_feedback: Callable[[Fields], None],
        caller: bytes,
    ) -> Request:
        """Queue a goal."""
        return self._submit(asked, answer, send_feedback=send_feedback, caller=caller)

    def on_outcome(self, outcome: Outcome) -> None:
        """Schedule the work that is deferred until the answer has been sent."""
        self.answered = time.monotonic()
        self._unfinished.append(outcome.on_sent)
        self._on_change()
        if self._node.executor:
            # The executor gets to this task only after it has sent the response.
            self._node.executor.create_task(self._finish_one)

    def finish_answered(self) -> None:
        """Do the work that :meth:`on_outcome` scheduled, in case the executor no longer does."""
        while self._unfinished:
            self._finish_one()

    async def _plan_focus(
        self, request: PlanFocus.Request, response: PlanFocus.Response
    ) -> PlanFocus.Response:
        """Queue a call, and wait until it is answered."""
        caller = getattr(self._node.executor, "caller", UNKNOWN)
        outcome = self._inactive() if not self._is_active else await self._answered(request, caller)
        write_outcome(response, outcome)
        self.on_outcome(outcome)
        return response

    async def _answered(self, request: PlanFocus.Request, caller: bytes) -> Outcome:
        answer = Future()
        self._calls.add(answer)
        try:
            until = time.perf_counter() + self._settings().serving.service_max_wait
            asked = fields_from_ros(request)
            self._submit(asked, answer.set_result, waits_until=until, caller=caller)
            outcome: Outcome = await answer
        finally:
            self._calls.remove(answer)
        return outcome

    def _submit(self, asked: Fields, answer: Callable[[Outcome], None], **options: Any) -> Request:
        assert self._planning is not None
        assert self._inputs is not None
        self._inputs.take_all()

        def answer_and_wake(outcome: Outcome) -> None:
            answer(outcome)
            if self._node.executor:
                self._node.executor.wake()

        request = Request(asked, self._settings(), new_run_id(), answer_and_wake, **options)
        self._on_change()
        if self.requests.add(request):
            self._planning.plan(request)
        return request

    def _finish_one(self) -> None:
        if self._unfinished:
            self._unfinished.popleft()()

    def _inactive(self) -> Outcome:
        if self._node.is_finalized:
            return Outcome(Reason.INACTIVE, "the planner has been shut down; start it again")
        command = f"ros2 lifecycle set {self._node.get_fully_qualified_name()} activate"
        return Outcome(Reason.INACTIVE, f"the planner is inactive; activate it: {command}")
