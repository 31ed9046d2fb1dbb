# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far each method is from the proven optimum, which the paper could not tell (Sec. 4.3)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import SOLVERS, Options, Solution
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
    AVERAGE,
    CLOSEST,
    EM,
    THREE_VIEW,
    TWO_VIEW,
    TWO_VIEW_ALL,
)
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import counted, percent, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_METHODS = (CLOSEST, AVERAGE, EM, TWO_VIEW, TWO_VIEW_ALL, THREE_VIEW)
_OPTIMAL = "optimal"
_GAP = 1e-4
# Bodies take a few dozen. Steps, not seconds, so that where it gives up is the same everywhere.
_MOST_STEPS = 1000
# Less than this share above the bound is drawn as if it were this.
_LEAST_DRAWN = 1e-5


def prove(problem: Problem, most_steps: int = _MOST_STEPS) -> Solution:
    """Return the optimum, proven within 0.01 %, or the best plan and bound after so many steps."""
    steps = 0

    def keep_going(_: Progress) -> bool:
        nonlocal steps
        steps += 1
        return steps < most_steps

    return SOLVERS["optimal"](problem, Options(gap=_GAP), keep_going)


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem, fresh = subject.problem(conditions), subject.fresh_problem(conditions)
    solutions, seconds = {}, {}
    for method in _METHODS:
        started = time.perf_counter()
        solutions[method.name] = method.solve(problem, subject.rig)
        seconds[f"{method.name}_seconds"] = time.perf_counter() - started
    started = time.perf_counter()
    solutions[_OPTIMAL] = optimum = prove(problem)
    seconds[f"{_OPTIMAL}_seconds"] = time.perf_counter() - started
    rows: list[Row] = [
        {
            "method": name,
            "cost": solution.cost,
            "lower_bound": optimum.lower_bound or 0.0,
            "proven": optimum.converged,
            "fresh_cost": judge(fresh, solution.focus_distances).cost.value,
        }
        for name, solution in solutions.items()
    ]
    return Measured(rows, seconds)


def _write_up(results: Results) -> WriteUp:
    rows = results.rows.assign(above=results.rows["cost"] / results.rows["lower_bound"] - 1)
    text = _paragraph(results, rows) + "\n" + _table(results, rows)
    return WriteUp(text, lambda figure: _draw(figure, rows))


def _paragraph(results: Results, rows: DataFrame) -> str:
    of_optimum = rows[rows["method"] == _OPTIMAL]
    count, proven = len(of_optimum), int(of_optimum["proven"].sum())
    above = rows.groupby("method")["above"].mean()
    fresh = rows.groupby("method")["fresh_cost"].mean()
    return (
        f"The paper cannot say how close its plans are to the best. Here the best plan on"
        f" {results.conditions.samples:,} samples was sought by branch and bound for"
        f" {counted(count, 'subject')}, and proven to cost at most {percent(_GAP, 2)} more than any"
        f" other for {_all_or(proven, count)}. {_unproven(of_optimum)}Above the lower bound EM"
        f" costs {_share(above, EM.name)}, 2-view {_share(above, TWO_VIEW.name)}, 2-view on all"
        f" samples {_share(above, TWO_VIEW_ALL.name)} on average: what is left to gain on the"
        f" samples planned on is at most that. On {results.conditions.judged:,} fresh samples the"
        f" best plan costs {fresh.get(_OPTIMAL, np.nan):.1f}, 2-view on all samples"
        f" {fresh.get(TWO_VIEW_ALL.name, np.nan):.1f}.\n"
    )


def _all_or(proven: int, count: int) -> str:
    if proven == count:
        return "it" if count == 1 else "all of them"
    return f"{proven or 'none'} of them"


def _unproven(of_optimum: DataFrame) -> str:
    """Return what is left between plan and bound where nothing was proven."""
    left = of_optimum.loc[~of_optimum["proven"].astype(bool), "above"]
    if left.empty:
        return ""
    where = "A" if len(left) == len(of_optimum) else "For the others a"
    return f"{where} gap of at most {percent(left.max(), 2)} is left. "


def _share(above: Series[float], method: str) -> str:
    return percent(above.get(method, np.nan), 2)


def _table(results: Results, rows: DataFrame) -> str:
    header = (
        "method", "cost", "above the lower bound, at most", "worst", "cost on fresh samples",
        "median seconds",
    )  # fmt: skip
    return table(header, (_cells(results, *each) for each in rows.groupby("method", sort=False)))


def _cells(results: Results, method: object, rows: DataFrame) -> list[str]:
    return [
        str(method),
        f"{rows['cost'].mean():.2f}",
        percent(rows["above"].mean(), 3),
        percent(rows["above"].max(), 3),
        f"{rows['fresh_cost'].mean():.2f}",
        f"{results.seconds[f'{method}_seconds'].median():.2f}",
    ]


def _draw(figure: Figure, rows: DataFrame) -> None:
    axes = figure.add_subplot()
    colours = {method.name: method.colour for method in _METHODS} | {_OPTIMAL: "black"}
    names = [name for name in colours if (rows["method"] == name).any()]
    for place, name in enumerate(names):
        above = np.sort(rows.loc[rows["method"] == name, "above"].to_numpy())
        drawn = 100 * np.maximum(above, _LEAST_DRAWN)
        spread = place + np.linspace(-0.25, 0.25, len(drawn) + 2)[1:-1]
        axes.plot(drawn, spread, "o", color=colours[name], markersize=4)
    axes.axvline(100 * _GAP, color="black", linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel(
        "cost above the lower bound, %; below 0.001 % as 0.001 % (dotted: what counts as proven)"
    )
    axes.grid(axis="x", linewidth=0.4)


EXPERIMENT = Experiment(
    name="optimum",
    title="Distance to the optimum",
    paper="",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
