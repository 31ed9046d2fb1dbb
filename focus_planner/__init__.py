"""Focus distances for every camera of a multi-view capture rig; the public API without ROS."""

from focus_planner.core.checks import InputError
from focus_planner.core.optics import depth_of_field, focus_interval, hyperfocal_distance
from focus_planner.core.planning import CameraFocus, FocusPlan, PlanRequest, plan_focus
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
    "Mesh",
    "PlanRequest",
    "PointCloud",
    "Problem",
    "Rig",
    "Scene",
    "cylinder_rig",
    "depth_of_field",
    "focus_interval",
    "hyperfocal_distance",
    "plan_focus",
]
