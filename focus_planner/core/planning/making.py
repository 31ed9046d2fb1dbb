# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From a solution to a plan: what every camera has to do, and how good it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.notes import Note
from focus_planner.core.planning.holding import Held, held_distances
from focus_planner.core.planning.many_subjects import Formulated, judge_subjects, mean_area
from focus_planner.core.planning.methods import proves_itself
from focus_planner.core.planning.observations import cost_of_tolerance
from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, Shot, SolvedPlan
from focus_planner.core.planning.quality import Estimate, Quality, estimate_quality
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.planning.worst import Balanced
from focus_planner.core.problem.cells import group_by_lens
from focus_planner.core.problem.problem import Problem, mean_cost, with_depth_tolerance
from focus_planner.core.problem.shots import (
    most_shots,
    sort_shots,
    with_one_shot,
    with_shots,
)
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import depth_of_field, distance_from_sensor
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers.solution import fill_missing_distances


@dataclass(frozen=True, eq=False)
class Given:
    """What a plan was asked for, and which lenses are to stay where they are."""

    subjects: tuple[Subject, ...]
    rig: Rig
    request: PlanRequest
    held: Held


@dataclass(frozen=True, eq=False)
class Judged:
    """What a solution is worth.

    Attributes
    ----------
    problem, fresh : Problem
        With as many shots as the busiest camera takes.
    quality : Quality
    cost : float
        On the samples planned on, and on fresh ones.
    fresh_cost : Estimate
    subjects : tuple of SubjectQuality
        Of each of several.
    cameras : tuple of CameraFocus
    notes : tuple of Note
    stay : int
        How many lenses stay where they are though the solution would have them move.
    """

    problem: Problem
    fresh: Problem
    quality: Quality
    cost: float
    fresh_cost: Estimate
    subjects: tuple[SubjectQuality, ...]
    cameras: tuple[CameraFocus, ...]
    notes: tuple[Note, ...]
    stay: int


def judged(given: Given, formulated: Formulated, solved: Balanced) -> Judged:
    """Return what the distances that were found are worth; the bound does not matter.

    Parameters
    ----------
    given : Given
    formulated : Formulated
        The problems that were solved and that it is judged on.
    solved : Balanced
    """
    with kernels.threads_for(len(formulated.fresh.depth)):
        return _judged(given, formulated, solved)


def _judged(given: Given, formulated: Formulated, solved: Balanced) -> Judged:
    problem, fresh, found = _with_shots_taken(formulated, solved.solution.focus_distances)
    focus = held_distances(problem, found, given.held)
    stay = int(np.count_nonzero(focus != found))
    costs, best = problem.assign(focus)
    quality = estimate_quality(fresh, focus, given.rig)
    cost, fresh_cost = mean_cost(problem.samples.weights, costs), quality.cost
    of_subjects: tuple[SubjectQuality, ...] = ()
    if len(given.subjects) > 1:
        multipliers = solved.multipliers
        of_subjects = judge_subjects(given.subjects, problem, fresh, focus, costs, multipliers)
    if solved.multipliers.any():
        cost = max(each.cost for each in of_subjects)
        worst = max(of_subjects, key=lambda each: each.fresh_cost)
        fresh_cost = Estimate(worst.fresh_cost, worst.fresh_standard_error)
    return Judged(
        problem,
        fresh,
        quality,
        cost,
        fresh_cost,
        of_subjects,
        _camera_plans(problem, focus, best),
        (*_tolerated(given, fresh, focus, quality), *([given.held.note] if stay else ())),
        stay,
    )


def plan_of(
    given: Given,
    formulated: Formulated,
    solved: Balanced,
    worth: Judged,
    notes: tuple[Note, ...],
    pacer: Pacer,
    solve_seconds: float,
) -> SolvedPlan:
    """Return the plan at the distances that were found.

    Parameters
    ----------
    given : Given
    formulated : Formulated
        The problems that were solved and that it is judged on.
    solved : Balanced
    worth : Judged
        Of the same solution.
    notes : tuple of Note
        On the problems.
    pacer : Pacer
        Of this plan.
    solve_seconds : float
    """
    request, cost, quality = given.request, worth.cost, worth.quality
    bound = solved.mean.lower_bound
    bound = None if bound is None else min(bound, cost)
    converged = solved.solution.converged and not pacer.samples_left_out
    proven = proves_itself(formulated.problem, request) and not solved.multipliers.any()
    if (worth.stay or not proven) and request.method == "optimal" and bound is not None:
        converged = converged and cost - bound <= request.gap * cost
    return SolvedPlan(
        method=request.method,
        cost=cost,
        lower_bound=bound,
        converged=converged,
        samples=worth.problem.sample_count,
        seed=request.seed,
        depth_tolerance=request.depth_tolerance,
        views=request.views,
        images=request.images,
        max_mm_per_pixel=request.max_mm_per_pixel,
        fresh_cost=worth.fresh_cost.value,
        fresh_standard_error=worth.fresh_cost.standard_error,
        fresh_samples=worth.fresh.sample_count,
        surface_area=mean_area(given.subjects),
        covered_area=quality.covered_area.value,
        in_focus_area=quality.in_focus_area.value,
        in_focus_standard_error=quality.in_focus_area.standard_error,
        sharp_areas=quality.sharp_areas,
        resolution=quality.resolution,
        solve_seconds=solve_seconds,
        total_seconds=pacer.budget.elapsed(),
        notes=(*notes, *worth.notes),
        cameras=worth.cameras,
        subjects=worth.subjects,
        problem=worth.problem,
        fresh_problem=worth.fresh,
        prices=solved.mean.prices,
        stop_log=pacer.stop_log,
    )


def _with_shots_taken(
    formulated: Formulated, focus: FloatArray
) -> tuple[Problem, Problem, FloatArray]:
    """Return the problems and the distances with as many shots as the busiest camera takes."""
    problem, fresh = formulated.problem, formulated.fresh
    focus = sort_shots(problem, fill_missing_distances(problem, focus))
    most = most_shots(problem, focus)
    if most == problem.shots:
        return problem, fresh, focus
    kept = focus.reshape(-1, problem.shots)[:, :most].ravel()
    problem, fresh = (with_shots(with_one_shot(each), most) for each in (problem, fresh))
    return problem, fresh, kept


def _tolerated(
    given: Given, fresh: Problem, focus: FloatArray, quality: Quality
) -> tuple[Note, ...]:
    """Return the note on what the depth tolerance costs, if there is one."""
    tolerance = given.request.depth_tolerance
    if not tolerance:
        return ()
    nominal = estimate_quality(with_depth_tolerance(fresh, 0.0), focus).in_focus_area.value
    within = quality.in_focus_area.value
    return (cost_of_tolerance(tolerance, mean_area(given.subjects), within, nominal),)


def _camera_plans(problem: Problem, focus: FloatArray, best: IntArray) -> tuple[CameraFocus, ...]:
    """Return every camera's part of the plan, given each sample's best cameras (N, views).

    A picture is needed too if it is the last of the views that a sample needs.
    """
    count = problem.camera_count
    assigned = np.bincount(best[best >= 0], minlength=count)
    in_focus = np.zeros(count, dtype=np.int64)
    for of_view in best.T:
        in_focus += np.bincount(of_view[problem.in_focus(focus, of_view)], minlength=count)
    taken = focus != kernels.UNTAKEN
    # Where a lens rests whose camera takes no picture.
    neutral = fill_missing_distances(problem, np.where(taken, focus, np.nan))
    shots = _shots(problem.lenses, neutral, assigned, in_focus)
    cameras = []
    for first in range(0, count, problem.shots):
        own = range(first, first + problem.shots)
        of_camera = tuple(shots[c] for c in own if taken[c])
        cameras.append(_camera_focus(problem, first, of_camera, neutral=shots[first]))
    return tuple(cameras)


def _shots(
    lenses: tuple[Lens, ...],
    focus: FloatArray,
    assigned: NDArray[np.int64],
    in_focus: NDArray[np.int64],
) -> list[Shot]:
    """Return a shot of every lens, given (C,) focus distances and what they are best for."""
    near, far, from_sensor = np.empty((3, len(lenses)))
    for lens, part in group_by_lens(lenses, np.arange(len(lenses))):
        near[part], far[part] = depth_of_field(focus[part], lens)
        from_sensor[part] = distance_from_sensor(focus[part], lens)
    values = [
        lens.table.value_at(distance) if lens.table else None
        for lens, distance in zip(lenses, focus.tolist(), strict=True)
    ]
    columns = (each.tolist() for each in (focus, near, far, assigned, in_focus))
    return [Shot(*each) for each in zip(*columns, values, from_sensor.tolist(), strict=True)]


def _camera_focus(
    problem: Problem, first: int, shots: tuple[Shot, ...], neutral: Shot
) -> CameraFocus:
    """Return a camera's part of the plan; its first shot is camera ``first`` of the problem."""
    main = max(shots, key=lambda shot: shot.assigned_samples, default=neutral)
    table = problem.lenses[first].table
    assigned = sum(shot.assigned_samples for shot in shots)
    status = CameraStatus.PLANNED if assigned else CameraStatus.UNASSIGNED
    if problem.camera_offsets[first] == problem.camera_offsets[first + 1]:
        status = CameraStatus.SEES_NOTHING
    elif not shots:
        status = CameraStatus.DROPPED
    return CameraFocus(
        name=problem.names[first],
        status=status,
        focus_distance=main.focus_distance,
        near_limit=main.near_limit,
        far_limit=main.far_limit,
        assigned_samples=assigned,
        in_focus_samples=sum(shot.in_focus_samples for shot in shots),
        shots=shots,
        device_value=main.device_value,
        device_unit=table.unit if table else None,
        from_sensor=main.from_sensor,
    )
