# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What the aperture does: depth of field on one side, diffraction on the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core.problem.lenses import with_lenses
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.diffraction import GREEN, airy_diameter
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import lens_of_aperture
from focus_planner.core.rig.rig import Rig
from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.measuring.methods import CLOSEST, EM, TWO_VIEW_ALL
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import percent, table
from focus_planner.evaluation.writing.means import mean_column, mean_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_METHODS = (CLOSEST, EM, TWO_VIEW_ALL)
_F_NUMBERS = (2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0)
_WAVELENGTHS = {"defocus alone": 0.0, "with diffraction": GREEN}


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem, fresh = subject.problem(conditions), subject.fresh_problem(conditions)
    rows: list[Row] = []
    for f_number in _F_NUMBERS:
        lenses = _lenses(subject.rig, f_number)
        told = _told(problem, lenses)
        for blur, wavelength in _WAVELENGTHS.items():
            planned = with_lenses(problem, lenses, wavelength)
            judged = with_lenses(fresh, lenses, wavelength)
            of_problem = {"f_number": f_number, "blur": blur, **told, "focus_range": _held(planned)}
            for method in _METHODS:
                focus = method.solve(planned, subject.rig).focus_distances
                quality = judge(judged, focus)
                rows.append(
                    {
                        **of_problem,
                        "method": method.name,
                        "fresh_cost": quality.cost.value,
                        "in_focus": quality.in_focus_area.value / fresh.samples.areas.sum(),
                    }
                )
    return Measured(rows)


def _lenses(rig: Rig, f_number: float) -> tuple[Lens, ...]:
    """Return every camera's lens at an f-number, with its circle of confusion or an assumed one."""
    return tuple(
        lens_of_aperture(camera.lens, f_number, camera.lens.circle_of_confusion, camera.intrinsics)
        for camera in rig.cameras
    )


def _told(problem: Problem, lenses: tuple[Lens, ...]) -> Row:
    """Return what follows from the lenses: means of the cameras, focused on what they see."""
    depth = np.array([np.median(problem.depth)])
    circles = [lens.circle_of_confusion or 0.0 for lens in lenses]
    return {
        "circle_of_confusion": float(np.mean(circles)),
        "airy_diameter": float(np.mean([airy_diameter(depth, lens)[0] for lens in lenses])),
    }


def _held(problem: Problem) -> float:
    """Return the median range of focus distances that hold a visible place in focus, metres."""
    ranges = problem.focus_far - problem.focus_near
    return float(np.median(np.maximum(ranges, 0.0)))


def _write_up(results: Results) -> WriteUp:
    keys = ["blur", "f_number", "method"]
    measured = ["in_focus", "fresh_cost", "focus_range", "circle_of_confusion", "airy_diameter"]
    mean = results.rows.groupby(keys)[measured].mean()
    text = _paragraph(results, mean) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean["in_focus"]))


def _paragraph(results: Results, mean: DataFrame) -> str:
    count = results.rows["subject"].nunique()
    subjects = "1 subject" if count == 1 else f"{count} subjects"
    both = mean_rows(mean, "with diffraction")
    circle = 1e6 * both.circle_of_confusion.iloc[0]
    return (
        f"Plans for {subjects}, on {results.conditions.samples:,} samples, were judged on"
        f" {results.conditions.judged:,} others from f/{min(_F_NUMBERS):g} to"
        f" f/{max(_F_NUMBERS):g}. A point is sharp if it is imaged no wider than the circle of"
        f" confusion, {circle:.1f} µm on average: that of the lenses, or the one to assume where"
        " nothing tells it. Its width is the root of the squares of defocus and of the Airy disc,"
        f" 2.44 λ N (1 + m) at {1e9 * GREEN:.0f} nm, so that coverage rises with the depth of field"
        f" until diffraction takes it back{_none_sharp(both)}. {_best(both, CLOSEST.name)};"
        f" {_best(both, EM.name)}; {_best(both, TWO_VIEW_ALL.name)}. {_early(both)}\n"
    )


def _none_sharp(both: DataFrame) -> str:
    """Return from which f-number on nothing is sharp at all, as a clause."""
    most = both.in_focus.groupby("f_number").max()
    blurred = most.index[most == 0]
    if not len(blurred):
        return ""
    return f"; at f/{blurred.min():g} the Airy disc alone is wider, and nothing counts as sharp"


def _best(both: DataFrame, method: str) -> str:
    """Return the f-number at which a method holds most in focus, in words."""
    of_method = both.in_focus.xs(method, level="method")
    name = "Autofocus (*closest*)" if method == CLOSEST.name else method
    return f"{name} holds most at f/{of_method.idxmax():g}: {percent(of_method.max())}"


def _early(both: DataFrame) -> str:
    """Return how wide open 2-view still beats autofocus at its best."""
    autofocus = both.in_focus.xs(CLOSEST.name, level="method").max()
    planned = both.in_focus.xs(TWO_VIEW_ALL.name, level="method")
    better = planned[planned > autofocus]
    if better.empty:
        return "2-view nowhere holds more than that."
    return (
        f"Planned by 2-view, f/{better.index[0]:g} already holds {percent(better.iloc[0])}, more"
        " than autofocus at any f-number."
    )


def _table(mean: DataFrame) -> str:
    """Return what is in focus by f-number, without diffraction in brackets."""
    header = (
        "f-number", "Airy disc, µm", "focus range, mm", *(method.name for method in _METHODS),
        "cost, 2-view",
    )  # fmt: skip
    rows = []
    for f_number in _F_NUMBERS:
        both, alone = (mean_rows(mean, blur, f_number) for blur in reversed(_WAVELENGTHS))
        told = both.loc[TWO_VIEW_ALL.name]
        shares = [
            f"{percent(both.in_focus[method.name])} ({percent(alone.in_focus[method.name])})"
            for method in _METHODS
        ]
        rows.append(
            [
                f"f/{f_number:g}",
                f"{1e6 * told.airy_diameter:.1f}",
                f"{1000 * told.focus_range:.0f}",
                *shares,
                f"{told.fresh_cost:.1f}",
            ]
        )
    return (
        "Of the surface in focus, in brackets by defocus alone; the focus range is that of focus"
        " distances that hold a place, the median of all that are seen:\n\n" + table(header, rows)
    )


def _draw(figure: Figure, mean: Series[float]) -> None:
    axes = figure.add_subplot()
    for method in _METHODS:
        for blur, style in (("with diffraction", ".-"), ("defocus alone", ":")):
            share = 100 * mean_column(mean, blur).xs(method.name, level="method")
            label = f"{method.name}, {blur}"
            axes.plot(share.index, share, style, color=method.colour, label=label)
    axes.set_xscale("log")
    axes.set_xticks(_F_NUMBERS, [f"f/{number:g}" for number in _F_NUMBERS])
    axes.minorticks_off()
    axes.set_ylim(0, 100)
    axes.set_xlabel("f-number")
    axes.set_ylabel("in focus, % of the surface")
    axes.legend(fontsize=8)


EXPERIMENT = Experiment(
    name="aperture",
    title="Apertures",
    paper="",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
