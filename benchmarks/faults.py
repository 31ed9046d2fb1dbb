# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Faults: nodes killed in every state; clients that vanish, cancel twice or call too early."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from uuid import uuid4

import numpy as np
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from focus_planner_msgs.msg import PlannerStatus
from focus_planner_msgs.srv import PlanFocus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node as RosNode
from rich.console import Console

from benchmarks.guarantees import (
    Cameras,
    Node,
    Outcome,
    arguments,
    cameras_for,
    cameras_of,
    own_graph,
    report,
    running,
)
from focus_planner.ros.client import PlannerClient
from testing.malformed import BALL, RIG

_KILLS = int(os.environ.get("KILLS", "2"))
_SECONDS_TO_COME_BACK = 3.0
_VANISHING_CALLS, _VANISHING_GOALS = 100, 10
_START = 180.0
_PATIENCE = 60.0
# After which DDS forgets who is gone.
_LEASE = 25.0
_QUICK = {"method": "em", "samples": 200}
# Longer than it takes to see that it is planned.
_LONG = {"method": "optimal", "samples": 20_000, "gap": 1e-9, "time_budget": 4.0}


def run(console: Console) -> bool:
    """Print the tables; return whether all guarantees held."""
    with own_graph() as folder:
        kills = [partial(_kill, state, folder) for state in _STATES]
        kept = report(console, "kill -9, then started again", kills)
        clients = [_early, _vanishing_calls, _vanishing_goals, _cancelled_twice, _unknown_goal]
        return kept & report(console, "Clients", clients)


# --- kill -9 -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Victim:
    """A node that has made a plan and is to be killed."""

    node: Node
    client: PlannerClient
    plan_id: str


def _start(name: str, folder: Path, **parameters: object) -> Node:
    record = {"record_directory": folder / name, "fresh_samples": 256}
    return Node(name, *arguments(**record, **parameters))


def _kill(state: str, folder: Path) -> Outcome:
    seconds, published, said = [], [], 0
    name = f"killed_{state.replace(' ', '_')}_{os.getpid()}"
    for _ in range(_KILLS):
        plan_id = _bring_to(state, name, folder)
        came_back, sent, told = _restart(name, folder, plan_id)
        seconds.append(came_back)
        published.append(sent)
        said += told
    result = (
        f"last plan published after {np.median(published):.2f} s, {max(published):.2f} s at most,"
        f" received after {np.median(seconds):.2f} s, {max(seconds):.2f} s at most;"
        f" {said} of {_KILLS} say so"
    )
    kept = max(seconds) < _SECONDS_TO_COME_BACK and said == _KILLS
    return Outcome(f"killed while {state}", _KILLS, result, kept)


def _bring_to(state: str, name: str, folder: Path) -> str:
    """Start a node, bring it to a state, kill it; return the id of its last plan."""
    node = _start(name, folder)
    try:
        with PlannerClient(node.name) as client:
            client.wait_for_node(_START)
            _put_inputs(client)
            victim = _Victim(node, client, _planned(client))
            return _STATES[state](victim, partial(_start, name, folder))
    finally:
        if node.is_alive:
            node.kill()


def _put_inputs(client: PlannerClient) -> None:
    client.publish_rig(RIG)
    client.publish_mesh(BALL)


def _planned(client: PlannerClient) -> str:
    answer = client.plan(_PATIENCE, **_QUICK)
    assert answer.success, answer.message
    plan_id: str = answer.plan.plan_id
    return plan_id


def _while_active(victim: _Victim, _: Callable[..., Node]) -> str:
    # Its record is whole before long.
    time.sleep(1.0)
    victim.node.kill()
    return victim.plan_id


def _while_recording(victim: _Victim, _: Callable[..., Node]) -> str:
    """Kill it as soon as the caller has the response, when the recording is still incomplete."""
    plan_id = _planned(victim.client)
    victim.node.kill()
    return plan_id


def _while_planning(victim: _Victim, _: Callable[..., Node]) -> str:
    time.sleep(1.0)
    victim.client.plan_async(**_LONG)
    _wait_until_planning(victim.client)
    victim.node.kill()
    return victim.plan_id


def _while_inactive(victim: _Victim, _: Callable[..., Node]) -> str:
    time.sleep(1.0)
    assert victim.client.change_state("deactivate")
    victim.node.kill()
    return victim.plan_id


def _while_deactivating(victim: _Victim, _: Callable[..., Node]) -> str:
    time.sleep(1.0)
    victim.client.plan_async(**_LONG)
    _wait_until_planning(victim.client)
    asked = threading.Thread(target=_deactivate, args=(victim.client,), daemon=True)
    asked.start()
    time.sleep(0.005)
    victim.node.kill()
    return victim.plan_id


def _deactivate(client: PlannerClient) -> None:
    with suppress(Exception):  # the node, and then the client, are gone
        client.change_state("deactivate")


def _while_unconfigured(victim: _Victim, start: Callable[..., Node]) -> str:
    return _in_another(victim, start, "unconfigured", autostart=False)


def _while_configuring(victim: _Victim, start: Callable[..., Node]) -> str:
    return _in_another(victim, start, "configuring")


def _in_another(
    victim: _Victim, start: Callable[..., Node], state: str, **parameters: object
) -> str:
    """Kill the node, and then a restarted one early on."""
    time.sleep(1.0)
    victim.node.kill()
    other = start(**parameters)
    try:
        if state == "configuring":
            other.wait_for_log("loading kernels")
        else:
            with PlannerClient(other.name) as client:
                assert client.state() == state
    finally:
        other.kill()
    return victim.plan_id


def _wait_until_planning(client: PlannerClient) -> None:
    until = time.monotonic() + _PATIENCE
    while not client.status().planning:
        assert time.monotonic() < until, "the planner never said that it was planning"


_STATES: dict[str, Callable[[_Victim, Callable[..., Node]], str]] = {
    "unconfigured": _while_unconfigured,
    "configuring": _while_configuring,
    "inactive": _while_inactive,
    "active": _while_active,
    "planning": _while_planning,
    "recording": _while_recording,
    "deactivating": _while_deactivating,
}


def _restart(name: str, folder: Path, plan_id: str) -> tuple[float, float, bool]:
    """Return when a subscriber has the last plan, when it was sent, and whether the node says so.

    Both in seconds from the start of the process. Between the two is the middleware's discovery.
    """
    with PlannerClient(f"/{name}") as client:
        started, since_epoch = time.perf_counter(), time.time()
        node = _start(name, folder)
        try:
            plan = client.latched_plan(_PATIENCE)
            seconds = time.perf_counter() - started
            assert plan.plan_id == plan_id, f"{plan.plan_id} came back, not {plan_id}"
            node.wait_for_log(f"last plan, {plan_id}")
            said = re.search(r"\[(\d+\.\d+)\][^\n]*last plan", node.log)
            assert said is not None
            told = _status_of(client, plan_id).from_record
            client.wait_for_node(_START)
            _put_inputs(client)
            told = told and not _status_of(client, _planned(client)).from_record
            assert not node.faults, node.faults
            return seconds, float(said[1]) - since_epoch, told
        finally:
            node.kill()


def _status_of(client: PlannerClient, plan_id: str) -> PlannerStatus:
    """Return the status once it reports a plan, which may take a moment."""
    until = time.monotonic() + _PATIENCE
    while (status := client.status()).plan_id != plan_id:
        assert time.monotonic() < until, f"the status is of {status.plan_id}, never of {plan_id}"
        time.sleep(0.05)
    return status


# --- clients -----------------------------------------------------------------------------------


def _right_plan(planner: str, expected: Cameras) -> bool:
    """Return whether the next caller gets the right plan, newly made."""
    with PlannerClient(planner) as client:
        answer = client.plan(_PATIENCE, **_QUICK)
        return answer.success and cameras_of(answer.plan) == expected


def _expected() -> Cameras:
    return cameras_for(BALL, RIG, fresh_samples=256, **_QUICK)


def _early() -> Outcome:
    answers = []
    with running("early", autostart=False) as node, PlannerClient(node.name) as client:
        assert client.change_state("configure")
        inactive = client.plan(_PATIENCE, **_QUICK)
        answers.append(inactive.reason == PlanFocus.Response.REASON_INACTIVE)
        answers.append(not client.send_goal(**_QUICK).accepted)
        assert client.change_state("activate")
        for put in (lambda: None, lambda: client.publish_rig(RIG)):
            put()
            early = client.plan(_PATIENCE, **_QUICK)
            answers.append(early.reason == PlanFocus.Response.REASON_NOT_READY)
            _, result = client.send_goal(**_QUICK).result(_PATIENCE)
            answers.append(result.reason == PlanFocus.Response.REASON_NOT_READY)
        client.publish_mesh(BALL)
        answers.append(client.plan(_PATIENCE, **_QUICK).success)
        faults = node.faults
    result = (
        f"{sum(answers)} of {len(answers)} responses as guaranteed; {len(faults)} errors logged"
    )
    return Outcome(
        "asked while inactive, and before inputs", 1, result, all(answers) and not faults
    )


def _vanishing_calls() -> Outcome:
    return _vanishing("call", _VANISHING_CALLS)


def _vanishing_goals() -> Outcome:
    return _vanishing("goal", _VANISHING_GOALS)


def _vanishing(what: str, times: int) -> Outcome:
    """Kill clients while they wait for a response, and call from another in between."""
    expected, right, checks = _expected(), 0, 5
    with running("vanishing", fresh_samples=256, service_max_wait=_PATIENCE) as node:
        with PlannerClient(node.name) as client:
            client.wait_for_node(_START)
            _put_inputs(client)
        before = node.memory
        command = [sys.executable, "-m", "benchmarks.vanishing", node.name, what]
        for _ in range(checks):
            subprocess.run([*command, str(times // checks)], check=True)  # noqa: S603
            right += _right_plan(node.name, expected)
        time.sleep(_LEASE)
        faults, growth = node.faults, node.memory - before
    result = (
        f"{right} of {checks} later callers got the right plan;"
        f" memory {growth:+.1f} MiB; {len(faults)} errors logged"
    )
    kept = right == checks and not faults
    return Outcome(f"clients killed with a {what} in progress", times, result, kept)


def _cancelled_twice() -> Outcome:
    times, ended, right = 10, 0, 0
    expected = _expected()
    with running("cancelled", fresh_samples=256) as node, PlannerClient(node.name) as client:
        client.wait_for_node(_START)
        _put_inputs(client)
        for _ in range(times):
            goal = client.send_goal(**_LONG)
            goal.cancel()
            goal.cancel()
            status, result = goal.result(_PATIENCE)
            ended += (status, result.reason) == (
                GoalStatus.STATUS_CANCELED,
                PlanFocus.Response.REASON_CANCELLED,
            )
            goal.cancel()
            right += _right_plan(node.name, expected)
        faults = node.faults
    result = f"{ended} ended as cancelled; {right} later callers got the right plan"
    kept = ended == right == times and not faults
    return Outcome("goals cancelled twice, and once more", times, result, kept)


def _unknown_goal() -> Outcome:
    times = 10
    with running("unknown") as node, PlannerClient(node.name) as client:
        client.wait_for_node(_START)
        codes = _cancel_unknown(node.name, times)
        refused = codes.count(CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID)
        _put_inputs(client)
        success = client.plan(_PATIENCE, **_QUICK).success
        faults = node.faults
    kept = refused == times and success and not faults
    result = f"{refused} told that there is no such goal; {len(faults)} errors logged"
    return Outcome("unknown goals cancelled", times, result, kept)


def _cancel_unknown(planner: str, times: int) -> list[int]:
    """Return the planner's responses to cancelling goals that do not exist."""
    context = Context()
    context.init(args=[])
    node = RosNode("canceller", context=context, use_global_arguments=False, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        cancel = node.create_client(CancelGoal, f"{planner}/plan/_action/cancel_goal")
        assert cancel.wait_for_service(_PATIENCE)
        codes = []
        for _ in range(times):
            request = CancelGoal.Request()
            request.goal_info.goal_id.uuid = np.frombuffer(uuid4().bytes, np.uint8)
            answer = cancel.call_async(request)
            executor.spin_until_future_complete(answer, _PATIENCE)
            codes.append(answer.result().return_code)
        return codes
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
