# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a pair of cameras gains by moving together, by how much of what they see is the same."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array
from scipy.stats import spearmanr

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers.k_view import gains_of_pairs
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
    from matplotlib.figure import Figure
    from pandas import DataFrame

# Of a body before 168 cameras, some 4,500 pairs see a common sample.
_PAIRS = 500
_BIN_ENDS = (0.0, 0.1, 0.25, 0.5, 1.0)
# Gains below it are roundings.
_LEAST_GAIN = 1e-9


def overlaps(problem: Problem) -> tuple[IntArray, FloatArray]:
    """Return the pairs of cameras that see a common sample, and how much of what they see.

    Returns
    -------
    pairs : (T, 2) array of int
        Each pair once. Cameras that cannot hold any sample in focus are left out.
    overlap : (T,) array
        Of the samples that either camera sees, the share that both see.
    """
    ones = np.ones(len(problem.sample_index), dtype=np.int64)
    shape = (problem.sample_count, problem.camera_count)
    seen = csr_array((ones, (problem.sample_index, problem.camera_index)), shape=shape)
    common = (seen.T @ seen).toarray()
    able = np.diff(problem.cells.offsets) > 0
    a, b = np.nonzero(np.triu(common * able[:, None] * able, 1))
    counts = common.diagonal()
    both = common[a, b]
    return np.stack([a, b], axis=1).astype(np.int32), both / (counts[a] + counts[b] - both)


def _measure(subjects: Sequence[Subject], _: Row, conditions: Conditions) -> Measured:
    (subject,) = subjects
    problem = subject.problem(conditions)
    pairs, overlap = overlaps(problem)
    drawn = np.random.default_rng(conditions.seed).permutation(len(pairs))[:_PAIRS]
    pairs, overlap = pairs[drawn], overlap[drawn]
    focus = EM.solve(problem, subject.rig).focus_distances
    gain = gains_of_pairs(problem, focus, pairs)
    gain_assigned = gains_of_pairs(problem, focus, pairs, "assigned")
    return Measured(
        [
            {
                "camera_a": problem.names[a],
                "camera_b": problem.names[b],
                "overlap": float(overlap[t]),
                "gain": float(gain[t]),
                "gain_assigned": float(gain_assigned[t]),
            }
            for t, (a, b) in enumerate(pairs)
        ]
    )


def _write_up(results: Results) -> WriteUp:
    rows = results.rows
    text = _paragraph(results) + "\n" + _table(rows)
    return WriteUp(text, lambda figure: _draw(figure, rows))


def _paragraph(results: Results) -> str:
    rows, samples = results.rows, results.conditions.samples
    subjects = rows["subject"].nunique()
    return (
        f"{counted(len(rows), 'pair')} of cameras before {counted(subjects, 'subject')}, drawn from"
        f" those that see a common one of {samples:,} samples, moved from EM's plan to their best"
        " focus distances, one pair at a time. Overlap is the share of the samples seen by either"
        " camera that both see. The paper sees a clear correlation of overlap and gain. With its"
        f" step, which re-assigns only the pair's own samples,"
        f" {percent(_gaining(rows, 'gain_assigned'))} of the pairs gain, and"
        f" {_correlation(rows, 'gain_assigned')}.{_extremes(rows)} With the step that re-assigns"
        f" all that the pair sees, {percent(_gaining(rows, 'gain'))} gain, and"
        f" {_correlation(rows, 'gain')}: it may gain even from moving one of the two, whatever it"
        " shares with the other, since EM moves a camera only for the samples that it already"
        " has.\n"
    )


def _extremes(rows: DataFrame) -> str:
    """Return how many of the pairs gain by the paper's step that share most and least."""
    least, most = _BIN_ENDS[1], _BIN_ENDS[-2]
    apart, alike = rows[rows["overlap"] <= least], rows[rows["overlap"] > most]
    if apart.empty or alike.empty:
        return ""
    return (
        f" Of those with an overlap above {percent(most, 0)}"
        f" {percent(_gaining(alike, 'gain_assigned'))} gain, of those with up to"
        f" {percent(least, 0)} {percent(_gaining(apart, 'gain_assigned'))}."
    )


def _correlation(rows: DataFrame, gain: str) -> str:
    """Return Spearman's rank correlation in words; there is none of what does not vary."""
    if rows["overlap"].nunique() < 2 or rows[gain].nunique() < 2:
        return "a correlation cannot be told"
    rho = float(spearmanr(rows["overlap"], rows[gain]).statistic)
    return f"Spearman's ρ is {rho:.2f}".replace("-", "−")


def _gaining(rows: DataFrame, gain: str) -> float:
    return float((rows[gain] > _LEAST_GAIN).mean())


def _table(rows: DataFrame) -> str:
    header = ("overlap", "pairs", "gain, paper's step", "pairs that gain",
              "gain, all samples", "pairs that gain")  # fmt: skip
    bins = np.digitize(rows["overlap"], _BIN_ENDS[1:-1], right=True)
    groups = ((place, rows[bins == place]) for place in range(len(_BIN_ENDS) - 1))
    return table(header, (_cells(place, group) for place, group in groups if len(group)))


def _cells(place: int, rows: DataFrame) -> list[str]:
    cells = [f"{100 * _BIN_ENDS[place]:g}–{100 * _BIN_ENDS[place + 1]:g} %", f"{len(rows):,}"]
    for gain in ("gain_assigned", "gain"):
        cells += [f"{rows[gain].mean():.4f}", percent(_gaining(rows, gain))]
    return cells


def _draw(figure: Figure, rows: DataFrame) -> None:
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, method, gain in ((left, TWO_VIEW, "gain_assigned"), (right, TWO_VIEW_ALL, "gain")):
        axes.plot(100 * rows["overlap"], rows[gain], ".", color=method.colour, alpha=0.4)
        axes.set_title(method.name)
        axes.set_xlabel("samples seen by both of those seen by either, %")
        axes.grid(linewidth=0.4)
    left.set_ylabel("fall of the cost")


EXPERIMENT = Experiment(
    name="overlap",
    title="Overlap of pairs",
    paper="Sec. 4.6.1",
    tasks=each_subject(),
    measure=_measure,
    write_up=_write_up,
)
