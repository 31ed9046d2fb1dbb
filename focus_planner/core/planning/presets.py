# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Several plans for many subjects, and which subject takes which.

Assignment and plans in turn, as in k-means: each plan is for the subjects that take it, and each
subject takes the plan that serves it best. Neither step raises the mean of all subjects' costs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.planning.many_subjects import formulate_subjects, judge_subjects
from focus_planner.core.planning.methods import solver_of
from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.planning.plan import SolvedPlan, WarmStart
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.precompile import precompile, works_for
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.subjects import Scenes, Subject, subjects_of
from focus_planner.core.planning.time_budget import TimeBudget
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.joined import costs_of_subjects, join_problems, separated
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import spread_start
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Options
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError, check_whole

# Assignments that are tried at most; on bodies, three or four settle.
_ROUNDS = 8
# Of the time budget, for the search; what is left is shared by the plans.
_SEARCH_SHARE = 0.5

#: Makes a plan for the subjects of a preset: its number from 1, they, the request and the start.
MakePlan = Callable[[int, Sequence[Subject], PlanRequest, WarmStart], SolvedPlan]


@dataclass(frozen=True, eq=False)
class Presets:
    """Several plans, and which subject takes which.

    Attributes
    ----------
    plans : tuple of SolvedPlan
        One per preset, for the subjects that take it.
    subjects : tuple of str
        All of them, in the order given.
    taken : tuple of int
        The preset that each takes, from 1.
    cost : float
        The mean of their costs on the samples planned on, by weight.
    """

    plans: tuple[SolvedPlan, ...]
    subjects: tuple[str, ...]
    taken: tuple[int, ...]
    cost: float

    __repr__ = brief_repr


def plan_presets(
    scenes: Scenes,
    rig: Rig,
    presets: int,
    request: PlanRequest | None = None,
    model: CostModel | None = None,
    on_progress: ProgressCallback = never_stop,
    *,
    limits: ResourceLimits | None = None,
    make_plan: MakePlan | None = None,
) -> Presets:
    """Return several plans for many subjects, each for those that it serves best.

    The search begins with the subjects whose own plans serve all best. Each preset's plan is the
    better of those found from there and from one plan for all, so that presets are never worse than
    that. The search is bounded, and repeats bit for bit unless the time budget, which is for all
    plans together, or the callback ends it early.

    Parameters
    ----------
    scenes, rig, request, model, on_progress, limits
        As for :func:`~focus_planner.core.planning.plan_focus.plan_focus`.
    presets : int
        How many plans; at most as many as subjects.
    make_plan : callable, optional
        Makes the plan of a preset; by default ``plan_focus``.

    Raises
    ------
    InputError
        As :func:`~focus_planner.core.planning.plan_focus.plan_focus`, or if there are more presets
        than subjects, or the request is for the worst subject.
    """
    request = request or PlanRequest()
    subjects = subjects_of(scenes)
    if check_whole("presets", presets, 1) > len(subjects):
        raise InputError("presets", f"at most {len(subjects)}, one per subject", str(presets))
    if request.worst:
        raise InputError("presets", "plans for the mean of those that take them", "worst")
    clouds = any(isinstance(each.scene.surface, PointCloud) for each in subjects)
    precompile(works_for(request, clouds=clouds), on_progress)
    began = time.perf_counter()
    search = _Search(subjects, rig, request, model, on_progress, limits)
    taken, starts = search.run(presets)
    left = request.time_budget - (time.perf_counter() - began)
    each = replace(request, time_budget=max(left / len(starts), 1e-3))

    def plan(_: int, taking: Sequence[Subject], asked: PlanRequest, start: WarmStart) -> SolvedPlan:
        return plan_focus(taking, rig, asked, model, on_progress, start, limits=limits)

    plans = []
    for number, start in enumerate(starts):
        taking = [subjects[s] for s in np.flatnonzero(taken == number)]
        made = (make_plan or plan)(number + 1, taking, each, start)
        plans.append(_numbered(made, taking, number + 1))
    weights = np.array([subject.weight for subject in subjects])
    totals = [weights[taken == number].sum() for number in range(len(plans))]
    return Presets(
        plans=tuple(plans),
        subjects=tuple(subject.name for subject in subjects),
        taken=tuple((taken + 1).tolist()),
        cost=float(np.dot(totals, [made.cost for made in plans]) / weights.sum()),
    )


def _numbered(plan: SolvedPlan, taking: Sequence[Subject], preset: int) -> SolvedPlan:
    """Return a preset's plan, which tells who takes it even if that is one subject alone."""
    subjects = plan.subjects
    if not subjects:
        costs, _ = plan.problem.evaluate(plan.focus_distances)
        nothing = np.zeros(len(taking))
        subjects = judge_subjects(
            taking, plan.problem, plan.fresh_problem, plan.focus_distances, costs, nothing
        )
    return replace(plan, subjects=tuple(replace(each, preset=preset) for each in subjects))


class _Search:
    """Finds which subject takes which of several plans."""

    def __init__(
        self,
        subjects: Sequence[Subject],
        rig: Rig,
        request: PlanRequest,
        model: CostModel | None,
        on_progress: ProgressCallback,
        limits: ResourceLimits | None,
    ) -> None:
        budget = TimeBudget(_SEARCH_SHARE * request.time_budget)
        self._pacer = Pacer(budget, on_progress)
        self._weights = np.array([subject.weight for subject in subjects])
        self._request = request
        # A search needs no fresh samples but as many as an estimate takes.
        asked = replace(request, fresh_samples=2) if request.samples else request
        self._problem = formulate_subjects(subjects, rig, asked, model, self._pacer, limits).problem
        self._parts = separated(self._problem)
        self._options = Options(
            k=request.k,
            scope=request.scope,
            grid=rig.grid if request.tuples == "grid" else None,
            gap=request.gap,
        )

    def run(self, presets: int) -> tuple[IntArray, list[WarmStart]]:
        """Return the preset of each subject, from 0, and a start for the plan of each preset."""
        everyone = np.arange(len(self._parts))
        one = self._solved(everyone, None)
        if presets == 1:
            return np.zeros(len(everyone), dtype=np.int32), [self._start(one)]
        own = [self._solved(everyone[s : s + 1], one) for s in everyone]
        costs_of_own = np.stack([self._costs(each) for each in own])
        chosen = self._centres(costs_of_own, presets)
        focus, costs = [own[s] for s in chosen], costs_of_own[chosen]
        costs_of_one, starts = self._costs(one), [one]
        taken = self._assigned(costs, focus)
        for _ in range(_ROUNDS):
            if self._pacer.stopped:
                break
            for number in range(presets):
                members = np.flatnonzero(taken == number)
                for start in (focus[number], *starts):
                    better = self._solved(members, start)
                    served = self._costs(better)
                    if self._total(served, members) < self._total(costs[number], members):
                        focus[number], costs[number] = better, served
            starts = []
            again = self._assigned(costs, focus)
            if np.array_equal(again, taken):
                break
            taken = again
        if self._total(costs.min(axis=0), everyone) > self._total(costs_of_one, everyone):
            # There was no time for as good a plan as one for all.
            focus = [one] * presets
            taken = self._assigned(np.stack([costs_of_one] * presets), focus)
        return taken, [self._start(each) for each in focus]

    def _centres(self, costs: FloatArray, presets: int) -> list[int]:
        """Return the subjects whose own plans serve all best together, as far as exchanges find.

        Parameters
        ----------
        costs : (S, S) array
            What each one's own plan costs each.
        presets : int
        """
        everyone = np.arange(len(costs))

        def total(centres: list[int]) -> float:
            return self._total(costs[centres].min(axis=0), everyone)

        centres: list[int] = []
        for _ in range(presets):
            others = [s for s in everyone.tolist() if s not in centres]
            centres.append(min(others, key=lambda s: total([*centres, s])))
        for _ in range(_ROUNDS):
            before = total(centres)
            for place in range(presets):
                rest = centres[:place] + centres[place + 1 :]
                others = [s for s in everyone.tolist() if s not in rest]
                centres[place] = min(others, key=lambda s: total([*rest, s]))
            if total(centres) >= before:
                break
        return centres

    def _assigned(self, costs: FloatArray, focus: list[FloatArray]) -> IntArray:
        """Return what serves each subject best.

        A preset that nobody takes is made what serves one of a larger group, which takes it.
        """
        taken = costs.argmin(axis=0).astype(np.int32)
        for number in range(len(costs)):
            if number not in taken:
                served = self._weights * costs.min(axis=0)
                served[np.bincount(taken, minlength=len(costs))[taken] < 2] = -np.inf
                s = int(np.argmax(served))
                focus[number], costs[number] = focus[taken[s]], costs[taken[s]]
                taken[s] = number
        return taken

    def _solved(self, members: NDArray[np.integer], start: FloatArray | None) -> FloatArray:
        """Return distances for some subjects."""
        parts = [self._parts[s] for s in members]
        problem: Problem = join_problems(parts, self._weights[members].tolist())
        options = self._options
        start = spread_start(problem) if start is None else start
        with kernels.threads_for(len(problem.depth)):
            solver = solver_of(problem, self._request)
            solution = solver(problem, replace(options, start=start), self._pacer)
        return fill_missing_distances(problem, solution.focus_distances)

    def _costs(self, focus: FloatArray) -> FloatArray:
        """Return (S,) what distances cost each subject."""
        return costs_of_subjects(self._problem, self._problem.evaluate(focus)[0])

    def _total(self, costs: FloatArray, members: NDArray[np.integer]) -> float:
        return float(self._weights[members] @ costs[members])

    def _start(self, focus: FloatArray) -> WarmStart:
        problem = self._problem
        return WarmStart(problem.names, focus, problem.samples.points, None)
