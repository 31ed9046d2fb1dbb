# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How closely time budgets are kept, and how good the plans are then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from benchmarks.timing import timed
from focus_planner import PlanRequest, Scene, SolvedPlan, plan_focus

_SAMPLES = 65536
_BUDGETS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0)
_REPEATS = 5
_REQUESTS = {
    "em": PlanRequest("em"),
    "k_view": PlanRequest("k_view"),
    "k_view, k = 3": PlanRequest("k_view", k=3),
    "k_view, 3 shots": PlanRequest("k_view", shots=3),
    "optimal": PlanRequest("optimal"),
    "optimal, 3 shots": PlanRequest("optimal", shots=3),
}


def run(console: Console) -> None:
    """Print the table."""
    name, scene = next(iter(body_scenes().items()))
    table = Table(
        "method",
        "budget",
        "late by, median",
        "worst",
        "samples planned on",
        "cost",
        "fresh cost",
        "gap",
        title=f"Plans of {name} with a time budget, {_SAMPLES:,} samples asked for",
    )
    for method, request in _REQUESTS.items():
        _plan(scene, request, 1.0)  # compiles, or loads, what will run
        for budget in _BUDGETS:
            runs = [_plan(scene, request, budget) for _ in range(_REPEATS)]
            late = [taken - budget for taken, _ in runs]
            plans = [plan for _, plan in runs]
            table.add_row(
                method,
                f"{budget:g} s",
                f"{1000 * np.median(late):+.0f} ms",
                f"{1000 * max(late):+.0f} ms",
                f"{np.median([plan.samples for plan in plans]):,.0f}",
                f"{np.median([plan.cost for plan in plans]):.1f}",
                f"{np.median([plan.fresh_cost for plan in plans]):.1f}",
                f"{np.median([plan.gap for plan in plans if plan.gap is not None]):.2%}",
            )
    console.print(table)


def _plan(scene: Scene, request: PlanRequest, budget: float) -> tuple[float, SolvedPlan]:
    timely = replace(request, samples=_SAMPLES, time_budget=budget)
    return timed(lambda: plan_focus(scene, rig(), timely))
