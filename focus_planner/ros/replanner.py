# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans for new surfaces without being asked, as parameter ``replan`` says."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.timer import Timer

from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Surface
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.naming import new_run_id
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.replanning import Pace
from focus_planner.runtime.requests import unasked

_NANOSECONDS = 1e9
_LONG = 3600.0


class Replanner:
    """Hands inputs to the planning thread, and has it plan for surfaces.

    It belongs to the executor's thread.

    Parameters
    ----------
    node : Node
    planning : PlanningThread
    settings : callable
        Returns the current parameters.
    """

    def __init__(
        self, node: Node, planning: PlanningThread, settings: Callable[[], Settings]
    ) -> None:
        self._node = node
        self._planning = planning
        self._settings = settings
        self._pace = Pace()
        # Not by the node's own clock, which is set, and stands still while a simulation is paused.
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer: Timer = node.create_timer(_LONG, self.plan_if_due, clock=clock)
        self._timer.cancel()

    def receive_surface(self, arrival: Arrival[Surface]) -> None:
        """Have a surface read and, if that is wished, planned for."""
        to_replan = self._settings().replan.is_on
        self._planning.receive_surface(arrival, to_replan=to_replan)
        if to_replan:
            self.plan_if_due()

    def receive_rig(self, arrival: Arrival[Rig]) -> None:
        """Have a rig read; a surface may have waited for it."""
        self._planning.receive_rig(arrival)
        self.plan_if_due()

    def plan_if_due(self) -> None:
        """Plan for a surface that waits, or see to it that this is called again when it is time."""
        self._timer.cancel()
        settings = self._settings()
        if not (settings.replan.is_on and self._planning.surfaces_wait):
            return
        left = self._pace.seconds_left(time.monotonic(), settings.replan.period)
        if left > 0:
            self._timer.timer_period_ns = int(left * _NANOSECONDS) + 1
            self._timer.reset()
            return
        self._pace.begin(time.monotonic())
        self._planning.replan(unasked(settings, new_run_id()))

    def destroy(self) -> None:
        """Plan no more."""
        self._node.destroy_timer(self._timer)
