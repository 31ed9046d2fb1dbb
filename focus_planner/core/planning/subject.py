"""A plan together with what it was made for: what reports, previews and masks are about."""

from __future__ import annotations

from dataclasses import dataclass, replace

from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan import FocusPlan, SolvedPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene


@dataclass(frozen=True, eq=False)
class PlannedSubject:
    """A plan, and the surface, rig and request that it was made for.

    Attributes
    ----------
    scene : Scene
    rig : Rig
        Its cameras are those of the plan, in the same order.
    request : PlanRequest
    plan : FocusPlan
    model : CostModel or None
        None for the paper's.
    """

    scene: Scene
    rig: Rig
    request: PlanRequest
    plan: FocusPlan
    model: CostModel | None = None

    def with_method(self, method: str, on_progress: ProgressCallback = never_stop) -> SolvedPlan:
        """Return another method's plan for the same request."""
        request = replace(self.request, method=method)
        return plan_focus(self.scene, self.rig, request, self.model, on_progress)

    def fresh_problem(self, samples: int) -> Problem:
        """Return the problem on this many samples that no plan was made on, by area."""
        request = replace(self.request, fresh_samples=samples)
        return formulate_problem(self.scene, self.rig, request, self.model, by="area", fresh=True)
