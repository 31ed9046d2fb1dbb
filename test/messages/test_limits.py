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

import pytest

from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import length_after_header, write_mesh
from focus_planner.messages.limits import Limits
from focus_planner.messages.reading import cloud_from_message, mesh_from_bytes
from focus_planner.messages.typestore import deserialize, serialize
from focus_planner.messages.writing import poses_to_fields, rig_to_fields
from focus_planner.parameters.planner_settings import Settings
from testing.malformed import BALL, CLOUD, RIG, TYPES, good

POINTS, TRIANGLES, CAMERAS = len(CLOUD.points), len(BALL.triangles), len(RIG)


def read_cloud(limits):
    return cloud_from_message(deserialize(TYPES["cloud"], good("cloud")), "world", limits)


def test_a_cloud_has_a_limit():
    assert len(read_cloud(Limits(max_points=POINTS)).points) == POINTS
    with pytest.raises(InputError) as refused:
        read_cloud(Limits(max_points=POINTS - 1))
    assert str(refused.value) == (
        f"cloud: expected at most {POINTS - 1} points (parameter max_points), got {POINTS};"
        " thin the cloud out, or raise the parameter if there is enough memory"
    )


def test_the_count_of_a_cloud_is_enough_to_refuse_it():
    """The data is not looked at: it is not there."""
    fields = {"header": {"frame_id": "world"}, "height": 100_000, "width": 100_000}
    message = deserialize(TYPES["cloud"], serialize(TYPES["cloud"], fields))
    with pytest.raises(InputError, match=r"at most 5,000,000 points.*, got 10,000,000,000;"):
        cloud_from_message(message, "world", Settings.from_values({}).limits)


def test_a_mesh_has_a_limit():
    assert mesh_from_bytes(good("mesh"), Limits(max_triangles=TRIANGLES))
    with pytest.raises(InputError, match=r"mesh: expected at most 9 triangles \(parameter max_tr"):
        mesh_from_bytes(good("mesh"), Limits(max_triangles=9))


def test_so_have_the_vertices_of_no_triangle():
    few = write_mesh(BALL.triangles[:2], BALL.vertices)
    with pytest.raises(InputError, match=r"at most 6 vertices \(parameter 3 × max_tri"):
        mesh_from_bytes(few, Limits(max_triangles=2))


@pytest.mark.parametrize("topic", ["rig", "camera_poses"])
def test_a_rig_has_a_limit(topic):
    Limits(max_cameras=CAMERAS).check_rig(good(topic))
    with pytest.raises(InputError, match=r"rig: expected at most 11 cameras \(parameter max_cam"):
        Limits(max_cameras=CAMERAS - 1).check_rig(good(topic))


@pytest.mark.parametrize("frame_id", ["", "a", "ab", "abc", "world", "é😀"])
@pytest.mark.parametrize("little", [True, False])
def test_cameras_are_counted_behind_any_header(frame_id, little):
    header = {"header": {"frame_id": frame_id}}
    for topic, fields in (("rig", rig_to_fields(RIG)), ("camera_poses", poses_to_fields(RIG))):
        payload = serialize(TYPES[topic], fields | header)
        assert length_after_header(payload) == CAMERAS
    order, head = ("<", b"\0\1\0\0") if little else (">", b"\0\0\0\0")
    name = frame_id.encode() + b"\0"
    padded = name + b"\xff" * (-len(name) % 4)
    payload = head + struct.pack(order + "iII", 1, 2, len(name)) + padded
    assert length_after_header(payload + struct.pack(order + "I", 7)) == 7
    assert length_after_header(payload) == 0


def test_what_is_no_message_has_no_length():
    assert length_after_header(b"") == length_after_header(b"\xff" * 40) == 0
    assert length_after_header(b"\0\1\0\0" + b"\xff" * 40) == 0


def test_zero_is_no_limit():
    none = Settings.from_values({"max_points": 0, "max_triangles": 0, "max_cameras": 0})
    assert none.limits == Limits()
    assert Settings.from_values({}).limits == Limits(5_000_000, 5_000_000, 20_000)
