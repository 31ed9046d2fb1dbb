# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Starting and ending the nodes of a rig of 1,000 cameras, each with a driver node of its own.

``python -m benchmarks many_lenses``; the processor seconds do not depend on what else the machine
does.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import rclpy
from focus_planner_msgs.msg import CameraFocus, LensState
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rich.console import Console
from rich.table import Table

from benchmarks.service import running_node
from focus_planner import cylinder_rig
from focus_planner.ros.qos import LATCHED
from testing.ros.spinning import spun

_CAMERAS = 1000
_SIMULATED = (100, 200)  # each driver node has eight services
_TICKS = os.sysconf("SC_CLK_TCK")
_PATIENCE = 300.0


@dataclass
class _Process:
    """A node's process, and the seconds and processor seconds that it took to be ready."""

    process: subprocess.Popen[str]
    began: float = field(default_factory=time.perf_counter)

    def wait_until_ready(self) -> tuple[float, float]:
        """Wait for the log to say so."""
        assert self.process.stderr is not None
        while line := self.process.stderr.readline():
            if "ready" in line:
                # A log that nobody reads would hold the node up.
                threading.Thread(target=self.process.stderr.read, daemon=True).start()
                return time.perf_counter() - self.began, self.processor_seconds
        raise RuntimeError(f"ended with {self.process.wait()}")

    @property
    def processor_seconds(self) -> float:
        """Of all threads until now."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / _TICKS

    def end(self) -> tuple[float, float]:
        """Ask it to end; return how long that took, in seconds and processor seconds."""
        used, began = self.processor_seconds, time.perf_counter()
        self.process.send_signal(signal.SIGINT)
        _, status, usage = os.wait4(self.process.pid, 0)
        self.process.returncode = os.waitstatus_to_exitcode(status)
        assert self.process.returncode == 0
        return time.perf_counter() - began, usage.ru_utime + usage.ru_stime - used


def run(console: Console) -> None:
    """Print the table."""
    os.environ.setdefault("ROS_DOMAIN_ID", "88")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    table = Table(
        "node",
        "cameras",
        "ready, s",
        "processor",
        "then",
        "s",
        "processor",
        "ended, s",
        "processor",
        title=f"Starting and ending; {os.getloadavg()[0]:.1f} others wanted the processors before",
    )
    _measure(table, "lens_adapter", _CAMERAS)
    _measure(table, "lens_adapter", _CAMERAS, "all clients made", _idle)
    with _latched_orders() as answered:
        _measure(table, "lens_adapter", _CAMERAS, "every order answered", lambda _: answered())
    for cameras in _SIMULATED:
        _measure(table, "simulated_lens", cameras)
    seconds = _seconds_to_topics()
    table.add_row("planner", f"{_CAMERAS:,}", "", "", "all topics there", f"{seconds:.2f}")
    console.print(table)


def _measure(
    table: Table,
    module: str,
    cameras: int,
    what: str = "",
    then: Callable[[_Process], object] | None = None,
) -> None:
    process = _start(module, cameras)
    try:
        ready = process.wait_until_ready()
        began, used = time.perf_counter(), process.processor_seconds
        if then is not None:
            then(process)
        later = (time.perf_counter() - began, process.processor_seconds - used)
        ended = process.end()
    finally:
        process.process.kill()
    shown = [f"{each:.2f}" for each in later] if then else ["", ""]
    first, last = ([f"{each:.2f}" for each in pair] for pair in (ready, ended))
    table.add_row(module, f"{cameras:,}", *first, what, *shown, *last)


def _start(module: str, cameras: int) -> _Process:
    names = ", ".join(_names(cameras))
    command = [sys.executable, "-m", f"focus_planner.ros.{module}", "--ros-args"]
    return _Process(
        subprocess.Popen(  # noqa: S603
            [*command, "-p", f"cameras:=[{names}]"], stderr=subprocess.PIPE, text=True
        )
    )


def _names(cameras: int) -> list[str]:
    return [f"cam_{number:04}" for number in range(cameras)]


def _idle(process: _Process) -> None:
    """Wait until a process has nothing to do."""
    used = -1.0
    while process.processor_seconds - used > 0.1:
        used = process.processor_seconds
        time.sleep(1.0)


@contextmanager
def _latched_orders() -> Iterator[Callable[[], None]]:
    """Latch an order for every camera; yield a function that waits for an answer to each."""
    rclpy.init()
    node = Node("orchestrator")
    answers: set[str] = set()
    qos = QoSProfile(depth=10 * _CAMERAS, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(
        LensState, "/focus_planner/lens_states", lambda state: answers.add(state.name), qos
    )
    for name in _names(_CAMERAS):
        topic = f"/focus_planner/cameras/{name}/focus"
        order = CameraFocus(name=name, plan_id="a plan", status=1, focus_distance=0.5)
        node.create_publisher(CameraFocus, topic, LATCHED).publish(order)

    def answered() -> None:
        deadline = time.monotonic() + _PATIENCE
        while len(answers) < _CAMERAS:
            assert time.monotonic() < deadline, f"{len(answers)} answers"
            time.sleep(0.05)

    try:
        with spun(node):
            yield answered
    finally:
        node.destroy_node()
        rclpy.shutdown()


def _seconds_to_topics() -> float:
    """Return how long the planner takes from a rig to the topics of all its cameras."""
    with running_node() as client:
        node = client._node  # noqa: SLF001
        namespace, _, short = client._planner.rpartition("/")  # noqa: SLF001
        began = time.perf_counter()
        client.publish_rig(cylinder_rig(rows=10, columns=_CAMERAS // 10))
        while len(node.get_publisher_names_and_types_by_node(short, namespace)) < _CAMERAS:
            time.sleep(0.05)
        return time.perf_counter() - began
