# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How many cameras to move at a time: pairs against triples (Sec. 4.6.3 of the paper)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.measuring.methods import (
    EM,
    THREE_VIEW,
    TWO_VIEW,
    TWO_VIEW_ALL,
    Method,
)
from focus_planner.evaluation.measuring.passes import Passes, k_view_passes
from focus_planner.evaluation.subject import Subject
from focus_planner.evaluation.writing.markdown import changed, counted, percent, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

# Pairs and triples by scope: the paper's, and every sample that the cameras see.
_METHODS = {
    "assigned": (TWO_VIEW, replace(TWO_VIEW, name="3-view", k=3)),
    "all": (TWO_VIEW_ALL, THREE_VIEW),
}
# What triples cost beside pairs, and how much longer an iteration takes.
_PAPER_CHANGE, _PAPER_TIMES = -0.012, 300


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem, fresh = subject.problem(conditions), subject.fresh_problem(conditions)
    rows, seconds = [], {}
    with kernels.threads_for(0):
        em = EM.solve(problem, subject.rig)
        for scope, methods in _METHODS.items():
            start = em.focus_distances
            for method in methods:
                found, taken = _passes(method, problem, subject.rig, start)
                start = found.solution.focus_distances
                rows.append({"scope": scope, "k": method.k, **_found(found, fresh)})
                seconds[f"{scope}_pass_{method.k}_seconds"] = found.seconds[0]
                seconds[f"{scope}_stage_{method.k}_seconds"] = taken
    return Measured(rows, seconds)


def _passes(method: Method, problem: Problem, rig: Rig, start: FloatArray) -> tuple[Passes, float]:
    """Return the method's last stage, and the seconds that it takes with its tuples."""
    started = time.perf_counter()
    passes = k_view_passes(problem, method.options(rig), start)
    return passes, time.perf_counter() - started


def _found(found: Passes, fresh: Problem) -> Row:
    focus = fill_missing_distances(fresh, found.solution.focus_distances)
    return {
        "passes": len(found.seconds),
        "cost": found.solution.cost,
        "fresh_cost": fresh.cost(focus),
    }


def _write_up(results: Results) -> WriteUp:
    changes, times = _changes(results.rows), _times(results.seconds)
    text = _paragraph(results, changes, times) + "\n" + _table(results)
    return WriteUp(text, lambda figure: _draw(figure, changes, times))


def _changes(rows: DataFrame) -> DataFrame:
    """Return, per subject and by scope, what triples cost beside pairs."""
    costs = rows.pivot(index=["subject", "scope"], columns="k", values="cost")
    return (costs[3] / costs[2] - 1).unstack("scope")


def _times(seconds: DataFrame) -> DataFrame:
    """Return, per subject and by scope, how many times as long a pass of triples takes."""
    times = {s: seconds[f"{s}_pass_3_seconds"] / seconds[f"{s}_pass_2_seconds"] for s in _METHODS}
    return seconds[["subject"]].assign(**times)


def _paragraph(results: Results, changes: DataFrame, times: DataFrame) -> str:
    subjects = counted(results.rows["subject"].nunique(), "subject")
    said = " ".join(_comparison(scope, changes, times) for scope in _METHODS)
    return (
        f"Two and three cameras at a time planned for {subjects}, on"
        f" {results.conditions.samples:,} samples of each, in one thread; triples start where pairs"
        f" end. {said} (The paper: {percent(abs(_PAPER_CHANGE))} less, and {_PAPER_TIMES} times per"
        " iteration.)\n"
    )


_SCOPES = {
    "assigned": "With the paper's scope, the samples assigned to a tuple,",
    "all": "Where a step takes all samples that its cameras see,",
}


def _comparison(scope: str, changes: DataFrame, times: DataFrame) -> str:
    cost = changed(changes[scope].mean(), 2)
    return (
        f"{_SCOPES[scope]} triples cost {cost} than pairs, and a pass of them takes"
        f" {times[scope].median():.2g} times as long."
    )


def _table(results: Results) -> str:
    header = (
        "method", "cost", "beside two", "cost on fresh samples", "passes", "a pass, ms",
        "all passes and their tuples, ms",
    )  # fmt: skip
    means = results.rows.groupby(["scope", "k"])[["cost", "fresh_cost", "passes"]].mean()
    seconds = results.seconds.drop(columns="subject").median()
    lines = [
        _cells(scope, method, means, seconds)
        for scope, methods in _METHODS.items()
        for method in methods
    ]
    return table(header, lines)


def _cells(scope: str, method: Method, means: DataFrame, seconds: Series[float]) -> list[str]:
    here, cost = (scope, method.k), means["cost"]
    return [
        method.name,
        f"{cost[here]:.2f}",
        "" if method.k == 2 else percent(cost[here] / cost[scope, 2] - 1, 2),
        f"{means['fresh_cost'][here]:.2f}",
        f"{means['passes'][here]:.1f}",
        f"{1000 * seconds[f'{scope}_pass_{method.k}_seconds']:.1f}",
        f"{1000 * seconds[f'{scope}_stage_{method.k}_seconds']:.1f}",
    ]


def _draw(figure: Figure, changes: DataFrame, times: DataFrame) -> None:
    left, right = figure.subplots(1, 2)
    _boxes(left, 100 * changes, 100 * _PAPER_CHANGE)
    left.axhline(0, color="0.8", linewidth=1)
    left.set_ylabel("cost of triples beside pairs, %")
    _boxes(right, times, _PAPER_TIMES)
    right.set_yscale("log")
    right.set_ylabel("seconds of a pass, triples over pairs")


def _boxes(axes: Axes, values: DataFrame, paper: float) -> None:
    """Draw a box per scope, and the paper's figure on that of its scope."""
    for place, (scope, (pairs, _)) in enumerate(_METHODS.items(), start=1):
        axes.boxplot(
            values[scope],
            positions=[place],
            widths=0.4,
            tick_labels=[pairs.name.replace("2-view", "k-view")],
            medianprops={"color": pairs.colour},
        )
    axes.plot(1, paper, "D", color=EM.colour, label="the paper")
    axes.legend()


EXPERIMENT = Experiment(
    name="k",
    title="Size of camera tuples",
    paper="Sec. 4.6.3",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
