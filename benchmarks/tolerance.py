# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a depth tolerance is worth where subject, cameras and lenses are not as planned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from focus_planner import PlanRequest, Rig, Scene, SolvedPlan, plan_focus
from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.problem.problem import Problem, with_depth_tolerance

# Standard deviations: of where the subject stands and of where each camera is, metres along each
# axis; of what each lens is set to, dioptres.
_SUBJECT, _CAMERA, _LENS = 0.010, 0.005, 0.02
_SCALES = (1.0, 0.5, 2.0)
_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
_DRAWS = 40


def run(console: Console) -> None:
    """Print what is really in focus, by tolerance, with such errors, half and twice as large."""
    for scale in _SCALES:
        console.print(_measured(scale))


def _measured(scale: float) -> Table:
    rows: dict[float, list[list[float]]] = {share: [] for share in _SHARES}
    errors = []
    for scene in body_scenes().values():
        error = _standard_error(scene, scale)
        errors.append(error)
        plans = [
            plan_focus(scene, rig(), PlanRequest(depth_tolerance=share * error, bound="none"))
            for share in _SHARES
        ]
        truths = [_truth(scene, scale, seed) for seed in range(_DRAWS)]
        for share, plan in zip(_SHARES, plans, strict=True):
            rows[share].append([*_as_planned(plan), *_really(plan, truths)])
    mean = np.mean(errors)
    table = Table(
        *("tolerance / σ", "tolerance", "within it, as planned", "in focus, as planned"),
        *("really in focus", "real cost"),
        title=f"{len(errors)} bodies × {_DRAWS} draws; off by {1000 * scale * _SUBJECT:g} mm:"
        f" subject, {1000 * scale * _CAMERA:g} mm: cameras, {scale * _LENS:g} D: lenses;"
        f" σ of depths {1000 * mean:.1f} mm",
    )
    for share, values in rows.items():
        within, nominal, really, spread, cost = np.mean(values, axis=0)
        error = spread / np.sqrt(len(errors))
        table.add_row(
            *(f"{share:g}", f"{1000 * share * mean:.1f} mm", f"{within:.1%}", f"{nominal:.1%}"),
            *(f"{100 * really:.1f} ± {100 * error:.1f} %", f"{cost:.1f}"),
        )
    return table


def depth_errors(depths: FloatArray, scale: float = 1.0) -> FloatArray:
    """Return the standard error of depths: of the subject, the camera and the lens together.

    A lens that is off by so many dioptres is focused d² times that away from d.
    """
    errors: FloatArray = scale * np.sqrt(_SUBJECT**2 + _CAMERA**2 + (_LENS * depths**2) ** 2)
    return errors


def real_rig(planned: Rig, random: np.random.Generator, scale: float = 1.0) -> Rig:
    """Return the cameras where they really are, as seen from a subject that is elsewhere too."""
    subject = random.normal(scale=scale * _SUBJECT, size=3)
    moved = random.normal(scale=scale * _CAMERA, size=(len(planned), 3)) - subject
    cameras = (
        replace(camera, position=tuple((np.array(camera.position) + by).tolist()))
        for camera, by in zip(planned.cameras, moved, strict=True)
    )
    return replace(planned, cameras=tuple(cameras))


def _standard_error(scene: Scene, scale: float) -> float:
    """Return the root mean square of the errors of the depths at which cameras image samples."""
    plan = plan_focus(scene, rig(), PlanRequest(bound="none"))
    fresh = plan.fresh_problem
    _, best = fresh.evaluate(plan.focus_distances)
    imaged = fresh.camera_index == np.repeat(best, np.diff(fresh.sample_offsets))
    return float(np.sqrt((depth_errors(fresh.depth[imaged], scale) ** 2).mean()))


def _truth(scene: Scene, scale: float, seed: int) -> tuple[Problem, FloatArray]:
    """Return the problem as it really is, on fresh samples, and by how many dioptres lenses err."""
    random = np.random.default_rng(seed)
    really = real_rig(rig(), random, scale)
    problem = formulate_problem(scene, really, PlanRequest(seed=seed), fresh=True)
    return problem, random.normal(scale=scale * _LENS, size=len(really))


def _as_planned(plan: SolvedPlan) -> tuple[float, float]:
    """Return the shares of the surface in focus, with the tolerance and without."""
    nominal = with_depth_tolerance(plan.fresh_problem, 0.0)
    in_focus = estimate_quality(nominal, plan.focus_distances).in_focus_area.value
    return plan.in_focus_area / plan.surface_area, in_focus / plan.surface_area


def _really(
    plan: SolvedPlan, truths: list[tuple[Problem, FloatArray]]
) -> tuple[float, float, float]:
    """Return the share really in focus, its standard error over draws, and the cost."""
    shares, costs = [], []
    for problem, dioptres in truths:
        quality = estimate_quality(problem, 1 / (1 / plan.focus_distances + dioptres))
        shares.append(quality.in_focus_area.value / plan.surface_area)
        costs.append(quality.cost.value)
    error = float(np.std(shares, ddof=1) / np.sqrt(len(shares)))
    return float(np.mean(shares)), error, float(np.mean(costs))
