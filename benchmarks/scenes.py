"""The bodies and problems that are measured."""

from __future__ import annotations

from functools import cache

from focus_planner import PlanRequest, Problem, Rig, Scene, cylinder_rig
from focus_planner.core.planning import pose_problem
from focus_planner.io.bodies import bodies
from focus_planner.io.surfaces import load_surface


@cache
def rig() -> Rig:
    return cylinder_rig()


@cache
def body_scenes() -> dict[str, Scene]:
    """The shipped bodies."""
    return {path.stem: Scene(load_surface(path)) for path in bodies()}


def problem(scene: Scene, samples: int, seed: int = 1) -> Problem:
    posed = pose_problem(scene, rig(), PlanRequest(samples=samples, seed=seed))
    _ = posed.cells
    return posed
