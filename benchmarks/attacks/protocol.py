# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calls that no client library makes: unknown types, transitions and goals, odd names."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
from action_msgs.srv import CancelGoal
from focus_planner_msgs.action import PlanFocus as PlanFocusAction
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node as RosNode
from rich.console import Console

from benchmarks.attacks.lens_nodes import LensNode, running_lenses
from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import new_name, peer, victim

# Seconds in which a call is answered, if it ever is: who raises in it answers never.
_ANSWERED = 5.0
_MOST = 2**64 - 1
_NAMES = ["", "..", "\x1b[31m", "y" * 100_000, "none.such"]


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    lenses = [
        Attack(
            f"{kind}: parameters of unknown types, odd names",
            "each is answered, and so are those made afterwards; no traceback",
            partial(_lens_node, kind),
        )
        for kind in ("lens_adapter", "simulated_lens")
    ]
    return report(console, "8. The rest: calls", [planner, *lenses])


@attack(
    "the planner's services: parameters of unknown types, unknown transitions and goals, odd names",
    "each is answered, and so are those made afterwards; the plan is the same; no traceback",
)
def planner(folder: Path) -> Seen:
    """Call every service of the planner as no client library does."""
    calls = [*_parameter_calls(), *_other_calls()]
    left, harmful = calls.copy(), []
    while left:
        harmful += _call_until_harmed(left, folder)
    return Seen(_told(harmful, len(calls)), not harmful, len(calls))


def _call_until_harmed(left: list[Any], folder: Path) -> list[str]:
    """Make calls, and take them off the list, until one does harm; return that one."""
    what, harmful = "the start", []
    try:
        with victim(folder, clean=False) as one, peer() as node:
            while left:
                what, service, kind, request = left.pop(0)
                answer = _call(node, kind, f"{one.node.name}/{service}", request)
                if not _answers(node, one.node.name):
                    one.node.kill()
                    return [*harmful, f"{what}: no call afterwards"]
                harmful += [what] if answer is None else []
            one.put_inputs()
            one.check_plan()
            assert "Traceback" not in one.node.log, "a traceback in the log"
    except (AssertionError, TimeoutError) as error:
        return [*harmful, f"{what}: {error}"]
    return harmful


def _lens_node(module: str, _: Path) -> Seen:
    camera = new_name("webcam")
    node_of_lens = LensNode(module, cameras=[camera], driver="v4l2_camera")
    name = "/lens_adapter" if module == "lens_adapter" else f"/{camera}/v4l2_camera"
    harmful, made = [], 0
    with running_lenses(node_of_lens), peer() as node:
        for what, service, kind, request in _parameter_calls():
            made += 1
            if _call(node, kind, f"{name}/{service}", request) is None:
                harmful.append(what)
            if _call(node, ListParameters, f"{name}/list_parameters") is None:
                harmful.append("no call afterwards")
                break
        log = node_of_lens.log
    held = not harmful and "Traceback" not in log
    return Seen(_told(harmful, made), held, made)


def _told(harmful: list[str], made: int) -> str:
    some = harmful if len(harmful) < 5 else [*harmful[:2], "…", *harmful[-2:]]
    return (
        f"without an answer {len(harmful)} of {made} calls{': ' if some else ''}{', '.join(some)}"
    )


def _parameter_calls() -> Iterator[tuple[str, str, type, Any]]:
    """Yield what a call is, its service, type and request."""
    for number in (0, 10, 11, 200, 255):
        value = ParameterValue(type=number)
        for name in ("seed", "none_such"):
            parameters = [Parameter(name=name, value=value)]
            what = f"{name} of type {number}"
            for kind, service in _SETTERS.items():
                yield f"{service}: {what}", service, kind, kind.Request(parameters=parameters)
    kinds = {
        "get_parameters": GetParameters,
        "get_parameter_types": GetParameterTypes,
        "describe_parameters": DescribeParameters,
    }
    for service, kind in kinds.items():
        for names in (_NAMES, [], ["seed"] * 10_000):
            yield f"{service}: {len(names)} names", service, kind, kind.Request(names=names)
    request = ListParameters.Request(prefixes=_NAMES, depth=_MOST)
    yield "list_parameters: odd prefixes", "list_parameters", ListParameters, request


_SETTERS = {
    SetParameters: "set_parameters",
    SetParametersAtomically: "set_parameters_atomically",
}


def _other_calls() -> Iterator[tuple[str, str, type, Any]]:
    for label, number in (("", 0), ("", 255), ("y" * 100_000, 0), ("\x1b[31m", 1), ("destroy", 0)):
        request = ChangeState.Request(transition=Transition(id=number, label=label))
        yield f"change_state: {number} {label[:10]!r}", "change_state", ChangeState, request
    for service, kind in (
        ("get_state", GetState),
        ("get_available_transitions", GetAvailableTransitions),
        ("get_transition_graph", GetAvailableTransitions),
    ):
        yield service, service, kind, kind.Request()
    unknown = np.frombuffer(uuid4().bytes, np.uint8)
    cancel = CancelGoal.Request()
    cancel.goal_info.goal_id.uuid = unknown
    cancel.goal_info.stamp.sec, cancel.goal_info.stamp.nanosec = -(2**31), 2**32 - 1
    yield "cancel_goal: an unknown goal before time", "plan/_action/cancel_goal", CancelGoal, cancel
    result = PlanFocusAction.Impl.GetResultService
    request = result.Request()
    request.goal_id.uuid = unknown
    yield "get_result: an unknown goal", "plan/_action/get_result", result, request
    send = PlanFocusAction.Impl.SendGoalService
    for what in ("a goal", "the same goal again"):
        request = send.Request()
        request.goal_id.uuid = unknown
        yield f"send_goal: {what}", "plan/_action/send_goal", send, request


def _answers(node: RosNode, name: str) -> bool:
    return _call(node, GetState, f"{name}/get_state") is not None


def _call(node: RosNode, kind: type, service: str, request: Any = None) -> Any:
    """Return the response; None if there is none."""
    client = node.create_client(kind, service)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        if not client.wait_for_service(_ANSWERED):
            return None
        call = client.call_async(kind.Request() if request is None else request)
        executor.spin_until_future_complete(call, _ANSWERED)
        return call.result() if call.done() else None
    finally:
        executor.remove_node(node)
        executor.shutdown()
        node.destroy_client(client)
