# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Who sent a request: told by the middleware, read from where rclpy leaves it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from focus_planner_msgs.action import PlanFocus as PlanAction
from focus_planner_msgs.srv import PlanFocus
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.node import Node

from focus_planner.ros.callers import (
    UNKNOWN,
    CallerTellingActionServer,
    CallerTellingExecutor,
    caller_of_call,
    caller_of_goal,
)
from testing.ros.calls import until

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


class Served:
    """A node that serves calls and goals, two others that send them, and who is found to have."""

    def __init__(self, contexts):
        self.executor = CallerTellingExecutor(context=contexts[0])
        self.called, self.sent, self.executed = [], [], 0
        self.nodes = [
            Node(f"node_{k}", context=context, use_global_arguments=False)
            for k, context in enumerate(contexts)
        ]
        server, *_ = self.nodes
        server.create_service(PlanFocus, "/plan_focus", self._answer)
        self._actions = CallerTellingActionServer(
            server, PlanAction, "/plan", self._execute, handle_accepted_callback=self._accept
        )
        self.executor.add_node(server)

    async def _answer(self, _, response):
        self.called.append(self.executor.caller)
        return response

    def _accept(self, goal):
        self.sent.append(self._actions.caller)
        goal.execute()

    def _execute(self, goal):
        goal.succeed()
        self.executed += 1
        return PlanAction.Result()

    def spin_until(self, condition):
        def turn():
            self.executor.spin_once(timeout_sec=0.01)
            return condition()

        until(turn)

    def close(self):
        self._actions.destroy()
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()


@pytest.fixture
def served():
    contexts = [Context() for _ in range(3)]
    for context in contexts:
        context.init(args=[])
    served = Served(contexts)
    yield served
    served.close()
    for context in contexts:
        context.try_shutdown()


def test_calls_and_goals_of_a_participant_have_one_caller_and_others_have_others(served):
    _, *others = served.nodes
    for node in others:
        client = node.create_client(PlanFocus, "/plan_focus")
        goals = ActionClient(node, PlanAction, "/plan")
        served.spin_until(lambda client=client: client.service_is_ready())
        served.spin_until(lambda goals=goals: goals.server_is_ready())
        for _ in range(2):
            asked = len(served.called), served.executed
            client.call_async(PlanFocus.Request())
            goals.send_goal_async(PlanAction.Goal())
            served.spin_until(
                lambda asked=asked: len(served.called) > asked[0] and served.executed > asked[1]
            )
        goals.destroy()
    first, second = served.called[:2], served.called[2:]
    assert len(set(first)) == len(set(second)) == 1
    assert first != second
    assert UNKNOWN not in served.called
    assert served.sent == served.called


def test_what_is_no_header_has_an_unknown_caller():
    other = SimpleNamespace(source_timestamp=0, received_timestamp=0, sequence_number=0)
    assert caller_of_call(other) == UNKNOWN
    assert caller_of_goal(other) == UNKNOWN
