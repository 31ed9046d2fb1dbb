"""Focus distances for every camera of a multi-view capture rig; the public API without ROS."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import (
        CameraFocus,
        CameraStatus,
        FocusPlan,
        Shot,
        SolvedPlan,
    )
    from focus_planner.core.planning.plan_focus import plan_focus
    from focus_planner.core.planning.request import PlanRequest
    from focus_planner.core.problem.cost_model import CostModel
    from focus_planner.core.problem.problem import Problem
    from focus_planner.core.rig.camera import Camera, CameraIntrinsics
    from focus_planner.core.rig.layouts import cylinder_rig
    from focus_planner.core.rig.lens import Lens
    from focus_planner.core.rig.lens_table import LensTable
    from focus_planner.core.rig.optics import depth_of_field, focus_interval, hyperfocal_distance
    from focus_planner.core.rig.rig import Grid, Rig
    from focus_planner.core.surface.scene import Scene
    from focus_planner.core.surface.surface import Mesh, PointCloud
    from focus_planner.core.validation import InputError

__all__ = [
    "Camera",
    "CameraFocus",
    "CameraIntrinsics",
    "CameraStatus",
    "CostModel",
    "FocusPlan",
    "Grid",
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
    "validation": ("InputError",),
    "rig.lens": ("Lens",),
    "rig.lens_table": ("LensTable",),
    "rig.optics": ("depth_of_field", "focus_interval", "hyperfocal_distance"),
    "rig.camera": ("Camera", "CameraIntrinsics"),
    "rig.rig": ("Grid", "Rig"),
    "rig.layouts": ("cylinder_rig",),
    "surface.surface": ("Mesh", "PointCloud"),
    "surface.scene": ("Scene",),
    "problem.problem": ("Problem",),
    "problem.cost_model": ("CostModel",),
    "planning.plan_focus": ("plan_focus",),
    "planning.request": ("PlanRequest",),
    "planning.plan": ("CameraFocus", "CameraStatus", "FocusPlan", "Shot", "SolvedPlan"),
}


def __getattr__(name: str) -> Any:
    """Import what is asked for, and not before: Open3D and Numba take a second each."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next(home for home, names in _HOMES.items() if name in names)
    return getattr(import_module(f"focus_planner.core.{home}"), name)
