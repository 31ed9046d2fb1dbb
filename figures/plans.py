# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The picture on the front page: a body, and what four methods make of it."""

from __future__ import annotations

from rich.console import Console

from figures.places import DOCS
from focus_planner import PlanRequest, Scene, cylinder_rig, load_surface, plan_focus
from focus_planner.io.bodies import body
from focus_planner.io.picture import draw_plans

_METHODS = {"closest": "closest (autofocus)", "average": "average", "em": "em", "k_view": "k_view"}


def run(console: Console) -> None:
    """Draw ``docs/plans.png``, as the demonstration draws its own."""
    scene, rig = Scene(load_surface(body("arms_out"))), cylinder_rig()
    plans = {
        title: plan_focus(scene, rig, PlanRequest(method=method))
        for method, title in _METHODS.items()
    }
    draw_plans(scene, rig, plans, DOCS / "plans.png")
    for plan in plans.values():
        console.print(plan.summary())
