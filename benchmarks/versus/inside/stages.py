# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""The stages of planning: what is timed, after what is not.

A stage takes the inputs, a number of samples or cameras, and a seed. It returns its seconds, and a
figure by which results are compared. Every turn has another seed, so that nothing kept from the
turn before helps, except where inputs are meant to be the same.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import shims

from focus_planner import Mesh, PlanRequest, Rig, Scene, cylinder_rig, plan_focus
from focus_planner.core import kernels
from focus_planner.core.solvers import SOLVERS, Options
from focus_planner.io.surfaces import load_surface

_SHIFT = 1e-6  # metres: another mesh, and hardly another problem
_SITE_SPACING = 3.0
_SITE_SAMPLES = 1000
_PROVEN = 1e-4


@dataclass(frozen=True)
class Inputs:
    """A surface in front of the default rig."""

    path: Path
    folder: Path

    @cached_property
    def rig(self) -> Rig:
        return cylinder_rig()

    @cached_property
    def mesh(self) -> Mesh:
        return load_surface(self.path)

    @cached_property
    def scene(self) -> Scene:
        return Scene(self.mesh)


#: Seconds, and a figure of the result.
Outcome = tuple[float, float]


def _timed(function: Callable[[], float]) -> Outcome:
    start = time.perf_counter()
    result = function()
    return time.perf_counter() - start, result


def formulate(inputs: Inputs, samples: int, seed: int) -> Outcome:
    request = PlanRequest(samples=samples, seed=seed)
    return _timed(lambda: len(shims.formulate(inputs.scene, inputs.rig, request).depth))


def fresh(inputs: Inputs, samples: int, seed: int) -> Outcome:
    request = PlanRequest(method="em", samples=1000, bound="none")
    focus = _planned(inputs, request).focus_distances
    request = replace(request, fresh_samples=samples, seed=seed)
    return _timed(lambda: shims.judge(inputs.scene, inputs.rig, request, focus))


def em(inputs: Inputs, samples: int, seed: int) -> Outcome:
    return _solving("em", inputs, samples, seed)


def k_view(inputs: Inputs, samples: int, seed: int) -> Outcome:
    return _solving("k_view", inputs, samples, seed)


def optimal(inputs: Inputs, samples: int, seed: int) -> Outcome:
    return _solving("optimal", inputs, samples, seed)


def _solving(method: str, inputs: Inputs, samples: int, seed: int) -> Outcome:
    problem = shims.formulate(inputs.scene, inputs.rig, PlanRequest(samples=samples, seed=seed))
    with kernels.threads_for(len(problem.depth)):
        return _timed(lambda: SOLVERS[method](problem, Options(gap=_PROVEN)).cost)


def plan(inputs: Inputs, samples: int, _: int) -> Outcome:
    """Plan again with everything as it was."""
    request = PlanRequest(samples=samples)
    return _timed(lambda: plan_focus(inputs.scene, inputs.rig, request).cost)


def plan_new_mesh(inputs: Inputs, samples: int, seed: int) -> Outcome:
    vertices, triangles = inputs.mesh.vertices + seed * _SHIFT, inputs.mesh.triangles.copy()
    request = PlanRequest(samples=samples)
    return _timed(lambda: plan_focus(Scene(Mesh(vertices, triangles)), inputs.rig, request).cost)


def bound(inputs: Inputs, samples: int, seed: int) -> Outcome:
    """Return the seconds of a plan's bound, from the solver's last step on, and the gap."""
    request = PlanRequest(samples=samples, seed=seed)
    moments = {}

    def note(progress: Any) -> bool:
        moments[progress.stage] = time.perf_counter()
        return True

    found = plan_focus(inputs.scene, inputs.rig, request, None, note)
    return moments["prices"] - moments["k_view"], 100 * (1 - found.lower_bound / found.cost)


def tuples(inputs: Inputs, cameras: int, _: int) -> Outcome:
    problem = replace(_hall_problem(inputs, cameras // len(inputs.rig)))
    _ = problem.cells, problem.camera_pairs
    return _timed(lambda: len(shims.camera_tuples(problem).cameras))


def command(inputs: Inputs, samples: int, _: int) -> Outcome:
    """Plan in a process of its own."""
    rig, output = inputs.folder / "rig.yaml", inputs.folder / "plan.json"
    if not rig.exists():
        rig.write_text(_run(inputs.folder, "rig", "cylinder"))
    arguments = "plan", inputs.path, "--rig", rig, "--samples", samples, "--output", output

    def run() -> float:
        _run(inputs.folder, *map(str, arguments))
        return json.loads(output.read_text())["cost"]

    return _timed(run)


def _run(folder: Path, *arguments: str) -> str:
    """Run the command line in a folder; in another's sources Python would import those."""
    done = subprocess.run(  # noqa: S603
        [sys.executable, *shims.PROGRAM, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"focus_planner {arguments[0]}: {done.stderr.strip()}")
    return done.stdout


@cache
def _planned(inputs: Inputs, request: PlanRequest) -> Any:
    return plan_focus(inputs.scene, inputs.rig, request)


@cache
def _hall_problem(inputs: Inputs, sites: int) -> Any:
    """Return the problem of as many subjects side by side, each in a rig of its own."""
    vertices, triangles, cameras = [], [], []
    for site in range(sites):
        place = np.array([_SITE_SPACING * site, 0.0, 0.0])
        vertices.append(inputs.mesh.vertices + place)
        triangles.append(inputs.mesh.triangles + site * len(inputs.mesh.vertices))
        for camera in inputs.rig.cameras:
            position = tuple((np.array(camera.position) + place).tolist())
            cameras.append(replace(camera, name=f"site_{site}_{camera.name}", position=position))
    scene = Scene(Mesh(np.concatenate(vertices), np.concatenate(triangles)))
    request = PlanRequest(samples=_SITE_SAMPLES * sites)
    return shims.formulate(scene, Rig(tuple(cameras)), request)


STAGES: dict[str, Callable[[Inputs, int, int], Outcome]] = {
    stage.__name__: stage
    for stage in (
        *(formulate, fresh, em, k_view, optimal, bound),
        *(plan, plan_new_mesh, command, tuples),
    )
}
