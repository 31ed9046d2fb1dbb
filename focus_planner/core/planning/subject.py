# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A plan together with what it was made for: what reports, previews and masks are about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from focus_planner.core.brief import brief_repr
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan import FocusPlan, SolvedPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError, first_few


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

    __repr__ = brief_repr

    def with_method(self, method: str, on_progress: ProgressCallback = never_stop) -> SolvedPlan:
        """Return another method's plan for the same request, to compare with.

        It is given all the time that it needs, and no lower bound is sought.
        """
        request = replace(self.request, method=method, time_budget=math.inf, bound="none")
        return plan_focus(self.scene, self.rig, request, self.model, on_progress)

    def fresh_problem(self, samples: int) -> Problem:
        """Return the problem on this many samples that no plan was made on, by area."""
        # Without a number of samples, a request on a mesh chooses that of fresh ones as well.
        request = replace(self.request, samples=self.plan.samples, fresh_samples=samples)
        return formulate_problem(self.scene, self.rig, request, self.model, by="area", fresh=True)


def one_of(
    subjects: Sequence[Subject], planned: PlannedSubject, name: str | None = None
) -> PlannedSubject:
    """Return what a plan for several subjects is for one of them.

    Parameters
    ----------
    subjects : sequence of Subject
        Those of the plan, in its order.
    planned : PlannedSubject
        The plan for all.
    name : str, optional
        Of the subject; by default the one that costs most.

    Raises
    ------
    InputError
        If there is none of this name.
    """
    if name is None:
        assert planned.plan.worst is not None
        name = planned.plan.worst.surface
    plan = plan_for_one(planned.plan, name)
    place = [each.surface for each in planned.plan.subjects].index(name)
    return replace(planned, scene=subjects[place].scene, plan=plan)


def plan_for_one(plan: FocusPlan, name: str) -> FocusPlan:
    """Return a plan for several subjects with what it is worth for the one of this name.

    Raises
    ------
    InputError
        If there is none.
    """
    names = [each.surface for each in plan.subjects]
    if name not in names:
        raise InputError("subject", f"one of {first_few(names)}", repr(name))
    of_it = plan.subjects[names.index(name)]
    note = Note(
        "subjects",
        f"the plan is for {len(names)} subjects together; this is what it is worth for {name}, and"
        " samples of cameras are those of all",
    )
    told = vars(of_it)
    alone = {
        field.name: told.get(field.name, getattr(plan, field.name)) for field in fields(FocusPlan)
    }
    alone |= {"lower_bound": None, "notes": (note, *plan.notes), "subjects": ()}
    return FocusPlan(**alone)


def requested(plan: FocusPlan, scene: Scene) -> PlanRequest:
    """Return the request of a plan for this scene, as far as the plan tells it.

    Raises
    ------
    InputError
        If there is no such request.
    """
    samples = plan.samples
    if isinstance(scene.surface, PointCloud) and samples == len(scene.sample(0, plan.seed)):
        samples = 0  # the cloud's own points
    return PlanRequest(
        method=plan.method,
        samples=samples,
        seed=plan.seed,
        shots=plan.shots,
        views=plan.views,
        images=plan.images,
        depth_tolerance=plan.depth_tolerance,
        max_mm_per_pixel=plan.max_mm_per_pixel,
        fresh_samples=plan.fresh_samples,
    )
