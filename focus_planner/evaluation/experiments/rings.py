# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Choosing camera tuples: pairs within a 1-ring, within a 2-ring, by overlap (Sec. 4.6.2)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.camera_tuples import camera_tuples
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Options, k_view
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.measuring.methods import EM, TWO_VIEW, TWO_VIEW_ALL
from focus_planner.evaluation.subject import Subject
from focus_planner.evaluation.writing.markdown import counted, percent, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_METHODS = {"assigned": TWO_VIEW, "all": TWO_VIEW_ALL}
_ONE, _TWO, _OVERLAP = "1-ring", "2-ring", "overlap"
# The relative difference between pairs within a 2-ring and within a 1-ring.
_PAPER = 0.004


def _options(pairs: str, scope: str, rig: Rig) -> Options:
    if pairs == _OVERLAP:
        return Options(scope=scope)
    if rig.grid is None:
        raise InputError(
            "rings",
            "rigs whose cameras stand on a grid",
            "a rig without a grid",
            "give the rig's grid, or leave this experiment out",
        )
    return Options(scope=scope, grid=rig.grid, rings=1 if pairs == _ONE else 2)


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    settings = {
        (pairs, scope): _options(pairs, scope, subject.rig)
        for scope, pairs in product(_METHODS, (_ONE, _TWO, _OVERLAP))
    }
    problem, fresh = subject.problem(conditions), subject.fresh_problem(conditions)
    rows, seconds = [], {}
    with kernels.threads_for(0):
        for (pairs, scope), options in settings.items():
            started = time.perf_counter()
            focus = k_view.solve(problem, options).focus_distances
            seconds[f"{scope}_{pairs}_seconds"] = time.perf_counter() - started
            rows.append({"scope": scope, "pairs": pairs, **_found(problem, fresh, options, focus)})
    return Measured(rows, seconds)


def _found(problem: Problem, fresh: Problem, options: Options, focus: FloatArray) -> Row:
    tuples = camera_tuples(problem, 2, options.scope, options.grid, rings=options.rings)
    return {
        "count": len(tuples.cameras),
        "cost": problem.cost(focus),
        "fresh_cost": fresh.cost(fill_missing_distances(fresh, focus)),
    }


def _write_up(results: Results) -> WriteUp:
    changes = _changes(results.rows)
    text = _paragraph(results, changes) + "\n" + _table(results, changes)
    return WriteUp(text, lambda figure: _draw(figure, changes))


def _changes(rows: DataFrame) -> DataFrame:
    """Return, per subject, by scope and pairs, what they cost beside pairs within a 1-ring."""
    costs = rows.pivot(index="subject", columns=["scope", "pairs"], values="cost")
    ones = costs.xs(_ONE, axis="columns", level="pairs")
    return costs.div(ones, axis="columns", level="scope") - 1


def _paragraph(results: Results, changes: DataFrame) -> str:
    subjects = counted(results.rows["subject"].nunique(), "subject")
    mean = changes.mean()
    counts = results.rows.groupby("pairs")["count"].mean()
    return (
        f"2-view planned for {subjects}, on {results.conditions.samples:,} samples of each, with"
        f" pairs of cameras within a 1-ring of the grid (its edges; {counts[_ONE]:,.0f} pairs),"
        f" within a 2-ring (up to two edges apart; {counts[_TWO]:,.0f}), and with each camera and"
        f" the four that share most samples with it ({counts[_OVERLAP]:,.0f}), as this package"
        f" chooses them. With the paper's scope the cost changes by"
        f" {percent(mean['assigned', _TWO], 2)} from the 1-ring to the 2-ring (the paper:"
        f" {percent(_PAPER)} relative difference), and by {percent(mean['assigned', _OVERLAP], 2)}"
        f" to pairs by overlap. Where a step takes all samples that its cameras see, these changes"
        f" are {percent(mean['all', _TWO], 2)} and {percent(mean['all', _OVERLAP], 2)}.\n"
    )


def _table(results: Results, changes: DataFrame) -> str:
    header = (
        "2-view", "pairs", "cost", "beside the 1-ring", "cost on fresh samples", "seconds",
    )  # fmt: skip
    means = results.rows.groupby(["scope", "pairs"])[["count", "cost", "fresh_cost"]].mean()
    lines = [
        [
            f"{method.name}, {pairs}",
            f"{means['count'][scope, pairs]:,.0f}",
            f"{means['cost'][scope, pairs]:.2f}",
            percent(changes[scope, pairs].mean(), 2),
            f"{means['fresh_cost'][scope, pairs]:.2f}",
            f"{results.seconds[f'{scope}_{pairs}_seconds'].median():.2g}",
        ]
        for scope, method in _METHODS.items()
        for pairs in (_ONE, _TWO, _OVERLAP)
    ]
    return table(header, lines)


def _draw(figure: Figure, changes: DataFrame) -> None:
    axes = figure.add_subplot()
    for place, (scope, pairs) in enumerate(product(_METHODS, (_TWO, _OVERLAP))):
        _box(axes, place, 100 * changes[scope, pairs], scope, pairs)
    axes.axhline(0, color="0.8", linewidth=1)
    axes.plot([0, 0], [-100 * _PAPER, 100 * _PAPER], "D", color=EM.colour, label="the paper, ±")
    axes.set_ylabel("cost beside pairs within a 1-ring, %")
    axes.legend()


def _box(axes: Axes, place: int, values: Series[float], scope: str, pairs: str) -> None:
    method = _METHODS[scope]
    label = f"{method.name}\n{pairs}"
    median = {"color": method.colour}
    axes.boxplot(values, positions=[place], tick_labels=[label], medianprops=median)


EXPERIMENT = Experiment(
    name="rings",
    title="Choosing camera tuples",
    paper="Sec. 4.6.2",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
