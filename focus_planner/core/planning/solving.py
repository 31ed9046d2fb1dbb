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
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.ahead import Ahead
from focus_planner.core.arrays import FloatArray
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.bounds.lower_bound import prepare as prepare_bound
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import subsample
from focus_planner.core.planning.holding import Held
from focus_planner.core.planning.kept import KEPT, with_own_problems
from focus_planner.core.planning.making import Given, judged, plan_of
from focus_planner.core.planning.many_subjects import Formulated, formulate_subjects
from focus_planner.core.planning.methods import picture_limit, proves_itself, solver_of
from focus_planner.core.planning.observations import fewer_samples
from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.planning.plan import SolvedPlan, WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.planning.subjects import Scenes, subjects_of
from focus_planner.core.planning.time_budget import TimeBudget
from focus_planner.core.planning.warm_start import warm_options, warm_prices
from focus_planner.core.planning.worst import Balanced, balance_subjects
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.derived import derived, keep_derived, keeps_derived
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import spread_start
from focus_planner.core.problem.spatial_order import SortedProblem, sort_by_place
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Options, k_view
from focus_planner.core.validation import InputError

# Price steps of a quick bound: on bodies they bring it within a quarter of a percent, in about the
# time of a 2-view plan.
_QUICK_STEPS = 60
# From so many pairs on, sorting samples takes less time than it saves.
_LARGE = 200_000


def solve(
    scenes: Scenes,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    on_progress: ProgressCallback = never_stop,
    warm_start: WarmStart | None = None,
    stop_log: StopLog | None = None,
    *,
    min_change: float = 0.0,
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
    solving_began = clock()
    problem = _with_cells(formulated.problem, request, pacer)
    cells_seconds = clock() - solving_began
    formulated, small = replace(formulated, problem=problem), formulated.small
    with kernels.threads_for(len(problem.depth)):
        placed = _placed(problem, request)
    find_beside = partial(_Beside.of, formulated, placed, request, options, warm_start)
    with Ahead(find_beside, when=small) as beside:
        options = replace(options, start=spread_start(problem))
        if warm_start is not None:
            limited = picture_limit(problem, request) is not None
            options = warm_options(options, warm_start, problem, limited=limited)
        proven = proves_itself(problem, request)
        bounded = not proven and (request.bound != "none" or request.method == "optimal")
        pacer.start_solver(cells_seconds, request.shots, bound=bounded)
        with kernels.threads_for(len(problem.depth)):
            if request.method == "optimal" or request.worst:
                options = replace(options, prices=_sorted(beside.result().prices, placed))
            solved = _solved(placed.problem, request, options, pacer)
        solve_seconds = clock() - solving_began
        given = Given(subjects, rig, request, Held(warm_start, min_change))
        with Ahead(partial(judged, given, formulated, solved), when=small) as judging:
            # A caller who stopped the plan is waiting for it, not for a bound.
            if bounded and not pacer.callback_stopped:
                pacer.start_bound()
                options = replace(options, prices=_sorted(beside.result().prices, placed))
                with kernels.threads_for(len(problem.depth)):
                    solved = _bounded(solved, request, options, pacer)
            solved = _restored(solved, placed)
            worth = judging.result()
        notes = beside.result().notes
    if pacer.samples_left_out:
        stopped = pacer.callback_stopped
        notes = (*notes, fewer_samples(request, problem, formulated.fresh, stopped=stopped))
    plan = plan_of(given, formulated, solved, worth, notes, pacer, solve_seconds)
    KEPT.measure(formulated.problem, formulated.fresh)
    return with_own_problems(plan)


@dataclass(frozen=True, eq=False)
class _Beside:
    """What a plan needs besides its solution, and can be found meanwhile.

    Attributes
    ----------
    notes : tuple of Note
    prices : (N,) array or None
        To start a bound from.
    """

    notes: tuple[Note, ...]
    prices: FloatArray | None

    @classmethod
    def of(
        cls,
        formulated: Formulated,
        placed: SortedProblem,
        request: PlanRequest,
        options: Options,
        warm_start: WarmStart | None,
    ) -> _Beside:
        """Find it, and what solving will ask for, if that is kept."""
        problem = formulated.problem
        is_usual = keeps_derived(placed.problem) and picture_limit(problem, request) is None
        if is_usual and request.method == "k_view":
            k_view.prepare(placed.problem, options)
        needed = request.bound != "none" or request.method == "optimal" or request.worst
        prices = warm_prices(warm_start, problem) if needed else None
        if is_usual and request.bound != "none":
            prepare_bound(placed.problem)
        return cls(formulated.observe(), prices)


def _placed(problem: Problem, request: PlanRequest) -> SortedProblem:
    """Return a large problem sorted by place, another as it is.

    Not where a plan would change: proofs and multipliers of subjects depend on sums of floats.
    """
    exact = request.method != "optimal" and not request.worst
    if exact and len(problem.depth) >= _LARGE:
        return derived(problem, "sorted by place", partial(_sort_and_keep, problem))
    return SortedProblem(problem, None)


def _sort_and_keep(problem: Problem) -> SortedProblem:
    """Sort a problem by place; what is derived of it is kept if the original's is."""
    found = sort_by_place(problem)
    if keeps_derived(problem):
        keep_derived(found.problem)
    return found


def _sorted(prices: FloatArray | None, placed: SortedProblem) -> FloatArray | None:
    """Return prices in the order of the samples as they are solved for."""
    return None if prices is None else placed.sorted(prices)


def _restored(solved: Balanced, placed: SortedProblem) -> Balanced:
    """Return what was found with prices in the order of the samples that were drawn."""
    prices = solved.mean.prices
    if prices is None:
        return solved
    return replace(solved, mean=replace(solved.mean, prices=placed.restored(prices)))


def _solved(problem: Problem, request: PlanRequest, options: Options, pacer: Pacer) -> Balanced:
    """Return what the method finds, for the mean or the worst of the problem's subjects."""
    count = len(problem.subjects)
    if request.worst and count > 1:
        return balance_subjects(problem, solver_of(problem, request), options, pacer)
    solution = solver_of(problem, request)(problem, options, pacer)
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
        near = solver_of(problem, replace(request, method="em"))(problem, options).cost
    is_quick = request.bound == "quick" and request.method != "optimal"
    bound = lower_bound(
        problem,
        mean.cost,
        near,
        options.gap,
        options.prices,
        on_progress,
        _QUICK_STEPS if is_quick else None,
        picture_limit(problem, request),
    )
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
