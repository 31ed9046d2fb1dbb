# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Times and states at which a node may be caught out: cleanup, a clock that jumps, no memory."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from focus_planner_msgs.msg import PlannerStatus
from rclpy.qos import QoSProfile
from rich.console import Console
from rosgraph_msgs.msg import Clock

from benchmarks.attacks.graph import messages
from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import (
    PATIENCE,
    REQUEST,
    START,
    Victim,
    command,
    ended,
    kill,
    new_name,
    peer,
    until,
    victim,
)
from benchmarks.guarantees import Node, arguments
from benchmarks.processes import family, processor_seconds
from focus_planner.ros.client import Goal, PlannerClient
from testing.malformed import BALL, RIG, absurd

_LONG = {"method": "optimal", "samples": 16_384, "gap": 1e-12}
_ROUNDS, _GOALS = 5, 3
_GIB = 2**30
_LIMITS = (0.7, 1.0, 1.2, 1.6, 2.4)
_ABSURD = 300
# Seconds of a clock, before and after it jumps.
_BEFORE, _BACK, _AHEAD = 100_000.0, 10.0, 10_000_000.0
_LISTENING = 6.0


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    memory = [
        Attack(
            f"{limit:g} GiB of address space",
            "it works, or ends by itself with a status other than 0 and says why",
            partial(_with_address_space, limit),
        )
        for limit in _LIMITS
    ]
    return report(console, "8. The rest: states and times", [cleanup, clock, *memory, warnings])


@attack(
    f"{_GOALS} goals and 2 calls in flight during deactivate and cleanup, {_ROUNDS} times",
    "each gets an answer, and the node can be configured again",
)
def cleanup(folder: Path) -> Seen:
    """Clean up while goals are planned, wait, and are being sent."""
    answered, asked = 0, 0
    with victim(folder) as one, PlannerClient(one.node.name) as other:
        for number in range(_ROUNDS):
            goals = [one.client.send_goal(**_LONG, seed=number + 1) for _ in range(_GOALS)]
            calls = [one.client.plan_async(**_LONG) for _ in range(2)]
            late: list[Goal | None] = []
            thread = threading.Thread(target=_send_meanwhile, args=(other, late))
            time.sleep(0.2 * number)
            thread.start()
            assert one.client.change_state("deactivate")
            assert one.client.change_state("cleanup")
            thread.join()
            asked += len(goals) + len(late) + len(calls)
            answered += sum(map(_answered, [*goals, *late]))
            answered += sum(one.client.wait_for(call, PATIENCE) is not None for call in calls)
            assert one.client.change_state("configure")
            assert one.client.change_state("activate")
            one.put_inputs()
            one.check_plan()
    return Seen(f"{answered} of {asked} answered", answered == asked, asked)


def _send_meanwhile(client: PlannerClient, late: list[Goal | None]) -> None:
    """Send goals as long as there is somebody to take them; None for one without an answer."""
    for _ in range(5):
        try:
            late.append(client.send_goal(**_LONG))
        except TimeoutError as error:
            if "no planner offers" not in str(error):
                late.append(None)
            return
        time.sleep(0.02)


def _answered(goal: Goal | None) -> bool:
    """Return whether a goal was rejected, or has a result."""
    if goal is None:
        return False
    try:
        return not goal.accepted or goal.result(PATIENCE) is not None
    except TimeoutError:
        return False


@attack(
    "/clock that jumps back by a day, and ahead by months, with use_sim_time",
    "plans, statuses and their ages go on: none is negative",
)
def clock(folder: Path) -> Seen:
    """Set back the clock of a node that runs on it."""
    seen = []
    with _ticking() as tick, victim(folder, use_sim_time=True) as one:
        one.check_plan()
        for jump in (_BACK, _AHEAD, _BACK):
            tick.now = jump
            seen.append(_look(one))
    ages = [age for each in seen for age in each[1]]
    statuses = [each[0] for each in seen]
    negative = sum(age < 0 for age in ages)
    observed = f"statuses in {_LISTENING:g} s: {statuses}; {negative} of {len(ages)} ages negative"
    return Seen(observed, min(statuses) >= _LISTENING / 2 and not negative, len(seen))


def _look(one: Victim) -> tuple[int, list[float]]:
    """Return how many statuses came, and the ages that they and plans tell."""
    ages = []
    for _ in range(2):
        answer = one.client.plan(PATIENCE, **REQUEST)
        assert answer.success, answer.message
        ages += [answer.plan.surface.age, answer.plan.rig.age]
        one.put_inputs()
    with peer() as node:
        qos = QoSProfile(depth=100)
        found = messages(node, PlannerStatus, f"{one.node.name}/status", qos, _LISTENING)
    ages += [each.age for status in found for each in (status.surface, status.rig)]
    return len(found), ages


class _Tick:
    """The time that is published."""

    def __init__(self) -> None:
        self.now = _BEFORE


@contextmanager
def _ticking() -> Iterator[_Tick]:
    """Publish a clock that can be set while it runs."""
    tick, stopping, period = _Tick(), threading.Event(), 0.02
    with peer() as node:
        publisher = node.create_publisher(Clock, "/clock", 1)

        def run_clock() -> None:
            while not stopping.wait(period):
                tick.now += period
                seconds, part = divmod(tick.now, 1.0)
                stamp = Time(sec=int(seconds), nanosec=int(part * 1e9))
                publisher.publish(Clock(clock=stamp))

        thread = threading.Thread(target=run_clock)
        thread.start()
        try:
            yield tick
        finally:
            stopping.set()
            thread.join()


def _with_address_space(limit: float, folder: Path) -> Seen:
    """Start a node that soon gets no more memory."""
    under = ["prlimit", f"--as={int(limit * _GIB)}"]
    node = Node(new_name(), *arguments(fresh_samples=256), folder=str(folder), under=under)
    try:
        with PlannerClient(node.name) as client:
            try:
                until(lambda: node.has_ended() or _works(node, client), "it does nothing", START)
            except TimeoutError:
                spent = processor_seconds(family(node.pid))
                said = f"neither works nor ends within {START:g} s, {spent:.0f} s of processor"
                return Seen(f"{said} time; {_last(node)}", held=False)
            if not node.has_ended():
                return Seen("it works", held=True)
        status = ended(node, PATIENCE)
    finally:
        kill(node)
    return Seen(f"ended with {status}; {_last(node)}", status not in {0, None} and bool(node.log))


def _works(node: Node, client: PlannerClient) -> bool:
    """Return whether it plans."""
    try:
        client.wait_for_node(1.0)
        if client.status(1.0).state != "active":
            return False
        client.publish_rig(RIG)
        client.publish_mesh(BALL)
        # What is refused for want of memory, in words, is answered too.
        return node.is_alive and bool(client.plan(PATIENCE, **REQUEST).success)
    except TimeoutError:
        return False


def _last(node: Node) -> str:
    lines = node.log.strip().splitlines()
    return repr(lines[-1][:200]) if lines else "it said nothing"


@attack(
    f"{_ABSURD} absurd values on each input, and files with them",
    "no RuntimeWarning, no traceback, the same plan afterwards",
)
def warnings(folder: Path) -> Seen:
    """Send absurd values, and plan for files with them."""
    random = np.random.default_rng(1)
    with victim(folder) as one:
        for topic in ("mesh", "cloud", "camera_poses", "rig"):
            for number in range(_ABSURD):
                one.client.publish(topic, absurd(topic, random))
                if number % 4 == 0:
                    one.client.plan(PATIENCE, **REQUEST)
            one.put_inputs()
            one.check_plan()
        one.check_log()
    said = [line for ran in _plans_of_absurd_files(folder) for line in _warnings(ran.err)]
    return Seen(f"of files: {said[:3] or 'nothing'}", not said, 4 * _ABSURD)


def _plans_of_absurd_files(folder: Path) -> Iterator[Any]:
    rig = folder / "rig.yaml"
    rig.write_text(command("rig", "cylinder", "--rows", 1, "--columns", 3, "--radius", 1).out)
    for number, scale in enumerate((1e308, 1e200, 1e150, 1e-150, 1e-300, 5e-324)):
        path = folder / f"absurd{number}.obj"
        corners = (f"v {scale * x} {scale * y} {scale * z}" for x, y, z in np.eye(3))
        path.write_text("\n".join([*corners, "f 1 2 3", ""]))
        options = ("--quiet", "--method", "closest", "--samples", "50")
        yield command("plan", path, "--rig", rig, *options)


def _warnings(text: str) -> list[str]:
    return [line for line in text.splitlines() if "Warning" in line or "Traceback" in line]
