# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How long it takes until there is a plan, or a node, from nothing."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import rig
from focus_planner.core.arrays import FloatArray
from focus_planner.io.bodies import bodies
from focus_planner.io.rigs import save_rig
from focus_planner.ros.client import PlannerClient

_REPEATS = 7
_PATIENCE = 120.0


def run(console: Console) -> None:
    """Print the table."""
    table = Table("from the start of", "until", "median, s", "least, s", title="From nothing")
    with TemporaryDirectory() as folder:
        commands = np.array([_command(Path(folder)) for _ in range(_REPEATS + 1)])[1:]
    processes, plans = commands.T
    for until, seconds in (("its end", processes), ("of that, the plan", plans)):
        table.add_row("focus_planner plan", until, *_figures(seconds))
    nodes = np.array([_node() for _ in range(_REPEATS + 1)])[1:]
    table.add_row("the node", "its service is offered", *_figures(nodes))
    console.print(table)
    ratio = float(np.median(processes / plans))
    console.print(f"focus_planner plan / the plan within: {ratio:.1f} (median)")


def _figures(seconds: FloatArray) -> tuple[str, str]:
    return f"{np.median(seconds):.2f}", f"{seconds.min():.2f}"


def _command(folder: Path) -> tuple[float, float]:
    """Return the seconds of a process that plans for a shipped body, and of the plan."""
    save_rig(rig(), folder / "rig.yaml")
    output = folder / "plan.json"
    command = [sys.executable, "-m", "focus_planner", "plan", str(bodies()[0])]
    command += ["--rig", str(folder / "rig.yaml"), "--output", str(output), "--quiet"]
    began = time.perf_counter()
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)  # noqa: S603
    elapsed = time.perf_counter() - began
    return elapsed, json.loads(output.read_text(encoding="utf-8"))["total_seconds"]


def _node() -> float:
    """Return the seconds until a node offers its service to who waits for it."""
    os.environ.setdefault("ROS_DOMAIN_ID", "89")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    namespace = f"/bench_{os.getpid()}_{time.monotonic_ns()}"
    command = [sys.executable, "-m", "focus_planner.ros.node", "--ros-args"]
    command += ["--remap", f"__ns:={namespace}", "--log-level", "error"]
    with PlannerClient(f"{namespace}/focus_planner") as client:
        began = time.perf_counter()
        node = subprocess.Popen(command)  # noqa: S603
        try:
            client.wait_for_node(_PATIENCE)
            elapsed = time.perf_counter() - began
            node.send_signal(signal.SIGINT)
            node.wait(_PATIENCE)
        finally:
            node.kill()
            node.wait()
    return elapsed
