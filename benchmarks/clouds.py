"""The quality of plans made on point clouds, evaluated on the meshes that they were drawn from."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem, rig
from focus_planner import FocusPlan, Mesh, PlanRequest, PointCloud, Scene, plan_focus
from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.sampling import sample_mesh

_SEEDS = range(1, 4)
_FRESH = 65_536
_CASES = [
    (points, given, noise)
    for points in (20_000, 100_000)
    for given in (True, False)
    for noise in (0.0, 0.002)
]


def run(console: Console) -> None:
    """Print the table."""
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
