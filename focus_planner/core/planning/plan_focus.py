"""From a scene, a rig and a request to a plan: the one path that every user takes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.planning.deadline import FRESH_SHARE, SAMPLES_SHARE, Deadline
from focus_planner.core.planning.formulation import (
    choose_samples,
    formulate_fresh_problem,
    formulate_problem,
    subsample,
)
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, Shot, SolvedPlan, WarmStart
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.warm_start import warm_options
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem, mean_cost
from focus_planner.core.problem.shots import sort_shots, spread_start
from focus_planner.core.rig.optics import depth_of_field
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import SOLVERS, Options, ProgressCallback, Solution, never_stop
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError

# A quick bound's price steps: on bodies it is then within a quarter of a percent, in about the time
# that a 2-view plan takes.
_QUICK_STEPS = 60


def plan_focus(
    scene: Scene,
    rig: Rig,
    request: PlanRequest | None = None,
    model: CostModel | None = None,
    on_progress: ProgressCallback = never_stop,
    warm_start: WarmStart | None = None,
    answers: Sequence[int] | None = None,
) -> SolvedPlan:
    """Sample the surface, find what each camera sees, and solve for the focus distances.

    The same arguments give the same plan, bit for bit, but for its seconds, unless a time budget
    or the watch ends it.

    Parameters
    ----------
    scene : Scene
        Of the surface, in the rig's frame.
    rig : Rig
    request : PlanRequest, optional
    model : CostModel, optional
        The paper's constants by default.
    on_progress : callable, optional
        Told of every step: of ray casting (stages "fresh" and "visibility", of no cost yet), of
        the solver when it is to begin ("solving") and of its steps, of the bound ("prices");
        answers whether to go on. If not, the plan is the best so far.
    warm_start : WarmStart, optional
        Of a plan for a similar surface, rig and request, to start from; the plan depends on it
        then.
    answers : sequence of int, optional
        Those of a plan that a time budget or a watch ended, to make it again, bit for bit.

    Raises
    ------
    InputError
        If the request does not fit the rig or the surface, no camera sees the surface, or the
        standard error would take too many samples; the message says what was suspected.
    """
    request = request or PlanRequest()
    options = _options(rig, request)
    deadline = Deadline(request.time_budget, on_progress, answers)
    request = choose_samples(scene, rig, request, model, deadline)
    asked = on_progress is not never_stop or request.time_budget < np.inf or answers is not None
    fresh_part, part = (
        deadline.within(stage, share / request.shots) if asked else None
        for stage, share in (("fresh", FRESH_SHARE), ("visibility", SAMPLES_SHARE))
    )
    enough = deadline.enough
    fresh = formulate_fresh_problem(
        scene, rig, request, model, keep_going=fresh_part, enough=enough
    )
    problem = formulate_problem(scene, rig, request, model, keep_going=part, enough=enough)
    formulated = time.perf_counter()
    problem = _with_cells(problem, request, deadline if asked else None)
    options = replace(options, start=spread_start(problem))
    if warm_start is not None:
        options = warm_options(options, warm_start, problem)
    bounded = request.bound != "none" and request.method != "optimal"
    deadline.allow_for(time.perf_counter() - formulated, bounded, request.shots)
    with kernels.threads_for(len(problem.depth)):
        solution = SOLVERS[request.method](problem, options, deadline)
        solved = time.perf_counter()
        # One who wants no more waits for no bound, unless it is there already.
        if bounded and not deadline.told_no:
            deadline.bound_now()
            solution = _bounded(problem, solution, request, options, deadline)
    return _plan(
        scene,
        problem,
        fresh,
        request,
        solution,
        deadline=deadline,
        solve_seconds=solved - formulated,
    )


def _with_cells(problem: Problem, request: PlanRequest, deadline: Deadline | None) -> Problem:
    """Return the problem with its cells; of fewer samples, if they are not to be waited for."""
    with kernels.threads_for(len(problem.depth)):
        if deadline is None:
            _ = problem.cells
        elif not problem.find_cells(partial(deadline.asked, "cells")):
            few = int(min(deadline.enough(), problem.sample_count))
            deadline.shortened = deadline.shortened or few < problem.sample_count
            return subsample(problem, few, request.seed)
    return problem


def _bounded(
    problem: Problem,
    solution: Solution,
    request: PlanRequest,
    options: Options,
    on_progress: ProgressCallback,
) -> Solution:
    """Return a solution that comes without a lower bound, with one."""
    near = solution.cost
    if request.method in {"closest", "average"}:
        near = SOLVERS["em"](problem, options).cost
    steps = _QUICK_STEPS if request.bound == "quick" else None
    bound = lower_bound(
        problem, solution.cost, near, options.gap, options.prices, on_progress, steps
    )
    return replace(solution, lower_bound=bound.lower_bound, prices=bound.prices)


def _options(rig: Rig, request: PlanRequest) -> Options:
    if request.method == "k_view" and request.tuples == "grid" and rig.grid is None:
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
    scene: Scene,
    problem: Problem,
    fresh: Problem,
    request: PlanRequest,
    solution: Solution,
    *,
    deadline: Deadline,
    solve_seconds: float,
) -> SolvedPlan:
    focus = sort_shots(problem, fill_missing_distances(problem, solution.focus_distances))
    costs, best = problem.evaluate(focus)
    count = problem.camera_count
    assigned = np.bincount(best[best >= 0], minlength=count)
    in_focus = np.bincount(best[problem.in_focus(focus, best)], minlength=count)
    shots = []
    for c, lens in enumerate(problem.lenses):
        near, far = depth_of_field(focus[c], lens)
        device_value = lens.table.value_at(float(focus[c])) if lens.table else None
        counts = int(assigned[c]), int(in_focus[c])
        shots.append(Shot(float(focus[c]), float(near), float(far), *counts, device_value))
    cameras = [
        _camera_focus(problem, c, tuple(shots[c : c + problem.shots]))
        for c in range(0, count, problem.shots)
    ]
    quality = estimate_quality(fresh, focus)
    cost = mean_cost(problem.samples.weights, costs)
    bound = solution.lower_bound
    return SolvedPlan(
        method=request.method,
        cost=cost,
        lower_bound=None if bound is None else min(bound, cost),
        converged=solution.converged and not deadline.shortened,
        samples=problem.sample_count,
        seed=request.seed,
        depth_tolerance=request.depth_tolerance,
        fresh_cost=quality.cost.value,
        fresh_standard_error=quality.cost.standard_error,
        fresh_samples=fresh.sample_count,
        surface_area=scene.area,
        covered_area=quality.covered_area.value,
        in_focus_area=quality.in_focus_area.value,
        in_focus_standard_error=quality.in_focus_area.standard_error,
        solve_seconds=solve_seconds,
        total_seconds=time.perf_counter() - deadline.started,
        cameras=tuple(cameras),
        problem=problem,
        fresh_problem=fresh,
        prices=solution.prices,
        answers=deadline.answers,
    )


def _camera_focus(problem: Problem, first: int, shots: tuple[Shot, ...]) -> CameraFocus:
    """Return what the shots of one camera, whose first is ``first`` in the problem, amount to."""
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
    )
