# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A subject of an evaluation: a surface before a rig, and its problems."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.quality import Quality, estimate_quality
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Surface
from focus_planner.evaluation.experiment import Conditions


@dataclass(frozen=True, eq=False)
class Subject:
    """A surface before a rig.

    It travels between machines without what it prepares, which each of them prepares anew.

    Attributes
    ----------
    name : str
    surface : Surface
        In the rig's frame.
    rig : Rig
    notes : tuple of Note
        What was assumed to bring the surface there.
    """

    name: str
    surface: Surface
    rig: Rig
    notes: tuple[Note, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what is prepared: ray-casting structures stay in their process."""
        return {name: self.__dict__[name] for name in ("name", "surface", "rig", "notes")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take over what came from another process."""
        self.__dict__.update(state)

    @cached_property
    def scene(self) -> Scene:
        """The surface, prepared for casting rays."""
        return Scene(self.surface)

    def with_rig(self, rig: Rig) -> Subject:
        """Return the same subject, prepared as it is, before another rig."""
        other = replace(self, rig=rig)
        if "scene" in self.__dict__:
            other.__dict__["scene"] = self.scene
        return other

    def problem(
        self,
        conditions: Conditions,
        request: PlanRequest | None = None,
        model: CostModel | None = None,
    ) -> Problem:
        """Return the problem to plan on.

        Parameters
        ----------
        conditions : Conditions
            Its samples and seed, instead of the request's.
        request : PlanRequest, optional
            All else that a problem depends on: shots, views, tolerances.
        model : CostModel, optional
        """
        request = _under(conditions, request)
        problem = formulate_problem(self.scene, self.rig, request, model)
        _ = problem.cells  # so that no solver's seconds include them
        return problem

    def fresh_problem(
        self,
        conditions: Conditions,
        request: PlanRequest | None = None,
        model: CostModel | None = None,
    ) -> Problem:
        """Return the problem to judge plans on, of samples that none was made for."""
        request = _under(conditions, request)
        return formulate_problem(self.scene, self.rig, request, model, fresh=True)


def judge(problem: Problem, focus: FloatArray, rig: Rig | None = None) -> Quality:
    """Return how good focus distances are on a problem that they were not made for.

    Parameters
    ----------
    problem : Problem
    focus : (C,) array
        Metres; NaN where a solver found none.
    rig : Rig, optional
        Needed only for the resolution.
    """
    return estimate_quality(problem, fill_missing_distances(problem, focus), rig)


def _under(conditions: Conditions, request: PlanRequest | None) -> PlanRequest:
    return replace(
        request or PlanRequest(),
        samples=conditions.samples,
        fresh_samples=conditions.judged,
        seed=conditions.seed,
    )
