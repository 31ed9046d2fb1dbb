# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The quality of plans made on point clouds, evaluated on the meshes that they were drawn from.

The first table is of clouds that are used as they are, the second of clouds with noise, holes and
strays, large ones among them: both are evaluated on the true mesh.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import open3d as o3d
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem, rig
from benchmarks.timing import timed
from focus_planner import FocusPlan, Mesh, PlanRequest, PointCloud, Scene, plan_focus
from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.io.surfaces import load_surface

_SEEDS = range(1, 4)
_FRESH = 65_536
_CASES = [
    (points, given, noise)
    for points in (20_000, 100_000)
    for given in (True, False)
    for noise in (0.0, 0.002)
]


_SIZES = (100_000, 300_000, 1_000_000, 5_000_000)
_NOISES = (0.0, 0.001, 0.002, 0.003)
_HOLE_ABOVE = 0.5  # of the body's height: what lies behind its middle, up to 0.1 of the height more
_HOLE_HEIGHT = 0.1
_STRAY_SHARE = 0.01
_STRAY_MARGIN = 0.2  # m around the body


def run(console: Console) -> None:
    """Print the tables."""
    _plans_of_all_bodies(console)
    _noise(console)


def _plans_of_all_bodies(console: Console) -> None:
    table = Table(
        "points",
        "normals",
        "noise",
        "cost on the mesh",
        "beside the mesh's plan",
        "at worst",
        "its own fresh cost less that",
        title=(
            f"Plans from clouds sampled from {len(body_scenes())} bodies, {len(_SEEDS)} seeds,"
            f" 4,096 samples, evaluated on {_FRESH:,} other samples of the mesh"
        ),
    )
    fresh = {name: problem(scene, _FRESH, 999) for name, scene in body_scenes().items()}
    from_mesh = {
        (name, seed): fresh[name].cost(_focus(_plan(scene, seed)))
        for name, scene in body_scenes().items()
        for seed in _SEEDS
    }
    table.add_row("the mesh", "", "", f"{np.mean(list(from_mesh.values())):.1f}", "", "", "")
    for points, given, noise in _CASES:
        plans = {
            (name, seed): _plan(_cloud(scene, points, given, noise), seed)
            for name, scene in body_scenes().items()
            for seed in _SEEDS
        }
        costs = {key: fresh[key[0]].cost(_focus(plan)) for key, plan in plans.items()}
        off = [plan.fresh_cost - costs[key] for key, plan in plans.items()]
        excess = [100 * (costs[key] / from_mesh[key] - 1) for key in costs]
        table.add_row(
            f"{points:,}",
            "given" if given else "estimated",
            f"{1000 * noise:g} mm",
            f"{np.mean(list(costs.values())):.1f}",
            f"{np.mean(excess):+.2f} %",
            f"{np.max(excess):+.2f} %",
            f"{np.mean(off):+.1f}",
        )
    console.print(table)


def _plan(scene: Scene, seed: int) -> FocusPlan:
    return plan_focus(scene, rig(), PlanRequest(samples=4096, seed=seed))


def _focus(plan: FocusPlan) -> FloatArray:
    return np.array([camera.focus_distance for camera in plan.cameras])


def _cloud(scene: Scene, points: int, given: bool, noise: float) -> Scene:
    assert isinstance(scene.surface, Mesh)
    sampled = sample_mesh(scene.surface, points, seed=123)
    jitter = noise * np.random.default_rng(0).standard_normal(sampled.points.shape)
    return Scene(PointCloud(sampled.points + jitter, sampled.normals if given else None))


# --- noise ---------------------------------------------------------------------------------------


def _noise(console: Console) -> None:
    """Print how well plans from clouds with noise know themselves."""
    name, scene = next(iter(body_scenes().items()))
    assert isinstance(scene.surface, Mesh)
    table = Table(
        "points",
        "noise",
        "with",
        "normals",
        "averaged to",
        "area is off by",
        "cost on the mesh",
        "beside the mesh's plan",
        "its own fresh cost is off by",
        "reading, s",
        "preparing, s",
        title=f"Clouds sampled from {name}, with noise",
    )
    whole, holed = scene.surface, _with_hole(scene.surface)
    for mesh, what, sizes in (
        (whole, "", _SIZES),
        (whole, "strays", _SIZES[1:2]),
        (holed, "a hole", _SIZES[1:2]),
    ):
        true_scene = Scene(mesh)
        fresh = problem(true_scene, _FRESH, 999)
        best = fresh.cost(_focus(_plan(true_scene, 1)))
        for points in sizes:
            for noise in _NOISES if what == "" else (_NOISES[0], _NOISES[-1]):
                for given in (True, False):
                    cloud = _scan(mesh, points, noise, given=given, strays=what == "strays")
                    numbers = _row(cloud, true_scene, fresh, best)
                    normals = "given" if given else "estimated"
                    table.add_row(f"{points:,}", f"{1000 * noise:g} mm", what, normals, *numbers)
    console.print(table)


def _row(cloud: PointCloud, true_scene: Scene, fresh: Problem, best: float) -> tuple[str, ...]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.ply"
        written = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points.copy()))
        if cloud.normals is not None:
            written.normals = o3d.utility.Vector3dVector(cloud.normals.copy())
        o3d.io.write_point_cloud(str(path), written)
        reading, surface = timed(lambda: load_surface(path))
    preparing, scene = timed(lambda: Scene(surface))
    plan = plan_focus(scene, rig(), PlanRequest(samples=4096, fresh_samples=_FRESH))
    cost = fresh.cost(_focus(plan))
    used = len(scene.sample(0, 0))
    return (
        f"{used:,}" if used < len(cloud.points) else "as given",
        f"{100 * (scene.area / true_scene.area - 1):+.1f} %",
        f"{cost:.1f}",
        f"{100 * (cost / best - 1):+.2f} %",
        f"{100 * (plan.fresh_cost / cost - 1):+.2f} %",
        f"{reading:.1f}",
        f"{preparing:.1f}",
    )


def _scan(mesh: Mesh, points: int, noise: float, *, given: bool, strays: bool) -> PointCloud:
    random = np.random.default_rng(0)
    sampled = sample_mesh(mesh, points, seed=123)
    places = sampled.points + noise * random.standard_normal(sampled.points.shape)
    normals = sampled.normals
    if strays:
        low, high = places.min(axis=0) - _STRAY_MARGIN, places.max(axis=0) + _STRAY_MARGIN
        apart = random.uniform(low, high, (int(_STRAY_SHARE * points), 3))
        places = np.concatenate([places, apart])
        normals = np.concatenate([normals, random.standard_normal(apart.shape)])
    return PointCloud(places, normals if given else None)


def _with_hole(mesh: Mesh) -> Mesh:
    """Return the mesh without a band of its back."""
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    share = (middles[:, 2] - low[2]) / (high[2] - low[2])
    band = (share > _HOLE_ABOVE) & (share < _HOLE_ABOVE + _HOLE_HEIGHT)
    return Mesh(mesh.vertices, mesh.triangles[~(band & (middles[:, 1] > (low + high)[1] / 2))])
