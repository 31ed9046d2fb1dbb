# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a simulated driver answers and publishes, in this process."""

from __future__ import annotations

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.parameter import Parameter

from focus_planner.lenses.frames import frame_from_message
from focus_planner.parameters.lenses import SimulationSettings
from focus_planner.ros.simulated_driver import SimulatedDriver


@pytest.fixture(scope="module", autouse=True)
def ros():
    rclpy.init(args=[])
    yield
    rclpy.shutdown()


@pytest.fixture
def driver():
    made = []

    def make(number=0, **values):
        settings = SimulationSettings.from_values({"cameras": ["cam"]} | values)
        node = next(iter(settings.lenses.values())).node
        made.append(SimulatedDriver(node, settings, number))
        return made[-1]

    yield make
    for node in made:
        node.destroy_node()


def tell(node, **values):
    """Set parameters in one call."""
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    return node.set_parameters_atomically(parameters)


def read(node, name="LensPosition"):
    return node.get_parameter(name).value


def frame_of(node):
    """Let a driver make a frame, and return what it publishes."""
    published = []
    node._publisher.publish = published.append
    node.make_frame()
    (message,) = published
    return message


def seen(node):
    """Return where the next frame says that the lens is, and its autofocus."""
    frame = frame_from_message(frame_of(node))
    return frame.position, frame.autofocus


def test_it_has_the_names_and_parameters_of_camera_ros(driver):
    node = driver()
    assert node.get_fully_qualified_name() == "/cam/camera"
    assert (read(node, "AfMode"), read(node)) == (2, 0.0)
    (limits,) = node.describe_parameter("LensPosition").floating_point_range
    assert (limits.from_value, limits.to_value) == (0.0, 10.0)


def test_its_frames_have_the_form_of_those_of_camera_ros(driver):
    node = driver()
    message = frame_of(node)
    assert node._publisher is not None
    assert message.header.frame_id == read(node, "frame_id") == "cam/camera"
    assert message.header.stamp.sec > 0
    (status,) = message.status
    assert (status.name, status.level) == ("", DiagnosticStatus.OK)
    assert {each.key: each.value for each in status.values} == {
        "LensPosition": "0.000000",
        "AfState": "2",
    }


def test_what_was_set_takes_effect_with_the_next_frame(driver):
    node = driver()
    assert tell(node, AfMode=0, LensPosition=2.0).successful
    assert read(node) == 2.0  # as asked, whatever the lens does
    assert seen(node) == (2.0, "")


def test_of_two_calls_before_a_frame_the_first_is_lost(driver):
    """The adapter of 0.1 set both this way, and reported the lens as verified."""
    node = driver()
    assert tell(node, AfMode=0).successful
    assert tell(node, LensPosition=2.0).successful
    assert seen(node) == (0.0, "2")
    assert (read(node, "AfMode"), read(node)) == (0, 2.0)


def test_during_autofocus_a_position_is_ignored(driver):
    node = driver()
    assert tell(node, LensPosition=2.0).successful
    assert seen(node) == (0.0, "2")


def test_before_0_7_frames_do_not_tell(driver):
    node = driver(metadata=False)
    assert node._publisher is None
    tell(node, AfMode=0, LensPosition=2.0)
    node.make_frame()
    assert read(node) == 2.0


def test_during_autofocus_v4l2_camera_refuses_without_a_reason(driver):
    node = driver(driver="v4l2_camera")
    assert node.get_fully_qualified_name() == "/cam/v4l2_camera"
    result = tell(node, focus_absolute=60)
    assert (result.successful, result.reason) == (False, "")
    assert tell(node, focus_automatic_continuous=False, focus_absolute=60).successful
    assert read(node, "focus_absolute") == 60


def test_several_lenses_of_one_node(driver):
    values = {"driver": "depthai", "driver_node": "/oak", "lens": "{camera}"}
    node = driver(cameras=["left", "right"], stuck=["right"], **values)
    for name in ("left", "right"):
        assert tell(node, **{f"{name}.r_set_man_focus": True}).successful
        assert tell(node, **{f"{name}.r_focus": 40}).successful
    places = {name: device.position(1e9) for name, device in node._devices.items()}
    assert places == {"left.r_focus": 40, "right.r_focus": 0}


def test_beyond_the_limits_it_refuses_or_clamps(driver):
    refusing = driver(autofocus=False)
    result = tell(refusing, LensPosition=10.5)
    assert not result.successful
    assert "out of range" in result.reason
    clamping = driver(autofocus=False, beyond_limits="clamp")
    assert tell(clamping, LensPosition=10.5).successful
    assert seen(clamping) == (10.0, "")


def test_it_reads_back_what_it_was_told_or_where_it_is(driver):
    ring = {"driver": "custom", "parameter": "ring", "latency": 600.0}
    assert tell(told := driver(**ring), ring=0.5).successful
    assert read(told, "ring") == 0.5
    assert tell(there := driver(**ring, reports="position"), ring=0.5).successful
    assert read(there, "ring") == 0.0


def test_whole_drivers_report_whole_positions(driver):
    ring = {"driver": "custom", "parameter": "ring", "reports": "position"}
    node = driver(**ring, whole=True, max_value=90.0, step=2.5)
    tell(node, ring=42)
    assert read(node, "ring") == 42  # 42.5
    assert type(read(node, "ring")) is int


def test_a_stuck_lens_accepts_values_and_stays(driver):
    node = driver(autofocus=False, stuck=["cam"])
    assert tell(node, LensPosition=2.0).successful
    assert seen(node) == (0.0, "")


def refusals(node):
    return [not tell(node, LensPosition=2.0).successful for _ in range(40)]


def test_failures_come_by_chance_and_repeat(driver):
    values = {"autofocus": False, "failure_rate": 0.5, "seed": 7}
    first = refusals(driver(**values))
    assert 5 < sum(first) < 35
    assert refusals(driver(**values)) == first
    assert refusals(driver(number=1, **values)) != first
    assert tell(driver(autofocus=False, failure_rate=1.0), LensPosition=2.0).reason == (
        "simulated failure"
    )
