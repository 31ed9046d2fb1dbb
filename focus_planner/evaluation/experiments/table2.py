# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Table 2 of the paper: how stable the cost is, and how long a pass takes, by samples."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.problem.problem import Problem
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
from focus_planner.evaluation.measuring.methods import AVERAGE, EM, TWO_VIEW
from focus_planner.evaluation.measuring.passes import k_view_passes
from focus_planner.evaluation.subject import Subject
from focus_planner.evaluation.writing.markdown import counted, percent, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_COUNTS = tuple(2**exponent for exponent in range(7, 19))
_SAMPLINGS = 10
# By samples (Tab. 2): the standard deviation of the cost, and seconds of an iteration.
_PAPER_DEVIATION = dict(zip(_COUNTS, (2.4, 2.6, 1.5, 1.1, 0.9, 0.6, 0.4), strict=False))
_PAPER_SECONDS = dict(zip(_COUNTS, (3.7, 3.8, 4.2, 6.6, 17.9, 66.3, 259.2), strict=False))
# With fewer samples most of the time does not depend on how many they are, in the paper either.
_GROWS_FROM = 2**10


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    fresh = _judged(subject, conditions)
    with kernels.threads_for(0):
        started = time.perf_counter()
        problem = subject.problem(_sampling(setting, conditions))
        start = EM.solve(problem, subject.rig).focus_distances
        planned = k_view_passes(problem, TWO_VIEW.options(subject.rig), start)
        seconds = time.perf_counter() - started
    focus = fill_missing_distances(fresh, planned.solution.focus_distances)
    return Measured(
        [{"cost": planned.solution.cost, "fresh_cost": fresh.cost(focus)}],
        {"pass_seconds": planned.seconds[0], "plan_seconds": seconds},
    )


@lru_cache(maxsize=1)
def _judged(subject: Subject, conditions: Conditions) -> Problem:
    """Return what all plans of a subject are judged on: casting its rays takes longer than most."""
    return subject.fresh_problem(conditions)


def _sampling(setting: Row, conditions: Conditions) -> Conditions:
    """Return the conditions of one sampling, whose seed no evaluation with another seed has."""
    seed = _SAMPLINGS * conditions.seed + int(setting["sampling"])
    return replace(conditions, samples=int(setting["samples"]), seed=seed)


def _write_up(results: Results) -> WriteUp:
    by_samples = _by_samples(results)
    text = _paragraph(results, by_samples) + "\n" + _table(by_samples)
    return WriteUp(text, lambda figure: _draw(figure, by_samples))


def _by_samples(results: Results) -> DataFrame:
    """Return means, deviations between samplings of a subject, and seconds, by samples."""
    found = results.rows.groupby("samples")[["cost", "fresh_cost"]].mean()
    between = results.rows.groupby(["samples", "subject"])[["cost", "fresh_cost"]].var()
    deviation = between.groupby("samples").mean() ** 0.5
    # The first task of a process loads the kernels, so a mean would tell of those.
    seconds = results.seconds.groupby("samples")[["pass_seconds", "plan_seconds"]].median()
    return found.join(deviation.add_suffix("_deviation")).join(seconds)


def growth(seconds: Mapping[int, float]) -> float | None:
    """Return by which power of the number of samples seconds grow, from 1,024 samples on.

    The slope of the straight line that fits their logarithms best; None for fewer than two.

    Parameters
    ----------
    seconds : mapping of int to float
        By the number of samples.
    """
    points = [(count, taken) for count, taken in seconds.items() if count >= _GROWS_FROM]
    if len(points) < 2:
        return None
    x, y = np.log(points).T
    x -= x.mean()
    return float(x @ y / (x @ x))


def _paragraph(results: Results, found: DataFrame) -> str:
    rows, counts = results.rows, sorted({found.index.min(), found.index.max()})
    asked = (
        "2-view as in the paper, with neighbouring cameras as pairs and the samples assigned to"
        f" them, planned for {counted(rows['subject'].nunique(), 'subject')} on"
        f" {counted(rows['sampling'].nunique(), 'sampling')} each of"
        f" {' to '.join(f'{count:,}' for count in counts)} samples, in one thread. All plans of a"
        f" subject were judged on the same {results.conditions.judged:,} others. "
    )
    return asked + " ".join(filter(None, (_stability(found), _time(found), _growth(found)))) + "\n"


def _stability(found: DataFrame) -> str:
    thousand = 2**10
    if thousand not in found.index or np.isnan(found.cost_deviation[thousand]):
        return ""
    cost, fresh, most = found.cost[thousand], found.fresh_cost, found.index.max()
    return (
        f"On {thousand:,} samples the cost differs between samplings by"
        f" σ = {found.cost_deviation[thousand]:.1f} (the paper: {_PAPER_DEVIATION[thousand]}), and"
        " that of the same plans on the fresh samples, on which only the plans differ, by"
        f" {found.fresh_cost_deviation[thousand]:.1f}. Over the paper's range the former σ is"
        f" {_beside_paper(found.cost_deviation):.1f} times the paper's on average, the latter"
        f" {_beside_paper(found.fresh_cost_deviation):.1f} times. A stable estimate of the cost is"
        f" no good plan, though: on the fresh samples those made on {thousand:,} cost"
        f" {percent(fresh[thousand] / cost - 1)} more than on their own, and"
        f" {percent(fresh[thousand] / fresh[most] - 1)} more than those made on {most:,} samples."
    )


def _beside_paper(deviation: Series[float]) -> float:
    ratios = [deviation[n] / _PAPER_DEVIATION[n] for n in deviation.index if n in _PAPER_DEVIATION]
    return float(np.mean(ratios))


def _time(found: DataFrame) -> str:
    both = sorted(set(found.index) & set(_PAPER_SECONDS))
    if not both:
        return ""
    return (
        f"A pass over {both[-1]:,} samples takes {found.pass_seconds[both[-1]]:.2g} s (the paper:"
        f" {_PAPER_SECONDS[both[-1]]:g} s, on another machine)."
    )


def _growth(found: DataFrame) -> str:
    power = growth(dict(zip(found.index, found.pass_seconds, strict=True)))
    if power is None:
        return ""
    return (
        f"From {_GROWS_FROM:,} samples on its seconds grow with the number of samples to the power"
        f" {power:.2f}; the paper's, in its range, to {growth(_PAPER_SECONDS):.2f}, towards the"
        " square."
    )


def _table(found: DataFrame) -> str:
    header = (
        "samples", "σ", "σ, fresh samples", "paper", "cost", "cost on fresh samples",
        "a pass, s", "paper, s", "the plan, s",
    )  # fmt: skip
    return table(header, (_cells(count, found.loc[count]) for count in found.index))


def _cells(count: int, row: Series[float]) -> list[str]:
    return [
        f"{count:,}",
        _deviation(row.cost_deviation),
        _deviation(row.fresh_cost_deviation),
        f"{_PAPER_DEVIATION.get(count, '')}",
        f"{row.cost:.1f}",
        f"{row.fresh_cost:.1f}",
        f"{row.pass_seconds:.2g}",
        f"{_PAPER_SECONDS.get(count, '')}",
        f"{row.plan_seconds:.2g}",
    ]


def _deviation(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}"  # a single sampling has none


def _draw(figure: Figure, found: DataFrame) -> None:
    left, right = figure.subplots(1, 2)
    left.plot(found.cost_deviation, "o-", color=TWO_VIEW.colour, label="samples planned on")
    left.plot(found.fresh_cost_deviation, "o-", color=AVERAGE.colour, label="fresh samples")
    _finish(left, _PAPER_DEVIATION, "σ of the cost between samplings")
    right.plot(found.pass_seconds, "o-", color=TWO_VIEW.colour, label="a pass of 2-view")
    right.plot(found.plan_seconds, "o-", color=AVERAGE.colour, label="the plan, rays included")
    _finish(right, _PAPER_SECONDS, "seconds")


def _finish(axes: Axes, paper: dict[int, float], label: str) -> None:
    axes.plot(list(paper), list(paper.values()), "D", color=EM.colour, label="the paper")
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.set_xlabel("samples")
    axes.set_ylabel(label)
    axes.legend()


EXPERIMENT = Experiment(
    name="table2",
    title="Sampling density",
    paper="Tab. 2, Sec. 4.4",
    tasks=each_subject(
        *(
            {"samples": count, "sampling": sampling}
            for count, sampling in product(_COUNTS, range(_SAMPLINGS))
        )
    ),
    measure=_measure,
    write_up=_write_up,
    most_subjects=2,
)
