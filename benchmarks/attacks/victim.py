# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The node under attack: a planner in a process of its own, its client, and its good plan."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from signal import SIGINT
from typing import Any, TypeVar

from rclpy.context import Context
from rclpy.node import Node as RosNode

from benchmarks.guarantees import Cameras, Node, arguments, cameras_for, cameras_of
from benchmarks.processes import Watch, end_all, family, watched
from focus_planner.ros.client import PlannerClient
from testing.malformed import BALL, RIG

# Seconds: what a node that works never needs, and one that hangs is not given more than.
PATIENCE = 30.0
START = 90.0
# MiB: above it a node is killed, for the sake of the machine.
MOST_MEMORY = 4096.0
REQUEST = {"method": "em", "samples": 200}
FRESH = 256
_FAULT = re.compile(r"Traceback|internal error|Warning:", re.IGNORECASE)
_count = itertools.count()
_Found = TypeVar("_Found")


@cache
def expected() -> Cameras:
    """Return the good plan, as the library makes it."""
    return cameras_for(BALL, RIG, fresh_samples=FRESH, **REQUEST)


@dataclass
class Victim:
    """A node that runs, and its client."""

    node: Node
    client: PlannerClient
    watch: Watch

    @property
    def faults(self) -> list[str]:
        """Lines of the log that no attack may cause."""
        return [line for line in self.node.log.splitlines() if _FAULT.search(line)]

    def put_inputs(self) -> None:
        """Publish what the good plan is for."""
        self.client.publish_rig(RIG)
        self.client.publish_mesh(BALL)

    def check_plan(self, timeout: float = PATIENCE) -> str:
        """Have it plan, which gives the good plan bit for bit; return the plan's id."""
        answer = self.client.plan(timeout, **REQUEST)
        assert answer.success, f"no plan: {answer.message}"
        assert cameras_of(answer.plan) == expected(), "another plan than before"
        plan_id: str = answer.plan.plan_id
        return plan_id

    def check_log(self) -> None:
        """Check that nothing in the log is a fault of the node's own."""
        assert not self.faults, f"{len(self.faults)} faults logged: {self.faults[0]}"


def new_name(what: str = "victim") -> str:
    """Return a name that no other node has."""
    return f"{what}_{os.getpid()}_{next(_count)}"


@contextmanager
def victim(
    folder: Path | None = None,
    *,
    name: str = "",
    inputs: bool = True,
    clean: bool = True,
    under: Sequence[str] = (),
    start: float = START,
    most: float = MOST_MEMORY,
    **parameters: object,
) -> Iterator[Victim]:
    """Run a node that has its inputs; it has to end when asked to, without faults in its log.

    Parameters
    ----------
    folder : Path, optional
        Where it is started.
    name : str, optional
        Its name.
    inputs : bool
        Whether its inputs are published.
    clean : bool
        Whether a fault in its log is an error.
    under : sequence of str
        A command that starts it.
    start : float
        Seconds that it may take to start.
    most : float
        MiB above which it is killed.
    parameters
        Those of the node.
    """
    given = {"fresh_samples": FRESH, "service_max_wait": PATIENCE} | parameters
    node = Node(
        name or new_name(),
        *arguments(**given),
        folder=None if folder is None else str(folder),
        under=under,
    )
    with ExitStack() as stack:
        stack.callback(kill, node)
        watch = stack.enter_context(watched(node.pid, most))
        client = stack.enter_context(PlannerClient(node.name))
        one = Victim(node, client, watch)
        until(lambda: _is_active(one), "it never became active", start)
        if inputs:
            one.put_inputs()
        yield one
        assert not watch.killed, f"it took more than {most:.0f} MiB and was killed"
        assert node.is_alive, f"it ended by itself: {node.log[-300:]}"
        check_end(node)
        if clean:
            one.check_log()


def check_end(node: Node, seconds: float = PATIENCE) -> None:
    """End a node with SIGINT, which it has to obey."""
    node.signal(SIGINT)
    status = ended(node, seconds)
    assert status is not None, f"SIGINT did not end it within {seconds:.0f} s"
    assert status == 0, f"SIGINT ended it with status {status}"


def ended(node: Node, seconds: float) -> int | None:
    """Return the exit status of a node once it has ended, None if it has not by then."""
    with suppress(TimeoutError):
        until(node.has_ended, "", seconds)
        return node.wait()
    return None


def kill(node: Node) -> None:
    """Kill a node and all that it has started."""
    end_all(family(node.pid) if node.is_alive else [])
    node.wait()


def until(condition: Callable[[], _Found], otherwise: str, seconds: float = PATIENCE) -> _Found:
    """Wait until a condition holds, and return its value."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        if time.monotonic() > end:
            raise TimeoutError(f"{otherwise} within {seconds:.0f} s")
        time.sleep(0.02)
    return found


def _is_active(one: Victim) -> bool:
    if one.watch.killed:
        raise TimeoutError("it took too much memory and was killed while starting")
    if not one.node.is_alive:
        raise TimeoutError(f"it ended while starting: {one.node.log[-300:]}")
    with suppress(TimeoutError):
        one.client.wait_for_node(1.0)
        return bool(one.client.status(5.0).state == "active")
    return False


@dataclass(frozen=True)
class Ran:
    """What a command did.

    Attributes
    ----------
    status : int or None
        None if it had to be killed.
    out, err : str
    seconds : float
    peak : float
        Resident memory, MiB.
    """

    status: int | None
    out: str
    err: str
    seconds: float
    peak: float

    @property
    def is_refusal(self) -> bool:
        """Whether it ended as bad input does: status 2 and one line."""
        return self.status == 2 and len(self.err.strip().splitlines()) == 1

    def told(self) -> str:
        """Return it in a few words."""
        status = "killed" if self.status is None else f"status {self.status}"
        return f"{status} after {self.seconds:.1f} s and {self.peak:.0f} MiB, {_last(self.err)!r}"


def command(
    *argv: object,
    seconds: float = PATIENCE,
    most: float = MOST_MEMORY,
    under: Sequence[str] = (),
    env: Mapping[str, str] | None = None,
) -> Ran:
    """Run ``focus_planner`` with arguments; kill it if it takes too long or too much memory."""
    full = [*under, sys.executable, "-m", "focus_planner", *map(str, argv)]
    began = time.perf_counter()
    process = subprocess.Popen(  # noqa: S603
        full,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="backslashreplace",
        env={**os.environ, **(env or {})},
    )
    with watched(process.pid, most) as watch:
        try:
            out, err = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            end_all(family(process.pid))
            out, err = process.communicate()
            watch.killed = True
    status = None if watch.killed else process.returncode
    return Ran(status, out, err, time.perf_counter() - began, watch.peak)


def _last(text: str) -> str:
    return (text.strip().splitlines() or [""])[-1][:160]


@contextmanager
def peer() -> Iterator[RosNode]:
    """Yield a node in this process that is not spun, as any peer on the graph may have one."""
    context = Context()
    context.init(args=[])
    node = RosNode(
        new_name("peer"), context=context, use_global_arguments=False, enable_rosout=False
    )
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def parameter_of(client: PlannerClient, **values: Any) -> tuple[bool, str, float]:
    """Set a parameter; return whether it was taken, the reason, and the seconds it took."""
    began = time.perf_counter()
    (result,) = client.set_parameters(**values)
    return result.successful, result.reason, time.perf_counter() - began
