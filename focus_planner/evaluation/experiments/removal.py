# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Cameras removed: which are missed least, what their loss costs, and what one failure does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_pictures
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import SOLVERS, Options
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
from focus_planner.evaluation.measuring.methods import CLOSEST, EM, TWO_VIEW_ALL
from focus_planner.evaluation.subject import Subject, judge
from focus_planner.evaluation.writing.markdown import percent, table
from focus_planner.evaluation.writing.means import mean_row, mean_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame, Series

_SHARES = (1.0, 0.875, 0.75, 0.625, 0.5, 0.375, 0.25)
_LEAST_MISSED, _AT_RANDOM, _EACH_ALONE = "least missed", "at random", "each alone"
_REPLANNED, _UNNOTICED, _AUTOFOCUS = "replanned", "not replanned", "autofocus"
# Of the failures of single cameras: so many are planned for again.
_FAILURES = 16
_LEAST_CAMERAS = 4


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    if len(subject.rig) < _LEAST_CAMERAS:
        raise InputError(
            f"rig of {subject.name}",
            f"at least {_LEAST_CAMERAS} cameras, to remove some",
            str(len(subject.rig)),
            "leave out the experiment 'removal'",
        )
    problem, fresh = subject.problem(conditions), subject.fresh_problem(conditions)
    focus = TWO_VIEW_ALL.solve(problem, subject.rig).focus_distances
    focus = fill_missing_distances(problem, focus)
    if setting["removed"] == _EACH_ALONE:
        return Measured(_each_alone(subject.rig, problem, fresh, focus))
    closest = CLOSEST.solve(problem, subject.rig).focus_distances
    closest = fill_missing_distances(problem, closest)
    order = None
    if setting["removed"] == _AT_RANDOM:
        order = np.random.default_rng(conditions.seed).permutation(len(subject.rig))
    return Measured(list(_fewer_and_fewer(problem, fresh, focus, closest, order)))


def _fewer_and_fewer(
    problem: Problem,
    fresh: Problem,
    planned: FloatArray,
    closest: FloatArray,
    order: NDArray[np.int64] | None,
) -> Iterator[Row]:
    """Yield what plans are worth with ever fewer cameras.

    Parameters
    ----------
    problem, fresh : Problem
    planned, closest : (C,) arrays
        The plan for all cameras, and what autofocus sets, metres.
    order : (C,) array of int64, optional
        In which cameras are removed; by default, always the one that is missed least, while all
        others stay focused as they are.
    """
    taken, focus = np.ones(len(planned), dtype=np.bool_), planned
    for share in _SHARES:
        while taken.sum() > round(share * len(planned)):
            gone = _least_missed(problem, focus) if order is None else order[(~taken).sum()]
            taken[gone] = False
            focus = np.where(taken, focus, kernels.UNTAKEN)
        if not taken.all():
            focus = _planned_again(problem, taken, focus)
        for plan, distances in (
            (_REPLANNED, focus),
            (_UNNOTICED, planned),
            (_AUTOFOCUS, closest),
        ):
            judged = judge(fresh, np.where(taken, distances, kernels.UNTAKEN))
            in_focus = judged.in_focus_area.value / fresh.samples.areas.sum()
            yield _row(plan, judged.cost.value, float(in_focus), int(taken.sum()), share)


def _row(
    plan: str,
    fresh_cost: float,
    in_focus: float,
    cameras: int,
    share: float = 0.0,
    camera: tuple[str, int, int] = ("", -1, -1),
) -> Row:
    """Return a row; the camera that is missing is given by name, row and column of a grid."""
    return {
        "plan": plan,
        "share": share,
        "cameras": cameras,
        "camera": camera[0],
        "row": camera[1],
        "column": camera[2],
        "fresh_cost": fresh_cost,
        "in_focus": in_focus,
    }


def _each_alone(rig: Rig, problem: Problem, fresh: Problem, focus: FloatArray) -> list[Row]:
    """Return what the failure of each camera costs, unnoticed and, of some, planned for again."""
    whole = judge(fresh, focus)
    area = float(fresh.samples.areas.sum())
    cost, in_focus = whole.cost.value, whole.in_focus_area.value / area
    places = [_place(rig, number) for number in range(len(rig))]
    dearer, blurred = missed(fresh, focus)
    rows = [_row(_UNNOTICED, cost, in_focus, len(rig))]
    rows += [
        _row(
            _UNNOTICED,
            cost + float(dearer[c]),
            in_focus - float(blurred[c]) / area,
            len(rig) - 1,
            camera=place,
        )
        for c, place in enumerate(places)
    ]
    # Evenly spaced from the least missed to the most, so that their mean is that of all.
    ranks = np.linspace(0, len(rig) - 1, min(_FAILURES, len(rig))).round().astype(np.int64)
    for c in np.argsort(dearer, kind="stable")[ranks].tolist():
        taken = np.arange(len(rig)) != c
        left = judge(fresh, _planned_again(problem, taken, focus))
        share = left.in_focus_area.value / area
        rows.append(_row(_REPLANNED, left.cost.value, share, len(rig) - 1, camera=places[c]))
    return rows


def missed(problem: Problem, focus: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how much each camera is missed if it fails and all others stay as they are.

    Parameters
    ----------
    problem : Problem
        For one view.
    focus : (C,) array
        Metres.

    Returns
    -------
    dearer : (C,) array
        By how much the cost rises.
    blurred : (C,) array
        How much less surface is in focus, square metres; below 0 where the next camera images in
        focus, although it images worse, what this one does not.
    """
    costs, best = problem.evaluate(focus)
    # The mean cost of the two best views; a view that is missing costs 1, as no camera does.
    of_two, both = replace(problem, views=2).assign(focus)
    samples = problem.samples
    seen = best >= 0
    rises = samples.weights / samples.weights.sum() * 2000 * (of_two - costs)
    second = both[:, 1].copy()
    held = problem.in_focus(focus, best).astype(np.float64) - problem.in_focus(focus, second)
    dearer, blurred = (
        np.bincount(best[seen], values[seen], problem.camera_count)
        for values in (rises, samples.areas * held)
    )
    return dearer, blurred


def _least_missed(problem: Problem, focus: FloatArray) -> int:
    """Return the camera whose failure costs least, of those that are left."""
    dearer, _ = missed(problem, focus)
    return int(np.argmin(np.where(focus == kernels.UNTAKEN, np.inf, dearer)))


def _planned_again(problem: Problem, taken: NDArray[np.bool_], focus: FloatArray) -> FloatArray:
    """Return a plan for the cameras that are left, from where they are focused."""
    start = np.where(taken, focus, np.nan)
    options = Options(TWO_VIEW_ALL.k, TWO_VIEW_ALL.scope, start=start)
    again = SOLVERS[TWO_VIEW_ALL.solver](with_pictures(problem, taken), options)
    return np.where(taken, fill_missing_distances(problem, again.focus_distances), kernels.UNTAKEN)


def _place(rig: Rig, number: int) -> tuple[str, int, int]:
    """Return a camera's name, and its row and column, -1 without a grid."""
    name = rig.cameras[number].name
    return (name, -1, -1) if rig.grid is None else (name, *divmod(number, rig.grid.columns))


def _write_up(results: Results) -> WriteUp:
    rows = results.rows
    fewer = rows[rows.removed != _EACH_ALONE]
    keys = ["removed", "plan", "share"]
    mean = fewer.groupby(keys)[["cameras", "fresh_cost", "in_focus"]].mean()
    alone = _failures(rows[rows.removed == _EACH_ALONE])
    text = _paragraph(results, mean, alone) + "\n" + _table(mean)
    return WriteUp(text, lambda figure: _draw(figure, mean, alone))


def _failures(rows: DataFrame) -> DataFrame:
    """Return the failures of single cameras, with what they cost in addition."""
    failed = rows[rows.camera != ""].copy()
    whole = rows[rows.camera == ""].set_index("subject")
    failed["dearer"] = failed.fresh_cost - failed.subject.map(whole.fresh_cost)
    failed["blurred"] = failed.subject.map(whole.in_focus) - failed.in_focus
    return failed


def _paragraph(results: Results, mean: DataFrame, alone: DataFrame) -> str:
    count = results.rows["subject"].nunique()
    subjects = "1 subject" if count == 1 else f"{count} subjects"
    return (
        f"From the rigs of {subjects} cameras were removed one after the other, always the one"
        " that was missed least while all others stayed focused as they were; after every eighth"
        f" of the rig the rest was planned again by 2-view, on {results.conditions.samples:,}"
        f" samples, and judged on {results.conditions.judged:,} others. {_halved(mean)}"
        f" {_few(mean)} {_one(alone)}{_rows_of_grid(alone)}\n"
    )


def _halved(mean: DataFrame) -> str:
    share, cost = mean.in_focus, mean.fresh_cost
    kept, random = ((way, _REPLANNED, 0.5) for way in (_LEAST_MISSED, _AT_RANDOM))
    whole = (_LEAST_MISSED, _REPLANNED, 1.0)
    left = mean.cameras[kept]
    return (
        f"With {left:.0f} of {mean.cameras[whole]:.0f} cameras {percent(share[kept])} of the"
        f" surface is in focus in place of {percent(share[whole])}, and the cost is"
        f" {cost[kept]:.1f} in place of {cost[whole]:.1f}; with as many drawn at random"
        f" {percent(share[random])} and {cost[random]:.1f}, and where the plan for all cameras is"
        f" kept for those left {percent(share[_LEAST_MISSED, _UNNOTICED, 0.5])} and"
        f" {cost[_LEAST_MISSED, _UNNOTICED, 0.5]:.1f}."
    )


def _few(mean: DataFrame) -> str:
    """Return with how few planned cameras as much is in focus as with all on autofocus."""
    autofocus = mean.in_focus[_LEAST_MISSED, _AUTOFOCUS, 1.0]
    planned = mean_rows(mean, _LEAST_MISSED, _REPLANNED)
    enough = planned[planned.in_focus >= autofocus]
    if enough.empty:
        return f"Autofocus holds more with all cameras: {percent(autofocus)}."
    few = enough.iloc[0]
    return (
        f"{few.cameras:.0f} planned cameras hold {percent(few.in_focus)}, all of them on autofocus"
        f" {percent(autofocus)}."
    )


def _one(alone: DataFrame) -> str:
    """Return what the failure of one camera does."""
    unnoticed = alone[alone.plan == _UNNOTICED]
    again = alone[alone.plan == _REPLANNED]
    same = unnoticed.merge(again, on=["subject", "camera"])
    worst = unnoticed.iloc[int(unnoticed.dearer.argmax())]
    return (
        f"A single camera that fails unnoticed raises the cost by {unnoticed.dearer.mean():.2f} on"
        f" average and blurs {percent(unnoticed.blurred.mean(), 2)} of the surface, at worst by"
        f" {worst.dearer:.1f} and {percent(worst.blurred, 2)} ({worst.camera}, {worst.subject})."
        f" Of cameras from the least to the most missed, failures cost {same.dearer_x.mean():.2f}"
        f" unnoticed and {same.dearer_y.mean():.2f} once the rest is planned again."
    ).replace(" -", " −")


def _rows_of_grid(alone: DataFrame) -> str:
    """Return which row of a grid is missed most and which least, as a sentence; "" without one."""
    of_row = _by_place(alone, ["row"])
    if len(of_row) < 2:
        return ""
    most, least = (of_row.index[int(at)] + 1 for at in (of_row.argmax(), of_row.argmin()))
    return (
        f" Of the {len(of_row)} rows of the grid, counted from below, cameras of row {most} are"
        f" missed most ({of_row.max():.2f} each), those of row {least} least ({of_row.min():.2f})."
    )


def _by_place(alone: DataFrame, keys: list[str]) -> Series[float]:
    """Return the mean cost of unnoticed failures by place on the grid."""
    on_grid = alone[(alone.plan == _UNNOTICED) & (alone["row"] >= 0)]
    return on_grid.groupby(keys).dearer.mean()


def _table(mean: DataFrame) -> str:
    header = (
        "cameras left", "least missed removed", "cost", "not replanned", "autofocus",
        "removed at random", "cost",
    )  # fmt: skip
    rows = []
    for share in _SHARES:
        planned, unnoticed, autofocus = (
            mean_row(mean, _LEAST_MISSED, plan, share)
            for plan in (_REPLANNED, _UNNOTICED, _AUTOFOCUS)
        )
        random = mean_row(mean, _AT_RANDOM, _REPLANNED, share)
        rows.append(
            [
                f"{planned.cameras:.0f} ({percent(share)})",
                percent(planned.in_focus),
                f"{planned.fresh_cost:.1f}",
                percent(unnoticed.in_focus),
                percent(autofocus.in_focus),
                percent(random.in_focus),
                f"{random.fresh_cost:.1f}",
            ]
        )
    return "Of the surface in focus, and the cost:\n\n" + table(header, rows)


def _draw(figure: Figure, mean: DataFrame, alone: DataFrame) -> None:
    figure.set_layout_engine("constrained")
    left, right = figure.subplots(1, 2)
    for way, plan, style, colour in (
        (_LEAST_MISSED, _REPLANNED, ".-", TWO_VIEW_ALL.colour),
        (_AT_RANDOM, _REPLANNED, ".--", TWO_VIEW_ALL.colour),
        (_LEAST_MISSED, _UNNOTICED, ".-", EM.colour),
        (_LEAST_MISSED, _AUTOFOCUS, ".-", CLOSEST.colour),
    ):
        share = 100 * mean_rows(mean, way, plan).in_focus
        left.plot(100 * share.index, share, style, color=colour, label=f"{plan}, {way} removed")
    left.set(xlabel="cameras left, %", ylabel="in focus, % of the surface", ylim=(0, 100))
    left.invert_xaxis()
    left.legend(fontsize=7)
    _draw_failures(right, alone)


def _draw_failures(axes: Axes, alone: DataFrame) -> None:
    """Draw what each camera's failure costs: on the grid, else from the most missed on."""
    by_place = _by_place(alone, ["row", "column"])
    if by_place.empty:
        of_camera = alone[alone.plan == _UNNOTICED].groupby("camera").dearer.mean()
        of_camera = of_camera.sort_values(ascending=False)
        axes.plot(range(1, len(of_camera) + 1), of_camera, color=TWO_VIEW_ALL.colour)
        axes.set(xlabel="cameras, the most missed first", ylabel="cost of its failure")
        return
    grid = by_place.unstack("column")
    rows, columns = grid.shape
    extent = (0.5, columns + 0.5, 0.5, rows + 0.5)
    image = axes.imshow(grid, origin="lower", cmap="Greens", aspect="auto", vmin=0, extent=extent)
    axes.set(xlabel="column", ylabel="row, from below")
    axes.figure.colorbar(image, ax=axes, orientation="horizontal", label="cost of a failure")


EXPERIMENT = Experiment(
    name="removal",
    title="Cameras removed",
    paper="",
    tasks=each_subject(*({"removed": way} for way in (_LEAST_MISSED, _AT_RANDOM, _EACH_ALONE))),
    measure=_measure,
    write_up=_write_up,
)
