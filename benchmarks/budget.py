# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans within a budget of pictures: a small object on a turntable; which cameras of a rig.

The object is the first body, scaled to be 30 mm high if it were 1.8 m; the rig's subjects are
bodies 0, 4 and 8 of twelve: BODIES=folder.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import rig, three_body_scenes
from benchmarks.timing import processed
from focus_planner import (
    CameraIntrinsics,
    CostModel,
    Lens,
    Mesh,
    PlanRequest,
    Rig,
    Scene,
    SolvedPlan,
    cylinder_rig,
    hyperfocal_distance,
    plan_focus,
)
from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.sharp_views import TOLD_VIEWS, sharp_views
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.geometry import camera_positions

# --- the turntable -------------------------------------------------------------------------------
_SCALE, _DISTANCE = 0.03 / 1.8, 0.3
_ROWS, _STOPS = 3, 16
_FOCAL_LENGTH, _F_NUMBER, _CIRCLE = 0.1, 8.0, 12e-6
_STEEPEST = 0.3  # the least cosine of incidence that counts, of 72°
_REQUEST = PlanRequest(samples=3000, fresh_samples=20_000, seed=1, views=3, bound="tight")
# Pictures and the most of a view, with what is asked for in three views or more.
_BUDGETS = ((96, 3, "at least 86 %"), (144, 4, "at least 90 %"))
_STACKS = (2, 3, 8)  # pictures of a view
# --- which cameras -------------------------------------------------------------------------------
_CAMERAS = (24, 32, 60)
_ASKED_CAMERAS = 32


def run(console: Console) -> None:
    """Print the tables."""
    console.print(_turntable())
    console.print(_which_cameras())


def _turntable() -> Table:
    """Return what is sharp in how many views with limited pictures, and with even stacks."""
    scene, table_rig = _object(), _turntable_rig()
    title = f"A 30 mm object on a turntable, {len(table_rig)} views, incidence below 72°"
    table = Table(
        *("pictures", "of a view", *(f"sharp in ≥ {count}" for count in TOLD_VIEWS)),
        *("asked, in ≥ 3", "cost", "gap", "seconds", "of processors"),
        title=title,
    )
    # Kernels are loaded when they are first called, which no plan's time should contain.
    plan_focus(scene, table_rig, replace(_REQUEST, samples=500, images=60, shots=2), _MODEL)
    for images, shots, asked in _BUDGETS:
        request = replace(_REQUEST, images=images, shots=shots)
        processor, plan = processed(partial(plan_focus, scene, table_rig, request, _MODEL))
        shares = _sharp_shares(plan.fresh_problem, plan.focus_distances, table_rig)
        found = f"{plan.cost:.1f}", f"{plan.gap:.2%}", f"{plan.total_seconds:.1f}"
        row = (*(f"{share:.1%}" for share in shares), asked, *found, f"{processor:.1f}")
        table.add_row(f"{plan.pictures}, planned", _of_a_view(plan), *row)
    for pictures in _STACKS:
        request = replace(_REQUEST, shots=pictures)
        seen, fresh = (
            formulate_problem(scene, table_rig, request, _MODEL, fresh=fresh)
            for fresh in (False, True)
        )
        focus = _even_stacks(seen)
        shares = _sharp_shares(fresh, focus, table_rig)
        row = *(f"{share:.1%}" for share in shares), "", f"{seen.cost(focus):.1f}"
        table.add_row(f"{len(focus)}, even stacks", f"{pictures}", *row)
    endless = np.full_like(fresh.depth, np.inf)
    every = _sharp_shares(replace(fresh, focus_near=-endless, focus_far=endless), focus, table_rig)
    table.add_row("everything sharp", "", *(f"{share:.1%}" for share in every))
    return table


_MODEL = CostModel(projected_area_scale=(0.75 / _DISTANCE) ** 2, axis_deviation_limit=0.75 * _SCALE)


def _object() -> Scene:
    mesh = next(iter(three_body_scenes().values())).surface
    assert isinstance(mesh, Mesh)
    return Scene(Mesh(mesh.vertices * _SCALE, mesh.triangles))


def _turntable_rig() -> Rig:
    lens = Lens(_FOCAL_LENGTH, hyperfocal_distance(_FOCAL_LENGTH, _F_NUMBER, _CIRCLE))
    image = CameraIntrinsics(width=1000, height=1500, fx=9000, fy=9000, cx=499.5, cy=749.5)
    return cylinder_rig(_ROWS, _STOPS, _DISTANCE, 0.004, 0.026, lens=lens, intrinsics=image)


def _even_stacks(problem: Problem) -> FloatArray:
    """Return as many distances per view, equally far apart in dioptres over the depths it sees."""
    stacks = []
    middles = (np.arange(problem.shots) + 0.5) / problem.shots
    for first in range(0, problem.camera_count, problem.shots):
        low, high = problem.camera_offsets[first : first + 2]
        nearness = 1 / problem.depth[problem.camera_pairs[low:high]]
        stacks.append(1 / (nearness.max() - np.ptp(nearness) * middles))
    return np.concatenate(stacks)


def _sharp_shares(fresh: Problem, focus: FloatArray, cameras: Rig) -> list[float]:
    """Return the shares sharp in at least 1, 2, 3 and 5 views that do not see them too steeply."""
    near = np.where(_is_faced(fresh, cameras), fresh.focus_near, np.inf)
    counts, areas = sharp_views(replace(fresh, focus_near=near), focus), fresh.samples.areas
    return [float(areas[counts >= count].sum() / areas.sum()) for count in TOLD_VIEWS]


def _is_faced(problem: Problem, cameras: Rig) -> NDArray[np.bool_]:
    """Return (P,) whether each pair's incidence is below the steepest that counts."""
    camera = problem.view[problem.camera_index]
    samples = problem.samples
    rays = camera_positions(cameras)[camera] - samples.points[problem.sample_index]
    cosines = (rays * samples.normals[problem.sample_index]).sum(axis=1)
    faced: NDArray[np.bool_] = cosines > _STEEPEST * np.linalg.norm(rays, axis=1)
    return faced


def _of_a_view(plan: SolvedPlan) -> str:
    """Return how many views take how many pictures."""
    counts = np.bincount([len(camera.shots) for camera in plan.cameras])
    return ", ".join(f"{count} × {shots}" for shots, count in enumerate(counts) if count)


def _which_cameras() -> Table:
    """Return what some cameras cost on bodies, beside autofocus on all."""
    scenes = three_body_scenes()
    request = PlanRequest(samples=4096, fresh_samples=20_000, seed=1, bound="tight")
    title = "One picture each of the cameras that pay"
    table = Table("body", "pictures", "fresh cost", "in focus", "gap", "seconds", title=title)
    tried = {f"autofocus on all {len(rig())}": replace(request, method="closest", bound="none")}
    tried |= {f"{images}": replace(request, images=images) for images in _CAMERAS}
    tried[f"{len(rig())}"] = request
    for title, each in tried.items():
        plans = {name: plan_focus(scene, rig(), each) for name, scene in scenes.items()}
        for name, plan in plans.items():
            gap = "" if plan.gap is None else f"{plan.gap:.2%}"
            share = f"{plan.in_focus_area / plan.surface_area:.1%}"
            row = title, f"{plan.fresh_cost:.1f}", share, gap, f"{plan.total_seconds:.1f}"
            table.add_row(name, *row)
        mean = float(np.mean([plan.fresh_cost for plan in plans.values()]))
        share = np.mean([plan.in_focus_area / plan.surface_area for plan in plans.values()])
        asked = ", asked: autofocus's at most" if each.images == _ASKED_CAMERAS else ""
        table.add_row(f"mean{asked}", title, f"{mean:.1f}", f"{share:.1%}", end_section=True)
    return table
