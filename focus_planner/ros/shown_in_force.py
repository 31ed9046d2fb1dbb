# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Shows the plan in force in 3D, and has it described for its record."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, replace

from focus_planner_msgs.msg import FocusPlan

from focus_planner.messages.writing import Stamp
from focus_planner.recording.recorder import RunRecorder
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.remote_planner import PlanningDied, RemotePlanner
from focus_planner.runtime.seldom import Seldom

# How long at least, of plans that nobody asked for, of which there may be many a second.
_SECONDS_SHOWN = 1.0


@dataclass(frozen=True)
class _InForce:
    """The plan in force, unless it was restored from a record.

    Attributes
    ----------
    plan_id : str
    stamp : tuple of int
    is_shown : bool
    shows_later : bool
        Whether it is to be shown once the plan before it was shown for a while.
    """

    plan_id: str = ""
    stamp: Stamp = (0, 0)
    is_shown: bool = False
    shows_later: bool = False


class ShownInForce:
    """Keeps which plan is in force, and shows it to who watches.

    Apart from reading attributes it is for the planning thread only.

    Parameters
    ----------
    planner : RemotePlanner
    host : PlanningHost
    """

    def __init__(self, planner: RemotePlanner, host: PlanningHost) -> None:
        self._planner = planner
        self._host = host
        self._in_force = _InForce()
        self._seldom = Seldom()

    @property
    def plan_id(self) -> str:
        """The plan in force; empty if there is none, or it was restored from a record."""
        return self._in_force.plan_id

    def put_in_force(self, plan_id: str, stamp: Stamp) -> None:
        """Show this plan next, and until then none if nobody watches."""
        self._in_force = _InForce(plan_id, stamp)
        if not self._host.is_watched():
            self._show(None)

    def show(self) -> None:
        """Show the plan in force to who has begun to watch, unless it is shown."""
        plan = self._in_force = replace(self._in_force, shows_later=False)
        if not plan.plan_id or plan.is_shown or not self._host.is_watched():
            return
        visuals, why = None, "the planning process that made it has gone"
        if self._planner.pid is not None:
            order = orders.Describe(plan.plan_id, False, plan.stamp)
            try:
                visuals = self._planner.describe(order).visuals
            except PlanningDied as error:
                why = str(error)
        if visuals is None:
            text = f"{plan.plan_id} is not shown in 3D: {why}; the next plan will be"
            self._host.get_logger().warning(text)
        self._show(visuals)

    @property
    def is_due(self) -> bool:
        """Whether the plan in force is still to be shown, and it is time for that."""
        return self._in_force.shows_later and self._seldom.is_due("show", _SECONDS_SHOWN)

    def describe(
        self,
        plan: FocusPlan,
        run: RunRecorder | None,
        description: Future[orders.Description],
        *,
        at_once: bool,
    ) -> None:
        """Have a plan described for its record and for who watches, after it has been returned.

        Parameters
        ----------
        plan : FocusPlan
        run : RunRecorder or None
        description : Future
            Is given the description.
        at_once : bool
            Whether to show it at once, however shortly the plan before it was shown.
        """
        watched = plan.plan_id == self._in_force.plan_id and self._host.is_watched()
        if watched and not self._seldom.take("show", 0.0 if at_once else _SECONDS_SHOWN):
            watched, self._in_force = False, replace(self._in_force, shows_later=True)
        if run is None and not watched:
            return
        visual = watched or (run is not None and run.with_visuals)
        stamp = (plan.header.stamp.sec, plan.header.stamp.nanosec) if visual else None
        order = orders.Describe(plan.plan_id, run is not None, stamp)
        described = None
        try:
            described = self._planner.describe(order)
            description.set_result(described)
        except PlanningDied as error:
            description.set_exception(error)
        if watched:
            self._show(described.visuals if described else None)

    def _show(self, visuals: orders.Visuals | None) -> None:
        """Show the plan in force, or nothing rather than the plan before it."""
        self._in_force = replace(self._in_force, is_shown=visuals is not None)
        if visuals is None:
            self._host.hide(self._planner.frame_id, self._in_force.stamp)
        else:
            self._host.show(visuals)
