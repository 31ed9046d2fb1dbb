# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How many cameras on a cylinder, and in how many rows (Sec. 4.5)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.measuring.cylinders import aspect_ratio, cylinder_like
from focus_planner.evaluation.measuring.methods import EM, TWO_VIEW
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import counted, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

_METHODS = (EM, TWO_VIEW)
# The paper's curves: as many cameras in this colour, EM as circles, 2-view as diamonds.
_COLOURS = {60: "#c0392b", 120: "#2c6fb5", 240: "#2f8f5b"}
_MARKERS = {EM.name: "o", TWO_VIEW.name: "D"}
_PAPER_RATIO = 1.5
# Ratios closer than this factor are called alike.
_ALIKE = 1.25
# On the paper's cylinder, about 1:4 and 6:1.
_LEAST_RATIO, _MOST_RATIO = 0.2, 7.0
# Three determine a parabola; one fitted to many more is off around its minimum.
_FITTED = 5


def layouts(cameras: int) -> list[Row]:
    """Return the grids of so many cameras whose aspect ratio makes sense, as settings."""
    return [
        {"cameras": cameras, "rows": rows, "columns": cameras // rows}
        for rows in range(2, cameras)
        if cameras % rows == 0
        and _LEAST_RATIO <= aspect_ratio(rows, cameras // rows) <= _MOST_RATIO
    ]


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    rig, ratio = cylinder_like(subject.rig, int(setting["rows"]), int(setting["columns"]))
    before = subject.with_rig(rig)
    problem, fresh = before.problem(conditions), before.fresh_problem(conditions)
    rows: list[Row] = []
    for method in _METHODS:
        solution = method.solve(problem, rig)
        fresh_cost = judge(fresh, solution.focus_distances).cost.value
        rows.append(
            {
                "method": method.name,
                "aspect_ratio": ratio,
                "cost": solution.cost,
                "fresh_cost": fresh_cost,
            }
        )
    return Measured(rows)


def _write_up(results: Results) -> WriteUp:
    keys = ["cameras", "method", "rows"]
    mean = results.rows.groupby(keys)[["aspect_ratio", "cost", "fresh_cost"]].mean().reset_index()
    mean = mean.sort_values(["cameras", "method", "aspect_ratio"])
    text = _paragraph(results, mean) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean))


def fitted_minimum(ratios: Sequence[float], costs: Sequence[float]) -> float:
    """Return where a parabola through the lowest costs has its minimum; NaN if it has none there.

    It is fitted in the logarithm of the ratios, ascending, to the five around the lowest cost.
    """
    if len(ratios) < 3:
        return math.nan
    begin = max(0, min(int(np.argmin(costs)) - _FITTED // 2, len(ratios) - _FITTED))
    near = slice(begin, begin + _FITTED)
    at = np.log(ratios[near])
    curvature, slope, _ = np.polyfit(at, costs[near], 2)
    vertex = -slope / (2 * curvature) if curvature > 0 else math.nan
    return math.exp(vertex) if at[0] <= vertex <= at[-1] else math.nan


def _curves(mean: DataFrame) -> dict[tuple[int, str], DataFrame]:
    """Return the curve of every number of cameras and method, by ascending aspect ratio."""
    return {
        (int(cameras), str(method)): curve  # type: ignore[call-overload]
        for (cameras, method), curve in mean.groupby(["cameras", "method"])
    }


def _paragraph(results: Results, mean: DataFrame) -> str:
    count, conditions = results.rows["subject"].nunique(), results.conditions
    curves = _curves(mean)
    numbers = _listed([str(n) for n in sorted(mean["cameras"].unique())])
    return (
        f"EM and 2-view planned for {counted(count, 'subject')} before cylinders of {numbers}"
        " cameras, in all grids whose ratio of the distance between rows to that between columns,"
        f" along the cylinder, is between about 1:4 and 6:1, on {conditions.samples:,} samples, and"
        f" were judged on {conditions.judged:,} others. {_minima(curves)} {_two_view_lower(curves)}"
        f" {_more_cameras_lower(curves)}\n"
    )


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _minima(curves: dict[tuple[int, str], DataFrame]) -> str:
    found = [_minimum(curve) for curve in curves.values()]
    ratios = [ratio for ratio, _ in found if not math.isnan(ratio)]
    excess = [100 * more for _, more in found if not math.isnan(more)]
    if not ratios:
        return "No curve has its minimum within these ratios; the paper's have it near 3:2."
    middle = math.exp(float(np.mean(np.log(ratios))))
    at_paper = f" At 3:2 it costs {_from_to(excess, '.1f')} % more than at best." if excess else ""
    return (
        f"Parabolas in the ratio's logarithm have their minima at {_from_to(ratios, '.2f')}, on"
        f" average at {middle:.2f}, or {1 / middle:.2f} taken as columns over rows; the paper's are"
        f" near 3:2.{at_paper}{_reason(middle)}"
    )


def _reason(ratio: float) -> str:
    """Return what may be behind a minimum far below the paper's."""
    if ratio > _PAPER_RATIO / _ALIKE:
        return ""
    return (
        " On the subject, nearer to the axis, columns are closer together than on the cylinder, and"
        " rows are not: that may be why."
    )


def _from_to(values: Sequence[float], form: str) -> str:
    least, most = (format(value, form) for value in (min(values), max(values)))
    return least if least == most else f"{least} to {most}"


def _minimum(curve: DataFrame) -> tuple[float, float]:
    """Return the best ratio of a curve, and how much more than its least cost 3:2 costs."""
    ratios, costs = curve["aspect_ratio"].tolist(), curve["cost"].tolist()
    at_paper = float(np.interp(math.log(_PAPER_RATIO), np.log(ratios), costs, math.nan, math.nan))
    return fitted_minimum(ratios, costs), at_paper / min(costs) - 1


def _two_view_lower(curves: dict[tuple[int, str], DataFrame]) -> str:
    counts = [n for n, method in curves if method == TWO_VIEW.name and (n, EM.name) in curves]
    lower = all(_is_lower(curves[n, TWO_VIEW.name], curves[n, EM.name]) for n in counts)
    return f"2-view is {_uniformly(lower)} lower than EM (the paper: uniformly)."


def _more_cameras_lower(curves: dict[tuple[int, str], DataFrame]) -> str:
    lower = all(
        _is_lower(curves[more, method], curves[fewer, method])
        for method in _MARKERS
        for fewer, more in pairwise(sorted(n for n, name in curves if name == method))
    )
    return f"More cameras cost {_uniformly(lower)} less than fewer (the paper: uniformly)."


def _uniformly(really: bool) -> str:
    return "uniformly" if really else "not uniformly"


def _is_lower(curve: DataFrame, other: DataFrame) -> bool:
    """Return whether a curve runs below another wherever both have a ratio to compare."""
    at = np.union1d(curve["aspect_ratio"], other["aspect_ratio"])
    lower, upper = (
        np.interp(at, each["aspect_ratio"], each["cost"], math.nan, math.nan)
        for each in (curve, other)
    )
    return not (lower >= upper).any()


def _table(mean: DataFrame) -> str:
    """Return the cheapest grid of every curve."""
    header = ("cameras", "method", "best grid", "ratio", "cost", "cost on fresh samples",
              "minimum of the parabola")  # fmt: skip
    return table(header, (_cells(*each) for each in _curves(mean).items()))


def _cells(key: tuple[int, str], curve: DataFrame) -> list[str]:
    cameras, method = key
    best = curve.nsmallest(1, "cost").iloc[0]
    ratio, _ = _minimum(curve)
    return [
        str(cameras),
        method,
        f"{int(best['rows'])} × {cameras // int(best['rows'])}",
        f"{best['aspect_ratio']:.2f}",
        f"{best['cost']:.1f}",
        f"{best['fresh_cost']:.1f}",
        "" if math.isnan(ratio) else f"{ratio:.2f}",
    ]


def _draw(figure: Figure, mean: DataFrame) -> None:
    axes = figure.add_subplot()
    for (cameras, method), curve in _curves(mean).items():
        style = f"{_MARKERS[method]}-"
        label = f"{cameras} cameras, {method}"
        axes.plot(curve["aspect_ratio"], curve["cost"], style, color=_COLOURS[cameras], label=label)
    axes.axvline(_PAPER_RATIO, color="black", linewidth=0.8, linestyle=":")
    axes.set_xscale("log", base=2)
    ticks = {
        0.25: "1:4",
        0.5: "1:2",
        2 / 3: "2:3",
        1: "1:1",
        1.5: "3:2",
        2: "2:1",
        4: "4:1",
        6: "6:1",
    }
    axes.set_xticks(list(ticks), list(ticks.values()))
    axes.minorticks_off()
    axes.set_xlabel("distance between rows : distance between columns (dotted: the paper's minima)")
    axes.set_ylabel("cost")
    axes.legend()
    axes.grid(linewidth=0.4)


EXPERIMENT = Experiment(
    name="cameras",
    title="Numbers of cameras and rows",
    paper="Sec. 4.5",
    tasks=each_subject(*(each for cameras in _COLOURS for each in layouts(cameras))),
    measure=_measure,
    write_up=_write_up,
)
