"""The bodies and problems that are measured."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

from focus_planner import PlanRequest, Problem, Rig, Scene, cylinder_rig
from focus_planner.core.planning import pose_problem
from focus_planner.io.bodies import bodies
from focus_planner.io.surfaces import load_surface


@cache
def rig() -> Rig:
    return cylinder_rig()


@cache
def body_scenes() -> dict[str, Scene]:
    """Return the bodies of the folder that BODIES names, else the shipped ones."""
    folder = os.environ.get("BODIES")
    paths = sorted(Path(folder).glob("*.ply")) if folder else bodies()
    return {path.stem: Scene(load_surface(path)) for path in paths}


def problem(scene: Scene, samples: int, seed: int = 1) -> Problem:
    posed = pose_problem(scene, rig(), PlanRequest(samples=samples, seed=seed))
    _ = posed.cells
    return posed
