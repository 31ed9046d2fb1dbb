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
