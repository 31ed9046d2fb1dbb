# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Taped plans: one for several subjects, or a few to choose from, judged on subjects not seen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.presets import plan_presets
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subjects import Subject as PlannedFor
from focus_planner.core.problem.joined import join_problems
from focus_planner.core.problem.problem import Problem
from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    Task,
    WriteUp,
)
from focus_planner.evaluation.measuring.methods import CLOSEST, EM, TWO_VIEW_ALL
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import percent, table
from focus_planner.evaluation.writing.means import mean_row, mean_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

# Subjects of a task: judged at most, and planned on.
_JUDGED = 4
_PLANNED_ON = (1, 2, 4, 8, 12)
_FOLDS = 4
_PRESETS = (2, 3)
_AUTOFOCUS, _TAPED, _BEST_OF, _OWN = "autofocus", "one plan", "best of", "a plan of its own"


@dataclass(frozen=True, eq=False)
class _Unseen:
    """A subject that plans are judged on.

    Attributes
    ----------
    name : str
    problem, fresh : Problem
        To choose a plan on, and to judge it on.
    """

    name: str
    problem: Problem
    fresh: Problem

    @classmethod
    def of(cls, subject: Subject, conditions: Conditions) -> _Unseen:
        """Return a subject with its problems."""
        return cls(subject.name, subject.problem(conditions), subject.fresh_problem(conditions))

    def row(self, plan: str, planned_on: int, plans: Sequence[FloatArray]) -> Row:
        """Return a row: what the best of some plans, which the subject takes, is worth for it."""
        quality = judge(self.fresh, min(plans, key=self.problem.cost))
        return {
            "plan": plan,
            "planned_on": planned_on,
            "unseen": self.name,
            "fresh_cost": quality.cost.value,
            "in_focus": quality.in_focus_area.value / float(self.fresh.samples.areas.sum()),
        }


def _tasks(names: Sequence[str], conditions: Conditions) -> Sequence[Task]:
    """Return the folds: each has some subjects to judge on, and plans are made for others.

    No subject is judged in two folds.
    """
    if len(names) < 2:
        raise InputError(
            "subjects",
            "at least 2: plans are made for some and judged on others",
            str(len(names)),
            "give more, or leave out the experiment 'taped'",
        )
    judged = min(_JUDGED, max(1, len(names) // 3))
    folds = min(_FOLDS, len(names) // judged)
    drawn = np.random.default_rng(conditions.seed).permutation(len(names))
    tasks = []
    for fold in range(folds):
        order = [names[s] for s in np.roll(drawn, -fold * judged)]
        planned_on = order[judged:][: _PLANNED_ON[-1]]
        subjects = (*order[:judged], *planned_on)
        tasks.append(Task(subjects, {"fold": fold, "judged": judged}))
    return tasks


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    _check_rigs(subjects)
    count = int(setting["judged"])
    others = subjects[count:]
    unseen = [_Unseen.of(each, conditions) for each in subjects[:count]]
    rows: list[Row] = []

    def judge_all(plan: str, planned_on: int, plans: Sequence[FloatArray]) -> None:
        rows.extend(each.row(plan, planned_on, plans) for each in unseen)

    for each in unseen:
        for plan, method in ((_AUTOFOCUS, CLOSEST), (_OWN, TWO_VIEW_ALL)):
            focus = method.solve(each.problem, subjects[0].rig).focus_distances
            rows.append(each.row(plan, 0, [focus]))
    problems = [each.problem(conditions) for each in others]
    for number in _sizes(len(others)):
        joined = join_problems(problems[:number], [1.0] * number)
        focus = TWO_VIEW_ALL.solve(joined, others[0].rig).focus_distances
        judge_all(_TAPED, number, [focus])
    for presets in _PRESETS:
        if presets < len(others):
            judge_all(f"{_BEST_OF} {presets}", len(others), _presets(others, presets, conditions))
    return Measured(rows)


def _check_rigs(subjects: Sequence[Subject]) -> None:
    for each in subjects:
        if each.rig != subjects[0].rig:
            raise InputError(
                "rigs",
                "the same one for all subjects: one plan is made for several",
                f"{each.name} before another than {subjects[0].name}",
                "evaluate subjects of each rig by themselves",
            )


def _sizes(most: int) -> Iterator[int]:
    """Yield of how many subjects plans are made."""
    return (number for number in _PLANNED_ON if number <= most)


def _presets(subjects: Sequence[Subject], presets: int, conditions: Conditions) -> list[FloatArray]:
    """Return plans that subjects choose from, as :func:`plan_presets` finds them."""
    request = PlanRequest(
        method=TWO_VIEW_ALL.solver,
        samples=conditions.samples,
        seed=conditions.seed,
        fresh_samples=2,  # plans are judged here
        bound="none",
    )
    scenes = [PlannedFor(each.scene, each.name) for each in subjects]
    plans = plan_presets(scenes, subjects[0].rig, presets, request).plans
    return [plan.focus_distances for plan in plans]


def _write_up(results: Results) -> WriteUp:
    # All rows of a plan are of the same subjects, except where a fold had too few to plan on.
    mean = results.rows.groupby(["plan", "planned_on"])[["in_focus", "fresh_cost"]].mean()
    text = _paragraph(results, mean) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean))


def _paragraph(results: Results, mean: DataFrame) -> str:
    unseen = results.rows["unseen"].nunique()
    folds = results.rows["fold"].nunique()
    taped = mean_rows(mean, _TAPED)
    most = int(taped.index.max())
    own, autofocus = (mean_row(mean, plan, 0) for plan in (_OWN, _AUTOFOCUS))
    return (
        "Where cameras cannot be focused from a computer, a plan is taped to them once and serves"
        f" all who come. Plans were made by 2-view for up to {_subjects(most)} together, on"
        f" {results.conditions.samples:,} samples of each, and judged on {_subjects(unseen)} that"
        f" they were not made for ({folds} {'fold' if folds == 1 else 'folds'},"
        f" {results.conditions.judged:,} samples of each). One plan made for {_subjects(most)}"
        f" holds {percent(taped.in_focus[most])} of an unseen subject in focus, autofocus on each"
        f" {percent(autofocus.in_focus)}, a plan of its own {percent(own.in_focus)}; costs are"
        f" {taped.fresh_cost[most]:.1f}, {autofocus.fresh_cost:.1f} and {own.fresh_cost:.1f}."
        f"{_from_one(mean, most)}{_of_presets(mean)}\n"
    )


def _subjects(count: int) -> str:
    return "1 subject" if count == 1 else f"{count} subjects"


def _from_one(mean: DataFrame, most: int) -> str:
    """Return what a plan made for one subject is worth for others, as a sentence."""
    if most == 1:
        return ""
    one = mean.in_focus[_TAPED, 1]
    return f" Made for a single subject, a plan holds {percent(one)} of others."


def _of_presets(mean: DataFrame) -> str:
    """Return what it brings to have some plans to choose from, as a sentence."""
    found = [f"{_BEST_OF} {presets}" for presets in _PRESETS]
    found = [plan for plan in found if plan in mean.index.get_level_values("plan")]
    if not found:
        return ""
    shares = " and ".join(
        f"{percent(mean.in_focus[plan].iloc[0])} with {plan.removeprefix(_BEST_OF).strip()}"
        for plan in found
    )
    return (
        f" Where each takes the best of several plans, for as many others together, it is {shares}."
    )


def _table(mean: DataFrame) -> str:
    taped = [(_TAPED, number) for number in mean.loc[_TAPED].index]
    presets = [key for key in mean.index if key[0].startswith(_BEST_OF)]
    rows = [
        [
            plan,
            str(number or ""),
            percent(mean.in_focus[plan, number]),
            f"{mean.fresh_cost[plan, number]:.1f}",
        ]
        for plan, number in [(_AUTOFOCUS, 0), *taped, *presets, (_OWN, 0)]
    ]
    return table(("plan", "made for subjects", "in focus", "cost"), rows)


def _draw(figure: Figure, mean: DataFrame) -> None:
    axes = figure.add_subplot()
    taped = 100 * mean.in_focus[_TAPED]
    axes.plot(taped.index, taped, "o-", color=EM.colour, label=_TAPED)
    for plan, colour in ((_OWN, TWO_VIEW_ALL.colour), (_AUTOFOCUS, CLOSEST.colour)):
        axes.axhline(100 * mean.in_focus[plan, 0], color=colour, ls="--", label=plan)
    for presets, marker in zip(_PRESETS, "^s", strict=True):
        plan = f"{_BEST_OF} {presets}"
        if plan in mean.index.get_level_values("plan"):
            share = 100 * mean.in_focus[plan]
            axes.plot(share.index, share, marker, color=EM.colour, mfc="none", label=plan)
    axes.set_xticks(taped.index)
    axes.set_ylim(0, 100)
    axes.set_xlabel("subjects that plans were made for")
    axes.set_ylabel("in focus, % of an unseen subject")
    axes.legend(loc="lower right")


EXPERIMENT = Experiment(
    name="taped",
    title="Taped plans",
    paper="",
    tasks=_tasks,
    measure=_measure,
    write_up=_write_up,
)
