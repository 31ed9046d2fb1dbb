# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The cost on samples that no solver has seen, by how many the plan was made on."""

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
from focus_planner.evaluation.measuring.methods import (
    AVERAGE,
    CLOSEST,
    EM,
    TWO_VIEW,
    TWO_VIEW_ALL,
)
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import counted, percent, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_METHODS = (CLOSEST, AVERAGE, EM, TWO_VIEW, TWO_VIEW_ALL)
# Those that a plot has room for: baselines cost too much more.
_DRAWN = (EM, TWO_VIEW, TWO_VIEW_ALL)
_COUNTS = tuple(2**exponent for exponent in range(8, 17))
_PAPER_COUNT = 2**10
# A plan that looks no more than this better than it is does not overfit to speak of.
_SMALL = 0.01


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem = subject.problem(replace(conditions, samples=int(setting["samples"])))
    fresh = subject.fresh_problem(conditions)
    rows: list[Row] = []
    seconds = {}
    for method in _METHODS:
        started = time.perf_counter()
        solution = method.solve(problem, subject.rig)
        seconds[f"{method.name}_seconds"] = time.perf_counter() - started
        fresh_cost = judge(fresh, solution.focus_distances).cost.value
        rows.append({"method": method.name, "cost": solution.cost, "fresh_cost": fresh_cost})
    return Measured(rows, seconds)


def _write_up(results: Results) -> WriteUp:
    mean = results.rows.pivot_table(["cost", "fresh_cost"], "samples", "method")
    text = _paragraph(results, mean) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean))


def _paragraph(results: Results, mean: DataFrame) -> str:
    count = results.rows["subject"].nunique()
    least, most = int(mean.index.min()), int(mean.index.max())
    fresh = {method: mean["fresh_cost"][method.name] for method in (CLOSEST, EM, TWO_VIEW_ALL)}
    first, last = ({method: costs[n] for method, costs in fresh.items()} for n in (least, most))
    return (
        f"Every method planned on {least:,} to {most:,} samples of {counted(count, 'subject')}; all"
        f" plans were judged on the same {results.conditions.judged:,} others. A plan looks better"
        " than it is on the samples that it was made for"
        f"{_overfit_of_paper(mean)}. On fresh samples the cost of 2-view on all samples goes from"
        f" {first[TWO_VIEW_ALL]:.1f} to {last[TWO_VIEW_ALL]:.1f} as there are more, that of EM from"
        f" {first[EM]:.1f} to {last[EM]:.1f}, that of focusing on the closest sample from"
        f" {first[CLOSEST]:.1f} to {last[CLOSEST]:.1f}. {_enough(mean)}\n"
    )


def _overfit(mean: DataFrame, method: str) -> Series[float]:
    """Return by what share more plans of each number of samples cost on fresh ones."""
    overfit: Series[float] = mean["fresh_cost"][method] / mean["cost"][method] - 1
    return overfit


def _overfit_of_paper(mean: DataFrame) -> str:
    if _PAPER_COUNT not in mean.index:
        return ""
    em, both = (percent(_overfit(mean, method.name)[_PAPER_COUNT]) for method in (EM, TWO_VIEW_ALL))
    return (
        f": made on {_PAPER_COUNT:,}, about as many as the paper takes, it costs {em} more on fresh"
        f" ones by EM and {both} more by 2-view on all samples"
    )


def _enough(mean: DataFrame) -> str:
    overfit = _overfit(mean, TWO_VIEW_ALL.name)
    enough = overfit.index[overfit <= _SMALL]
    if len(enough) == 0:
        return f"However many there were, it cost over {percent(_SMALL, 0)} more on fresh ones."
    return (
        f"It takes {int(enough.min()):,} samples for 2-view on all samples to cost at most"
        f" {percent(_SMALL, 0)} more on fresh ones than on its own."
    )


def _table(mean: DataFrame) -> str:
    header = ["planned on"] + [
        f"{method.name}: {kind}" for method in _DRAWN for kind in ("own", "fresh")
    ]
    header += [f"{method.name}: fresh" for method in (CLOSEST, AVERAGE)]
    columns = [(kind, m.name) for m in _DRAWN for kind in ("cost", "fresh_cost")]
    columns += [("fresh_cost", m.name) for m in (CLOSEST, AVERAGE)]
    rows = mean[columns]
    return table(
        header,
        (
            [f"{n:,}", *(f"{cost:.1f}" for cost in costs)]
            for n, costs in zip(rows.index, rows.to_numpy(), strict=True)
        ),
    )


def _draw(figure: Figure, mean: DataFrame) -> None:
    axes = figure.add_subplot()
    for method in _DRAWN:
        own, fresh = mean["cost"][method.name], mean["fresh_cost"][method.name]
        axes.plot(fresh.index, fresh, "o-", color=method.colour, label=f"{method.name}, fresh")
        axes.plot(own.index, own, "o--", color=method.colour, label="own samples", alpha=0.6)
    axes.set_xscale("log", base=2)
    axes.set_xlabel("samples planned on")
    axes.set_ylabel("cost")
    axes.legend(ncols=len(_DRAWN))
    axes.grid(linewidth=0.4)


EXPERIMENT = Experiment(
    name="fresh",
    title="Fresh samples",
    paper="",
    tasks=each_subject(*({"samples": count} for count in _COUNTS)),
    measure=_measure,
    write_up=_write_up,
)
