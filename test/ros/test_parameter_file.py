# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameter files, given to the node as a user gives them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from geometry_msgs.msg import PoseArray
from rcl_interfaces.msg import ParameterType
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh

from focus_planner.core.surface.surface import PointCloud
from focus_planner.messages.writing import cloud_to_fields, mesh_to_bytes
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.conversions import message_to_ros
from testing.forked import run_forked
from testing.ros.calls import WAITING, until
from testing.ros.parameter_services import described, listed
from testing.ros.planner_process import PlannerProcess

pytestmark = pytest.mark.processes

FILE = Path(__file__).parents[2] / "config" / "focus_planner.yaml"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TYPES = {
    str: ParameterType.PARAMETER_STRING,
    bool: ParameterType.PARAMETER_BOOL,
    int: ParameterType.PARAMETER_INTEGER,
    float: ParameterType.PARAMETER_DOUBLE,
}


def ended(*arguments):
    """Run the node until it ends by itself, which it must."""
    return run_forked("focus_planner.ros.node", "--ros-args", *arguments)


def test_the_node_takes_the_file_and_has_the_defaults_then(start_planner, context, make_node):
    planner = start_planner("--params-file", str(FILE))
    with PlannerClient(planner.name) as client:
        values = client.get_parameters([d.name for d in DECLARATIONS])
    assert values == {d.name: d.default for d in DECLARATIONS}
    found = described(make_node(), planner.name, values)
    for declaration in DECLARATIONS:
        check_descriptor(declaration, found[declaration.name])


def check_descriptor(declaration, descriptor):
    kind = type(declaration.default)
    assert descriptor.description == declaration.description
    assert descriptor.read_only == declaration.read_only
    assert not descriptor.dynamic_typing
    array = ParameterType.PARAMETER_DOUBLE_ARRAY
    assert descriptor.type == (array if kind is tuple else TYPES[kind])
    integers = [(r.from_value, r.to_value) for r in descriptor.integer_range]
    numbers = [(r.from_value, r.to_value) for r in descriptor.floating_point_range]
    limits = [(declaration.low, declaration.high)]
    assert integers == (limits if kind is int else [])
    assert numbers == (limits if kind is float else [])


def test_a_name_that_resembles_a_parameter_is_told_what_was_meant(start_planner, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "/**:\n  ros__parameters:\n    lens:\n      f_nmber: 8.0\n    base_frame: robot\n"
        "    cameras: [of_the_adapter]\n    use_sim_time: false\n"
        "another_node:\n  ros__parameters:\n    sampels: 3\n"
    )
    planner = start_planner("--params-file", str(path), "-p", "metod:=em")
    planner.wait_for_log("loading kernels")
    warned = [line.partition("]: ")[2] for line in planner.log.splitlines() if "[WARN]" in line]
    assert warned == [
        "there is no parameter lens.f_nmber: did you mean lens.f_number?",
        "there is no parameter metod: did you mean method?",
    ]


def uncommented(name, folder):
    """Write the file as a user does who wants what its example shows, for a node of that name."""
    text = re.sub(r"^    #(?! \S)", "    ", FILE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    path = folder / "focus_planner.yaml"
    path.write_text(text.replace("/focus_planner/", f"/{name}/"), encoding="utf-8")
    return path


def policies(node, topic):
    (info,) = node.get_subscriptions_info_by_topic(topic)
    return info.qos_profile.reliability, info.qos_profile.durability


def test_a_latched_mesh_and_a_best_effort_cloud_are_received(tmp_path, make_node, body, rig):
    node = make_node()
    latched = node.create_publisher(Mesh, "/latched/mesh", LATCHED)
    latched.publish(mesh_to_bytes(body))
    parameters = str(uncommented("latched", tmp_path))
    planner = PlannerProcess("latched", "--params-file", parameters, *WAITING)
    try:
        with PlannerClient("/latched") as client:
            client.publish_rig(rig)
            # The mesh comes once discovery has brought the two together.
            until(lambda: client.plan(method="em", samples=200).success)
            reliable, volatile = ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE
            assert policies(node, "/latched/mesh") == (reliable, LATCHED.durability)
            assert policies(node, "/latched/cloud") == (ReliabilityPolicy.BEST_EFFORT, volatile)
            assert policies(node, "/latched/camera_poses") == (reliable, volatile)
            assert policies(node, "/latched/rig") == (reliable, volatile)
            overrides = {n for n in listed(node, "/latched") if n.startswith("qos_overrides")}
            assert len(overrides) == 20  # of four inputs and /tf_static
            assert plans_from_best_effort(node, client, PointCloud(body.vertices))
    finally:
        assert planner.stop() == 0
    assert "Traceback" not in planner.log


def plans_from_best_effort(node, client, cloud):
    """Publish a cloud as a sensor does, again where it was lost; return whether it came."""
    qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = node.create_publisher(PointCloud2, "/latched/cloud", qos)
    message = message_to_ros(PointCloud2, cloud_to_fields(cloud, "world"))
    before = client.plan(method="em", samples=200).plan.cost

    def arrives():
        publisher.publish(message)
        return client.plan(method="em", samples=200).plan.cost != before

    return until(arrives)


def test_a_latched_mesh_is_not_received_without(make_node, body, rig):
    latched = make_node().create_publisher(Mesh, "/volatile/mesh", LATCHED)
    latched.publish(mesh_to_bytes(body))
    missed = (
        "/here latches /volatile/mesh, and what it sent before the planner subscribed is not"
        " received; publish again, or start the planner with"
        " -p qos_overrides./volatile/mesh.subscription.durability:=transient_local"
    )
    planner = PlannerProcess("volatile", "--params-file", str(FILE), *WAITING)
    try:
        with PlannerClient("/volatile") as client:
            client.publish_rig(rig)
            # The planner hears of the publisher, and then of its name, at times of their own.
            answer = until(lambda: says(client, ["surface", missed]))
    finally:
        assert planner.stop() == 0
    assert not answer.success


def test_publishers_that_are_not_received_are_named(make_node, body, rig):
    node = make_node()
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    cloud = (
        "/here publishes /deaf/cloud best effort, and the planner asks for reliable; publish"
        " reliably, or start the planner with"
        " -p qos_overrides./deaf/cloud.subscription.reliability:=best_effort"
    )
    mesh = (
        "/here does not latch /deaf/mesh (volatile), and the planner asks for latched; latch it"
        " (transient local), or start the planner with"
        " -p qos_overrides./deaf/mesh.subscription.durability:=volatile"
    )
    other_type = (
        "/here publishes shape_msgs/msg/Mesh on /deaf/rig, where focus_planner_msgs/msg/CameraRig"
        " is expected; publish that, or on another topic"
    )
    not_latched = "/here does not latch /deaf/camera_poses (volatile), and has sent nothing"
    node.create_publisher(PointCloud2, "/deaf/cloud", best_effort)
    not_latching = node.create_publisher(Mesh, "/deaf/mesh", 1)
    node.create_publisher(Mesh, "/deaf/rig", LATCHED)
    node.create_publisher(PoseArray, "/deaf/camera_poses", 1)
    planner = PlannerProcess(
        "deaf", *WAITING, "-p", "qos_overrides./deaf/mesh.subscription.durability:=transient_local"
    )
    try:
        with PlannerClient("/deaf") as client:
            without = until(lambda: says(client, [cloud, mesh, other_type, not_latched]))
            assert not without.success
            # The status is published after the answer.
            for text, name in ((cloud, "surface"), (mesh, "surface"), (other_type, "rig")):
                until(lambda t=text, n=name: t in getattr(client.status(), n).unheard)
            node.create_publisher(Mesh, "/deaf/mesh", LATCHED).publish(mesh_to_bytes(body))
            client.publish_rig(rig)
            planned = until(lambda: says(client, [cloud, mesh, other_type], success=True))
            assert not_latched not in planned.message
            node.destroy_publisher(not_latching)
            until(lambda: mesh not in client.plan(method="em", samples=200).message)
    finally:
        assert planner.stop() == 0


def says(client, texts, success=False):
    """Return an answer that has all of these in its message; None if it lacks one."""
    answer = client.plan(method="em", samples=200)
    found = answer.success == success and all(text in answer.message for text in texts)
    return answer if found else None


@pytest.mark.parametrize(
    ("lines", "error"),
    [
        ("samples: 3000000", "samples out of range. Min: 0, Max: 2000000, value: 3000000"),
        ("samples: many", "'samples' to 'many' of type 'STRING', expecting type 'INTEGER'"),
        ("time_budget: 1", "'time_budget' to '1' of type 'INTEGER', expecting type 'DOUBLE'"),
        ("method: guess", "method: expected one of closest"),
        ("lens: {focal_length: 0.0}", "lens.focal_length: expected a number above 0"),
        ("samples: [1", "bad.yaml: expected YAML, got line 4, column 1: did not find expected"),
    ],
)
def test_a_bad_value_ends_the_node_with_one_line(tmp_path, lines, error):
    path = tmp_path / "bad.yaml"
    path.write_text(f"/**:\n  ros__parameters:\n    {lines}\n", encoding="utf-8")
    process = ended("--params-file", str(path))
    assert process.returncode == 2
    assert process.stderr.startswith("planner_node: ")
    assert error in process.stderr
    assert process.stderr.count("\n") == 1


def test_a_file_that_is_not_there_ends_the_node_with_one_line():
    process = ended("--params-file", "/no/such/file.yaml")
    assert process.returncode == 2
    expected = "/no/such/file.yaml: expected a parameter file (YAML), got no such file"
    assert expected in process.stderr
    assert process.stderr.count("\n") == 1


def test_a_policy_that_there_is_not_is_told_in_words():
    override = "qos_overrides./unheard/mesh.subscription.durability:=latched"
    planner = PlannerProcess("unheard", "-p", override)
    assert planner.wait() == 1
    assert "qos_overrides./unheard/mesh.subscription: expected history, depth" in planner.log
    assert "the node could not start by itself; ending" in planner.log
    assert "`durability`: `latched`" in planner.log
    assert "Traceback" not in planner.log
