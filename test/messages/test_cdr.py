# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import read_mesh, write_mesh
from testing.messages import triangle_arrays, vertex_arrays


def test_a_mesh_in_plain_cdr():
    payload = write_mesh(np.array([[0, 1, 2]], np.int32), np.eye(3))
    numbers = struct.pack("<I3II4x9d", 1, 0, 1, 2, 3, *np.eye(3).ravel())
    assert payload == b"\x00\x01\x00\x00" + numbers


@pytest.mark.parametrize("big_endian", [False, True])
@given(triangles=triangle_arrays, vertices=vertex_arrays)
def test_it_reads_what_it_writes(triangles, vertices, big_endian):
    read = read_mesh(write_mesh(triangles, vertices, big_endian=big_endian))
    np.testing.assert_array_equal(read[0], triangles)
    np.testing.assert_array_equal(read[1], vertices)


@pytest.mark.parametrize("big_endian", [False, True])
def test_every_cut_is_noticed(big_endian):
    payload = write_mesh(np.array([[0, 1, 2]], np.int32), np.eye(3), big_endian=big_endian)
    for length in range(len(payload)):
        with pytest.raises(InputError, match="mesh message: expected"):
            read_mesh(payload[:length])


def test_a_writer_may_fill_its_last_word_and_no_more():
    payload = write_mesh(np.array([[0, 1, 2]], np.int32), np.eye(3))
    read_mesh(payload + b"\0\0\0")
    with pytest.raises(InputError, match=f"expected {len(payload)} bytes, according to its counts"):
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
        InputError, match="for 4294967295 triangles, got 108 bytes; the message is truncated"
    ):
        read_mesh(payload)
