# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Publishers of static transforms and of ``CameraInfo``, as robots and camera drivers have them."""

from __future__ import annotations

from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo
from tf2_msgs.msg import TFMessage

from focus_planner.messages.writing import intrinsics_to_fields
from focus_planner.ros.conversions import message_to_ros

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR_DATA = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def transform(parent, child, position=(0, 0, 0), orientation=(0, 0, 0, 1)):
    fields = {
        "header": {"frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", map(float, position), strict=True)),
            "rotation": dict(zip("xyzw", map(float, orientation), strict=True)),
        },
    }
    return message_to_ros(TransformStamped, fields)


def broadcaster(node):
    """Return a publisher of /tf_static, which latches its last message."""
    return node.create_publisher(TFMessage, "/tf_static", LATCHED)


def camera_info(frame, intrinsics, stamp=0):
    fields = {"header": {"frame_id": frame}, **intrinsics_to_fields(intrinsics)}
    message = message_to_ros(CameraInfo, fields)
    message.header.stamp.sec = stamp
    return message
