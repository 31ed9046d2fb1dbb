"""What a simulated driver answers, in this process."""

from __future__ import annotations

import pytest
import rclpy
from rclpy.parameter import Parameter

from focus_planner.parameters.lenses import SimulationSettings
from focus_planner.ros.simulated_lens import SimulatedLens


@pytest.fixture(scope="module", autouse=True)
def ros():
    rclpy.init(args=[])
    yield
    rclpy.shutdown()


@pytest.fixture
def lens():
    made = []

    def make(number=0, **values):
        settings = SimulationSettings.from_values({"cameras": ["cam"]} | values)
        made.append(SimulatedLens("/cam/camera", settings, "cam" in settings.stuck, number))
        return made[-1]

    yield make
    for node in made:
        node.destroy_node()


def tell(node, **values):
    """Set parameters one by one, as the service does; return the last result."""
    for name, value in values.items():
        result = node.set_parameters_atomically([Parameter(name, value=value)])
    return result


def read(node, name="LensPosition"):
    return node.get_parameter(name).value


def test_it_has_the_names_and_parameters_of_camera_ros(lens):
    node = lens()
    assert node.get_fully_qualified_name() == "/cam/camera"
    assert (read(node, "AfMode"), read(node)) == (2, 0.0)
    (limits,) = node.describe_parameter("LensPosition").floating_point_range
    assert (limits.from_value, limits.to_value) == (0.0, 10.0)


def test_during_autofocus_camera_ros_takes_a_value_and_does_nothing(lens):
    node = lens()
    assert tell(node, LensPosition=2.0).successful
    assert read(node) == 0.0
    tell(node, AfMode=0, LensPosition=2.0)
    assert read(node) == 2.0


def test_during_autofocus_v4l2_camera_refuses_without_a_reason(lens):
    node = lens(driver="v4l2_camera")
    result = tell(node, focus_absolute=60)
    assert (result.successful, result.reason) == (False, "")
    assert tell(node, focus_automatic_continuous=False, focus_absolute=60).successful
    assert read(node, "focus_absolute") == 60


def test_beyond_the_limits_it_refuses_or_clamps(lens):
    refusing = lens(autofocus=False)
    result = tell(refusing, LensPosition=10.5)
    assert not result.successful
    assert "out of range" in result.reason
    clamping = lens(autofocus=False, beyond_limits="clamp")
    assert tell(clamping, LensPosition=10.5).successful
    assert read(clamping) == 10.0


def test_it_reports_what_it_was_told_or_where_it_is(lens):
    slow = {"autofocus": False, "latency": 600.0}
    assert tell(told := lens(**slow, reports="command"), LensPosition=2.0).successful
    assert read(told) == 2.0
    assert tell(there := lens(**slow), LensPosition=2.0).successful
    assert read(there) == 0.0


def test_whole_drivers_report_whole_positions(lens):
    node = lens(driver="custom", parameter="ring", whole=True, max_value=90.0, step=2.5)
    tell(node, ring=42)
    assert read(node, "ring") == 42  # 42.5
    assert type(read(node, "ring")) is int


def test_a_stuck_lens_accepts_values_and_stays(lens):
    node = lens(autofocus=False, stuck=["cam"])
    assert tell(node, LensPosition=2.0).successful
    assert read(node) == 0.0


def refusals(node):
    return [not tell(node, LensPosition=2.0).successful for _ in range(40)]


def test_failures_come_by_chance_and_repeat(lens):
    values = {"autofocus": False, "failure_rate": 0.5, "seed": 7}
    first = refusals(lens(**values))
    assert 5 < sum(first) < 35
    assert refusals(lens(**values)) == first
    assert refusals(lens(number=1, **values)) != first
    assert tell(lens(autofocus=False, failure_rate=1.0), LensPosition=2.0).reason == (
        "simulated failure"
    )
