# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a peer hears on the graph."""

from __future__ import annotations

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node as RosNode
from rclpy.qos import QoSProfile

from benchmarks.attacks.victim import peer

# Seconds in which diagnostics come at least once.
_LISTENING = 4.0


def messages(
    node: RosNode, message_type: type, topic: str, qos: QoSProfile | int, seconds: float
) -> list[Any]:
    """Return what is heard on a topic within so many seconds."""
    found: list[Any] = []
    subscription = node.create_subscription(message_type, topic, found.append, qos)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        executor.spin_once(timeout_sec=left)
    executor.remove_node(node)
    executor.shutdown()
    node.destroy_subscription(subscription)
    return found


def heard(planner: str) -> list[str]:
    """Return all texts of a planner's diagnostics."""
    with peer() as node:
        arrays = messages(node, DiagnosticArray, "/diagnostics", 10, _LISTENING)
    return [
        text
        for array in arrays
        for status in array.status
        if planner.strip("/") in status.name or planner.strip("/") in status.hardware_id
        for text in (status.message, *(f"{pair.key}: {pair.value}" for pair in status.values))
    ]
