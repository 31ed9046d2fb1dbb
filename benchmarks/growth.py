# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How planning times grow with the number of samples, compared with the paper's Table 2."""

from __future__ import annotations

import time
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem, rig
from benchmarks.speed import from_em_to_convergence
from benchmarks.timing import seconds, timed
from focus_planner import Problem, Scene
from focus_planner.core import kernels
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import Options, em, k_view, optimal

_EXPONENTS = range(7, 21)
_PICTURE = Path(__file__).parents[1] / "docs" / "growth.png"
# Seconds of one iteration of the paper's 2-view optimisation, by the number of samples.
_PAPER = {128: 3.7, 256: 3.8, 512: 4.2, 1024: 6.6, 2048: 17.9, 4096: 66.3, 8192: 259.2}
# Every stage that is drawn; :func:`_measure` tells the seconds of each.
_COLOURS = {
    "formulation": "#3b75af",
    "EM": "#519e3e",
    "2-view all, from EM": "#c4432b",
    "tight bound": "#8b61a8",
    "optimal, to 0.1 %": "#d98b1f",
}
# Seconds after which `optimal` is not waited for any longer, and drawn no more.
_PATIENCE = 60.0
_APART = 1.8  # labels, as a ratio of seconds
_GAP = "2-view above the bound"


def run(console: Console) -> None:
    """Print the table and draw ``docs/growth.png``."""
    name, scene = next(iter(body_scenes().items()))
    _measure(scene, 1000)
    measured = {2**exponent: _measure(scene, 2**exponent) for exponent in _EXPONENTS}
    title = f"Seconds on {name} before {len(rig())} cameras"
    table = Table("samples", *_COLOURS, _GAP, "paper, one 2-view iteration", title=title)
    for samples, figures in measured.items():
        paper = f"{_PAPER[samples]:.1f}" if samples in _PAPER else "–"
        times = (_shown(figures[stage]) for stage in _COLOURS)
        table.add_row(f"{samples:,}", *times, f"{figures[_GAP]:.3%}", paper)
    console.print(table)
    _draw(measured)
    console.print(f"drawn: {_PICTURE.name}\n")


def _shown(seconds_taken: float) -> str:
    return f"> {_PATIENCE:.0f}" if np.isnan(seconds_taken) else f"{seconds_taken:.4f}"


def _measure(scene: Scene, samples: int) -> dict[str, float]:
    """Return the seconds of every stage, medians, of one run each where that takes long; the gap.

    NaN for what takes too long.
    """
    repeats = 5 if samples <= 2**13 else 3 if samples <= 2**16 else 1
    formulation = []
    for _ in range(repeats):
        taken, formulated = timed(lambda: problem(scene, samples))
        formulation.append(taken)
    with kernels.threads_for(len(formulated.depth)):
        plan = k_view.solve(formulated)
        bounds = [
            timed(lambda: lower_bound(formulated, plan.cost, plan.cost)) for _ in range(repeats)
        ]
        return {
            "formulation": float(np.median(formulation)),
            "EM": seconds(lambda: em.solve(formulated), repeats),
            "2-view all, from EM": float(
                np.median([from_em_to_convergence(formulated, Options()) for _ in range(repeats)])
            ),
            "tight bound": float(np.median([taken for taken, _ in bounds])),
            "optimal, to 0.1 %": float(np.median([_to_gap(formulated) for _ in range(repeats)])),
            _GAP: 1 - bounds[0][1].lower_bound / plan.cost,
        }


def _to_gap(formulated: Problem) -> float:
    """Return the seconds until ``optimal`` proves a gap of 0.1 %; NaN if it takes too long."""
    until = time.perf_counter() + _PATIENCE

    def in_time(_: Progress) -> bool:
        return time.perf_counter() < until

    taken, solution = timed(lambda: optimal.solve(formulated, Options(gap=1e-3), in_time))
    return taken if solution.converged else np.nan


def _draw(measured: dict[int, dict[str, float]]) -> None:
    with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        axes = figure.subplots()
        axes.loglog(list(_PAPER), list(_PAPER.values()), "o--", color="0.45", markersize=4)
        most = max(_PAPER)
        label = "paper, Table 2 (their machine): one 2-view iteration"
        axes.text(most * 1.25, _PAPER[most], label, color="0.35", va="center")
        ends = {}
        for stage, colour in _COLOURS.items():
            times = {n: t[stage] for n, t in measured.items() if not np.isnan(t[stage])}
            axes.loglog(list(times), list(times.values()), "o-", color=colour, markersize=4)
            ends[stage] = times[max(times)]
        low = 0.0
        for stage in sorted(ends, key=ends.__getitem__):
            low = max(ends[stage], _APART * low)  # labels that do not overlap
            axes.text(max(measured) * 1.25, low, stage, color=_COLOURS[stage], va="center")
        # A line to see the slopes by.
        guide = np.array([2**15, 2**20])
        low = measured[2**15]["EM"] / 4
        axes.loglog(guide, low * guide / guide[0], ":", color="0.6")
        axes.text(guide[1] * 1.25, low * guide[1] / guide[0], "linear", color="0.5", va="center")
        axes.set_xscale("log", base=2)
        axes.set_xticks([2**e for e in _EXPONENTS])
        axes.set_xlim(2**6.7, 2**23)
        axes.minorticks_off()
        axes.grid(True, color="0.92")
        axes.set_axisbelow(True)
        axes.set_xlabel("samples")
        axes.set_ylabel("seconds")
        axes.set_title("A body before 168 cameras, on two shared cores", loc="left", fontsize=10)
        figure.savefig(_PICTURE, dpi=150)
