# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The time saved by a warm start after the surface or some cameras moved a little."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

from benchmarks.scenes import body_scenes, rig
from focus_planner import Camera, Mesh, PlanRequest, Rig, Scene, SolvedPlan, plan_focus
from focus_planner.core.arrays import FloatArray
from focus_planner.core.progress import Progress

_CAMERAS_MOVED = 5
_MOVED_BY = 0.01  # metres
_TURNED_BY = math.radians(0.5)
_PATIENCE = 20.0  # seconds after which a plan is taken as it is
_REPEATS = 3
_STAGES = ("em", "k_view", "prices", "branching")
# Whole plans, with no bound beside the solver's.
_REQUESTS = (
    PlanRequest("k_view", samples=65536, bound="none"),
    PlanRequest("optimal", samples=1000, gap=1e-6),
    PlanRequest("optimal", samples=8192, gap=1e-3),
    PlanRequest("optimal", samples=65536, gap=1e-3),
)


def run(console: Console) -> None:
    """Print the table."""
    table = Table(
        "method",
        "samples",
        "change",
        "cold, s",
        "warm, s",
        "cold / warm",
        "of whole plans",
        "steps cold",
        "steps warm",
        "cost, warm beside cold (at worst)",
        title="Solving from nothing and from the plan before; medians of the bodies",
    )
    for request in _REQUESTS:
        limited = replace(request, time_budget=_PATIENCE)
        before = {name: plan_focus(s, rig(), limited) for name, s in body_scenes().items()}
        for change, moved in _CHANGES.items():
            pairs = [
                _compare(*moved(scene), limited, before[name])
                for name, scene in body_scenes().items()
            ]
            seconds = np.array([[run.seconds for run in pair] for pair in pairs])
            plans = [cold.total / warm.total for cold, warm in pairs]
            beside = [warm.cost / cold.cost - 1 for cold, warm in pairs]
            table.add_row(
                _title(request),
                f"{request.samples:,}",
                change,
                *(f"{median:.3f}" for median in np.median(seconds, axis=0)),
                f"{np.median(seconds[:, 0] / seconds[:, 1]):.2f} ×",
                f"{np.median(plans):.2f} ×",
                _steps([pair[0].steps for pair in pairs]),
                _steps([pair[1].steps for pair in pairs]),
                f"{np.mean(beside):+.3%} ({max(beside):+.3%})",
            )
    console.print(table)


def _title(request: PlanRequest) -> str:
    return request.method if request.method == "k_view" else f"optimal, gap {request.gap:g}"


# --- Runs ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Run:
    """Seconds of the solver and of the whole plan, the solver's steps by stage, and the cost."""

    seconds: float
    total: float
    steps: Counter[str]
    cost: float


def _compare(
    scene: Scene, moved_rig: Rig, request: PlanRequest, before: SolvedPlan
) -> tuple[_Run, _Run]:
    """Return the cold run and the one with a warm start."""
    return _solve(scene, moved_rig, request, None), _solve(scene, moved_rig, request, before)


def _solve(scene: Scene, moved_rig: Rig, request: PlanRequest, before: SolvedPlan | None) -> _Run:
    """Return the run with the median seconds of several."""
    runs = [_solve_once(scene, moved_rig, request, before) for _ in range(_REPEATS)]
    return replace(
        runs[0],
        seconds=float(np.median([run.seconds for run in runs])),
        total=float(np.median([run.total for run in runs])),
    )


def _solve_once(
    scene: Scene, moved_rig: Rig, request: PlanRequest, before: SolvedPlan | None
) -> _Run:
    steps: Counter[str] = Counter()

    def count(progress: Progress) -> bool:
        steps[progress.stage] += 1
        return True

    plan = plan_focus(
        scene, moved_rig, request, on_progress=count, warm_start=before and before.warm_start
    )
    return _Run(plan.solve_seconds, plan.total_seconds, steps, plan.cost)


def _steps(counts: list[Counter[str]]) -> str:
    medians = {stage: np.median([count[stage] for count in counts]) for stage in _STAGES}
    return ", ".join(f"{median:.0f} {stage}" for stage, median in medians.items() if median)


# --- Changes -------------------------------------------------------------------------------------


def _scaled(scene: Scene) -> tuple[Scene, Rig]:
    return _reshaped(scene, lambda mesh: 1.005 * mesh.vertices), rig()


def _shifted(scene: Scene) -> tuple[Scene, Rig]:
    return _reshaped(scene, lambda mesh: mesh.vertices + [0.003, 0.0, 0.0]), rig()


def _breathing(scene: Scene) -> tuple[Scene, Rig]:
    return _reshaped(scene, breathing), rig()


def breathing(mesh: Mesh, phase: float = 1.0) -> FloatArray:
    """Return the vertices, moved along their normals by waves of up to 3 mm and half a metre.

    ``phase`` is by which part of that, from -1 to 1.
    """
    corners = mesh.vertices[mesh.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(normals, mesh.triangles[:, corner], facing)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    waves = np.sin(4 * math.pi * mesh.vertices).prod(axis=1, keepdims=True)
    return mesh.vertices + phase * 0.003 * waves * normals


def _reshaped(scene: Scene, vertices: Callable[[Mesh], FloatArray]) -> Scene:
    mesh = scene.surface
    assert isinstance(mesh, Mesh)
    return Scene(replace(mesh, vertices=vertices(mesh)))


def _knocked(scene: Scene) -> tuple[Scene, Rig]:
    """Return the scene and the rig with some cameras moved and rotated."""
    cameras = list(rig().cameras)
    random = np.random.default_rng(0)
    for c in random.choice(len(cameras), _CAMERAS_MOVED, replace=False):
        cameras[c] = _knock(cameras[c], random)
    return scene, replace(rig(), cameras=tuple(cameras))


def _knock(camera: Camera, random: np.random.Generator) -> Camera:
    way, axis = random.normal(size=(2, 3))
    moved = np.array(camera.position) + _MOVED_BY * way / np.linalg.norm(way)
    turn = Rotation.from_rotvec(_TURNED_BY * axis / np.linalg.norm(axis))
    turned = turn * Rotation.from_quat(camera.orientation)
    return replace(
        camera, position=tuple(moved.tolist()), orientation=tuple(turned.as_quat().tolist())
    )


_CHANGES: dict[str, Callable[[Scene], tuple[Scene, Rig]]] = {
    "scaled by 1.005": _scaled,
    "shifted by 3 mm": _shifted,
    "breathing by 3 mm": _breathing,
    f"{_CAMERAS_MOVED} cameras knocked": _knocked,
}
