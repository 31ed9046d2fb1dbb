# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How soon the search converges (Sec. 5 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.measuring.methods import EM, TWO_VIEW, TWO_VIEW_ALL, Method
from focus_planner.evaluation.measuring.passes import Passes, em_passes, k_view_passes
from focus_planner.evaluation.subject import Subject
from focus_planner.evaluation.writing.markdown import counted, percent, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

_METHODS = (EM, TWO_VIEW, TWO_VIEW_ALL)
_MOST_TOLD = 10
_LINEAR_BELOW = 0.01  # per cent, of the plot's logarithmic axis, so that it ends at 0


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem = subject.problem(conditions)
    em = em_passes(problem, EM.options(subject.rig))
    rows = _rows(EM.name, em)
    for method in (TWO_VIEW, TWO_VIEW_ALL):
        options = method.options(subject.rig)
        rows += _rows(method.name, k_view_passes(problem, options, em.solution.focus_distances))
    return Measured(rows)


def _rows(method: str, passes: Passes) -> list[Row]:
    """Return a row for the start, ``passes`` 0, and one for the cost after every pass."""
    return [
        {"method": method, "passes": number, "cost": cost}
        for number, cost in enumerate(passes.costs)
    ]


def _write_up(results: Results) -> WriteUp:
    excess = _excess(results.rows)
    text = _paragraph(results, excess) + "\n" + _table(excess)
    return WriteUp(text, lambda figure: _draw(figure, excess))


def _excess(rows: DataFrame) -> DataFrame:
    """Return by passes (rows) and method and subject (columns) how far the cost is from its end.

    Relative to the cost at the end, where it stays once there.
    """
    costs = rows.pivot(index="passes", columns=["method", "subject"], values="cost").ffill()
    return costs / costs.iloc[-1] - 1


def _of(excess: DataFrame, method: Method) -> DataFrame:
    return cast("DataFrame", excess[method.name])


def _paragraph(results: Results, excess: DataFrame) -> str:
    subjects = counted(results.rows["subject"].nunique(), "subject")
    told = "; ".join(_told(method.name, _of(excess, method)) for method in _METHODS)
    return (
        f"The cost after every pass for {subjects}, on"
        f" {results.conditions.samples:,} samples of each. EM starts from the closest depths,"
        f" 2-view from where EM ends. {told}. (The paper: both appear to converge after several"
        " iterations.)\n"
    )


def _told(name: str, excess: DataFrame) -> str:
    passes = (excess > 0).sum()  # the cost never rises
    least, most = int(passes.min()), int(passes.max())
    until = f"{least}" if least == most else f"{least} to {most}"
    first = excess.loc[excess.index <= 1].iloc[-1].mean()
    return (
        f"{name} is at its end after {until} {'pass' if until == '1' else 'passes'}, and"
        f" {percent(first, 2)} above it after the first"
    )


def _table(excess: DataFrame) -> str:
    names = [method.name for method in _METHODS]
    mean = excess.T.groupby(level="method").mean().T[names]
    told = mean[mean.max(axis=1) > 0].iloc[:_MOST_TOLD]
    header = ["passes: cost above its end", *names]
    return table(
        header,
        ([f"{done}", *(percent(row[name], 3) for name in names)] for done, row in told.iterrows()),
    )


def _draw(figure: Figure, excess: DataFrame) -> None:
    axes = figure.add_subplot()
    for method in _METHODS:
        above = 100 * _of(excess, method)
        axes.fill_between(
            above.index, above.min(axis=1), above.max(axis=1), color=method.colour, alpha=0.12
        )
        axes.plot(above.mean(axis=1), "o-", color=method.colour, label=method.name)
    axes.set_yscale("symlog", linthresh=_LINEAR_BELOW)
    axes.set_ylim(bottom=0)
    axes.set_xticks(excess.index)
    axes.set_xlabel("passes")
    axes.set_ylabel("cost above its end, %: mean and range of subjects")
    axes.legend()


EXPERIMENT = Experiment(
    name="convergence",
    title="Convergence",
    paper="Sec. 5",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
