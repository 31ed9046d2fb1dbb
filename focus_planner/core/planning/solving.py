# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From a scene, a rig and a request to a plan, once what that runs is compiled."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import subsample
from focus_planner.core.planning.many_subjects import (
    formulate_subjects,
    judge_subjects,
    mean_area,
)
from focus_planner.core.planning.observations import fewer_samples
from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, Shot, SolvedPlan, WarmStart
from focus_planner.core.planning.quality import Estimate, estimate_quality
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.core.planning.subjects import Scenes, Subject, subjects_of
from focus_planner.core.planning.time_budget import TimeBudget
from focus_planner.core.planning.warm_start import warm_options
from focus_planner.core.planning.worst import Balanced, balance_subjects
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem, mean_cost
from focus_planner.core.problem.shots import sort_shots, spread_start
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.optics import depth_of_field, distance_from_sensor
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import SOLVERS, Options
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.core.validation import InputError

# Price steps of a quick bound: on bodies they bring it within a quarter of a percent, in about the
# time of a 2-view plan.
_QUICK_STEPS = 60


def solve(
    scenes: Scenes,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    on_progress: ProgressCallback = never_stop,
    warm_start: WarmStart | None = None,
    stop_log: StopLog | None = None,
    *,
    limits: ResourceLimits | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> SolvedPlan:
    """Plan, as :func:`focus_planner.core.planning.plan_focus.plan_focus` says.

    Kernels that are not compiled yet are compiled on the way, which counts as part of the plan.
    """
    subjects = subjects_of(scenes)
    options = _options(rig, request)
    pacer = Pacer(TimeBudget(request.time_budget, clock), on_progress, stop_log)
    formulated = formulate_subjects(subjects, rig, request, model, pacer, limits)
    fresh, problem, notes = formulated.fresh, formulated.problem, formulated.notes
    solving_began = clock()
    problem = _with_cells(problem, request, pacer)
    options = replace(options, start=spread_start(problem))
    if warm_start is not None:
        options = warm_options(options, warm_start, problem)
    bounded = request.bound != "none" and request.method != "optimal"
    pacer.start_solver(clock() - solving_began, request.shots, bound=bounded)
    with kernels.threads_for(len(problem.depth)):
        solved = _solved(problem, request, options, pacer)
        solve_seconds = clock() - solving_began
        # A caller who stopped the plan is waiting for it, not for a bound.
        if bounded and not pacer.callback_stopped:
            pacer.start_bound()
            solved = _bounded(solved, request, options, pacer)
    if pacer.samples_left_out:
        stopped = pacer.callback_stopped
        notes = (*notes, fewer_samples(request, problem, fresh, stopped=stopped))
    return _plan(
        subjects, problem, fresh, request, solved, notes, pacer=pacer, solve_seconds=solve_seconds
    )


def _solved(problem: Problem, request: PlanRequest, options: Options, pacer: Pacer) -> Balanced:
    """Return what the method finds, for the mean or the worst of the problem's subjects."""
    count = len(problem.subjects)
    if request.worst and count > 1:
        return balance_subjects(problem, request.method, options, pacer)
    solution = SOLVERS[request.method](problem, options, pacer)
    return Balanced(solution, np.zeros(count), problem, solution)


def _with_cells(problem: Problem, request: PlanRequest, pacer: Pacer) -> Problem:
    """Return the problem with its cells; on fewer samples if the callback stopped the search."""
    with kernels.threads_for(len(problem.depth)):
        if problem.find_cells(pacer.untimed("cells")):
            return problem
    count = int(min(pacer.enough(), problem.sample_count))
    if count < problem.sample_count:
        pacer.samples_left_out = True
    return subsample(problem, count, request.seed)


def _bounded(
    solved: Balanced, request: PlanRequest, options: Options, on_progress: ProgressCallback
) -> Balanced:
    """Return a solution without a lower bound with one added."""
    problem, mean = solved.problem, solved.mean
    near = mean.cost
    if request.method in {"closest", "average"}:
        near = SOLVERS["em"](problem, options).cost
    steps = _QUICK_STEPS if request.bound == "quick" else None
    bound = lower_bound(problem, mean.cost, near, options.gap, options.prices, on_progress, steps)
    return replace(solved, mean=replace(mean, lower_bound=bound.lower_bound, prices=bound.prices))


def _options(rig: Rig, request: PlanRequest) -> Options:
    several = len(rig) * request.shots > 1
    if several and request.method == "k_view" and request.tuples == "grid" and rig.grid is None:
        raise InputError(
            "tuples", "overlap, for a rig without a grid", "'grid'", "or give the rig's grid"
        )
    return Options(
        k=request.k,
        scope=request.scope,
        grid=rig.grid if request.tuples == "grid" else None,
        gap=request.gap,
    )


def _plan(
    subjects: Sequence[Subject],
    problem: Problem,
    fresh: Problem,
    request: PlanRequest,
    solved: Balanced,
    notes: tuple[Note, ...],
    *,
    pacer: Pacer,
    solve_seconds: float,
) -> SolvedPlan:
    solution = solved.solution
    focus = sort_shots(problem, fill_missing_distances(problem, solution.focus_distances))
    costs, best = problem.evaluate(focus)
    quality = estimate_quality(fresh, focus)
    cost, fresh_cost = mean_cost(problem.samples.weights, costs), quality.cost
    of_subjects: tuple[SubjectQuality, ...] = ()
    if len(subjects) > 1:
        of_subjects = judge_subjects(subjects, problem, fresh, focus, costs, solved.multipliers)
    if solved.multipliers.any():
        cost = max(each.cost for each in of_subjects)
        worst = max(of_subjects, key=lambda each: each.fresh_cost)
        fresh_cost = Estimate(worst.fresh_cost, worst.fresh_standard_error)
    bound = solved.mean.lower_bound
    bound = None if bound is None else min(bound, cost)
    converged = solution.converged and not pacer.samples_left_out
    if solved.multipliers.any() and request.method == "optimal" and bound is not None:
        converged = converged and cost - bound <= request.gap * cost
    return SolvedPlan(
        method=request.method,
        cost=cost,
        lower_bound=bound,
        converged=converged,
        samples=problem.sample_count,
        seed=request.seed,
        depth_tolerance=request.depth_tolerance,
        fresh_cost=fresh_cost.value,
        fresh_standard_error=fresh_cost.standard_error,
        fresh_samples=fresh.sample_count,
        surface_area=mean_area(subjects),
        covered_area=quality.covered_area.value,
        in_focus_area=quality.in_focus_area.value,
        in_focus_standard_error=quality.in_focus_area.standard_error,
        solve_seconds=solve_seconds,
        total_seconds=pacer.budget.elapsed(),
        notes=notes,
        cameras=_camera_plans(problem, focus, best),
        subjects=of_subjects,
        problem=problem,
        fresh_problem=fresh,
        prices=solved.mean.prices,
        stop_log=pacer.stop_log,
    )


def _camera_plans(problem: Problem, focus: FloatArray, best: IntArray) -> tuple[CameraFocus, ...]:
    """Return every camera's part of the plan, given each sample's best camera."""
    count = problem.camera_count
    assigned = np.bincount(best[best >= 0], minlength=count)
    in_focus = np.bincount(best[problem.in_focus(focus, best)], minlength=count)
    shots = []
    for c, lens in enumerate(problem.lenses):
        near, far = depth_of_field(focus[c], lens)
        shots.append(
            Shot(
                focus_distance=float(focus[c]),
                near_limit=float(near),
                far_limit=float(far),
                assigned_samples=int(assigned[c]),
                in_focus_samples=int(in_focus[c]),
                device_value=lens.table.value_at(float(focus[c])) if lens.table else None,
                from_sensor=float(distance_from_sensor(focus[c], lens)),
            )
        )
    return tuple(
        _camera_focus(problem, c, tuple(shots[c : c + problem.shots]))
        for c in range(0, count, problem.shots)
    )


def _camera_focus(problem: Problem, first: int, shots: tuple[Shot, ...]) -> CameraFocus:
    """Return a camera's part of the plan; its first shot is camera ``first`` of the problem."""
    main, table = max(shots, key=lambda shot: shot.assigned_samples), problem.lenses[first].table
    assigned = sum(shot.assigned_samples for shot in shots)
    status = CameraStatus.PLANNED if assigned else CameraStatus.UNASSIGNED
    sees = problem.camera_offsets[first] < problem.camera_offsets[first + 1]
    return CameraFocus(
        name=problem.names[first],
        status=status if sees else CameraStatus.SEES_NOTHING,
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
