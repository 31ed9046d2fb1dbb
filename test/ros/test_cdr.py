from __future__ import annotations

import numpy as np
import pytest
from geometry_msgs.msg import Point
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from rclpy.serialization import deserialize_message, serialize_message
from shape_msgs.msg import Mesh as MeshMsg
from shape_msgs.msg import MeshTriangle

from focus_planner.core.checks import InputError
from focus_planner.ros.cdr import read_mesh, write_mesh

triangle_arrays = st.integers(0, 7).flatmap(
    lambda n: arrays.arrays(np.int32, (n, 3), elements=st.integers(0, 2**31 - 1))
)
vertex_arrays = st.integers(0, 7).flatmap(lambda n: arrays.arrays(np.float64, (n, 3)))


def message_of(triangles, vertices):
    return MeshMsg(
        triangles=[MeshTriangle(vertex_indices=row.astype(np.uint32)) for row in triangles],
        vertices=[Point(x=x, y=y, z=z) for x, y, z in vertices.tolist()],
    )


@given(triangle_arrays, vertex_arrays)
def test_it_reads_what_rclpy_serializes(triangles, vertices):
    read = read_mesh(serialize_message(message_of(triangles, vertices)))
    np.testing.assert_array_equal(read[0], triangles)
    np.testing.assert_array_equal(read[1], vertices)


@given(triangle_arrays, vertex_arrays)
def test_rclpy_deserializes_what_it_writes(triangles, vertices):
    message = deserialize_message(write_mesh(triangles, vertices), MeshMsg)
    indices = [row.vertex_indices.tolist() for row in message.triangles]
    assert indices == triangles.tolist()
    points = np.array([[p.x, p.y, p.z] for p in message.vertices]).reshape(-1, 3)
    np.testing.assert_array_equal(points, vertices)


@given(triangle_arrays, vertex_arrays)
def test_big_endian_says_the_same(triangles, vertices):
    read = read_mesh(write_mesh(triangles, vertices, big_endian=True))
    np.testing.assert_array_equal(read[0], triangles)
    np.testing.assert_array_equal(read[1], vertices)


def test_rclpy_deserializes_big_endian():
    triangles, vertices = np.array([[0, 1, 2]], np.int32), np.eye(3)
    message = deserialize_message(write_mesh(triangles, vertices, big_endian=True), MeshMsg)
    assert message == message_of(triangles, vertices)


@pytest.mark.parametrize("big_endian", [False, True])
def test_every_cut_is_noticed(big_endian):
    payload = write_mesh(np.array([[0, 1, 2]], np.int32), np.eye(3), big_endian=big_endian)
    for length in range(len(payload)):
        with pytest.raises(InputError, match="mesh message: expected"):
            read_mesh(payload[:length])


def test_a_writer_may_fill_its_last_word_and_no_more():
    payload = write_mesh(np.array([[0, 1, 2]], np.int32), np.eye(3))
    read_mesh(payload + b"\0\0\0")
    with pytest.raises(InputError, match=f"expected {len(payload)} bytes, by its lengths"):
        read_mesh(payload + b"\0\0\0\0")


@given(st.binary(max_size=200))
def test_garbage_is_an_input_error_or_a_mesh(payload):
    try:
        triangles, vertices = read_mesh(payload)
    except InputError:
        return
    assert triangles.shape[1] == vertices.shape[1] == 3


@pytest.mark.parametrize("head", [b"\x00\x03\x00\x00", b"\x00\x07\x00\x00", b"\xff\xff\xff\xff"])
def test_other_encapsulations_are_refused(head):
    payload = write_mesh(np.array([[0, 1, 2]], np.int32), np.eye(3))
    with pytest.raises(InputError, match=f"plain CDR, got 100 bytes that begin with {head.hex()}"):
        read_mesh(head + payload[4:])


def test_lengths_that_promise_gigabytes_are_refused_by_the_buffer():
    payload = b"\x00\x01\x00\x00" + b"\xff\xff\xff\xff" + bytes(100)
    with pytest.raises(
        InputError, match="for 4294967295 triangles, got 108 bytes; the message was"
    ):
        read_mesh(payload)
