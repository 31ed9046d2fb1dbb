# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Whether it matters where the search starts (Sec. 5 of the paper)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers import SOLVERS, average
from focus_planner.core.solvers.closest import closest_depths
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

_METHODS = (EM, TWO_VIEW, TWO_VIEW_ALL)
_RANDOM = "random"
_STARTS = ("closest", "average", "farthest", "hyperfocal", _RANDOM)
_DRAWS = 5


def starts(problem: Problem, seed: int) -> Iterator[tuple[str, int, FloatArray]]:
    """Yield focus distances to start from: their name, the number of the draw, (C,) metres.

    Random ones are uniform between the closest and the farthest depth that a camera sees.
    """
    nearest, farthest = closest_depths(problem), _farthest_depths(problem)
    yield "closest", 0, nearest
    yield "average", 0, average.solve(problem).focus_distances
    yield "farthest", 0, farthest
    yield "hyperfocal", 0, np.array([lens.hyperfocal_distance for lens in problem.lenses])
    for draw in range(_DRAWS):
        random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1, draw)))
        yield _RANDOM, draw, nearest + random.random(len(nearest)) * (farthest - nearest)


def _farthest_depths(problem: Problem) -> FloatArray:
    depths = np.full(problem.camera_count, -np.inf)
    np.maximum.at(depths, problem.camera_index, problem.depth)
    return np.where(np.isfinite(depths), depths, np.nan)


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem = subject.problem(conditions)
    rows: list[Row] = []
    for name, draw, start in starts(problem, conditions.seed):
        for method in _METHODS:
            options = replace(method.options(subject.rig), start=start)
            cost = SOLVERS[method.solver](problem, options).cost
            rows.append({"start": name, "draw": draw, "method": method.name, "cost": cost})
    return Measured(rows)


def _write_up(results: Results) -> WriteUp:
    relative, spread = _relative(results.rows), _spread(results.rows)
    text = _paragraph(results, spread) + "\n" + _table(relative, spread)
    return WriteUp(text, lambda figure: _draw(figure, relative))


def _relative(rows: DataFrame) -> DataFrame:
    """Return the rows with their cost as a change from the mean of all starts of the same plan."""
    mean = rows.groupby(["subject", "method"])["cost"].transform("mean")
    return rows.assign(change=rows["cost"] / mean - 1)


def _spread(rows: DataFrame) -> DataFrame:
    """Return, per subject and by method, how far the dearest start is from the cheapest."""
    costs = rows.groupby(["subject", "method"])["cost"]
    return ((costs.max() - costs.min()) / costs.mean()).unstack("method")


def _paragraph(results: Results, spread: DataFrame) -> str:
    rows, mean = results.rows, spread.mean()
    random = rows.loc[rows["start"] == _RANDOM, "draw"].nunique()
    return (
        f"Each method planned for {counted(len(spread), 'subject')}, on"
        f" {results.conditions.samples:,} samples of each, from the closest, the average and the"
        f" farthest depth that each camera sees, from the hyperfocal distance, and from"
        f" {counted(random, 'draw')} of random depths; 2-view begins where EM from there ends. From"
        f" the best start to the worst the cost differs by {percent(mean[EM.name], 2)} for EM, by"
        f" {percent(mean[TWO_VIEW.name], 2)} for 2-view, and by"
        f" {percent(mean[TWO_VIEW_ALL.name], 2)} where its steps take all samples that a pair sees."
        " (The paper sees no significant differences, and less effect on 2-view than on EM.)\n"
    )


def _table(relative: DataFrame, spread: DataFrame) -> str:
    names = [method.name for method in _METHODS]
    change = relative.groupby(["start", "method"])["change"].mean().unstack("method")
    lines = [[start, *(percent(change[name][start], 2) for name in names)] for start in _STARTS]
    widest = ["best to worst", *(percent(spread[name].mean(), 2) for name in names)]
    header = ["cost beside the mean of all starts", *names]
    return table(header, [*lines, widest])


def _draw(figure: Figure, relative: DataFrame) -> None:
    axes = figure.add_subplot()
    for place, method in enumerate(_METHODS):
        costs = relative[relative["method"] == method.name]
        changes = [100 * costs.loc[costs["start"] == start, "change"] for start in _STARTS]
        _boxes(axes, changes, 0.25 * (place - 1), method.colour)
        axes.plot([], [], "s", color=method.colour, label=method.name)
    axes.axhline(0, color="0.8", linewidth=1)
    axes.set_xticks(range(len(_STARTS)), _STARTS)
    axes.set_xlabel("start")
    axes.set_ylabel("cost beside the mean of all starts, %")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=3, frameon=False)


def _boxes(axes: Axes, values: Sequence[Series[float]], shift: float, colour: str) -> None:
    axes.boxplot(
        values,
        positions=np.arange(len(values)) + shift,
        widths=0.2,
        patch_artist=True,
        boxprops={"facecolor": colour, "alpha": 0.6},
        medianprops={"color": "black"},
        flierprops={"markersize": 3},
        manage_ticks=False,
    )


EXPERIMENT = Experiment(
    name="initialisation",
    title="Initialisation",
    paper="Sec. 5",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
