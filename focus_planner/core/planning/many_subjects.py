# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From the scenes of one or several subjects to one discrete problem, and its parts' quality."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from focus_planner.core.ahead import Ahead
from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import choose_samples, formulate_problem
from focus_planner.core.planning.kept import (
    KEPT,
    KeptProblem,
    joined_key,
    notes_key,
    problem_key,
)
from focus_planner.core.planning.observations import observe
from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.planning.time_budget import FRESH_SHARE, SAMPLES_SHARE
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.derived import keeps_derived
from focus_planner.core.problem.joined import costs_of_subjects, join_problems, separated
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene

# Of the memory that a plan may take, what is kept of others when it begins.
_KEPT_SHARE = 0.125
# Samples times cameras below which kernels take one core.
_SMALL = 3_000_000


@dataclass(frozen=True, eq=False)
class Formulated:
    """What there is to plan on.

    Attributes
    ----------
    problem, fresh : Problem
        On the samples to plan on, and on fresh ones; of several subjects, joined.
    observe : callable
        Returns notes on them.
    small : bool
        Whether kernels take one core for them.
    """

    problem: Problem
    fresh: Problem
    observe: Callable[[], tuple[Note, ...]]
    small: bool

    __repr__ = brief_repr


def formulate_subjects(
    subjects: Sequence[Subject],
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None,
    pacer: Pacer,
    limits: ResourceLimits | None,
) -> Formulated:
    """Return the problems of a request, each subject alone in front of the rig.

    Each is given its part of the time for rays, so that none is left out for another.

    Raises
    ------
    InputError
        As :func:`plan_focus`; of several subjects it names the one that it is about.
    """
    limits = limits or ResourceLimits()
    requests = []
    for each in subjects:
        with _told(subjects, each):
            requests.append(choose_samples(each.scene, rig, request, model, pacer))
    counts = [
        asked.samples or len(each.scene.sample(0, asked.seed))
        for each, asked in zip(subjects, requests, strict=True)
    ]
    of_each = math.ceil(sum(counts) / len(counts))
    limits.check_size(requests[0], of_each, len(rig), len(subjects))
    KEPT.trim(limits.max_memory * _KEPT_SHARE)
    rays = _Rays(subjects, rig, requests, model, pacer)
    small = sum(counts) * len(rig) < _SMALL
    begins = small and not pacer.budget.limited  # of which each stage has its share
    with Ahead(rays.formulate_ahead, when=begins and not rays.are_kept) as ahead:
        fresh_parts = rays.cast("fresh", 0.0, FRESH_SHARE)
        fresh = _joined(subjects, fresh_parts)
        needed = limits.check_memory(requests[0], fresh, sum(counts))
        ahead.wait()
        KEPT.trim(limits.max_memory - needed)
        parts = rays.cast("visibility", FRESH_SHARE, SAMPLES_SHARE)
    problem = _joined(subjects, parts)
    limits.check_memory(requests[0], problem, problem.sample_count)
    observe_them: Callable[[], tuple[Note, ...]] = tuple
    if not pacer.callback_stopped:
        observe_them = partial(_observed, subjects, rig, request, parts, fresh_parts)
    return Formulated(problem, fresh, observe_them, small=small)


def judge_subjects(
    subjects: Sequence[Subject],
    problem: Problem,
    fresh: Problem,
    focus: FloatArray,
    costs: FloatArray,
    multipliers: FloatArray,
) -> tuple[SubjectQuality, ...]:
    """Return what focus distances are worth for each subject.

    Parameters
    ----------
    subjects : sequence of Subject
    problem, fresh : Problem
        On the samples planned on, and on fresh ones.
    focus : (C,) array
        Metres.
    costs : (N,) array
        Of the samples of ``problem``.
    multipliers : (S,) array
        Those that the bound of the worst cost was sought with; 0 for the mean.
    """
    judged = []
    of_each = zip(subjects, separated(fresh), costs_of_subjects(problem, costs), strict=True)
    shares = _shares(subjects).tolist()
    for s, (subject, part, cost) in enumerate(of_each):
        quality = estimate_quality(part, focus)
        # The joined problem's areas are those of a subject on average.
        covered = quality.covered_area.scaled(1 / shares[s])
        in_focus = quality.in_focus_area.scaled(1 / shares[s])
        judged.append(
            SubjectQuality(
                surface=subject.name,
                weight=subject.weight,
                multiplier=float(multipliers[s]),
                samples=problem.subjects[s].stop - problem.subjects[s].start,
                cost=float(cost),
                fresh_samples=part.sample_count,
                fresh_cost=quality.cost.value,
                fresh_standard_error=quality.cost.standard_error,
                surface_area=subject.scene.area,
                covered_area=covered.value,
                covered_standard_error=covered.standard_error,
                in_focus_area=in_focus.value,
                in_focus_standard_error=in_focus.standard_error,
            )
        )
    return tuple(judged)


def mean_area(subjects: Sequence[Subject]) -> float:
    """Return the surface of a subject on average, by weight, square metres."""
    if len(subjects) == 1:
        return subjects[0].scene.area
    return float(_shares(subjects) @ [subject.scene.area for subject in subjects])


@dataclass(frozen=True, eq=False)
class _Rays:
    """What casts the rays of all subjects, one after the other.

    Attributes
    ----------
    begun : dict
        The problem of each scene that was formulated ahead.
    """

    subjects: Sequence[Subject]
    rig: Rig
    requests: Sequence[PlanRequest]
    model: CostModel | None
    pacer: Pacer
    begun: dict[Scene, KeptProblem] = field(default_factory=dict)

    def cast(self, stage: str, begin: float, end: float) -> list[Problem]:
        """Return the problem of each subject, on fresh samples in the stage of these.

        Parameters
        ----------
        stage : {"fresh", "visibility"}
        begin, end : float
            Shares of the time budget, by which the stage begins, and has to end.
        """
        problems = []
        for s, (subject, request) in enumerate(zip(self.subjects, self.requests, strict=True)):
            left = (len(self.subjects) - 1 - s) / len(self.subjects)
            keep_going = None
            # Without questions in between, rays are cast all at once.
            if self.pacer.may_stop:
                share = (end - (end - begin) * left) / request.shots
                keep_going = self._part(self.pacer.within(stage, share), s)
            problems.append(self._formulated(subject, request, stage == "fresh", keep_going))
        return problems

    @property
    def are_kept(self) -> bool:
        """Whether the problem of each subject is known."""
        return all(
            KEPT.find([each.scene], problem_key(self.rig, asked, self.model, fresh=False))
            for each, asked in zip(self.subjects, self.requests, strict=True)
        )

    def formulate_ahead(self) -> None:
        """Formulate the problem of each subject to plan on; the questions are asked later."""
        for subject, request in zip(self.subjects, self.requests, strict=True):
            asking = _Asking(lambda _: True) if self.pacer.may_stop else None
            problem = self._cast(subject, request, False, asking)
            shares = None if asking is None else tuple(asking.shares)
            self.begun[subject.scene] = KeptProblem(problem, shares)

    def _formulated(
        self,
        subject: Subject,
        request: PlanRequest,
        fresh: bool,
        keep_going: Callable[[float], bool] | None,
    ) -> Problem:
        """Return the problem that is kept, or formulate it.

        The same is asked in both cases, so that plans that are stopped can be made again whatever
        is kept.
        """
        key = problem_key(self.rig, request, self.model, fresh=fresh)
        begun = None if fresh else self.begun.pop(subject.scene, None)
        kept: KeptProblem | None = begun or KEPT.find([subject.scene], key)
        asking = None if keep_going is None else _Asking(keep_going)
        if kept and (asking is None or (kept.shares is not None and all(map(asking, kept.shares)))):
            if begun:
                KEPT.keep([subject.scene], key, begun)
            return kept.problem
        if asking:
            asking.begin_again()
        problem = self._cast(subject, request, fresh, asking)
        if asking is None or not asking.stopped:
            shares = None if asking is None else tuple(asking.shares)
            KEPT.keep([subject.scene], key, KeptProblem(problem, shares))
        return problem

    def _cast(
        self, subject: Subject, request: PlanRequest, fresh: bool, asking: _Asking | None
    ) -> Problem:
        with _told(self.subjects, subject):
            return formulate_problem(
                subject.scene,
                self.rig,
                request,
                self.model,
                fresh=fresh,
                keep_going=asking,
                enough=self.pacer.enough,
            )

    def _part(self, keep_going: Callable[[float], bool], s: int) -> Callable[[float], bool]:
        """Return the question with the share that is done of all subjects."""
        count = len(self.subjects)
        return keep_going if count == 1 else lambda done: keep_going((s + done) / count)


class _Asking:
    """Asks whether to go on, and gives answers again to who begins again."""

    def __init__(self, keep_going: Callable[[float], bool]) -> None:
        self._keep_going = keep_going
        self._given: list[bool] = []
        self.shares: list[float] = []
        self.stopped = False

    def begin_again(self) -> None:
        """Have the questions so far answered as before."""
        self.shares = []

    def __call__(self, share: float) -> bool:
        """Return whether to go on, now that this share is done."""
        if len(self.shares) == len(self._given):
            self._given.append(self._keep_going(share))
        self.shares.append(share)
        more = self._given[len(self.shares) - 1]
        self.stopped = not more
        return more


def _told(subjects: Sequence[Subject], subject: Subject) -> AbstractContextManager[None]:
    """Have errors name the subject, if there are several."""
    return subject.told() if len(subjects) > 1 else nullcontext()


def _joined(subjects: Sequence[Subject], parts: Sequence[Problem]) -> Problem:
    if len(parts) == 1:
        return parts[0]
    scenes, key = [subject.scene for subject in subjects], joined_key(subjects, parts)
    kept: KeptProblem | None = KEPT.find(scenes, key)
    if kept:
        return kept.problem
    joined = join_problems(parts, [subject.weight for subject in subjects])
    if all(map(keeps_derived, parts)):
        KEPT.keep(scenes, key, KeptProblem(joined, None))
    return joined


def _observed(
    subjects: Sequence[Subject],
    rig: Rig,
    request: PlanRequest,
    parts: Sequence[Problem],
    fresh: Sequence[Problem],
) -> tuple[Note, ...]:
    """Return the notes on these problems; those that are kept, if any are."""
    scenes, key = (
        [each.scene for each in subjects],
        notes_key(rig, request, subjects, [*parts, *fresh]),
    )
    kept: tuple[Note, ...] | None = KEPT.find(scenes, key)
    if kept is None:
        kept = observe(subjects, rig, request, parts, fresh)
        if all(map(keeps_derived, [*parts, *fresh])):
            KEPT.keep(scenes, key, kept)
    return kept


def _shares(subjects: Sequence[Subject]) -> FloatArray:
    weights = np.array([subject.weight for subject in subjects])
    shares: FloatArray = weights / weights.sum()
    return shares
