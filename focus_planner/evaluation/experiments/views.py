# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans that hold every piece of surface in focus in one view, or in several."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.measuring.methods import TWO_VIEW_ALL
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import counted, percent, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

#: How many views plans are made for, and judged in: those of which quality tells the sharp area.
VIEWS = (1, 2, 3, 5)
# From light to dark, as there are more.
_COLOURS = ("#a9d6bd", "#63b387", "#2f8f5b", "#174d30")


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem, fresh = subject.problem(conditions), subject.fresh_problem(conditions)
    rows: list[Row] = []
    seconds = {}
    for planned in VIEWS:
        for_views = replace(problem, views=planned)
        for_views.find_cells(lambda: True)  # so that the seconds do not include them
        started = time.perf_counter()
        focus = TWO_VIEW_ALL.solve(for_views, subject.rig).focus_distances
        seconds[f"{planned}_seconds"] = time.perf_counter() - started
        sharp = judge(fresh, focus).sharp_areas
        costs = {q: judge(replace(fresh, views=q), focus).cost.value for q in VIEWS}
        rows.append(
            {"planned_for": planned, "surface_area": float(fresh.samples.areas.sum())}
            | {f"sharp_{each.views}": each.area for each in sharp}
            | {f"cost_{q}": cost for q, cost in costs.items()}
        )
    return Measured(rows, seconds)


def _write_up(results: Results) -> WriteUp:
    rows = results.rows
    shares = {f"sharp_{q}": rows[f"sharp_{q}"] / rows["surface_area"] for q in VIEWS}
    measured = [*shares, *(f"cost_{q}" for q in VIEWS)]
    mean = rows.assign(**shares).groupby("planned_for")[measured].mean()
    text = _paragraph(results, mean) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean))


def _paragraph(results: Results, mean: DataFrame) -> str:
    count, conditions = results.rows["subject"].nunique(), results.conditions
    least, most = int(mean.index.min()), int(mean.index.max())
    compared = [_compared(mean, q) for q in mean.index[mean.index > 1]]
    once = mean["sharp_1"]
    return (
        "Photogrammetry needs every piece of a surface sharp in several views; the paper plans for"
        f" one. 2-view on all samples planned for the mean of the q least costs of every sample,"
        f" for {counted(count, 'subject')} on {conditions.samples:,} samples of each; what is sharp"
        f" was judged on {conditions.judged:,} others. {' '.join(compared)} In one view at least,"
        f" {percent(once[least])} is sharp if planned for {least}, and {percent(once[most])} if"
        f" planned for {most}.\n"
    )


def _compared(mean: DataFrame, q: int) -> str:
    sharp = mean[f"sharp_{q}"]
    plain = f", planned for one {percent(sharp[1])}" if 1 in sharp.index else ""
    return (
        f"In at least {q} views {percent(sharp[q])} of the surface is sharp if planned so{plain}."
    )


def _table(mean: DataFrame) -> str:
    header = [
        "planned for",
        *(f"sharp in ≥ {q}" for q in VIEWS),
        *(f"cost, q = {q}" for q in VIEWS),
    ]
    return table(header, (_cells(mean, int(planned)) for planned in mean.index))


def _cells(mean: DataFrame, planned: int) -> list[str]:
    shares = [percent(mean[f"sharp_{q}"][planned]) for q in VIEWS]
    return [f"q = {planned}", *shares, *(f"{mean[f'cost_{q}'][planned]:.1f}" for q in VIEWS)]


def _draw(figure: Figure, mean: DataFrame) -> None:
    axes = figure.add_subplot()
    for planned, colour in zip(VIEWS, _COLOURS, strict=True):
        if planned in mean.index:
            shares = [100 * float(mean[f"sharp_{q}"][planned]) for q in VIEWS]
            axes.plot(VIEWS, shares, "o-", color=colour, label=f"planned for q = {planned}")
    axes.set_xticks(VIEWS)
    axes.set_xlabel("views, at least")
    axes.set_ylabel("surface that is sharp in so many, %")
    axes.legend()
    axes.grid(linewidth=0.4)


EXPERIMENT = Experiment(
    name="views",
    title="Several views",
    paper="",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
