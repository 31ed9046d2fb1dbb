# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The cameras of a cell as they are in a graph, for the recipes in the docs.

``python -m testing.ros.cell`` publishes where they are on /tf_static and their CameraInfo, like
drivers ten times a second, until SIGINT.
"""

from __future__ import annotations

import time
from contextlib import suppress

from rclpy.context import Context
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from tf2_msgs.msg import TFMessage

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.layouts import cylinder_rig
from testing.ros.static_frames import SENSOR_DATA, broadcaster, camera_info, transform

IMAGE = CameraIntrinsics(1920, 1080, 1400.0, 1405.0, 959.5, 541.0)


def main() -> None:
    """Publish until SIGINT."""
    context = Context()
    context.init(args=[])
    node = Node("cell", context=context, use_global_arguments=False)
    frames = broadcaster(node)
    cameras = {
        f"cam_{i}": camera for i, camera in enumerate(cylinder_rig(1, 4, radius=1.5).cameras)
    }
    frames.publish(
        TFMessage(
            transforms=[
                transform("world", f"{name}_optical_frame", camera.position, camera.orientation)
                for name, camera in cameras.items()
            ]
        )
    )
    drivers = {
        name: node.create_publisher(CameraInfo, f"/{name}/camera_info", SENSOR_DATA)
        for name in cameras
    }
    with suppress(KeyboardInterrupt):
        while True:
            for name, driver in drivers.items():
                driver.publish(camera_info(f"{name}_optical_frame", IMAGE))
            time.sleep(0.1)
    node.destroy_node()
    context.try_shutdown()


if __name__ == "__main__":
    main()
