from __future__ import annotations

import math
import re
from dataclasses import fields, replace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from focus_planner_msgs.msg import CameraFocus as CameraFocusMsg
from focus_planner_msgs.msg import CameraRig, RigCamera
from focus_planner_msgs.msg import FocusPlan as FocusPlanMsg
from focus_planner_msgs.msg import Lens as LensMsg
from focus_planner_msgs.srv import PlanFocus
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from hypothesis import given
from hypothesis import strategies as st
from messages.build import triangle_arrays, vertex_arrays
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, PointCloud2, PointField
from shape_msgs.msg import Mesh as MeshMsg
from shape_msgs.msg import MeshTriangle
from std_msgs.msg import Header

from focus_planner.core.checks import InputError
from focus_planner.core.planning import plan_focus
from focus_planner.core.plans import (
    BOUNDS,
    MAX_SAMPLES,
    MAX_SHOTS,
    METHODS,
    CameraFocus,
    FocusPlan,
    PlanRequest,
    Shot,
)
from focus_planner.core.scene import Scene
from focus_planner.core.types import Camera, CameraStatus, Grid, Image, Lens, PointCloud, Rig
from focus_planner.messages import reading
from focus_planner.messages.cdr import read_mesh, write_mesh
from focus_planner.messages.reading import (
    Optics,
    camera_focus_from_message,
    camera_from_message,
    cloud_from_message,
    distorted_cameras,
    image_from_message,
    lens_from_message,
    mesh_from_bytes,
    plan_from_message,
    poses_from_message,
    request_from_message,
    rig_from_message,
)
from focus_planner.ros import conversions
from focus_planner.ros.conversions import (
    camera_focus_to_ros,
    cloud_to_ros,
    image_to_ros,
    lens_to_ros,
    mesh_to_ros,
    message_from_ros,
    plan_to_ros,
    poses_to_ros,
    request_to_ros,
    rig_to_ros,
)

OPTICS = Optics(Image(64, 48, 50.0, 51.0, 31.5, 23.5), Lens(0.035, 5.0, 0.2, 4.0))

numbers = st.floats(-1e6, 1e6)
positions = st.tuples(numbers, numbers, numbers)
positive = st.floats(1e-3, 1e3)


def through_bytes(message):
    return deserialize_message(serialize_message(message), type(message))


@st.composite
def unit_quaternions(draw):
    q = np.array(draw(st.tuples(*[st.floats(-1, 1)] * 4)))
    norm = np.linalg.norm(q)
    return tuple((q / norm).tolist()) if norm > 1e-3 else (0.0, 0.0, 0.0, 1.0)


@st.composite
def lenses(draw):
    focal_length = draw(st.floats(0.01, 0.2))
    min_focus = draw(st.floats(0.0, 1.0))
    max_focus = draw(st.one_of(st.just(math.inf), st.floats(1.0, 50.0)))
    steps = draw(st.none() | st.integers(2, 65_536)) if min_focus > focal_length else None
    listed = draw(st.none() | st.lists(st.just(1.0), min_size=1)) if steps is None else None
    return Lens(focal_length, draw(st.floats(0.5, 100.0)), min_focus, max_focus, listed, steps)


images = st.builds(
    Image, st.integers(1, 10_000), st.integers(1, 10_000), positive, positive, numbers, numbers
)


@st.composite
def rigs(draw):
    count = draw(st.integers(1, 4))
    cameras = tuple(
        Camera(
            f"cam_{i}",
            draw(positions),
            draw(unit_quaternions()),
            draw(images),
            draw(lenses()),
        )
        for i in range(count)
    )
    return Rig(cameras, "world", draw(st.sampled_from([None, Grid(1, count), Grid(count, 1)])))


@given(rigs())
def test_a_rig_survives_the_wire_bit_for_bit(rig):
    assert rig_from_message(through_bytes(rig_to_ros(rig)), OPTICS, "world") == rig


@given(rigs())
def test_poses_survive_the_wire_bit_for_bit(rig):
    received = poses_from_message(through_bytes(poses_to_ros(rig)), OPTICS, "world")
    for index, (camera, sent) in enumerate(zip(received.cameras, rig.cameras, strict=True)):
        assert (camera.position, camera.orientation) == (sent.position, sent.orientation)
        assert (camera.name, camera.image, camera.lens) == (
            f"cam_{index:03d}",
            OPTICS.image,
            OPTICS.lens,
        )


@given(images)
def test_images_survive_the_wire(image):
    assert image_from_message(through_bytes(image_to_ros(image))) == image


@given(lenses())
def test_lenses_survive_the_wire(lens):
    assert lens_from_message(through_bytes(lens_to_ros(lens))) == lens


def test_a_lens_by_f_number_and_circle_of_confusion():
    lens = lens_from_message(LensMsg(focal_length=0.05, f_number=8.0, circle_of_confusion=3.125e-5))
    assert lens.focal_length == 0.05
    assert lens.hyperfocal_distance == pytest.approx(10.0)
    with pytest.raises(InputError, match=r"lens\.f_number: expected a number above 0, got 0"):
        lens_from_message(LensMsg(focal_length=0.05))


@given(
    st.builds(
        PlanRequest,
        method=st.sampled_from(METHODS),
        samples=st.integers(1, MAX_SAMPLES),
        seed=st.integers(1, 2**64 - 1),
        k=st.sampled_from([2, 3]),
        scope=st.sampled_from(["all", "assigned"]),
        time_budget=st.one_of(st.just(math.inf), positive),
        shots=st.integers(1, MAX_SHOTS),
        depth_tolerance=positive,
        bound=st.sampled_from(BOUNDS),
        gap=st.floats(1e-12, 1.0),
    )
)
def test_requests_survive_the_wire(request):
    assert request_from_message(through_bytes(request_to_ros(request)), PlanRequest()) == request


def test_what_a_request_leaves_out_is_the_default():
    defaults = PlanRequest("em", 0, 8, 3, "assigned", "grid", 9.0, 2, 0.01, 10, 1.5, "tight", 0.01)
    assert request_from_message(PlanFocus.Request(), defaults) == defaults
    own = request_from_message(PlanFocus.Request(bound="none", gap=0.5), defaults)
    assert own == replace(defaults, bound="none", gap=0.5)


def test_a_request_that_makes_no_sense_is_an_input_error():
    with pytest.raises(InputError, match="time_budget: expected a number above 0, got nan"):
        request_from_message(PlanFocus.Request(time_budget=math.nan), PlanRequest())
    with pytest.raises(InputError, match=r"method: expected one of .*, got 'guess'"):
        request_from_message(PlanFocus.Request(method="guess"), PlanRequest())
    with pytest.raises(InputError, match="bound: expected one of none, quick, tight, got 'some'"):
        request_from_message(PlanFocus.Request(bound="some"), PlanRequest())
    for gap in (math.nan, -1.0, 2.0, math.inf):
        with pytest.raises(InputError, match="gap: expected"):
            request_from_message(PlanFocus.Request(gap=gap), PlanRequest())


def test_meshes_survive_the_wire(body):
    received = mesh_from_bytes(mesh_to_ros(body))
    np.testing.assert_array_equal(received.vertices, body.vertices)
    np.testing.assert_array_equal(received.triangles, body.triangles)
    swapped = mesh_from_bytes(mesh_to_ros(body, big_endian=True))
    np.testing.assert_array_equal(swapped.vertices, body.vertices)


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


@pytest.mark.parametrize("with_importance", [False, True])
@pytest.mark.parametrize("with_normals", [False, True])
def test_clouds_survive_the_wire(with_normals, with_importance):
    random = np.random.default_rng(1)
    normals = random.normal(size=(50, 3))
    cloud = PointCloud(
        random.normal(size=(50, 3)),
        normals if with_normals else None,
        random.random(50) if with_importance else None,
    )
    received = cloud_from_message(through_bytes(cloud_to_ros(cloud, "world")), "world")
    np.testing.assert_array_equal(received.points, cloud.points)
    if with_normals:
        np.testing.assert_allclose(received.normals, cloud.normals, rtol=1e-15)
    else:
        assert received.normals is None
    if with_importance:
        np.testing.assert_array_equal(received.importance, cloud.importance)
    else:
        assert received.importance is None


def importance_message(values, *, name="importance", kind="f4", datatype=PointField.FLOAT32):
    """A cloud of random points with a field that is not aligned."""
    points = np.random.default_rng(4).normal(size=(len(values), 3))
    record = np.zeros(len(values), np.dtype([("xyz", "<f8", 3), ("_", "u1"), ("value", kind)]))
    record["xyz"], record["value"] = points, values
    message = cloud_to_ros(PointCloud(points), "world")
    message.fields.append(PointField(name=name, offset=25, datatype=datatype, count=1))
    message.point_step = record.itemsize
    message.row_step = record.nbytes
    message.data = record.tobytes()
    return message


@pytest.mark.parametrize("name", ["importance", "weight"])
@pytest.mark.parametrize(
    ("kind", "datatype"),
    [
        ("i1", PointField.INT8),
        ("u1", PointField.UINT8),
        ("<i2", PointField.INT16),
        ("<u2", PointField.UINT16),
        ("<i4", PointField.INT32),
        ("<u4", PointField.UINT32),
        ("<f4", PointField.FLOAT32),
        ("<f8", PointField.FLOAT64),
    ],
)
def test_importance_may_be_any_type_of_number(kind, datatype, name):
    message = importance_message(np.arange(40), name=name, kind=kind, datatype=datatype)
    received = cloud_from_message(through_bytes(message), "world")
    np.testing.assert_array_equal(received.importance, np.arange(40))


def test_importance_goes_before_weight():
    message = importance_message(np.arange(40))
    message.fields.append(PointField(name="weight", offset=0, datatype=8, count=1))
    np.testing.assert_array_equal(cloud_from_message(message, "world").importance, np.arange(40))


@pytest.mark.parametrize("dense", [True, False])
@pytest.mark.parametrize(
    ("bad", "error"),
    [
        (math.nan, r"cloud importance: expected finite numbers, got NaN .*\(first: point 7\)"),
        (math.inf, "cloud importance: expected finite numbers"),
        (-1.0, r"cloud importance: expected numbers of at least 0, got 1 of 40 below"),
    ],
)
def test_a_bad_importance_is_an_input_error_dense_or_not(bad, error, dense):
    values = np.ones(40)
    values[7] = bad
    message = importance_message(values)
    message.is_dense = dense
    with pytest.raises(InputError, match=error):
        cloud_from_message(message, "world")


def test_points_that_are_left_out_take_their_importance_along():
    points = np.random.default_rng(3).normal(size=(20, 3))
    message = cloud_to_ros(PointCloud(points, importance=np.arange(20)), "world")
    table = np.frombuffer(message.data).reshape(20, 4).copy()
    table[5] = math.nan
    message.data = table.tobytes()
    message.is_dense = False
    received = cloud_from_message(message, "world")
    np.testing.assert_array_equal(received.importance, np.delete(np.arange(20), 5))


def test_an_importance_of_several_numbers_is_an_input_error():
    message = importance_message(np.arange(40), kind="u1", datatype=PointField.UINT8)
    message.fields[-1].count = 2
    with pytest.raises(InputError, match="field importance: expected one number, got 2 of"):
        cloud_from_message(message, "world")
    message.fields[-1].count, message.fields[-1].datatype = 1, 99
    with pytest.raises(InputError, match="expected one number, got 1 of datatype 99"):
        cloud_from_message(message, "world")


def cloud_message(columns, *, dtype="f4", big_endian=False, gap=0, row_gap=0, rows=1, order="xyz"):
    """A cloud whose fields stand in any order, with gaps between and behind them."""
    points = np.asarray(columns, dtype=np.float64)
    size = np.dtype(dtype).itemsize
    step = (size + gap) * 3 + gap
    offsets = {name: gap + i * (size + gap) for i, name in enumerate(order)}
    width = len(points) // rows
    row_step = width * step + row_gap
    data = np.full((rows, row_step), 0xAB, dtype=np.uint8)
    packed = np.dtype(
        {
            "names": list(order),
            "formats": [(">" if big_endian else "<") + dtype] * 3,
            "offsets": [offsets[name] for name in order],
            "itemsize": step,
        }
    )
    view = np.ndarray((rows, width), packed, data, strides=(row_step, step))
    for column, name in enumerate("xyz"):
        view[name] = points[:, column].reshape(rows, width)
    datatype = PointField.FLOAT32 if dtype == "f4" else PointField.FLOAT64
    return PointCloud2(
        header=Header(frame_id="world"),
        height=rows,
        width=width,
        fields=[PointField(name=n, offset=offsets[n], datatype=datatype, count=1) for n in order],
        is_bigendian=big_endian,
        point_step=step,
        row_step=row_step,
        data=data.tobytes(),
        is_dense=True,
    )


@given(
    st.sampled_from(["f4", "f8"]),
    st.booleans(),
    st.integers(0, 5),
    st.integers(0, 9),
    st.sampled_from([1, 2, 4]),
    st.permutations("xyz"),
)
def test_any_layout_of_a_cloud_is_read(dtype, big_endian, gap, row_gap, rows, order):
    points = np.random.default_rng(2).normal(size=(20, 3)).astype(dtype)
    message = cloud_message(
        points,
        dtype=dtype,
        big_endian=big_endian,
        gap=gap,
        row_gap=row_gap,
        rows=rows,
        order="".join(order),
    )
    np.testing.assert_array_equal(
        cloud_from_message(through_bytes(message), "world").points, points
    )


def test_points_that_are_not_finite_are_left_out_where_the_cloud_says_so():
    points = np.random.default_rng(3).normal(size=(20, 3))
    points[[3, 7], [0, 2]] = math.nan
    message = cloud_message(points, dtype="f8")
    with pytest.raises(InputError, match=r"NaN or infinity in 2 of 20 \(first: point 3\)"):
        cloud_from_message(message, "world")
    message.is_dense = False
    np.testing.assert_array_equal(
        cloud_from_message(message, "world").points, np.delete(points, [3, 7], axis=0)
    )


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"data": bytes(10)}, "height × row_step bytes of data .*, got 10 bytes"),
        ({"row_step": 1}, "rows of at least width × point_step"),
        ({"width": 10_000}, "rows of at least width × point_step"),
        ({"height": 2**32 - 1}, "got 240 bytes for 4294967295 rows"),
        ({"point_step": 8}, "cloud field z: expected an end within point_step"),
        ({"fields": []}, "cloud fields: expected x, y and z, got none"),
        (
            {"fields": [PointField(name=n, datatype=PointField.INT16, count=1) for n in "xyz"]},
            "cloud field x: expected one FLOAT32 or FLOAT64, got 1 of datatype 3",
        ),
        ({"header": Header(frame_id="base")}, "header.frame_id: expected 'world'.*, got 'base'"),
        ({"header": Header()}, "header.frame_id: expected 'world'.*, got ''"),
        ({"width": 0, "row_step": 0, "data": b""}, "at least 16 points, got an empty cloud"),
    ],
)
def test_a_cloud_that_contradicts_itself_is_an_input_error(change, error):
    message = cloud_message(np.zeros((20, 3)))
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(InputError, match=error):
        cloud_from_message(through_bytes(message), "world")


@pytest.mark.parametrize(
    ("quaternion", "error"),
    [
        (Quaternion(x=0.0, y=0.0, z=0.0, w=0.0), "cam_001: orientation: .*probably never set"),
        (Quaternion(x=math.nan), "cam_001: orientation"),
        (Quaternion(w=2.0), "of length 2"),
    ],
)
def test_an_orientation_that_is_none_is_an_input_error(quaternion, error):
    message = PoseArray(
        header=Header(frame_id="world"), poses=[Pose(), Pose(orientation=quaternion)]
    )
    with pytest.raises(InputError, match=error):
        poses_from_message(message, OPTICS, "world")


def test_an_empty_rig_is_an_input_error():
    with pytest.raises(InputError, match="rig: expected at least one camera, got none"):
        poses_from_message(PoseArray(header=Header(frame_id="world")), OPTICS, "world")
    with pytest.raises(InputError, match="rig: expected at least one camera, got none"):
        rig_from_message(CameraRig(header=Header(frame_id="world")), OPTICS, "world")


def test_a_camera_takes_what_it_leaves_out_from_the_optics():
    camera = camera_from_message(RigCamera(name="left"), OPTICS)
    assert (camera.image, camera.lens) == (OPTICS.image, OPTICS.lens)


def test_errors_of_a_camera_name_it():
    message = RigCamera(name="left", camera_info=CameraInfo(width=10, height=10))
    with pytest.raises(InputError, match=r"camera left: image\.fx: expected a number above 0"):
        camera_from_message(message, OPTICS)
    message = RigCamera(name="left", lens=LensMsg(focal_length=-0.05, hyperfocal_distance=1.0))
    with pytest.raises(InputError, match=r"camera left: lens\.focal_length"):
        camera_from_message(message, OPTICS)


def test_distortion_is_told():
    cameras = [RigCamera(name="a"), RigCamera(name="b", camera_info=CameraInfo(d=[0.0, 0.1]))]
    assert distorted_cameras(CameraRig(cameras=cameras)) == ["b"]


def test_the_states_of_a_camera_are_those_of_the_message():
    constants = {
        name.removeprefix("STATUS_"): getattr(CameraFocusMsg, name)
        for name in dir(CameraFocusMsg)
        if name.startswith("STATUS_")
    }
    assert constants == {status.name: status.value for status in CameraStatus}


SHOTS = st.builds(
    Shot,
    focus_distance=positive,
    near_limit=positive,
    far_limit=st.one_of(positive, st.just(math.inf)),
    assigned_samples=st.integers(0, 2**32 - 1),
    in_focus_samples=st.integers(0, 2**32 - 1),
)


@given(
    st.builds(
        CameraFocus,
        name=st.just("left"),
        status=st.sampled_from(CameraStatus),
        focus_distance=positive,
        near_limit=positive,
        far_limit=st.one_of(positive, st.just(math.inf)),
        assigned_samples=st.integers(0, 2**32 - 1),
        in_focus_samples=st.integers(0, 2**32 - 1),
        shots=st.lists(SHOTS, min_size=1, max_size=3).map(tuple),
    )
)
def test_a_cameras_focus_survives_the_wire(focus):
    message = through_bytes(camera_focus_to_ros(focus, Header(frame_id="world")))
    assert camera_focus_from_message(message) == focus
    assert message.dioptres == 1 / focus.focus_distance
    assert list(message.bracket) == [shot.focus_distance for shot in focus.shots]


@pytest.mark.parametrize("bound", ["none", "quick"])
@pytest.mark.parametrize(("shots", "converged"), [(1, True), (3, False)])
def test_a_plan_survives_the_wire(body, rig, shots, converged, bound):
    request = PlanRequest(samples=200, shots=shots, depth_tolerance=0.001, bound=bound)
    plan = replace(plan_focus(Scene(body), rig, request), converged=converged)
    message = through_bytes(plan_to_ros(plan, "world", Time(sec=5), "a name"))
    received = plan_from_message(message)
    for field in fields(FocusPlan):
        assert getattr(received, field.name) == getattr(plan, field.name)
    assert math.isnan(message.lower_bound) == (bound == "none")
    assert received.gap == plan.gap
    assert message.shots == shots
    assert (message.plan_id, message.header) == ("a name", message.cameras[0].header)


@pytest.mark.parametrize("message_type", [PointCloud2, PoseArray, CameraRig, FocusPlanMsg])
@given(head=st.sampled_from([b"", b"\x00\x01\x00\x00"]), payload=st.binary(max_size=100))
def test_other_bytes_are_an_input_error_or_a_message(message_type, head, payload):
    try:
        message = message_from_ros(head + payload, message_type)
    except InputError as error:
        assert error.argument == f"{message_type.__name__} message"  # noqa: PT017
    else:
        assert isinstance(message, message_type)


def test_every_conversion_has_its_opposite():
    read = {name for name in dir(reading) if re.search("_from_(message|bytes)$", name)}
    written = {name for name in dir(conversions) if name.endswith("_to_ros")}
    stems = {re.sub("_from_(message|bytes)$", "", name) for name in read}
    assert {f"{stem}_to_ros" for stem in stems} == written
