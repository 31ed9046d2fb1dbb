# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How close plans come to the proven optimum, and how good they are on fresh samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, problem, rig
from focus_planner import Lens, PlanRequest, Rig, plan_focus
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.optics import nearest_settable
from focus_planner.core.solvers import SOLVERS, Options
from focus_planner.core.solvers.solution import fill_missing_distances
from testing import reference

_SEEDS = range(1, 5)
_UNSEEN = 100_000
_MOST_FOR_TRIPLES = 4096
_METHODS = {
    "closest (autofocus)": ("closest", Options()),
    "average": ("average", Options()),
    "EM": ("em", Options()),
    "2-view assigned": ("k_view", Options(scope="assigned")),
    "2-view assigned, grid": ("k_view", Options(scope="assigned", grid=rig().grid)),
    "2-view all": ("k_view", Options()),
    "2-view all, grid": ("k_view", Options(grid=rig().grid)),
    "3-view all": ("k_view", Options(k=3)),
}


def run(console: Console) -> None:
    """Print all tables."""
    _beside_the_optimum(console)
    _on_unseen_samples(console)
    _of_several_shots(console)
    _in_steps(console)


def _beside_the_optimum(console: Console) -> None:
    rows: dict[str, list[tuple[float, float]]] = {}
    for scene in body_scenes().values():
        for seed in _SEEDS:
            formulated = problem(scene, 1000, seed)
            best, _ = reference.optimum(reference.table(formulated))
            rows.setdefault("optimum (HiGHS)", []).append((best, 0.0))
            for title, (method, options) in _METHODS.items():
                cost = SOLVERS[method](formulated, options).cost
                rows.setdefault(title, []).append((cost, 100 * (cost / best - 1)))
    table = Table(
        "method",
        "cost",
        "above the optimum",
        "at worst",
        title=f"{len(body_scenes())} bodies × {len(_SEEDS)} seeds, 1,000 samples",
    )
    for title, values in rows.items():
        cost, above = np.mean(values, axis=0)
        table.add_row(title, f"{cost:.1f}", f"{above:.2f} %", f"{np.max(values, axis=0)[1]:.2f} %")
    console.print(table)


def _on_unseen_samples(console: Console) -> None:
    counts = (1000, 4096, 16384, 65536)
    table = Table(
        "method",
        *(f"{count:,}" for count in counts),
        title=f"Cost on {_UNSEEN:,} other samples, by the number planned on; mean of the bodies",
    )
    scenes = list(body_scenes().values())
    unseen = [problem(scene, _UNSEEN, 999) for scene in scenes]
    formulated = {count: [problem(scene, count) for scene in scenes] for count in counts}
    for title, (method, options) in _METHODS.items():
        if options.grid is None:
            cells = [
                f"{np.mean(_judged(method, options, formulated[count], unseen)):.1f}"
                for count in counts
                if options.k == 2 or count <= _MOST_FOR_TRIPLES
            ]
            table.add_row(title, *cells)
    console.print(table)


def _of_several_shots(console: Console) -> None:
    counts = (1, 2, 3, 4)
    table = Table(
        "method",
        *map(str, counts),
        title=f"Cost on {_UNSEEN:,} other samples, by shots per camera; 4,096 samples",
    )
    scenes = list(body_scenes().values())
    unseen = [problem(scene, _UNSEEN, 999) for scene in scenes]
    for method in ("em", "k_view"):
        costs = [
            np.mean(
                [
                    with_shots(other, shots).cost(
                        plan_focus(scene, rig(), PlanRequest(method, shots=shots)).focus_distances
                    )
                    for scene, other in zip(scenes, unseen, strict=True)
                ]
            )
            for shots in counts
        ]
        table.add_row(method, *(f"{cost:.1f}" for cost in costs))
    console.print(table)


def _in_steps(console: Console) -> None:
    table = Table(
        "focus steps",
        "planned in steps",
        "rounded afterwards",
        title="Cost of 2-view all on 4,096 samples, lenses from 0.25 m to 1.25 m",
    )
    free = Lens(min_focus=0.25, max_focus=1.25)
    plans = [plan_focus(scene, _rig_with(free)) for scene in body_scenes().values()]
    table.add_row("any distance", f"{np.mean([plan.cost for plan in plans]):.1f}", "")
    for steps in (8, 16, 32, 64):
        lens = replace(free, focus_steps=steps)
        stepped = [plan_focus(scene, _rig_with(lens)) for scene in body_scenes().values()]
        rounded = [
            plan.problem.cost(nearest_settable(plan_free.focus_distances, lens))
            for plan, plan_free in zip(stepped, plans, strict=True)
        ]
        exact = np.mean([plan.cost for plan in stepped])
        table.add_row(str(steps), f"{exact:.1f}", f"{np.mean(rounded):.1f}")
    console.print(table)


def _rig_with(lens: Lens) -> Rig:
    return replace(rig(), cameras=tuple(replace(camera, lens=lens) for camera in rig().cameras))


def _judged(
    method: str, options: Options, formulated: list[Problem], unseen: list[Problem]
) -> list[float]:
    plans = [SOLVERS[method](problem, options).focus_distances for problem in formulated]
    return [
        other.cost(fill_missing_distances(other, focus))
        for focus, other in zip(plans, unseen, strict=True)
    ]
