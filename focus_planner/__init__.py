# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
    from focus_planner.core.planning.precompile import precompile
    from focus_planner.core.planning.presets import Presets, plan_presets
    from focus_planner.core.planning.request import PlanRequest
    from focus_planner.core.planning.sharp_views import Resolution, SharpArea
    from focus_planner.core.planning.subject_quality import SubjectQuality
    from focus_planner.core.planning.subjects import Subject
    from focus_planner.core.problem.cost_model import CostModel
    from focus_planner.core.problem.problem import Problem
    from focus_planner.core.rig.camera import Camera, CameraIntrinsics
    from focus_planner.core.rig.camera_path import path_rig
    from focus_planner.core.rig.gantry import gantry_rig
    from focus_planner.core.rig.layouts import cylinder_rig, dome_rig, turntable_rig
    from focus_planner.core.rig.lens import Lens
    from focus_planner.core.rig.lens_table import LensTable
    from focus_planner.core.rig.optics import (
        depth_of_field,
        distance_from_sensor,
        focus_interval,
        hyperfocal_distance,
    )
    from focus_planner.core.rig.rig import Grid, Rig
    from focus_planner.core.surface.scene import Scene
    from focus_planner.core.surface.surface import Mesh, PointCloud
    from focus_planner.core.validation import InputError
    from focus_planner.io.lens_sheet.content import lens_sheet
    from focus_planner.io.lens_sheet.saving import save_lens_sheet
    from focus_planner.io.plans import load_plan, save_plan
    from focus_planner.io.rigs import load_rig, save_rig
    from focus_planner.io.surfaces import load_surface
    from focus_planner.report.making import save_report

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
    "Presets",
    "Problem",
    "Resolution",
    "Rig",
    "Scene",
    "SharpArea",
    "Shot",
    "SolvedPlan",
    "Subject",
    "SubjectQuality",
    "cylinder_rig",
    "depth_of_field",
    "distance_from_sensor",
    "dome_rig",
    "focus_interval",
    "gantry_rig",
    "hyperfocal_distance",
    "lens_sheet",
    "load_plan",
    "load_rig",
    "load_surface",
    "path_rig",
    "plan_focus",
    "plan_presets",
    "precompile",
    "save_lens_sheet",
    "save_plan",
    "save_report",
    "save_rig",
    "turntable_rig",
]

_HOMES = {
    "core.validation": ("InputError",),
    "core.rig.lens": ("Lens",),
    "core.rig.lens_table": ("LensTable",),
    "core.rig.optics": (
        "depth_of_field",
        "distance_from_sensor",
        "focus_interval",
        "hyperfocal_distance",
    ),
    "core.rig.camera": ("Camera", "CameraIntrinsics"),
    "core.rig.camera_path": ("path_rig",),
    "core.rig.gantry": ("gantry_rig",),
    "core.rig.rig": ("Grid", "Rig"),
    "core.rig.layouts": ("cylinder_rig", "dome_rig", "turntable_rig"),
    "core.surface.surface": ("Mesh", "PointCloud"),
    "core.surface.scene": ("Scene",),
    "core.problem.problem": ("Problem",),
    "core.problem.cost_model": ("CostModel",),
    "core.planning.plan_focus": ("plan_focus",),
    "core.planning.precompile": ("precompile",),
    "core.planning.presets": ("Presets", "plan_presets"),
    "core.planning.request": ("PlanRequest",),
    "core.planning.subject_quality": ("SubjectQuality",),
    "core.planning.subjects": ("Subject",),
    "core.planning.plan": ("CameraFocus", "CameraStatus", "FocusPlan", "Shot", "SolvedPlan"),
    "core.planning.sharp_views": ("Resolution", "SharpArea"),
    "io.lens_sheet.content": ("lens_sheet",),
    "io.lens_sheet.saving": ("save_lens_sheet",),
    "io.plans": ("load_plan", "save_plan"),
    "io.rigs": ("load_rig", "save_rig"),
    "io.surfaces": ("load_surface",),
    "report.making": ("save_report",),
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: Open3D and Numba take a second each."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next(home for home, names in _HOMES.items() if name in names)
    return getattr(import_module(f"{__name__}.{home}"), name)


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return __all__
