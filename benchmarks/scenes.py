# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The bodies, rigs and problems of the benchmarks."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from focus_planner import Mesh, PlanRequest, Problem, Rig, Scene, cylinder_rig
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.io.bodies import bodies
from focus_planner.io.surfaces import load_surface

_SITE_SPACING = 3.0  # two rigs' radii and an aisle
_TWELVE = 12


@cache
def rig() -> Rig:
    return cylinder_rig()


def body_paths() -> list[Path]:
    """Return the bodies in the folder of environment variable BODIES, else the shipped ones."""
    folder = os.environ.get("BODIES")
    return sorted(Path(folder).glob("*.ply")) if folder else list(bodies())


@cache
def body_scenes() -> dict[str, Scene]:
    """Return the same bodies as scenes, by name."""
    return {path.stem: Scene(load_surface(path)) for path in body_paths()}


def three_body_scenes() -> dict[str, Scene]:
    """Return bodies 0, 4 and 8 where BODIES is a folder of twelve, else the first three."""
    scenes = list(body_scenes().items())
    return dict(scenes[::4] if len(scenes) == _TWELVE else scenes[:3])


def hall(sites: int) -> tuple[Scene, Rig]:
    """Return one scene of bodies side by side, and one rig of the cameras around each of them."""
    meshes = [scene.surface for scene in body_scenes().values()]
    vertices, triangles, cameras, count = [], [], [], 0
    for site in range(sites):
        mesh = meshes[site % len(meshes)]
        assert isinstance(mesh, Mesh)
        place = np.array([_SITE_SPACING * site, 0.0, 0.0])
        vertices.append(mesh.vertices + place)
        triangles.append(mesh.triangles + count)
        count += len(mesh.vertices)
        cameras.extend(
            replace(
                camera,
                name=f"site_{site:02d}_{camera.name}",
                position=tuple((np.array(camera.position) + place).tolist()),
            )
            for camera in rig().cameras
        )
    return Scene(Mesh(np.concatenate(vertices), np.concatenate(triangles))), Rig(tuple(cameras))


def problem(scene: Scene, samples: int, seed: int = 1) -> Problem:
    formulated = formulate_problem(scene, rig(), PlanRequest(samples=samples, seed=seed))
    _ = formulated.cells
    return formulated
