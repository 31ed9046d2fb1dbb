# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What formulating problems takes beside the ray casting in it, and plans for a new mesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from benchmarks.timing import processed, seconds
from focus_planner import Mesh, PlanRequest, Scene, plan_focus
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.surface.ray_casting import ray_caster

_SAMPLES = (1000, 4096, 65536)
_REPEATS = 9

Rays = NDArray[np.float32]


class _Recorder(Scene):
    """A scene that notes the rays that are asked of it, while it is told to."""

    def __init__(self, mesh: Mesh) -> None:
        super().__init__(mesh)
        self.noted: list[Rays] | None = None

    def occluded(self, rays: Rays) -> NDArray[np.bool_]:
        if self.noted is not None:
            self.noted.append(rays.copy())
        return super().occluded(rays)


def run(console: Console) -> None:
    """Print the tables."""
    name, first = next(iter(body_scenes().items()))
    mesh = first.surface
    assert isinstance(mesh, Mesh)
    scene, bare = _Recorder(mesh), _bare(first)
    table = Table(
        *("samples", "fresh ones", "rays", "rays alone, ms", "all of it, ms", "ratio", "least"),
        title=f"Processor time of formulating, fresh samples included, on {name}; medians",
    )
    for samples in _SAMPLES:
        request = PlanRequest(samples=samples)
        rays = _rays(scene, request)
        alone, whole = _in_turns(
            lambda r=rays: [bare(each) for each in r], lambda q=request: _formulate(scene, q)
        )
        table.add_row(
            f"{samples:,}",
            f"{request.fresh_samples:,}",
            f"{sum(map(len, rays)):,}",
            f"{1000 * np.median(alone):.1f}",
            f"{1000 * np.median(whole):.1f}",
            f"{np.median(whole) / np.median(alone):.2f}",
            f"{min(whole) / min(alone):.2f}",
        )
    console.print(table)
    vertices, triangles = mesh.vertices, mesh.triangles
    taken = seconds(lambda: plan_focus(Scene(Mesh(vertices, triangles)), rig()), _REPEATS)
    console.print(f"A plan for a new mesh of {len(triangles):,} triangles: {1000 * taken:.1f} ms\n")


def _bare(scene: Scene) -> Callable[[Rays], object]:
    """Return what casts rays onto the scene, and does nothing else."""
    vertices, triangles = scene.opaque
    return ray_caster(vertices - scene.centre, triangles).occluded


def _formulate(scene: Scene, request: PlanRequest) -> None:
    for fresh in (False, True):
        formulate_problem(scene, rig(), request, fresh=fresh)


def _rays(scene: _Recorder, request: PlanRequest) -> list[Rays]:
    """Return the rays between cameras and samples that a request is about."""
    scene.noted = []
    _formulate(scene, request)
    noted, scene.noted = scene.noted, None
    return noted


def _in_turns(
    one: Callable[[], object], other: Callable[[], object]
) -> tuple[list[float], list[float]]:
    """Return the seconds of processors that both take, taking turns."""
    one(), other()
    taken = [(processed(one)[0], processed(other)[0]) for _ in range(_REPEATS)]
    return [a for a, _ in taken], [b for _, b in taken]
