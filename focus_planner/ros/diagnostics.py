# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``/diagnostics``: the planner's health, for the robot's monitors."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.diagnostics import Diagnosis

_DEPTH = 10


class DiagnosticsPublisher:
    """Publishes the planner's health periodically.

    Parameters
    ----------
    node : Node
    diagnose : callable
        Returns what to publish.
    """

    def __init__(self, node: Node, diagnose: Callable[[], Iterable[Diagnosis]]) -> None:
        self._node = node
        self._diagnose = diagnose
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", _DEPTH)
        self._published = 0.0

    def publish_if_due(self, period: float) -> None:
        """Publish if ``period`` seconds have passed since the last time."""
        if time.monotonic() - self._published < period:
            return
        self._published = time.monotonic()
        name = self._node.get_fully_qualified_name()
        array = DiagnosticArray()
        array.header.stamp = self._node.get_clock().now().to_msg()
        array.status = [
            message_to_ros(DiagnosticStatus, diagnosis.to_fields(name))
            for diagnosis in self._diagnose()
        ]
        self._publisher.publish(array)
