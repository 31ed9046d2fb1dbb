# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What planning needs of its node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from focus_planner_msgs.msg import FocusPlan

from focus_planner.messages.writing import Stamp
from focus_planner.parameters.planner_settings import Settings
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.remote_planner import Worker


@dataclass(frozen=True)
class PlanningHost:
    """What planning needs of its node.

    Attributes
    ----------
    name : str
        The node's full name.
    get_logger : callable
        Returns the node's logger.
    settings : callable
        Returns the current parameters.
    now : callable
        Returns the node's time, seconds and nanoseconds.
    on_rig : callable
        Called with every rig that comes into force.
    publish : callable
        Puts a plan in force.
    publish_changes : callable
        Does the same, and tells only the lenses that it moves.
    start : callable
        Starts a planning process.
    give_up : callable
        Called, with the reason, when none can be started any more.
    is_watched : callable
        Returns whether somebody wants to see the plan in force.
    show : callable
        Shows the plan in force.
    hide : callable
        Shows no plan any more; called with the frame and the stamp of the one in force.
    """

    name: str
    get_logger: Callable[[], Any]
    settings: Callable[[], Settings]
    now: Callable[[], Stamp]
    on_rig: Callable[[orders.RigInForce], None]
    publish: Callable[[FocusPlan], None]
    start: Callable[[], Worker]
    publish_changes: Callable[[FocusPlan], None] = lambda _: None
    give_up: Callable[[str], None] = lambda _: None
    is_watched: Callable[[], bool] = lambda: False
    show: Callable[[orders.Visuals], None] = lambda _: None
    hide: Callable[[str, Stamp], None] = lambda *_: None
