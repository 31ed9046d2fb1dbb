# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What ``optimal`` proves of made shapes, beside bodies: cost, bound, gap and seconds."""

from __future__ import annotations

import math
import time

from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem
from benchmarks.timing import timed
from focus_planner import Problem, Scene
from focus_planner.core import kernels
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import Options, Solution, optimal
from shapes.parts import part
from shapes.statues import statue

_PARTS = range(1, 7)
_BUSTS = range(1, 12, 2)  # statues with an odd seed
# Samples, the gap to end at, and seconds after which it is not waited for any longer: of parts and
# bodies, and of busts.
_TOLD = 1e-3
_SIZES = ((1024, 1e-4, 10.0, 10.0), (4096, 1e-4, 15.0, 30.0))


def run(console: Console) -> None:
    """Print a table for each number of samples."""
    scenes = {f"part {seed}": Scene(part(seed)) for seed in _PARTS}
    scenes |= {f"bust {seed}": Scene(statue(seed)) for seed in _BUSTS}
    scenes |= body_scenes()
    _prove(problem(scenes["bust 1"], 4096), 0.0, _Trace(10.0))  # loads what will run
    for samples, gap, patience, patience_of_busts in _SIZES:
        table = Table(
            *("shape", "cost", "bound", "gap", "seconds", f"seconds to {_TOLD:.1%}"),
            title=f"Proofs to a gap of {gap:.2%}, {samples:,} samples",
        )
        for name, scene in scenes.items():
            limit = patience_of_busts if name.startswith("bust") else patience
            table.add_row(name, *_figures(problem(scene, samples), gap, limit))
        console.print(table)


class _Trace:
    """A progress callback that stops after a while, and remembers when a gap was reached."""

    def __init__(self, limit: float) -> None:
        self._began = time.perf_counter()
        self._limit = limit
        self.reached = math.inf

    def __call__(self, progress: Progress) -> bool:
        after = time.perf_counter() - self._began
        bound = progress.lower_bound
        if bound is not None and progress.cost - bound <= _TOLD * progress.cost:
            self.reached = min(self.reached, after)
        return after < self._limit


def _figures(formulated: Problem, gap: float, limit: float) -> list[str]:
    trace = _Trace(limit)
    taken, solution = timed(lambda: _prove(formulated, gap, trace))
    assert solution.lower_bound is not None
    return [
        f"{solution.cost:.3f}",
        f"{solution.lower_bound:.3f}",
        f"{1 - solution.lower_bound / solution.cost:.4%}",
        f"{taken:.2f}",
        f"{trace.reached:.2f}" if math.isfinite(trace.reached) else "-",
    ]


def _prove(formulated: Problem, gap: float, trace: _Trace) -> Solution:
    with kernels.threads_for(len(formulated.depth)):
        return optimal.solve(formulated, Options(gap=gap), trace)
