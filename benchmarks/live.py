# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planning by itself for a body that moves and breathes: plans a second, delay, memory, coverage.

``--minutes`` says for how long. Plans are made without bounds, which nobody could look at as often;
environment variable BOUND, say "quick", has them made with. RECORD, if it is set, has the node
record.
"""

from __future__ import annotations

import math
import os
import time
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from focus_planner_msgs.msg import FocusPlan
from rclpy.context import Context
from rclpy.node import Node as RosNode
from rclpy.serialization import deserialize_message
from rich.console import Console
from rich.table import Table

from benchmarks.guarantees import Node, own_graph, running
from benchmarks.options import options
from benchmarks.processes import family, processor_seconds
from benchmarks.scenes import body_scenes, rig
from benchmarks.warm import breathing
from focus_planner import Mesh, PlanRequest, Scene
from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.messages.writing import mesh_to_bytes
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.qos import LATCHED
from testing.ros.spinning import spun

_HERTZ = 10.0
_MINUTES = 1.0
_MOVED = 0.05  # metres, there and back
_MESHES = 40  # of one movement
_WARM_UP = 5.0  # seconds
_MIN_CHANGE = 0.25
_BOUND = os.environ.get("BOUND", "none")
_BETWEEN_LOOKS = 50  # meshes
_JUDGED = 12  # plans
_JUDGES = PlanRequest(samples=20_000, seed=7)


def run(console: Console) -> None:
    """Print the table."""
    minutes = options().minutes or _MINUTES
    with own_graph() as folder:
        record = {"record_directory": folder / "runs"} if "RECORD" in os.environ else {}
        parameters = {"replan": "on_surface", "min_change": _MIN_CHANGE, "bound": _BOUND, **record}
        with running("live", **parameters) as node, _listening(node.name) as heard:
            meshes = _moving_body()
            seen = _Seen(meshes)
            with PlannerClient(node.name) as client:
                client.wait_for_node(180)
                client.publish_rig(rig())
                _send(client, node, seen, 60 * minutes)
            console.print(_table(seen, heard, node.faults, minutes))
            if record:
                sizes = [each.stat().st_size for each in folder.rglob("*.mcap")]
                console.print(f"recorded: {len(sizes)} runs of {sum(sizes) / 1e6:.1f} MB together")


# --- The body ------------------------------------------------------------------------------------


def _moving_body() -> list[Mesh]:
    """Return a body that moves sideways, there and back, and breathes meanwhile."""
    *_, body = (scene.surface for scene in body_scenes().values())
    assert isinstance(body, Mesh)
    phases = 2 * math.pi * np.arange(_MESHES) / _MESHES
    return [
        replace(
            body,
            vertices=breathing(body, math.sin(2 * phase)) + [0.0, _moved(phase), 0.0],
        )
        for phase in phases
    ]


def _moved(phase: float) -> float:
    return _MOVED * (1 - math.cos(phase)) / 2


# --- Sending and listening -----------------------------------------------------------------------


@dataclass
class _Seen:
    """When meshes were sent, by the time of day, and the memory of the node meanwhile, MiB."""

    meshes: list[Mesh]
    sent: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)
    processors: dict[str, float] = field(default_factory=dict)

    def note_processors(self, node: Node, sign: int) -> None:
        """Add, or take away, the processor seconds that the node has taken, and its others."""
        rest = [pid for pid in family(node.pid) if pid != node.pid]
        for name, pids in {"node": [node.pid], "planning": rest}.items():
            taken = self.processors.get(name, 0.0) + sign * processor_seconds(pids)
            self.processors[name] = taken


@dataclass
class _Heard:
    """Plans, serialized, and when each arrived; the newest counts of surfaces."""

    plans: list[tuple[float, bytes]] = field(default_factory=list)
    counts: dict[str, str] = field(default_factory=dict)

    def note_plan(self, payload: bytes, info: dict[str, int]) -> None:
        self.plans.append((info["received_timestamp"] * 1e-9, payload))

    def note_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name.endswith("replanning"):
                self.counts = {each.key: each.value for each in status.values}


def _send(client: PlannerClient, node: Node, seen: _Seen, seconds: float) -> None:
    payloads = [mesh_to_bytes(mesh) for mesh in seen.meshes]
    client.publish("mesh", payloads[0])
    time.sleep(_WARM_UP)
    seen.note_processors(node, -1)
    due = time.perf_counter()
    for number in range(int(seconds * _HERTZ)):
        due += 1 / _HERTZ
        time.sleep(max(0.0, due - time.perf_counter()))
        seen.sent.append(time.time())
        client.publish("mesh", payloads[number % len(payloads)])
        if number % _BETWEEN_LOOKS == 0:
            seen.memory.append(node.memory)
    seen.note_processors(node, 1)
    time.sleep(2.0)  # for the last plan, and for what /diagnostics says of all


@contextmanager
def _listening(planner: str) -> Iterator[_Heard]:
    """Hear a planner's plans in a context and thread of its own."""
    heard, context = _Heard(), Context()
    context.init(args=[])
    node = RosNode("listener", context=context, use_global_arguments=False)
    node.create_subscription(FocusPlan, f"{planner}/focus_plan", heard.note_plan, LATCHED, raw=True)
    node.create_subscription(DiagnosticArray, "/diagnostics", heard.note_diagnostics, 10)
    try:
        with spun(node):
            yield heard
    finally:
        node.destroy_node()
        context.try_shutdown()


# --- What came of it -----------------------------------------------------------------------------


@dataclass(frozen=True)
class _Plan:
    """A plan, when it arrived, and the number of the mesh that it is for."""

    at: float
    mesh: int
    distances: FloatArray


def _plans(seen: _Seen, heard: _Heard) -> list[_Plan]:
    """Return the plans for the meshes whose times were kept."""
    found = []
    for at, payload in heard.plans:
        plan = deserialize_message(payload, FocusPlan)
        received = plan.surface.received
        mesh = bisect_right(seen.sent, received.sec + received.nanosec * 1e-9) - 1
        distances = np.array([camera.focus_distance for camera in plan.cameras])
        found.append(_Plan(at, mesh, distances))
    return found


def _table(seen: _Seen, heard: _Heard, faults: list[str], minutes: float) -> Table:
    first, *_ = plans = _plans(seen, heard)
    live = [plan for plan in plans if plan.mesh >= 0]
    delays = np.array([plan.at - seen.sent[plan.mesh] for plan in live])
    moved = [np.count_nonzero(one.distances != next_.distances) for one, next_ in pairwise(plans)]
    seconds = live[-1].at - live[0].at
    table = Table(
        *("of", "asked", "measured"),
        title=f"Meshes at {_HERTZ:g} Hz for {minutes:g} minutes, bound: {_BOUND}",
    )
    table.add_row("plans a second", "10", f"{(len(live) - 1) / seconds:.2f}")
    delay = ", ".join(f"{1000 * np.quantile(delays, q):.0f}" for q in (0.5, 0.9, 0.99, 1.0))
    table.add_row("mesh to plan, ms: 50, 90, 99, 100 of 100", "99: 120", delay)
    per_plan = {name: 1000 * taken / len(live) for name, taken in seen.processors.items()}
    taken = ", ".join(f"{name} {each:.0f}" for name, each in per_plan.items())
    table.add_row("processor time of a plan, ms", "", taken)
    counts = ", ".join(f"{name} {count}" for name, count in heard.counts.items())
    table.add_row("surfaces", "", f"sent {len(seen.sent) + 1}: {counts}")
    quarters = [np.median(part) for part in np.array_split(seen.memory, 4)]
    told = ", ".join(f"{each:.0f}" for each in (seen.memory[0], *quarters, seen.memory[-1]))
    table.add_row("memory, MiB: at first, in quarters, at last", "flat", told)
    table.add_row("lenses told with a plan, of 168", "", f"{np.mean(moved):.1f}")
    table.add_row(*_coverage(seen, first, live))
    table.add_row("errors logged", "0", str(len(faults)))
    return table


def _coverage(seen: _Seen, first: _Plan, live: list[_Plan]) -> tuple[str, str, str]:
    """Return what is in focus of what cameras see, of the mesh that was newest at each plan."""
    shares = []
    for plan in live[:: _step(len(live))]:
        now = bisect_right(seen.sent, plan.at) - 1
        mesh = seen.meshes[now % _MESHES]
        moved = _moved(2 * math.pi * now / _MESHES)
        problem = formulate_problem(Scene(mesh), rig(), _JUDGES)
        shares.append((moved, *(_in_focus(problem, one) for one in (plan, first))))
    of_live, of_static = np.mean(shares, axis=0)[1:]
    _, far_live, far_static = max(shares)
    return (
        "in focus where the body then is, %: live, and the first plan; at its farthest",
        "86, 78",
        f"{of_live:.1f}, {of_static:.1f}; {far_live:.1f}, {far_static:.1f}",
    )


def _step(plans: int) -> int:
    """Return every how many plans one is judged, so that those are from all over the movement."""
    step = max(plans // _JUDGED, 1)
    while math.gcd(step, _MESHES) > 1:  # or, with a plan per mesh, they are of a few places only
        step += 1
    return step


def _in_focus(problem: Any, plan: _Plan) -> float:
    quality = estimate_quality(problem, plan.distances)
    return float(100 * quality.in_focus_area.value / quality.covered_area.value)
