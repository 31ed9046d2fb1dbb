# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Many concurrent callers while surfaces keep arriving: correctness and response times."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field, replace

import numpy as np
from rich.console import Console

from benchmarks.guarantees import (
    Cameras,
    Outcome,
    cameras_for,
    cameras_of,
    own_graph,
    report,
    running,
)
from benchmarks.scenes import body_scenes, rig
from focus_planner import Mesh
from focus_planner.messages.writing import mesh_to_bytes
from focus_planner.ros.client import PlannerClient

_CALLS = 1000
_CLIENTS = 16
_HERTZ = 10.0
# A mesh comes again after more seconds than a call may take.
_MESHES = 200
# All are to be planned: none is to be told that the node is busy.
_PATIENCE = 60.0
_REQUEST = {"method": "k_view", "samples": 1000}


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph():
        return report(console, "Load", [_load])


def _load() -> Outcome:
    meshes = _variants()
    expected = {cameras_for(mesh, rig(), **_REQUEST): i for i, mesh in enumerate(meshes)}
    assert len(expected) == len(meshes)
    with running("load", service_max_wait=_PATIENCE) as node, PlannerClient(node.name) as client:
        client.wait_for_node(180)
        client.publish_rig(rig())
        sender = _Sender(client, [mesh_to_bytes(mesh) for mesh in meshes])
        calls = _call_from_all(node.name, sender)
        sender.stop()
        faults, memory = node.faults, node.peak
    return _outcome(calls, expected, sender, faults, memory, len(meshes[0].triangles))


def _variants() -> list[Mesh]:
    """Return bodies of slightly different sizes, so that each has a different plan."""
    body = next(iter(body_scenes().values())).surface
    assert isinstance(body, Mesh)
    return [replace(body, vertices=body.vertices * (1 + 0.0005 * i)) for i in range(_MESHES)]


class _Sender:
    """Publishes meshes in turn, and keeps when each was sent and when it had arrived."""

    def __init__(self, client: PlannerClient, payloads: list[bytes]) -> None:
        self.sent: list[float] = []
        self.arrived: list[float] = []
        self._client = client
        self._payloads = payloads
        self._stopping = threading.Event()
        self._send()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        due = time.perf_counter()
        while not self._stopping.is_set():
            due += 1 / _HERTZ
            time.sleep(max(0.0, due - time.perf_counter()))
            self._send()

    def _send(self) -> None:
        self.sent.append(time.perf_counter())
        self._client.publish("mesh", self._payloads[(len(self.sent) - 1) % len(self._payloads)])
        self.arrived.append(time.perf_counter())


@dataclass
class _Calls:
    """The times of each request and response, and the responses."""

    times: list[tuple[float, float]] = field(default_factory=list)
    answers: list[Cameras | str] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)
    left: int = _CALLS

    def take(self) -> bool:
        with self.lock:
            self.left -= 1
            return self.left >= 0

    def add(self, called: float, answered: float, answer: Cameras | str) -> None:
        with self.lock:
            self.times.append((called, answered))
            self.answers.append(answer)


def _call_from_all(planner: str, sender: _Sender) -> _Calls:
    calls = _Calls()
    threads = [threading.Thread(target=_call, args=(planner, calls)) for _ in range(_CLIENTS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(sender.arrived) > 1
    return calls


def _call(planner: str, calls: _Calls) -> None:
    with PlannerClient(planner) as client:
        client.wait_for_node()
        while calls.take():
            called = time.perf_counter()
            try:
                response = client.plan(2 * _PATIENCE, **_REQUEST)
            except TimeoutError as error:
                calls.add(called, time.perf_counter(), f"no answer: {error}")
                continue
            answered = time.perf_counter()
            answer = cameras_of(response.plan) if response.success else response.message
            calls.add(called, answered, answer)


def _outcome(
    calls: _Calls,
    expected: dict[Cameras, int],
    sender: _Sender,
    faults: list[str],
    memory: float,
    triangles: int,
) -> Outcome:
    verdicts = [
        _verdict(times, answer, expected, sender)
        for times, answer in zip(calls.times, calls.answers, strict=True)
    ]
    waits = np.array([answered - called for called, answered in calls.times])
    counts = {verdict: verdicts.count(verdict) for verdict in sorted(set(verdicts))}
    p50, p99 = np.quantile(waits, [0.5, 0.99])
    seconds = sender.sent[-1] - sender.sent[0]
    result = (
        f"{counts}; p50 {p50:.2f} s, p99 {p99:.2f} s, slowest {waits.max():.2f} s;"
        f" {len(verdicts) / seconds:.1f} plans a second; {len(sender.sent):,} meshes at"
        f" {(len(sender.sent) - 1) / seconds:.1f} Hz; peak {memory:.0f} MiB;"
        f" {len(faults)} errors logged"
    )
    kept = counts == {"right": _CALLS} and not faults
    return Outcome(
        f"calls from {_CLIENTS} clients, meshes of {triangles:,} triangles at {_HERTZ:g} Hz",
        len(verdicts),
        result,
        kept,
    )


def _verdict(
    times: tuple[float, float],
    answer: Cameras | str,
    expected: dict[Cameras, int],
    sender: _Sender,
) -> str:
    """Say whether the plan is for a mesh at least as new as the caller could expect."""
    if isinstance(answer, str):
        return answer[:100]
    if answer not in expected:
        return "no mesh's plan"
    called, answered = times
    newest_there = int(np.searchsorted(sender.arrived, called)) - 1
    newest_sent = int(np.searchsorted(sender.sent, answered)) - 1
    fits = range(newest_there, newest_sent + 1)
    if len(fits) >= _MESHES:
        return "too slow to tell"
    return "right" if any(k % _MESHES == expected[answer] for k in fits) else "for an older mesh"
