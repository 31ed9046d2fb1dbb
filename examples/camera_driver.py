# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A camera driver that sets its lens to what the planner plans for it.

python examples/camera_driver.py cam_0_00    # a camera of the rig
"""

from __future__ import annotations

import sys
from contextlib import suppress

import rclpy
from focus_planner_msgs.msg import CameraFocus
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

# As the planner publishes it: a driver that starts late still gets its distance.
LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class CameraDriver(Node):
    """Subscribes to one camera's focus."""

    def __init__(self, camera: str) -> None:
        super().__init__(f"{camera}_driver")
        topic = f"/focus_planner/cameras/{camera}/focus"
        self.create_subscription(CameraFocus, topic, self.set_lens, LATCHED)

    def set_lens(self, focus: CameraFocus) -> None:
        """Set the lens: here a real driver would talk to its hardware."""
        if focus.status != CameraFocus.STATUS_UNKNOWN:
            where = f"{focus.focus_distance:.3f} m, {focus.dioptres:.3f} 1/m"
            print(f"{focus.name}: {where}", flush=True)


if __name__ == "__main__":
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(CameraDriver(sys.argv[1]))
