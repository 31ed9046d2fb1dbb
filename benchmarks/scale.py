# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The largest supported plan: ten thousand cameras and a million samples."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

from rich.console import Console
from rich.table import Table

from benchmarks.memory import peak
from benchmarks.scenes import hall
from focus_planner import PlanRequest, Rig, Scene
from focus_planner.core import kernels
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import Options, em, k_view

_SITES = 60
_SAMPLES = 1_000_000
_PATIENCE = 600.0  # seconds after which the bound is taken as it is


@dataclass(frozen=True)
class _Stage:
    name: str
    seconds: float
    processor_seconds: float
    peak: float
    result: str


class _Stages:
    """The durations of successive stages."""

    def __init__(self) -> None:
        self.done: list[_Stage] = []
        self._begin()

    def _begin(self) -> None:
        self._wall, self._processor = time.perf_counter(), time.process_time()

    def end(self, name: str, result: str) -> None:
        wall = time.perf_counter() - self._wall
        processor = time.process_time() - self._processor
        self.done.append(_Stage(name, wall, processor, peak(), result))
        self._begin()


def run(console: Console) -> None:
    """Print the table of a plan made in a process of its own, to measure its memory alone."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        stages = process.submit(_measure).result()
    table = Table(
        "stage",
        "seconds",
        "processor seconds",
        "peak memory, GiB",
        "result",
        title=f"{_SITES} bodies side by side, each in its rig; {_SAMPLES:,} samples",
    )
    for stage in stages:
        table.add_row(
            stage.name,
            f"{stage.seconds:.1f}",
            f"{stage.processor_seconds:.1f}",
            f"{stage.peak:.2f}",
            stage.result,
        )
    seconds = sum(stage.seconds for stage in stages)
    processor = sum(stage.processor_seconds for stage in stages)
    table.add_row("total", f"{seconds:.1f}", f"{processor:.1f}", f"{stages[-1].peak:.2f}", "")
    console.print(table)


def _measure() -> list[_Stage]:
    _plan(*hall(2), 2000, _Stages())  # compiles, or loads, what will run
    stages = _Stages()
    scene, rig = hall(_SITES)
    stages.end("scene", f"{len(rig):,} cameras")
    _plan(scene, rig, _SAMPLES, stages)
    return stages.done


def _plan(scene: Scene, rig: Rig, samples: int, stages: _Stages) -> None:
    problem = formulate_problem(scene, rig, PlanRequest(samples=samples))
    stages.end("formulation", f"{len(problem.depth):,} visible pairs")
    cells = problem.cells
    stages.end("cells", f"{len(cells.near):,} cells")
    with kernels.threads_for(len(problem.depth)):
        solution = em.solve(problem)
        stages.end("EM", f"cost {solution.cost:.2f}")
        options = Options(start=solution.focus_distances)
        solution = k_view.solve(problem, options)
        stages.end("2-view all, from EM", f"cost {solution.cost:.2f}")
        until = time.perf_counter() + _PATIENCE

        def in_time(_: Progress) -> bool:
            return time.perf_counter() < until

        bound = lower_bound(problem, solution.cost, solution.cost, on_progress=in_time).lower_bound
        gap = 1 - bound / solution.cost
        stages.end("bound", f"at least {bound:.2f}: within {gap:.3%} of the optimum")
