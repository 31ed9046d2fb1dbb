# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Malformed messages on every input, over DDS: the node must keep the inputs it has."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node as RosNode
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rich.console import Console

from benchmarks.guarantees import (
    Cameras,
    Node,
    Outcome,
    cameras_for,
    cameras_of,
    own_graph,
    report,
    running,
)
from benchmarks.options import options
from focus_planner.ros.client import PlannerClient
from testing.malformed import (
    BALL,
    RIG,
    SETTINGS,
    TYPES,
    Bench,
    absurd,
    broken,
)

# As many as the node keeps: more at once would push each other out unread.
_AT_ONCE = 4
_BETWEEN_PLANS = 200
# With a depth of 1 Fast DDS asks for an acknowledgement with every message, else every 3 s.
_ACKNOWLEDGED = QoSProfile(depth=1)
_PATIENCE = 60.0
_REQUEST = {"method": "em", "samples": 200}
# MiB, after the first quarter: what the largest messages took is kept for the next.
_MOST_GROWTH = 16.0
_MOST_LOGGED = 2_000_000


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        tests = [partial(_fuzz, topic, folder) for topic in TYPES]
        return report(console, "Malformed messages", tests)


def _fuzz(topic: str, folder: Path) -> Outcome:
    request = SETTINGS.request
    expected = cameras_for(BALL, RIG, **vars(request))
    with (
        running(f"fuzz_{topic}", fresh_samples=request.fresh_samples) as node,
        PlannerClient(node.name) as client,
        _publisher(node.name, topic) as publisher,
    ):
        client.wait_for_node(180)
        client.publish_rig(RIG)
        client.publish_mesh(BALL)
        return _Fuzzer(topic, node, client, publisher, expected).outcome(folder)


class _Fuzzer:
    """Sends malformed messages of one kind, and checks the node in between."""

    def __init__(
        self, topic: str, node: Node, client: PlannerClient, publisher: Publisher, expected: Cameras
    ) -> None:
        self._topic = topic
        self._node = node
        self._client = client
        self._publisher = publisher
        self._expected = expected
        self._right = self._wrong = self._good = self._told = 0
        self._longest = 0

    def outcome(self, folder: Path) -> Outcome:
        plan_id = self._check_plan()
        before = settled = self._node.memory
        for sent, payload in enumerate(self._payloads(plan_id), 1):
            self._send(payload)
            if sent % _AT_ONCE == 0:
                self._wait_until_read()
            if self._topic != "lens_states" and sent % _BETWEEN_PLANS == 0:
                self._check_plan()
            if sent == options().count // 4:
                settled = self._node.memory
        self._check_plan()
        self._client.status()
        return self._judge(settled - before, self._node.memory - settled, folder)

    def _payloads(self, plan_id: str) -> Iterator[bytes]:
        """Yield messages that the library rejects: half with absurd values, half broken bytes."""
        bench = None if self._topic == "lens_states" else Bench()
        changes = {"plan_id": plan_id} if bench is None else {}
        random, sent = np.random.default_rng(options().seed), 0
        while sent < options().count:
            make = absurd if sent % 2 else broken
            payload = make(self._topic, random, **changes)
            if bench is None or bench.refuses(self._topic, payload):
                sent += 1
                yield payload
            else:
                self._good += 1

    def _send(self, payload: bytes) -> None:
        self._publisher.publish(payload)
        if not self._publisher.wait_for_all_acked(Duration(seconds=_PATIENCE)):
            raise TimeoutError("the node does not take messages any more")

    def _wait_until_read(self) -> None:
        if self._topic == "lens_states":
            self._client.state()
            return
        answer = self._client.plan(_PATIENCE, **_REQUEST)
        self._longest = max(self._longest, len(answer.message))
        if not answer.success:
            self._told += "stays in force" in answer.message

    def _check_plan(self) -> str:
        """Plan, retrying once as a caller would that is told to."""
        answer = self._client.plan(_PATIENCE, **_REQUEST)
        if not answer.success:
            answer = self._client.plan(_PATIENCE, **_REQUEST)
        right = answer.success and cameras_of(answer.plan) == self._expected
        self._right, self._wrong = self._right + right, self._wrong + (not right)
        plan_id: str = answer.plan.plan_id
        return plan_id

    def _judge(self, first: float, growth: float, folder: Path) -> Outcome:
        log, faults = self._node.log, self._node.faults
        files = sum(file.stat().st_size for file in (folder / "log").rglob("*") if file.is_file())
        result = (
            f"{self._right} plans between them the same, {self._wrong} others;"
            f" callers were told {self._told:,} times, in at most {self._longest} characters;"
            f" {self._good:,} that happened to be good left out; memory {first:+.1f} MiB in the"
            f" first quarter and {growth:+.1f} MiB after it;"
            f" {len(log.splitlines()):,} lines logged, {(len(log) + files) / 1000:.0f} kB;"
            f" {len(faults)} errors logged"
        )
        kept = (
            not self._wrong
            and not faults
            and self._node.is_alive
            and growth < _MOST_GROWTH
            and len(log) < _MOST_LOGGED
        )
        for line in faults[:5]:
            result += f"; {line[:200]}"
        return Outcome(f"on ~/{self._topic}", options().count, result, kept)


@contextmanager
def _publisher(planner: str, topic: str) -> Iterator[Publisher]:
    """Yield a publisher of serialized messages, once the node has subscribed."""
    package, _, name = TYPES[topic].split("/")
    message_type = getattr(import_module(f"{package}.msg"), name)
    context = Context()
    context.init(args=[])
    node = RosNode("fuzzer", context=context, use_global_arguments=False, enable_rosout=False)
    try:
        publisher = node.create_publisher(message_type, f"{planner}/{topic}", _ACKNOWLEDGED)
        yield publisher
    finally:
        node.destroy_node()
        context.try_shutdown()
