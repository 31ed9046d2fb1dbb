# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Response times of the running node for a caller in another process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import gettempdir

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from focus_planner import Mesh, Scene
from focus_planner.messages.writing import mesh_to_bytes
from focus_planner.ros.client import PlannerClient

_CALLS = 50
_CASES = (("k_view", 1000), ("k_view", 4096), ("em", 1000))
_MESHES = 15
_GROWTH = 1e-4  # from mesh to mesh, by which the plan for one is told from that for the last


def run(console: Console) -> None:
    """Print the table."""
    with running_node() as client:
        _measure(console, client)


@contextmanager
def running_node() -> Iterator[PlannerClient]:
    """Run the node in a process of its own; yield its client."""
    os.environ.setdefault("ROS_DOMAIN_ID", "89")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    namespace = f"/bench_{os.getpid()}"
    command = [sys.executable, "-m", "focus_planner.ros.node", "--ros-args"]
    node = subprocess.Popen(  # noqa: S603
        [
            *(*command, "--remap", f"__ns:={namespace}", "--log-level", "error"),
            *("-p", f"data_directories:={gettempdir()}"),  # for what is set later
        ]
    )
    try:
        with PlannerClient(f"{namespace}/focus_planner") as client:
            client.wait_for_node(120)
            yield client
        node.send_signal(signal.SIGINT)
        node.wait(30)
    finally:
        node.kill()
        node.wait()


def _measure(console: Console, client: PlannerClient) -> None:
    surface = next(iter(body_scenes().values())).surface
    assert isinstance(surface, Mesh)
    client.publish_rig(rig())
    client.publish_mesh(surface)
    table = Table(
        "method",
        "samples",
        "median",
        "95 of 100",
        "slowest",
        "least",
        "of an empty call",
        "medians, plan / empty",
        "least, plan / empty",
        title=f"Milliseconds that a caller waits, {_CALLS} calls on an unchanged mesh",
    )
    for method, samples in _CASES:
        client.plan(method=method, samples=samples)
        waits, empty = (
            1000
            * np.array(
                [(_wait(client, method, samples), _wait_for_nothing(client)) for _ in range(_CALLS)]
            ).T
        )
        figures = (np.median(waits), np.quantile(waits, 0.95), np.max(waits), np.min(waits))
        table.add_row(
            method,
            f"{samples:,}",
            *(f"{figure:.1f}" for figure in figures),
            f"{np.median(empty):.2f}",
            f"{np.median(waits) / np.median(empty):.0f}",
            f"{np.min(waits) / np.min(empty):.0f}",
        )
    console.print(table)
    client.plan(method="k_view", samples=1000)
    waits = [_wait_for_new(client, _grown(surface, i + 1)) for i in range(_MESHES)]
    console.print(
        f"From publishing a new mesh of {len(surface.triangles):,} triangles to the answer:"
        f" median {np.median(waits):.3f} s, least {min(waits):.3f} s, {_MESHES} meshes\n"
    )


def _grown(mesh: Mesh, times: int) -> Mesh:
    return Mesh(mesh.vertices * (1 + times * _GROWTH), mesh.triangles)


def _wait_for_new(client: PlannerClient, mesh: Mesh) -> float:
    """Return the seconds from publishing a mesh to having a plan for that one."""
    area = Scene(mesh).area
    message = mesh_to_bytes(mesh)
    began = time.perf_counter()
    client.publish("mesh", message)
    while True:
        response = client.plan(method="k_view", samples=1000)
        assert response.success, response.message
        if abs(response.plan.surface_area / area - 1) < _GROWTH / 2:
            return time.perf_counter() - began


def _wait(client: PlannerClient, method: str, samples: int) -> float:
    called = time.perf_counter()
    response = client.plan(method=method, samples=samples)
    assert response.success, response.message
    return time.perf_counter() - called


def _wait_for_nothing(client: PlannerClient) -> float:
    """Return what a call takes that the node answers at once, with nothing."""
    called = time.perf_counter()
    client.get_parameters([])
    return time.perf_counter() - called
