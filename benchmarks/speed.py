# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planning times by number of samples."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem, rig
from benchmarks.timing import seconds
from focus_planner import PlanRequest, Problem, plan_focus
from focus_planner.core import kernels
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import Options, em, k_view

SAMPLES = (1000, 4096, 16384, 65536)


def from_em_to_convergence(formulated: Problem, options: Options) -> float:
    """Return the seconds from EM's last step to k_view's solution."""
    last_em = 0.0

    def on_progress(progress: Progress) -> bool:
        nonlocal last_em
        if progress.stage == "em":
            last_em = time.perf_counter()
        return True

    k_view.solve(formulated, options, on_progress)
    return time.perf_counter() - last_em


def run(console: Console) -> None:
    name, scene = next(iter(body_scenes().items()))
    table = Table(
        "samples",
        "visible pairs",
        "sort the interval ends",
        "evaluate the cost",
        "EM",
        "2-view all, from EM",
        "… per evaluation",
        "… per sort",
        "2-view assigned, from EM",
        "3-view all, from EM",
        "formulate (ray casting, cells)",
        "whole plan",
        title=f"Seconds on {name} before {len(rig())} cameras, medians",
    )
    for samples in SAMPLES:
        formulated = problem(scene, samples)
        repeats = 20 if samples < 10_000 else 5
        with kernels.threads_for(len(formulated.depth)):
            solution = em.solve(formulated)
            ends = np.concatenate([formulated.focus_near, formulated.focus_far])
            sort = seconds(lambda ends=ends: np.sort(ends), repeats)
            evaluate = seconds(lambda p=formulated, s=solution: p.evaluate(s.focus_distances), 20)
            em_time = seconds(lambda p=formulated: em.solve(p), repeats)
            everything = _median(formulated, Options(), repeats)
            assigned = _median(formulated, Options(scope="assigned"), repeats)
            triples = _median(formulated, Options(k=3), 3) if samples <= 4096 else None
        pose = seconds(lambda n=samples: problem(scene, n), min(repeats, 5))
        request = PlanRequest(samples=samples)
        total = seconds(lambda r=request: plan_focus(scene, rig(), r), min(repeats, 5))
        table.add_row(
            f"{samples:,}",
            f"{len(formulated.depth):,}",
            f"{sort:.5f}",
            f"{evaluate:.5f}",
            f"{em_time:.4f}",
            f"{everything:.4f}",
            f"{everything / evaluate:.0f} ×",
            f"{everything / sort:.0f} ×",
            f"{assigned:.4f}",
            "–" if triples is None else f"{triples:.3f}",
            f"{pose:.3f}",
            f"{total:.3f}",
        )
    console.print(table)


def _median(formulated: Problem, options: Options, repeats: int) -> float:
    from_em_to_convergence(formulated, options)
    return float(np.median([from_em_to_convergence(formulated, options) for _ in range(repeats)]))
