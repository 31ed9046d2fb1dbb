# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Messages of rclpy, and what they say after they were bytes."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from focus_planner_msgs.msg import CameraFocus as CameraFocusMsg
from focus_planner_msgs.msg import CameraRig, RigCamera
from focus_planner_msgs.msg import FocusPlan as FocusPlanMsg
from focus_planner_msgs.msg import Lens as LensMsg
from focus_planner_msgs.srv import PlanFocus
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, PointCloud2, PointField
from shape_msgs.msg import Mesh as MeshMsg
from shape_msgs.msg import MeshTriangle
from std_msgs.msg import Header

from focus_planner.core.planning.plan import CameraStatus, FocusPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import read_mesh, write_mesh
from focus_planner.messages.plan_reading import camera_focus_from_message, plan_from_message
from focus_planner.messages.reading import (
    Datatype,
    camera_from_message,
    cloud_from_message,
    intrinsics_from_message,
    lens_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.requests import request_from_message, request_to_fields
from focus_planner.messages.typestore import deserialize
from focus_planner.messages.writing import (
    camera_focus_to_fields,
    cloud_to_fields,
    intrinsics_to_fields,
    lens_to_fields,
    mesh_to_bytes,
    plan_to_fields,
    poses_to_fields,
    rig_to_fields,
)
from focus_planner.ros.conversions import message_to_ros, type_name_of
from testing.messages import (
    BAD_CLOUDS,
    EMPTY_CAMERA,
    EMPTY_REQUEST,
    NUMBERS,
    OPTICS,
    camera_foci,
    cloud_fields,
    cloud_layouts,
    clouds,
    images,
    importance_fields,
    lenses,
    requests,
    rigs,
    triangle_arrays,
    vertex_arrays,
)


def through_bytes(message_type, fields):
    payload = serialize_message(message_to_ros(message_type, fields))
    return deserialize(type_name_of(message_type), payload)


# --- what the core knows survives the wire -----------------------------------------------------


@given(rigs())
def test_a_rig_survives_the_wire_bit_for_bit(rig):
    message = through_bytes(CameraRig, rig_to_fields(rig))
    assert rig_from_message(message, OPTICS, "world") == rig


@given(rigs())
def test_poses_survive_the_wire_bit_for_bit(rig):
    message = through_bytes(PoseArray, poses_to_fields(rig))
    received = poses_from_message(message, OPTICS, "world")
    for index, (camera, sent) in enumerate(zip(received.cameras, rig.cameras, strict=True)):
        assert (camera.position, camera.orientation) == (sent.position, sent.orientation)
        assert (camera.name, camera.intrinsics, camera.lens) == (
            f"cam_{index:03d}",
            OPTICS.intrinsics,
            OPTICS.lens,
        )


@given(images)
def test_images_survive_the_wire(intrinsics):
    assert (
        intrinsics_from_message(through_bytes(CameraInfo, intrinsics_to_fields(intrinsics)))
        == intrinsics
    )


@given(lenses())
def test_lenses_survive_the_wire(lens):
    assert lens_from_message(through_bytes(LensMsg, lens_to_fields(lens))) == lens


@given(requests)
def test_requests_survive_the_wire(request):
    payload = serialize_message(message_to_ros(PlanFocus.Request, request_to_fields(request)))
    message = deserialize_message(payload, PlanFocus.Request)
    assert request_from_message(message, PlanRequest()) == request


def test_meshes_survive_the_wire(body):
    received = mesh_from_bytes(mesh_to_bytes(body))
    np.testing.assert_array_equal(received.vertices, body.vertices)
    np.testing.assert_array_equal(received.triangles, body.triangles)
    swapped = mesh_from_bytes(mesh_to_bytes(body, big_endian=True))
    np.testing.assert_array_equal(swapped.vertices, body.vertices)


@given(clouds())
def test_clouds_survive_the_wire(cloud):
    message = through_bytes(PointCloud2, cloud_to_fields(cloud, "world"))
    received = cloud_from_message(message, "world")
    np.testing.assert_array_equal(received.points, cloud.points)
    if cloud.normals is None:
        assert received.normals is None
    else:
        np.testing.assert_allclose(received.normals, cloud.normals, rtol=1e-15)
    if cloud.importance is None:
        assert received.importance is None
    else:
        np.testing.assert_array_equal(received.importance, cloud.importance)


@given(camera_foci())
def test_a_cameras_focus_survives_the_wire(focus):
    message = through_bytes(CameraFocusMsg, camera_focus_to_fields(focus, "world", (5, 6), "a"))
    assert camera_focus_from_message(message) == focus
    assert message.dioptres == 1 / focus.focus_distance
    assert list(message.bracket) == [shot.focus_distance for shot in focus.shots]
    assert message.plan_id == "a"
    assert math.isnan(message.device_value) == (focus.device_unit is None)


@pytest.mark.parametrize("bound", ["none", "quick"])
@pytest.mark.parametrize(("shots", "converged"), [(1, True), (3, False)])
def test_a_plan_survives_the_wire(body, rig, shots, converged, bound):
    request = PlanRequest(samples=200, shots=shots, depth_tolerance=0.001, bound=bound)
    request = replace(request, max_mm_per_pixel=2.0 if shots > 1 else math.inf)
    plan = replace(plan_focus(Scene(body), rig, request), converged=converged)
    message = through_bytes(FocusPlanMsg, plan_to_fields(plan, "world", (5, 6), "a name"))
    received = plan_from_message(message)
    for field in fields(FocusPlan):
        assert getattr(received, field.name) == getattr(plan, field.name)
    assert math.isnan(message.lower_bound) == (bound == "none")
    assert received.gap == plan.gap
    assert message.shots == shots
    assert (message.plan_id, message.header) == ("a name", message.cameras[0].header)
    stamp = message.header.stamp
    assert (message.header.frame_id, stamp.sec, stamp.nanosec) == ("world", 5, 6)


# --- what others send is read ------------------------------------------------------------------


@pytest.mark.parametrize("name", ["importance", "weight"])
@pytest.mark.parametrize(("kind", "datatype"), NUMBERS)
def test_importance_may_be_any_type_of_number(kind, datatype, name):
    sent = importance_fields(np.arange(40), name=name, kind=kind, datatype=datatype)
    message = through_bytes(PointCloud2, sent)
    received = cloud_from_message(message, "world", importance_field=name)
    np.testing.assert_array_equal(received.importance, np.arange(40))


@given(cloud_layouts)
def test_any_layout_of_a_cloud_is_read(layout):
    points = np.random.default_rng(2).normal(size=(20, 3)).astype(layout["dtype"])
    message = through_bytes(PointCloud2, cloud_fields(points, **layout))
    np.testing.assert_array_equal(cloud_from_message(message, "world").points, points)


@pytest.mark.parametrize(("change", "error"), BAD_CLOUDS)
def test_a_cloud_that_contradicts_itself_is_an_input_error(change, error):
    message = through_bytes(PointCloud2, cloud_fields(np.zeros((20, 3))) | change)
    with pytest.raises(InputError, match=error):
        cloud_from_message(message, "world")


def test_an_empty_request_and_an_empty_camera_take_the_defaults():
    defaults = PlanRequest(
        *("em", 0, 8, 3, "assigned", "grid", 9.0, 2, 0.01, 10, 1.5, "tight", 0.01, True),
        views=3,
        images=7,
        max_mm_per_pixel=0.5,
    )
    assert request_from_message(PlanFocus.Request(), defaults) == defaults
    camera = camera_from_message(RigCamera(name="left"), OPTICS)
    assert (camera.intrinsics, camera.lens) == (OPTICS.intrinsics, OPTICS.lens)


def test_a_message_without_a_frame_is_an_input_error():
    for message, read in (
        (PointCloud2(), lambda message: cloud_from_message(message, "world")),
        (PoseArray(), lambda message: poses_from_message(message, OPTICS, "world")),
        (CameraRig(), lambda message: rig_from_message(message, OPTICS, "world")),
    ):
        with pytest.raises(InputError, match=r"header\.frame_id: expected 'world'.*, got ''"):
            read(message)


def mesh_message(triangles, vertices):
    return MeshMsg(
        triangles=[MeshTriangle(vertex_indices=row.astype(np.uint32)) for row in triangles],
        vertices=[Point(x=x, y=y, z=z) for x, y, z in vertices.tolist()],
    )


@given(triangle_arrays, vertex_arrays)
def test_a_mesh_that_rclpy_serializes_is_read(triangles, vertices):
    read = read_mesh(serialize_message(mesh_message(triangles, vertices)))
    np.testing.assert_array_equal(read[0], triangles)
    np.testing.assert_array_equal(read[1], vertices)


@given(triangle_arrays, vertex_arrays)
def test_rclpy_deserializes_a_mesh_that_was_written(triangles, vertices):
    message = deserialize_message(write_mesh(triangles, vertices), MeshMsg)
    indices = [row.vertex_indices.tolist() for row in message.triangles]
    assert indices == triangles.tolist()
    points = np.array([[p.x, p.y, p.z] for p in message.vertices]).reshape(-1, 3)
    np.testing.assert_array_equal(points, vertices)


def test_rclpy_deserializes_a_big_endian_mesh():
    triangles, vertices = np.array([[0, 1, 2]], np.int32), np.eye(3)
    message = deserialize_message(write_mesh(triangles, vertices, big_endian=True), MeshMsg)
    assert message == mesh_message(triangles, vertices)


@pytest.mark.parametrize("message_type", [PointCloud2, PoseArray, CameraRig, FocusPlanMsg])
@given(head=st.sampled_from([b"", b"\x00\x01\x00\x00"]), payload=st.binary(max_size=100))
def test_other_bytes_are_an_input_error_or_a_message(message_type, head, payload):
    try:
        message = deserialize(type_name_of(message_type), head + payload)
    except InputError as error:
        assert error.argument == f"{type_name_of(message_type)} message"  # noqa: PT017
    else:
        assert message.header.frame_id.isprintable() or message.header.frame_id


# --- messages of fields ------------------------------------------------------------------------


def test_fields_make_the_message_that_its_class_makes_of_them():
    sent = {
        "header": {"frame_id": "world"},
        "poses": [{"position": {"x": 1.0}}, {"orientation": {"x": 1.0, "w": 0.0}}],
    }
    assert message_to_ros(PoseArray, sent) == PoseArray(
        header=Header(frame_id="world"),
        poses=[Pose(position=Point(x=1.0)), Pose(orientation=Quaternion(x=1.0, w=0.0))],
    )
    info = message_to_ros(CameraInfo, {"k": np.arange(9.0), "d": np.ones(2), "roi": {"width": 3}})
    assert (info.k.tolist(), info.d.tolist(), info.roi.width) == ([*range(9)], [1.0, 1.0], 3)


@pytest.mark.parametrize("message_type", [PointCloud2, CameraRig, FocusPlanMsg, PlanFocus.Request])
def test_what_fields_leave_out_keeps_the_messages_default(message_type):
    assert message_to_ros(message_type, {}) == message_type()


@pytest.mark.parametrize(
    ("sent", "error"),
    [
        ({"plan": ""}, "FocusPlan message: expected fields among header, plan_id, .*, got 'plan'"),
        ({"_plan_id": ""}, "FocusPlan message: .*, got '_plan_id'"),
        ({"header": {"frame": ""}}, "Header message: expected .* stamp, frame_id, got 'frame'"),
        ({"cameras": [{}, {"shots": [{"focus": 1.0}]}]}, "Shot message: .*, got 'focus'"),
    ],
)
def test_a_field_that_the_message_does_not_have_is_an_error(sent, error):
    with pytest.raises(TypeError, match=error):
        message_to_ros(FocusPlanMsg, sent)


# --- what is repeated where there is no ROS ----------------------------------------------------


def constants(message_type, prefix=""):
    return {
        name.removeprefix(prefix): getattr(message_type, name)
        for name in dir(message_type)
        if name.startswith(prefix) and name.isupper()
    }


def test_the_states_of_a_camera_are_those_of_the_message():
    states = {status.name: status.value for status in CameraStatus}
    assert constants(CameraFocusMsg, "STATUS_") == states


def test_the_datatypes_are_those_of_the_message():
    datatypes = {datatype.name: datatype.value for datatype in Datatype}
    assert datatypes.items() <= constants(PointField).items()


def test_what_tests_take_for_empty_messages_are_empty_messages():
    assert message_to_ros(RigCamera, EMPTY_CAMERA) == RigCamera()
    assert message_to_ros(PlanFocus.Request, EMPTY_REQUEST) == PlanFocus.Request()
