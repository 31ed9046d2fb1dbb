"""Focus distances for every camera of a multi-view capture rig; the public API without ROS."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from focus_planner.core.checks import InputError
    from focus_planner.core.lens_table import LensTable
    from focus_planner.core.optics import depth_of_field, focus_interval, hyperfocal_distance
    from focus_planner.core.planning import plan_focus
    from focus_planner.core.plans import CameraFocus, FocusPlan, PlanRequest, Shot, SolvedPlan
    from focus_planner.core.problem import Problem
    from focus_planner.core.rig import cylinder_rig
    from focus_planner.core.scene import Scene
    from focus_planner.core.types import (
        Camera,
        CameraStatus,
        CostModel,
        Grid,
        Image,
        Lens,
        Mesh,
        PointCloud,
        Rig,
    )

__all__ = [
    "Camera",
    "CameraFocus",
    "CameraStatus",
    "CostModel",
    "FocusPlan",
    "Grid",
    "Image",
    "InputError",
    "Lens",
    "LensTable",
    "Mesh",
    "PlanRequest",
    "PointCloud",
    "Problem",
    "Rig",
    "Scene",
    "Shot",
    "SolvedPlan",
    "cylinder_rig",
    "depth_of_field",
    "focus_interval",
    "hyperfocal_distance",
    "plan_focus",
]

_HOMES = {
    "checks": ("InputError",),
    "lens_table": ("LensTable",),
    "optics": ("depth_of_field", "focus_interval", "hyperfocal_distance"),
    "planning": ("plan_focus",),
    "plans": ("CameraFocus", "FocusPlan", "PlanRequest", "Shot", "SolvedPlan"),
    "problem": ("Problem",),
    "rig": ("cylinder_rig",),
    "scene": ("Scene",),
}


def __getattr__(name: str) -> Any:
    """Import what is asked for, and not before: Open3D and Numba take a second each."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next((home for home, names in _HOMES.items() if name in names), "types")
    return getattr(import_module(f"focus_planner.core.{home}"), name)
