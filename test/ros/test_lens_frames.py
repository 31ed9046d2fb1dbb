# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Frames on /diagnostics, taken when they are asked for."""

from __future__ import annotations

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock_type import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.time import Time

from focus_planner.core.validation import InputError
from focus_planner.lenses.frames import FrameSource
from focus_planner.ros.lens_frames import PolledFrames
from testing.ros.calls import until

DRIVER = "/cam/camera"


@pytest.fixture
def nodes(context):
    made = []

    def make(name, namespace=""):
        options = {"context": context, "use_global_arguments": False}
        made.append(Node(name, namespace=namespace, **options))
        return made[-1]

    yield make
    for node in made:
        node.destroy_node()


@pytest.fixture
def camera(nodes):
    return nodes("camera", "/cam").create_publisher(DiagnosticArray, "/diagnostics", 1)


def frame(number, frame_id="cam"):
    message = DiagnosticArray()
    message.header.stamp.sec, message.header.frame_id = number, frame_id
    values = [KeyValue(key="LensPosition", value="2.0")]
    message.status = [DiagnosticStatus(hardware_id="a sensor", values=values)]
    return message


def frames_in(node, frame_id="cam", others=("/focus_planner",)):
    frames = PolledFrames(node, 1, others)
    frames.expect(DRIVER, FrameSource(frame_id))
    return frames


def test_no_executor_wakes_for_them(nodes, camera):
    node = nodes("adapter")
    frames = frames_in(node)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    until(lambda: camera.get_subscription_count() == 1)
    for number in range(1, 6):
        camera.publish(frame(number))
        executor.spin_once(timeout_sec=0.0)  # would raise if the subscription's callback ran
    until(lambda: [f.stamp[0] for f in frames.frames_of(DRIVER, (0, 0))] == [3, 4, 5])
    assert [f.stamp[0] for f in frames.frames_of(DRIVER, (5, 0))] == [5]
    executor.shutdown()


def test_what_others_publish_there_is_no_frame(nodes, camera):
    frames = frames_in(nodes("adapter"))
    until(lambda: camera.get_subscription_count() == 1)
    camera.publish(DiagnosticArray(status=[DiagnosticStatus(name="focus_planner: memory")]))
    camera.publish(frame(1))
    (found,) = until(lambda: frames.frames_of(DRIVER, (0, 0)))
    assert (found.position, found.hardware_id) == (2.0, "a sensor")


def test_the_name_that_all_frames_have_by_default_is_trusted_only_if_no_other_may_have_it(
    nodes, camera
):
    frames = frames_in(nodes("adapter"), "camera")
    nodes("focus_planner").create_publisher(DiagnosticArray, "/diagnostics", 1)
    until(lambda: camera.get_subscription_count() == 1)
    camera.publish(frame(1, "camera"))
    assert until(lambda: frames.frames_of(DRIVER, (0, 0)))
    nodes("camera", "/elsewhere").create_publisher(DiagnosticArray, "/diagnostics", 1)
    until(lambda: len(camera_drivers(frames)) == 3)
    with pytest.raises(InputError, match="got 'camera' for several; set the drivers' parameter"):
        frames.frames_of(DRIVER, (0, 0))


def camera_drivers(frames):
    return frames._node.get_publishers_info_by_topic("/diagnostics")


def test_frames_from_before_the_clock_was_set_back_do_not_count(nodes, camera):
    node = nodes("adapter")
    clock = node.get_clock()
    frames = frames_in(node)
    until(lambda: camera.get_subscription_count() == 1)
    clock._set_ros_time_is_active(True)
    clock.set_ros_time_override(Time(seconds=1000, clock_type=ClockType.ROS_TIME))
    frames.frames_of(DRIVER, (0, 0))
    camera.publish(frame(999))
    until(lambda: len(frames.frames_of(DRIVER, (990, 0))) == 1)
    clock.set_ros_time_override(Time(seconds=5, clock_type=ClockType.ROS_TIME))
    assert frames.frames_of(DRIVER, (5, 0)) == ()
    camera.publish(frame(6))
    until(lambda: [each.stamp[0] for each in frames.frames_of(DRIVER, (5, 0))] == [6])
