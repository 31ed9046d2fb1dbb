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
