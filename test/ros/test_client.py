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

import gc
import threading
from pathlib import Path

import pytest
from focus_planner_msgs.srv import PlanFocus
from lifecycle_msgs.srv import GetState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future

from focus_planner.ros import calls
from focus_planner.ros.client import PlannerClient
from testing.ros.calls import until
from testing.ros.planner_process import PATIENCE
from testing.ros.spinning import spun


def test_a_subscription_is_destroyed_on_the_thread_that_waits_on_it(monkeypatch):
    """Elsewhere it may end that thread, and with it every later call."""
    threads = []
    with PlannerClient("/nobody") as client:
        destroy = client._node.destroy_subscription

        def noting(subscription):
            threads.append(threading.current_thread())
            return destroy(subscription)

        monkeypatch.setattr(client._node, "destroy_subscription", noting)
        with pytest.raises(TimeoutError, match="no response from status within 0 s"):
            client.status(timeout=0.0)
        until(lambda: threads)
        assert threads == [client._thread]


def test_a_closed_client_leaves_nothing_open():
    """A program that opens many would run out of ports, and others would go on seeing them."""

    def sockets():
        links = (file.readlink() for file in Path("/proc/self/fd").iterdir() if file.is_symlink())
        return sum("socket" in str(link) for link in links)

    gc.disable()
    try:
        before, closed = sockets(), []
        for _ in range(2):
            client = PlannerClient("/nobody")
            assert sockets() > before
            client.close()
            closed.append(client)
            assert sockets() == before
    finally:
        gc.enable()


def test_a_call_whose_response_is_lost_is_made_again(make_node, monkeypatch):
    monkeypatch.setattr(calls, "_AGAIN", 0.2)
    node, requests, never = make_node(), [], Future()

    async def answer(request, response):
        requests.append(request)
        if len(requests) == 1:
            await never
        response.current_state.label = f"after {len(requests)} calls"
        return response

    group = ReentrantCallbackGroup()
    node.create_service(GetState, "/forgetful/get_state", answer, callback_group=group)
    with spun(node), PlannerClient("/forgetful") as client:
        assert client.state() == "after 2 calls"


def test_a_response_is_not_waited_for_once_nobody_is_left_to_send_it(make_node, monkeypatch):
    monkeypatch.setattr(calls, "_GONE", 0.2)
    node, arrived, never = make_node(), threading.Event(), Future()

    async def answer(request, response):
        arrived.set()
        await never
        return response

    group = ReentrantCallbackGroup()
    service = node.create_service(PlanFocus, "/mortal/plan_focus", answer, callback_group=group)
    with PlannerClient("/mortal") as client:
        with spun(node):
            call = client.plan_async()
            assert arrived.wait(PATIENCE)
            with pytest.raises(TimeoutError, match=r"within 0\.5 s"):
                client.wait_for(call, 0.5)
        node.destroy_service(service)
        with pytest.raises(TimeoutError, match="from plan_focus: the node has ended, or lost"):
            client.wait_for(call)
