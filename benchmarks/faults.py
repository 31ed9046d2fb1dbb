"""Faults: a node killed in every state, clients that vanish, cancel twice or come too early."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from uuid import uuid4

import numpy as np
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from focus_planner_msgs.srv import PlanFocus
from messages.malformed import BALL, RIG
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node as RosNode
from rich.console import Console

from benchmarks.promises import (
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
from benchmarks.scenes import body_scenes, rig
from focus_planner import Mesh, PointCloud
from focus_planner.messages.typestore import CLOUD, serialize
from focus_planner.messages.writing import cloud_to_fields
from focus_planner.ros.client import PlannerClient

_KILLS = int(os.environ.get("KILLS", "3"))
_SECONDS_TO_COME_BACK = 3.0
_VANISHING_CALLS, _VANISHING_GOALS = 100, 10
_START = 180.0
_PATIENCE = 60.0
_QUICK = {"method": "em", "samples": 200}
# Longer than it takes to see that it is planned.
_LONG = {"method": "optimal", "samples": 20_000, "gap": 1e-9, "time_budget": 4.0}
_POINTS = 5_000_000
_MOST_MEMORY = 4096.0


def run(console: Console) -> bool:
    """Print the tables; return whether all promises were kept."""
    multiprocessing.set_start_method("forkserver", force=True)
    # Importing ROS takes a second, and a hundred clients are to vanish.
    multiprocessing.set_forkserver_preload(["focus_planner.ros.client"])
    with own_graph() as folder:
        kills = [partial(_kill, state, folder) for state in _STATES]
        kept = report(console, "kill -9, then started again", kills)
        clients = [_early, _vanishing_calls, _vanishing_goals, _cancelled_twice, _unknown_goal]
        kept &= report(console, "Clients", clients)
        return kept & report(console, "Large clouds", [_large_cloud])


# --- kill -9 -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Victim:
    """A node that has made a plan, and will be killed."""

    node: Node
    client: PlannerClient
    plan_id: str


def _start(name: str, folder: Path, **parameters: object) -> Node:
    record = {"record_directory": folder / name, "fresh_samples": 256}
    return Node(name, *arguments(**record, **parameters))


def _kill(state: str, folder: Path) -> Outcome:
    seconds, said = [], 0
    name = f"killed_{state.replace(' ', '_')}_{os.getpid()}"
    for _ in range(_KILLS):
        plan_id = _bring_to(state, name, folder)
        came_back, told = _restart(name, folder, plan_id)
        seconds.append(came_back)
        said += told
    result = (
        f"last plan latched after {np.median(seconds):.2f} s, {max(seconds):.2f} s at most;"
        f" {said} of {_KILLS} say so"
    )
    kept = max(seconds) < _SECONDS_TO_COME_BACK and said == _KILLS
    return Outcome(f"killed while {state}", _KILLS, result, kept)


def _bring_to(state: str, name: str, folder: Path) -> str:
    """Start a node that plans, bring it to a state, kill it; return its last plan's name."""
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
    """Kill it as soon as the caller has the answer, of which the record is not yet whole."""
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
    """Kill the node, and another one before it has come far."""
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


def _restart(name: str, folder: Path, plan_id: str) -> tuple[float, bool]:
    """Return the seconds until a subscriber has the last plan, and whether the node says so."""
    with PlannerClient(f"/{name}") as client:
        started = time.perf_counter()
        node = _start(name, folder)
        try:
            plan = client.latched_plan(_PATIENCE)
            seconds = time.perf_counter() - started
            assert plan.plan_id == plan_id, f"{plan.plan_id} came back, not {plan_id}"
            status = client.status()
            while not status.plan_id:
                status = client.status()
            told = status.from_record and status.plan_id == plan_id and "last plan" in node.log
            client.wait_for_node(_START)
            _put_inputs(client)
            _planned(client)
            assert not node.faults, node.faults
            return seconds, told and not client.status().from_record
        finally:
            node.kill()


# --- clients -----------------------------------------------------------------------------------


def _right_plan(planner: str, expected: Cameras) -> bool:
    """Return whether the next caller gets the right plan; a fresh one."""
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
    result = f"{sum(answers)} of {len(answers)} answers as promised; {len(faults)} errors logged"
    return Outcome(
        "asked while inactive, and before inputs", 1, result, all(answers) and not faults
    )


def _vanishing_calls() -> Outcome:
    return _vanishing("calls", _VANISHING_CALLS, _call_and_wait)


def _vanishing_goals() -> Outcome:
    return _vanishing("goals", _VANISHING_GOALS, _send_goal_and_wait)


def _vanishing(what: str, times: int, ask: Callable[[str, Connection], None]) -> Outcome:
    """Have clients killed while they wait for an answer."""
    expected, right = _expected(), 0
    with running("vanishing", fresh_samples=256, service_max_wait=_PATIENCE) as node:
        with PlannerClient(node.name) as client:
            client.wait_for_node(_START)
            _put_inputs(client)
        before = node.memory
        checks = range(0, times, max(times // 10, 1))
        for i in range(times):
            _vanish(node.name, ask)
            if i in checks:
                right += _right_plan(node.name, expected)
        faults, growth = node.faults, node.memory - before
    result = (
        f"{right} of {len(checks)} later callers got the right plan;"
        f" memory {growth:+.1f} MiB; {len(faults)} errors logged"
    )
    kept = right == len(checks) and not faults
    return Outcome(f"clients killed with {what} in progress", times, result, kept)


def _vanish(planner: str, ask: Callable[[str, Connection], None]) -> None:
    here, there = multiprocessing.Pipe()
    client = multiprocessing.Process(target=ask, args=(planner, there), daemon=True)
    client.start()
    assert here.poll(_PATIENCE), "the client never asked"
    here.recv()
    client.kill()
    client.join()
    client.close()


def _call_and_wait(planner: str, there: Connection) -> None:
    """In a process of its own, until it is killed."""
    client = PlannerClient(planner)
    client.plan_async(method="k_view", samples=2000)
    # Kill it once the call is on its way, sooner or later.
    time.sleep(0.02 * np.random.default_rng(os.getpid()).random())
    there.send("asked")
    threading.Event().wait()


def _send_goal_and_wait(planner: str, there: Connection) -> None:
    client = PlannerClient(planner)
    assert client.send_goal(**_LONG | {"time_budget": 1.0}).accepted
    there.send("accepted")
    threading.Event().wait()


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
    """Return what a planner answers to whoever cancels goals that nobody sent."""
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


# --- large clouds ------------------------------------------------------------------------------


def _large_cloud() -> Outcome:
    body = next(iter(body_scenes().values()))
    assert isinstance(body.surface, Mesh)
    large = PointCloud(body.sample(_POINTS + 1, 1).points)
    with running("cloud", fresh_samples=4096, service_max_wait=600.0) as node:
        with PlannerClient(node.name) as client:
            client.wait_for_node(_START)
            client.publish_rig(rig())
            client.publish_mesh(body.surface)
            refused, said = _refused(client, large)
            accepted = _accepted(client, PointCloud(large.points[:_POINTS]))
        peak, faults = node.peak, node.faults
    result = (
        f"{_POINTS + 1:,} points refused in {refused:.1f} s ({said});"
        f" {_POINTS:,} points planned for after {accepted:.0f} s;"
        f" peak {peak:.0f} MiB; {len(faults)} errors logged"
    )
    kept = "max_points" in said and peak < _MOST_MEMORY and not faults
    return Outcome("clouds at the limit, and above it", 2, result, kept)


def _refused(client: PlannerClient, cloud: PointCloud) -> tuple[float, str]:
    before = client.plan(_PATIENCE, **_QUICK).plan
    started = time.perf_counter()
    _publish(client, cloud)
    answer = client.plan(_PATIENCE, **_QUICK)
    seconds = time.perf_counter() - started
    after = client.plan(_PATIENCE, **_QUICK).plan
    assert not answer.success
    assert cameras_of(before) == cameras_of(after)
    return seconds, answer.message.split(";")[0]


def _accepted(client: PlannerClient, cloud: PointCloud) -> float:
    started = time.perf_counter()
    _publish(client, cloud)
    answer = client.plan(600.0, **_QUICK)
    assert answer.success, answer.message
    assert answer.plan.surface.topic.endswith("/cloud")
    return time.perf_counter() - started


def _publish(client: PlannerClient, cloud: PointCloud) -> None:
    """Publish the points as sensors do, in 32 bits."""
    fields = cloud_to_fields(cloud, "world")
    data = np.ascontiguousarray(cloud.points, "<f4")
    for i, part in enumerate(fields["fields"]):
        part |= {"offset": 4 * i, "datatype": 7}
    fields |= {"point_step": 12, "row_step": data.nbytes, "data": data.tobytes()}
    client.publish("cloud", serialize(CLOUD, fields))
