# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Record the runs in this folder again, with the current node and command line.

    .venv/bin/python bags/make_bags.py

All surfaces, rigs and requests are made from the shipped bodies and from seeds: only the times and
names of runs differ each time. The runs are described in ``README.md`` beside this file.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

# A graph of its own, on this machine only.
os.environ |= {"ROS_DOMAIN_ID": "86", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}

import numpy as np
import open3d as o3d
import trimesh

from focus_planner import Camera, CameraIntrinsics, Grid, Lens, Mesh, PointCloud, Rig, cylinder_rig
from focus_planner.cli.main import main as command_line
from focus_planner.io.bodies import bodies, body
from focus_planner.io.rigs import save_rig
from focus_planner.io.surfaces import load_surface
from focus_planner.messages.typestore import MESH
from focus_planner.messages.writing import mesh_to_bytes
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.ros.client import PlannerClient

HERE = Path(__file__).parent
PATIENCE = 120.0
TRIANGLES = 3000
SAMPLES = {"samples": 500}
LENS_TABLES = """\
# Two kinds of lenses by name, the others by their default.
default: {unit: focus_absolute, whole: true, distances: [0.35, 0.5, 1.0, 3.0],
          values: [250, 180, 90, 20]}
cameras:
  cam_0_00: {unit: dioptres}
  cam_1_04: {unit: steps, distances: [0.4, 0.8, .inf], values: [0, 1200.5, 2300]}
  of_another_rig: {unit: m}
"""
RIG = cylinder_rig(rows=4, columns=9, radius=0.9, lens=Lens(0.05, 5.0))


def small_body(name: str) -> Mesh:
    """Return a shipped body with fewer triangles."""
    mesh = load_surface(body(name))
    assert isinstance(mesh, Mesh)
    small = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices.copy()),
        o3d.utility.Vector3iVector(mesh.triangles.astype(np.int32)),
    ).simplify_quadric_decimation(TRIANGLES)
    # Rounded to micrometres, which compress better than sixteen digits.
    return Mesh(np.asarray(small.vertices).round(6), np.asarray(small.triangles))


def cloud(normals: bool) -> PointCloud:
    """Return seeded points on a body, with a millimetre's noise."""
    random = np.random.default_rng(7)
    mesh = load_surface(body("arms_out"))
    assert isinstance(mesh, Mesh)
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    points, faces = trimesh.sample.sample_surface(solid, 4000, seed=7)
    points = points + random.normal(0, 0.001, points.shape)
    outward = solid.face_normals[faces].round(6) if normals else None
    return PointCloud(points.round(6), outward)


def mixed_rig() -> Rig:
    """Return a rig with several kinds of cameras, in random order and at random distances."""
    random = np.random.default_rng(11)
    wide = CameraIntrinsics(1920, 1080, 1400.0, 1405.0, 955.5, 541.0)
    lenses = (
        Lens(0.035, 4.0, min_focus=0.3, max_focus=2.0),
        Lens(0.05, 6.0, focus_distances=(0.45, 0.5, 0.6, 0.75, 0.9, 1.1, 1.4)),
        Lens(0.085, 18.0, min_focus=0.5, max_focus=3.0, focus_steps=64),
    )
    cameras = []
    for k, camera in enumerate(RIG.cameras):
        position = tuple((np.array(camera.position) * random.uniform(0.9, 1.3)).tolist())
        intrinsics = wide if k % 2 else camera.intrinsics
        name = f"kind{k % 3}_{k:02d}"
        cameras.append(Camera(name, position, camera.orientation, intrinsics, lenses[k % 3]))
    return Rig(tuple(cameras[i] for i in random.permutation(len(cameras))))


class RecordingNode:
    """The recording node's client, and the folder of its runs."""

    def __init__(self, folder: Path, client: PlannerClient) -> None:
        self.folder = folder
        self.client = client

    def run(self, name: str, *, success: bool = True, **request: Any) -> None:
        """Request a plan, and keep its run under a name."""
        response = self.client.plan(**{**SAMPLES, **request})
        if response.success is not success:
            raise SystemExit(f"{name}: {response.message}")
        keep(self.folder, name)
        print(f"{name}: {response.message}")


def keep(folder: Path, name: str) -> None:
    """Move the only run in a folder here, once it is complete."""
    until = time.monotonic() + PATIENCE
    while not (runs := [run for run in folder.iterdir() if run.suffix != ".partial"]):
        if time.monotonic() > until:
            raise SystemExit(f"{name} was not recorded")
        time.sleep(0.05)
    shutil.rmtree(HERE / name, ignore_errors=True)
    shutil.move(runs[0], HERE / name)


@contextmanager
def node(folder: Path) -> Iterator[RecordingNode]:
    """Run the node, recording into a folder."""
    command = [sys.executable, "-m", "focus_planner.ros.node", "--ros-args"]
    # A relative path: a run contains all parameters, and no path of this machine should be there.
    where = ["-p", f"record_directory:={folder.name}"]
    process = subprocess.Popen([*command, *where], cwd=folder.parent)
    try:
        with PlannerClient() as client:
            client.wait_for_node(PATIENCE)
            yield RecordingNode(folder, client)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)


def every_method(node: RecordingNode) -> None:
    """Record plans for a mesh and a rig by every method."""
    node.client.publish_mesh(small_body("arms_down"))
    node.client.publish_rig(RIG)
    for method in ("closest", "average", "em", "greedy", "k_view", "optimal"):
        node.run(f"mesh_{method}", method=method)
    node.run("mesh_k_view_3_assigned", method="k_view", k=3, scope="assigned")
    node.client.set_parameters(tuples="grid", record_markers=True)
    node.run("mesh_grid_shots_markers", method="k_view", shots=2, depth_tolerance=0.002, seed=5)
    node.client.set_parameters(tuples="overlap", record_markers=False)
    node.run("mesh_budget", method="optimal", samples=60_000, time_budget=0.4, gap=1e-9)


def clouds(node: RecordingNode) -> None:
    """Record plans for clouds and camera poses."""
    node.client.set_parameters(lens__hyperfocal_distance=5.0)
    node.client.publish_poses(RIG)
    node.client.publish_cloud(cloud(normals=False))
    node.run("cloud_estimated_normals", method="k_view")
    node.client.publish_cloud(cloud(normals=True))
    node.client.set_parameters(samples=0)
    node.run("cloud_own_points", method="em", samples=0)
    node.client.set_parameters(samples=4096)


def other_rigs(node: RecordingNode) -> None:
    """Record several kinds of cameras, a warm start, and two failures."""
    node.client.publish_mesh(small_body("arms_raised"))
    node.client.publish_rig(mixed_rig())
    node.run("mixed_rig", method="optimal")
    node.client.set_parameters(warm_start=True)
    node.client.plan(**SAMPLES, seed=1)
    shutil.rmtree(next(iter_whole(node.folder)))
    node.run("warm_start", seed=2)
    node.client.set_parameters(warm_start=False)
    node.run("failed_request", success=False, method="k_view", depth_tolerance=1.0)
    node.client.publish_rig(replace(RIG, frame_id="elsewhere"))
    node.run("failed_rig", success=False)


def device_values(node: RecordingNode) -> None:
    """Record device values from a file of lens tables."""
    # In the node's working directory, so that the parameter contains no path of this machine.
    (node.folder.parent / "lens_tables.yaml").write_text(LENS_TABLES)
    node.client.set_parameters(lens_tables="lens_tables.yaml")
    node.client.publish_mesh(small_body("arms_out"))
    node.client.publish_rig(RIG)
    node.run("lens_tables", method="k_view", shots=2)
    node.client.set_parameters(lens_tables="")


def iter_whole(folder: Path) -> Iterator[Path]:
    """Yield the run in a folder, once it is complete."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        yield from (run for run in folder.iterdir() if run.suffix != ".partial")
        time.sleep(0.05)


def from_files(folder: Path) -> None:
    """Record a plan by the command line, for a mesh with vertex normals and importance."""
    mesh = small_body("arms_out")
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    solid.export(folder / "body.ply", vertex_normal=True)
    importance = np.where(mesh.vertices[:, 2] > 1.4, 3.0, 1.0)
    np.save(folder / "importance.npy", importance)
    save_rig(replace(RIG, grid=Grid(4, 9)), folder / "rig.yaml")
    surface, rig, face = (str(folder / n) for n in ("body.ply", "rig.yaml", "importance.npy"))
    where = ["--record", str(folder / "runs"), "--quiet", "--output", os.devnull]
    options = ["--samples", "500", "--importance", face, *where]
    if command_line(["plan", surface, "--rig", rig, *options]):
        raise SystemExit("files_importance was not planned")
    keep(folder / "runs", "files_importance")


def data_set() -> None:
    """Write the shipped bodies, one per second, as a data set."""
    bag = BagWriter()
    at = 1_767_225_600 * 10**9  # 2026-01-01 00:00 UTC
    for k, path in enumerate(bodies()):
        payload = mesh_to_bytes(load_surface(path))
        bag.add(BagMessage("/focus_planner/mesh", MESH, payload, at + k * 10**9))
    folder = HERE / "data_sets" / "bodies"
    shutil.rmtree(folder, ignore_errors=True)
    bag.open(folder)
    bag.close()


def main() -> None:
    """Record all runs and the data set."""
    steps: tuple[Callable[[RecordingNode], None], ...] = (
        every_method,
        clouds,
        other_rigs,
        device_values,
    )
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder, "runs")
        runs.mkdir()
        with node(runs) as recorded:
            for step in steps:
                step(recorded)
        runs.rmdir()
        from_files(Path(folder))
    data_set()


if __name__ == "__main__":
    main()
