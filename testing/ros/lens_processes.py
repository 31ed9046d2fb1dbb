# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lens nodes in processes of their own, and a node that orders foci and hears the outcome."""

from __future__ import annotations

import threading
import time

from focus_planner_msgs.msg import CameraFocus, LensState
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from focus_planner.ros.qos import LATCHED
from testing.ros.planner_process import PATIENCE, NodeProcess
from testing.ros.spinning import Spinning


class LensProcess(NodeProcess):
    """A node that a module of ``focus_planner.ros`` runs; parameters are given by name."""

    def __init__(self, module, namespace="", **parameters):
        arguments = ["--ros-args", *(["-r", f"__ns:={namespace}"] if namespace else [])]
        for name, value in parameters.items():
            arguments += ["-p", f"{name}:={_yaml(value)}"]
        self._start(f"focus_planner.ros.{module}", arguments)


class Orchestrator:
    """Publishes foci as the planner does, and keeps the lens states that come back."""

    def __init__(self, context, planner="/focus_planner"):
        self._planner = planner
        self._node = Node("orchestrator", context=context, use_global_arguments=False)
        self._publishers = {}
        self._news = threading.Condition()
        self._states = []
        qos = QoSProfile(
            depth=1000,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        )
        self._node.create_subscription(LensState, f"{planner}/lens_states", self._hear, qos)
        self._spinning = Spinning(self._node)

    def close(self):
        self._spinning.close()
        self._node.destroy_node()

    def plan(self, camera, plan_id, **fields):
        if camera not in self._publishers:
            topic = f"{self._planner}/cameras/{camera}/focus"
            self._publishers[camera] = self._node.create_publisher(CameraFocus, topic, LATCHED)
        fields = {
            "name": camera,
            "plan_id": plan_id,
            "status": CameraFocus.STATUS_PLANNED,
            "focus_distance": 0.5,
        } | fields
        self.publish(camera, CameraFocus(**fields))

    def publish(self, camera, message):
        """Publish an order to a camera that had one before; bytes as they are."""
        self._publishers[camera].publish(message)

    def states(self, camera, plan_id):
        with self._news:
            return [s for s in self._states if (s.name, s.plan_id) == (camera, plan_id)]

    def wait_for(self, camera, plan_id, status, read_value=None, after=None):
        """Return the last state of a camera and plan once it has a status.

        And a value read back, if one is given, and after it had another status, if one is given.
        """
        deadline = time.monotonic() + PATIENCE
        with self._news:
            while not (
                (found := [s for s in self._states if (s.name, s.plan_id) == (camera, plan_id)])
                and found[-1].status == status
                and (read_value is None or found[-1].read_value == read_value)
                and (after is None or after in [s.status for s in found])
            ):
                assert self._news.wait(deadline - time.monotonic()), f"{camera}: {found}"
            return found[-1]

    def _hear(self, state):
        with self._news:
            self._states.append(state)
            self._news.notify_all()


def _yaml(value):
    if isinstance(value, list):
        return f"[{', '.join(map(_yaml, value))}]"
    return str(value) if isinstance(value, (bool, int, float)) else f"'{value}'"
