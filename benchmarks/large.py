# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""Plans and bounds on many samples, with one thread and with all."""

from __future__ import annotations

from collections.abc import Callable

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem, rig
from benchmarks.timing import timed
from focus_planner import PlanRequest, plan_focus
from focus_planner.core import kernels
from focus_planner.core.bounds.lower_bound import lower_bound
from focus_planner.core.problem.spatial_order import sort_by_place
from focus_planner.core.solvers import Options, em, k_view

_SAMPLES = 65_536
_STEPS = 60  # of a quick bound
_ROUNDS = 5


def run(console: Console) -> None:
    """Time every part with one thread and with all in turn, so that both see the same machine."""
    every = int(numba.config.NUMBA_NUM_THREADS)
    name, parts = _parts()
    table = Table(
        "part",
        "one thread, least",
        "median",
        f"{every} threads, least",
        "median",
        "one ÷ all, least",
        "median",
        title=f"Seconds on {name}, {_SAMPLES:,} samples before {len(rig())} cameras",
    )
    for part, function in parts.items():
        rounds = [[_with_threads(n, function) for n in (1, every)] for _ in range(_ROUNDS)]
        seconds = np.array(rounds)
        least, median = seconds.min(axis=0), np.median(seconds, axis=0)
        table.add_row(
            part,
            *(f"{value:.4f}" for n in range(2) for value in (least[n], median[n])),
            f"{least[0] / least[1]:.2f}",
            f"{median[0] / median[1]:.2f}",
        )
    console.print(table)


def _parts() -> tuple[str, dict[str, Callable[[], object]]]:
    """Return the body's name, and what to time, each run once already."""
    name, scene = next(iter(body_scenes().items()))
    drawn = problem(scene, _SAMPLES)
    placed = sort_by_place(drawn).problem
    start = em.solve(placed)
    plan = k_view.solve(placed)
    request = PlanRequest(samples=_SAMPLES)
    plan_focus(scene, rig(), request)
    near = Options(start=start.focus_distances)
    return name, {
        "sort samples by place": lambda: sort_by_place(drawn),
        "EM": lambda: em.solve(placed),
        "EM, samples as drawn": lambda: em.solve(drawn),
        "2-view, from EM": lambda: k_view.solve(placed, near),
        "2-view, samples as drawn": lambda: k_view.solve(drawn, near),
        "bound": lambda: lower_bound(placed, plan.cost, plan.cost, most_steps=_STEPS),
        "formulate (ray casting, cells)": lambda: problem(scene, _SAMPLES),
        "whole plan": lambda: plan_focus(scene, rig(), request),
    }


def _with_threads(count: int, function: Callable[[], object]) -> float:
    """Return a call's seconds where kernels and rays may take so many threads."""
    before = numba.config.NUMBA_NUM_THREADS
    numba.config.NUMBA_NUM_THREADS = count
    try:
        with kernels.threads_for(_SAMPLES * len(rig())):
            return timed(function)[0]
    finally:
        numba.config.NUMBA_NUM_THREADS = before
