# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Hears what a planner says of itself."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from focus_planner_msgs.msg import PlannerStatus
from rclpy.node import Node

from focus_planner.ros.qos import LATCHED
from focus_planner.ros.waiting import wait_for_event


@dataclass(frozen=True)
class HeardStatus:
    """A status, as it was heard.

    Attributes
    ----------
    message : PlannerStatus
    age : float
        How old it was when it was heard, seconds, by the clocks of both machines: that of a node
        that hangs is older than its period.
    """

    message: PlannerStatus
    age: float


class StatusWatch:
    """Hears every status of a planner; the newest is latched, and heard at once.

    Parameters
    ----------
    node : Node
        That another thread spins.
    topic : str
    on_wait : callable
        Called again and again while it waits; what it raises ends the wait.
    """

    def __init__(self, node: Node, topic: str, on_wait: Callable[[], object]) -> None:
        self._on_wait = on_wait
        self._news = threading.Event()
        self._newest: HeardStatus | None = None
        hear: Callable[..., None] = self._hear
        node.create_subscription(PlannerStatus, topic, hear, LATCHED)

    @property
    def newest(self) -> HeardStatus | None:
        """The newest one; None while none was heard."""
        return self._newest

    def wait_for(
        self, condition: Callable[[PlannerStatus], bool], timeout: float
    ) -> HeardStatus | None:
        """Return a status for which a condition holds; None if there is none in time.

        Parameters
        ----------
        condition : callable
            Called with the newest one, and with those that follow.
        timeout : float
            Seconds.
        """
        end = time.monotonic() + timeout
        while True:
            self._news.clear()
            heard = self._newest
            if heard is not None and condition(heard.message):
                return heard
            left = end - time.monotonic()
            if left <= 0 or not wait_for_event(self._news, left, self._on_wait):
                return None

    def _hear(self, message: PlannerStatus, info: dict[str, Any]) -> None:
        published = info["source_timestamp"] / 1e9
        self._newest = HeardStatus(message, time.time() - published)
        self._news.set()
