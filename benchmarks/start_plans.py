# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pairs of cameras started from EM, as they are, and from greedy: costs and seconds.

Samples are sorted by place, as those of large plans are.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.options import options
from benchmarks.scenes import problem, three_body_scenes
from focus_planner import Problem, Scene
from focus_planner.core import kernels
from focus_planner.core.problem.spatial_order import sort_by_place
from focus_planner.core.solvers import Options, em, greedy
from focus_planner.core.solvers.k_view import Descent
from focus_planner.core.solvers.solution import finish_cells, start_cells
from shapes.parts import part

_SAMPLES = (1000, 8192, 65_536)
_PARTS = (1, 2)  # a bracket and a flange
_SEEDS = 3
_REPEATS = 7
_STARTS = {"EM": em.solve, "greedy": greedy.solve}

Result = TypeVar("Result")


@dataclass(frozen=True)
class _Run:
    """Costs of the start and of the pairs after it, and the seconds of each."""

    start_cost: float
    start_seconds: float
    cost: float
    seconds: float


def run(console: Console) -> None:
    """Print a table per number of samples."""
    for samples in options().samples or _SAMPLES:
        table = Table(
            *("subject", "EM", "s", "greedy", "s", "pairs from EM", "s", "from greedy", "s"),
            *("cost", "seconds in all"),
            title=f"{samples:,} samples; means of {_SEEDS} seeds, medians of {_REPEATS} runs;"
            " the last two: from greedy beside from EM",
        )
        for name, scene in _subjects().items():
            table.add_row(name, *_cells([_compare(scene, samples, s) for s in range(_SEEDS)]))
        console.print(table)


def _subjects() -> dict[str, Scene]:
    return three_body_scenes() | {f"part {seed}": Scene(part(seed)) for seed in _PARTS}


def _compare(scene: Scene, samples: int, seed: int) -> tuple[_Run, _Run]:
    """Return the runs from EM and from greedy, which take turns."""
    formulated = sort_by_place(problem(scene, samples, seed)).problem
    descent = Descent(formulated, Options())
    with kernels.threads_for(len(formulated.depth)):
        runs = [[_solve(formulated, name, descent) for name in _STARTS] for _ in range(_REPEATS)]
    from_em, from_greedy = (_median([pair[i] for pair in runs]) for i in range(2))
    return from_em, from_greedy


def _solve(formulated: Problem, name: str, descent: Descent) -> _Run:
    start, start_seconds = _timed(partial(_STARTS[name], formulated))
    cell = start_cells(formulated, start.focus_distances)
    _, seconds = _timed(lambda: descent.run(cell, lambda _: True))
    found = finish_cells(formulated, descent.cell, 1, True)
    return _Run(start.cost, start_seconds, found.cost, seconds)


def _timed(function: Callable[[], Result]) -> tuple[Result, float]:
    started = time.perf_counter()
    result = function()
    return result, time.perf_counter() - started


def _median(runs: list[_Run]) -> _Run:
    return _Run(
        runs[0].start_cost,
        float(np.median([each.start_seconds for each in runs])),
        runs[0].cost,
        float(np.median([each.seconds for each in runs])),
    )


def _cells(pairs: list[tuple[_Run, _Run]]) -> list[str]:
    """Return a row of the table."""
    columns = [[mean for run in pair for mean in _numbers(run)] for pair in pairs]
    em_cost, em_s, cost, s, greedy_cost, greedy_s, other_cost, other_s = np.mean(columns, axis=0)
    return [
        *(f"{em_cost:.2f}", f"{em_s:.4f}", f"{greedy_cost:.2f}", f"{greedy_s:.4f}"),
        *(f"{cost:.3f}", f"{s:.4f}", f"{other_cost:.3f}", f"{other_s:.4f}"),
        f"{other_cost / cost - 1:+.3%}",
        f"{(greedy_s + other_s) / (em_s + s):.2f} ×",
    ]


def _numbers(run: _Run) -> tuple[float, float, float, float]:
    return run.start_cost, run.start_seconds, run.cost, run.seconds
