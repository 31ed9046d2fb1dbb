# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is told of a plan besides the plan itself: to its record, and to who looks at it."""

from __future__ import annotations

from focus_planner.core.planning.fingerprint import fingerprints
from focus_planner.core.planning.plan import FocusPlan, SolvedPlan
from focus_planner.core.planning.sampled_quality import SampledQuality, sampled_quality
from focus_planner.core.problem.derived import bytes_with_derived
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.messages.markers import markers_to_bytes
from focus_planner.messages.quality_cloud import quality_cloud_to_fields
from focus_planner.messages.typestore import CLOUD, serialize
from focus_planner.messages.writing import Stamp
from focus_planner.runtime.planning_orders import Description, Visuals
from focus_planner.runtime.status import without_problem

# Bytes that no plan misses: each would take a tenth longer to have them back.
_LITTLE = 16 * 2**20


class ShownPlan:
    """What is needed to show a plan, for as long as somebody may ask for it.

    Parameters
    ----------
    plan : SolvedPlan
    rig : Rig
        That it is for.
    """

    def __init__(self, plan: SolvedPlan, rig: Rig) -> None:
        self._plan: FocusPlan = without_problem(plan)
        self._rig = rig
        self._problem: Problem | None = plan.fresh_problem
        self._quality: SampledQuality | None = None

    def condense(self) -> None:
        """Give back the memory that the next plan may need."""
        if self._problem is not None and bytes_with_derived(self._problem) > _LITTLE:
            self._evaluated()

    def visuals(self, stamp: Stamp) -> Visuals:
        """Return the markers and the cloud that show the plan, stamped."""
        quality, rig = self._evaluated(), self._rig
        cloud = quality_cloud_to_fields(quality, rig.frame_id, stamp)
        return Visuals(markers_to_bytes(self._plan, rig, quality, stamp), serialize(CLOUD, cloud))

    def _evaluated(self) -> SampledQuality:
        if self._quality is None:
            assert self._problem is not None
            self._quality = sampled_quality(self._problem, self._plan.focus_distances)
            self._problem = None
        return self._quality


def describe_plan(plan: SolvedPlan, rig: Rig, visuals_stamp: Stamp | None) -> Description:
    """Return the description of a plan for its record.

    Parameters
    ----------
    plan : SolvedPlan
    rig : Rig
        That it is for.
    visuals_stamp : tuple of int or None
        The stamp of what shows it, seconds and nanoseconds; None to leave that out.
    """
    shown = None if visuals_stamp is None else ShownPlan(plan, rig).visuals(visuals_stamp)
    return Description(fingerprints(plan), shown)
