# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The delay that recording causes, and the time to write and read large runs."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from benchmarks.service import running_node
from focus_planner import Mesh, PlanRequest, Scene, plan_focus
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording.folders import bag_size
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import beginning_of, inputs_of
from focus_planner.recording.software import software
from focus_planner.ros.client import PlannerClient

_PAIRS = 60
_SAMPLES = 1000
_TRIANGLES = 1_000_000
# Between two calls, so that what the last one left to do is done.
_PAUSE = 0.7


def run(console: Console) -> None:
    """Print the tables."""
    body = next(iter(body_scenes().values())).surface
    assert isinstance(body, Mesh)
    meshes = {f"{len(mesh.triangles):,}": mesh for mesh in (body, fine(body, _TRIANGLES))}
    with TemporaryDirectory() as folder:
        _delays(console, meshes, folder)
        _large(console, meshes, Path(folder))


def fine(mesh: Mesh, triangles: int) -> Mesh:
    """Return the mesh, subdivided until it has enough triangles and then truncated."""
    vertices, faces = mesh.vertices, mesh.triangles
    while len(faces) < triangles:
        a, b, c = (faces[:, k] for k in range(3))
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]))
        edges, of_face = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = of_face.reshape(3, -1) + len(vertices)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        parts = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = np.concatenate([np.stack(part, axis=1) for part in parts])
    return Mesh(vertices, faces[:triangles])


def _delays(console: Console, meshes: dict[str, Mesh], folder: str) -> None:
    table = Table(
        "triangles",
        "not recorded",
        "recorded",
        "difference",
        title=f"Milliseconds that a caller waits, medians of {_PAIRS} calls by turns,"
        f" {_SAMPLES} samples; the difference with its standard error",
    )
    with running_node() as client:
        client.publish_rig(rig())
        for name, mesh in meshes.items():
            client.publish_mesh(mesh)
            client.plan(samples=_SAMPLES)
            waits = np.array([_pair(client, folder) for _ in range(_PAIRS)]) * 1e3
            differences_ = waits[:, 1] - waits[:, 0]
            # Of a median, were they normally distributed.
            error = 1.2533 * differences_.std() / np.sqrt(_PAIRS)
            off, on = np.median(waits, axis=0)
            table.add_row(
                name, f"{off:.1f}", f"{on:.1f}", f"{np.median(differences_):+.1f} ± {error:.1f}"
            )
    console.print(table)


def _pair(client: PlannerClient, folder: str) -> tuple[float, float]:
    """Return the response times without and with recording."""
    return _wait(client, ""), _wait(client, folder)


def _wait(client: PlannerClient, folder: str) -> float:
    client.set_parameters(record_directory=folder)
    time.sleep(_PAUSE)
    called = time.perf_counter()
    response = client.plan(samples=_SAMPLES)
    waited = time.perf_counter() - called
    assert response.success, response.message
    assert "not recorded" not in response.message, response.message
    return waited


class _Log:
    def warning(self, message: str) -> None:
        raise AssertionError(message)

    error = warning


def _fail(error: Exception) -> None:
    raise AssertionError(error)


def _large(console: Console, meshes: dict[str, Mesh], folder: Path) -> None:
    table = Table(
        "triangles",
        "prepare",
        "write beginning",
        "write end",
        "read",
        "plan",
        "plan again",
        "MB",
        title="Seconds to write a run, to read it, and to plan it again from its bytes",
    )
    for name, mesh in meshes.items():
        table.add_row(name, *_write_and_read(mesh, folder))
    console.print(table)


def _write_and_read(mesh: Mesh, folder: Path) -> list[str]:
    cameras = rig()
    beginning = beginning_of(
        new_run_id(), "/focus_planner", PlanRequest(samples=_SAMPLES), "world", software()
    )
    inputs = inputs_of(beginning, mesh, cameras)
    marks = [time.perf_counter()]

    def mark() -> None:
        marks.append(time.perf_counter())

    recorder = Recorder(_Log())
    recorder.prepare(folder, inputs)
    recorder.do_later(mark, _fail).result()
    record = recorder.begin(Recording(folder), inputs, beginning)
    recorder.do_now(mark, _fail).result()
    scene = Scene(mesh)
    plan = plan_focus(
        scene, cameras, beginning.request, on_progress=record.wrap_callback(lambda _: True)
    )
    mark()
    record.finish(True, plan.summary(), plan, cameras).result()
    mark()
    assert record.path is not None
    recorder.close()
    mark()
    recorded = read_run(record.path)
    mark()
    replayed = plan_run(recorded)
    mark()
    assert not differences(recorded, replayed)
    compress, write, planned, end, _, read, again = np.diff(marks)
    seconds = [compress, write, end, read, planned, again]
    return [*(f"{second:.3f}" for second in seconds), f"{bag_size(record.path) / 1e6:.1f}"]
