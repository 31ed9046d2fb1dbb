# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Plans made on wrong geometry, judged on what is true: noise, holes, poses, moved subjects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
from focus_planner.evaluation.measuring.methods import AVERAGE, CLOSEST, EM, TWO_VIEW_ALL
from focus_planner.evaluation.measuring.wrong_geometry import (
    leaning,
    moved,
    noisy,
    with_holes,
    with_position_error,
    with_rotation_error,
)
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import percent, table
from focus_planner.evaluation.writing.means import mean_column, mean_row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_METHODS = (CLOSEST, AVERAGE, EM, TWO_VIEW_ALL)
# Of each error: patterns, and samplings to plan on.
_REPETITIONS = 2
_NOTHING = "nothing"


@dataclass(frozen=True)
class _Error:
    """Something that is wrong.

    Attributes
    ----------
    axis : str
        What its size is, for plots, with the unit.
    told : str
        A size in words, to be formatted.
    sizes : tuple of float
        In the unit.
    applied : callable
        Returns the subject as it is planned for, given the true one, a size and a generator.
    """

    axis: str
    told: str
    sizes: tuple[float, ...]
    applied: Callable[[Subject, float, np.random.Generator], Subject]


def _with_noise(subject: Subject, size: float, random: np.random.Generator) -> Subject:
    return replace(subject, surface=noisy(subject.scene, size / 1000, random))


def _with_holes(subject: Subject, size: float, random: np.random.Generator) -> Subject:
    return replace(subject, surface=with_holes(subject.scene, size / 100, random))


def _moved(subject: Subject, size: float, random: np.random.Generator) -> Subject:
    return replace(subject, surface=moved(subject.surface, size / 1000, random))


def _leaning(subject: Subject, size: float, random: np.random.Generator) -> Subject:
    return replace(subject, surface=leaning(subject.surface, size / 1000, random))


def _displaced(subject: Subject, size: float, random: np.random.Generator) -> Subject:
    return subject.with_rig(with_position_error(subject.rig, size / 1000, random))


def _turned(subject: Subject, size: float, random: np.random.Generator) -> Subject:
    return subject.with_rig(with_rotation_error(subject.rig, size, random))


_ERRORS = {
    "depth": _Error("depth noise, σ in mm", "σ = {:g} mm", (1, 2, 5, 10, 20), _with_noise),
    "holes": _Error("surface missing, %", "{:g} %", (5, 10, 20, 40), _with_holes),
    "positions": _Error("camera positions, σ in mm", "σ = {:g} mm", (1, 2, 5, 10, 20), _displaced),
    "rotations": _Error(
        "camera rotations, σ in degrees", "σ = {:g}°", (0.1, 0.2, 0.5, 1, 2), _turned
    ),
    "moved": _Error("subject moved, mm", "{:g} mm", (5, 10, 20, 50), _moved),
    "leaning": _Error("subject leaning, mm at the top", "{:g} mm", (5, 10, 20, 50), _leaning),
}
_TOLD = {
    "depth": "depth noise",
    "holes": "surface missing",
    "positions": "camera positions",
    "rotations": "camera rotations",
    "moved": "subject moved",
    "leaning": "subject leaning, at the top",
}


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    (truth,) = subjects
    fresh, wrong = truth.fresh_problem(conditions), str(setting["wrong"])
    area = float(fresh.samples.areas.sum())
    rows: list[Row] = []
    for repetition in range(_REPETITIONS):
        sampled = replace(conditions, seed=conditions.seed + repetition)
        for size in _ERRORS[wrong].sizes if wrong in _ERRORS else (0.0,):
            believed = _believed(truth, wrong, size, (conditions.seed, repetition))
            problem = believed.problem(sampled)
            for method in _METHODS:
                focus = method.solve(problem, truth.rig).focus_distances
                quality = judge(fresh, focus)
                rows.append(
                    {
                        "size": float(size),
                        "repetition": repetition,
                        "method": method.name,
                        "fresh_cost": quality.cost.value,
                        "in_focus": quality.in_focus_area.value / area,
                    }
                )
    return Measured(rows)


def _believed(truth: Subject, wrong: str, size: float, seed: tuple[int, ...]) -> Subject:
    """Return the subject that a plan is made for."""
    if wrong == _NOTHING:
        return truth
    # Every error has patterns of its own, the same ones at all sizes.
    random = np.random.default_rng([*seed, list(_ERRORS).index(wrong)])
    return _ERRORS[wrong].applied(truth, size, random)


def _write_up(results: Results) -> WriteUp:
    keys = ["wrong", "size", "method"]
    mean = results.rows.groupby(keys)[["in_focus", "fresh_cost"]].mean()
    text = _paragraph(results, mean) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean["in_focus"]))


def _paragraph(results: Results, mean: DataFrame) -> str:
    count = results.rows["subject"].nunique()
    subjects = "1 subject" if count == 1 else f"{count} subjects"
    best, autofocus = _true(mean, TWO_VIEW_ALL.name), _true(mean, CLOSEST.name)
    losses = "; ".join(
        _loss(mean, wrong, best.in_focus) for wrong in _ERRORS if _measured(mean, wrong)
    )
    return (
        f"The paper leaves to the future what becomes of plans when the geometry is wrong. Here"
        f" plans for {subjects} were made on {results.conditions.samples:,} samples of a wrong"
        " surface, or for wrong camera poses, and judged on"
        f" {results.conditions.judged:,} others of the true surface before the true cameras,"
        f" {_REPETITIONS} errors of each size. Depth noise is along the normals, alike over some"
        " 50 mm; what is missing is missing in holes of 1 % of the surface each. Planned on the"
        f" truth, 2-view (all samples) holds {percent(best.in_focus)} of the surface in focus at a"
        f" cost of {best.fresh_cost:.1f}. The share that it loses (in points), and the cost that"
        f" it gains: {losses}. Autofocus measures the subject itself, through the camera as it"
        f" stands, so no such error touches it: it is *closest* planned on the truth, and holds"
        f" {percent(autofocus.in_focus)} at a cost of {autofocus.fresh_cost:.1f}."
        f" {_where_autofocus_wins(mean, autofocus.in_focus)}\n"
    )


def _true(mean: DataFrame, method: str) -> Series[float]:
    """Return what a method's plan on the truth is worth."""
    return mean_row(mean, _NOTHING, 0.0, method)


def _measured(mean: DataFrame | Series[float], wrong: str) -> bool:
    return wrong in mean.index.get_level_values("wrong")


def _loss(mean: DataFrame, wrong: str, in_focus: float) -> str:
    """Return what 2-view loses at the least and at the largest size of an error."""
    of_method = mean.xs((wrong, TWO_VIEW_ALL.name), level=("wrong", "method"))
    true_cost = _true(mean, TWO_VIEW_ALL.name).fresh_cost
    told = [
        f"{_number(100 * (in_focus - each.in_focus))} and {_number(each.fresh_cost - true_cost)}"
        f" ({_ERRORS[wrong].told.format(size)})"
        for size, each in (
            (size, of_method.loc[size]) for size in (of_method.index.min(), of_method.index.max())
        )
    ]
    return f"{_TOLD[wrong]}, {told[0]} to {told[-1]}"


def _number(value: float) -> str:
    """Return ``−4.6``; what rounds to nothing has no sign."""
    return percent(value / 100).removesuffix(" %")


def _where_autofocus_wins(mean: DataFrame, autofocus: float) -> str:
    """Return at which sizes autofocus holds more in focus than 2-view on wrong geometry."""
    wins = []
    for wrong, error in _ERRORS.items():
        of_method = mean[
            (mean.index.get_level_values("wrong") == wrong)
            & (mean.index.get_level_values("method") == TWO_VIEW_ALL.name)
        ]
        sizes = of_method[of_method.in_focus < autofocus].index.get_level_values("size")
        if len(sizes):
            wins.append(f"{_TOLD[wrong]} of {error.told.format(sizes.min())}")
    if not wins:
        return "At every size measured, 2-view on wrong geometry still holds more."
    return f"It holds more than 2-view from {', '.join(wins)} on."


def _table(mean: DataFrame) -> str:
    header = ("planned on", "size", *(method.name for method in _METHODS))
    rows = [["the truth", "", *_cells(mean, _NOTHING, 0.0)]]
    for wrong, error in _ERRORS.items():
        measured = [size for size in error.sizes if (wrong, size) in mean.index]
        rows += [
            [_TOLD[wrong], error.told.format(size), *_cells(mean, wrong, size)]
            for size in measured[-1:] + measured[-2:-1]
        ][::-1]
    return "Of the surface in focus:\n\n" + table(header, rows)


def _cells(mean: DataFrame, wrong: str, size: float) -> list[str]:
    return [percent(mean_row(mean, wrong, size, method.name).in_focus) for method in _METHODS]


def _draw(figure: Figure, mean: Series[float]) -> None:
    truth = 100 * mean_column(mean, _NOTHING, 0.0)
    figure.set_layout_engine("constrained")
    axes = figure.subplots(2, 3, sharey=True).ravel()
    for place, (wrong, error) in zip(axes, _ERRORS.items(), strict=True):
        if _measured(mean, wrong):
            _draw_error(place, mean_column(mean, wrong))
        place.axhline(truth[CLOSEST.name], color=CLOSEST.colour, ls=":", label="autofocus")
        place.axhline(
            truth[TWO_VIEW_ALL.name],
            color=TWO_VIEW_ALL.colour,
            ls=":",
            label="2-view on the truth",
        )
        place.set_xscale("log")
        place.set_xticks(error.sizes, [f"{size:g}" for size in error.sizes])
        place.minorticks_off()
        place.set_xlabel(error.axis, fontsize=8)
        place.tick_params(labelsize=8)
    figure.supylabel("in focus, % of the surface", fontsize=9)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=6, fontsize=8, frameon=False)


def _draw_error(axes: Axes, mean: Series[float]) -> None:
    for method in _METHODS:
        of_method = 100 * mean.xs(method.name, level="method")
        axes.plot(
            of_method.index, of_method, ".-", color=method.colour, label=method.name, clip_on=False
        )


EXPERIMENT = Experiment(
    name="geometry",
    title="Wrong geometry",
    paper="future work, Sec. 5",
    tasks=each_subject({"wrong": _NOTHING}, *({"wrong": wrong} for wrong in _ERRORS)),
    measure=_measure,
    write_up=_write_up,
    most_subjects=8,
)
