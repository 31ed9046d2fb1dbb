"""``/diagnostics``: what can be wrong with the planner, for robots' monitors."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.diagnostics import Diagnosis

_DEPTH = 10


class Diagnostics:
    """Publishes what is found, from time to time.

    Parameters
    ----------
    node : Node
    find : callable
        Returns what there is to tell.
    """

    def __init__(self, node: Node, find: Callable[[], Iterable[Diagnosis]]) -> None:
        self._node = node
        self._find = find
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", _DEPTH)
        self._published = 0.0

    def publish_if_due(self, period: float) -> None:
        """Publish, unless that was done less than ``period`` seconds ago."""
        if time.monotonic() - self._published < period:
            return
        self._published = time.monotonic()
        name = self._node.get_fully_qualified_name()
        array = DiagnosticArray()
        array.header.stamp = self._node.get_clock().now().to_msg()
        array.status = [
            message_to_ros(DiagnosticStatus, diagnosis.to_fields(name))
            for diagnosis in self._find()
        ]
        self._publisher.publish(array)
