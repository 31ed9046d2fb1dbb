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

import math
import re

import numpy as np
import pytest
from hypothesis import given

from focus_planner import CameraIntrinsics, Mesh, PlanRequest
from focus_planner.messages import plan_reading, reading, writing
from focus_planner.messages.plan_reading import (
    camera_focus_from_message,
    plan_from_message,
    shot_from_message,
)
from focus_planner.messages.reading import (
    cloud_from_message,
    intrinsics_from_message,
    lens_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.requests import request_from_message, request_to_fields
from focus_planner.messages.writing import (
    camera_focus_to_fields,
    cloud_to_fields,
    intrinsics_to_fields,
    lens_to_fields,
    mesh_to_bytes,
    plan_to_fields,
    poses_to_fields,
    rig_to_fields,
    shot_to_fields,
)
from testing.messages import (
    EMPTY_INFO,
    OPTICS,
    camera_foci,
    clouds,
    images,
    lenses,
    message,
    plans,
    requests,
    rigs,
    shots,
)

STAMP = (5, 6)
_FROM = re.compile("_from_(message|bytes)$")
_TO = re.compile("_to_(fields|bytes)$")


def is_plain(value):
    if isinstance(value, dict):
        return all(isinstance(name, str) and is_plain(item) for name, item in value.items())
    if isinstance(value, (list, tuple)):
        return all(is_plain(item) for item in value)
    return type(value) in {bool, int, float, str, bytes}


@given(rigs())
def test_a_rig_is_read_as_it_was_written(rig):
    fields = rig_to_fields(rig)
    assert is_plain(fields)
    assert rig_from_message(message(fields), OPTICS, "world") == rig


@given(rigs())
def test_poses_are_read_as_they_were_written(rig):
    fields = poses_to_fields(rig)
    assert is_plain(fields)
    received = poses_from_message(message(fields), OPTICS, "world")
    assert [(c.position, c.orientation) for c in received.cameras] == [
        (c.position, c.orientation) for c in rig.cameras
    ]


@given(images)
def test_images_are_read_as_they_were_written(intrinsics):
    fields = intrinsics_to_fields(intrinsics)
    assert is_plain(fields)
    assert intrinsics_from_message(message(fields)) == intrinsics


def test_of_a_plain_image_only_size_and_matrix_are_not_zero():
    fields = intrinsics_to_fields(CameraIntrinsics())
    rest = {name: fields[name] for name in fields if name not in {"width", "height", "k"}}
    empty = {name: EMPTY_INFO[name] for name in rest}
    assert rest["roi"].items() <= empty.pop("roi").items()
    assert rest | empty == rest


@given(lenses())
def test_lenses_are_read_as_they_were_written(lens):
    assert lens_from_message(message(lens_to_fields(lens))) == lens


@given(requests)
def test_requests_are_read_as_they_were_written(request):
    fields = request_to_fields(request)
    assert is_plain(fields)
    assert request_from_message(message(fields), PlanRequest()) == request


@pytest.mark.parametrize("big_endian", [False, True])
def test_meshes_are_read_as_they_were_written(big_endian):
    mesh = Mesh(np.eye(3), [[0, 1, 2]])
    received = mesh_from_bytes(mesh_to_bytes(mesh, big_endian=big_endian))
    np.testing.assert_array_equal(received.vertices, mesh.vertices)
    np.testing.assert_array_equal(received.triangles, mesh.triangles)


@given(clouds())
def test_clouds_are_read_as_they_were_written(cloud):
    fields = cloud_to_fields(cloud, "world")
    assert is_plain(fields)
    received = cloud_from_message(message(fields), "world")
    np.testing.assert_array_equal(received.points, cloud.points)
    if cloud.normals is None:
        assert received.normals is None
    else:
        np.testing.assert_allclose(received.normals, cloud.normals, rtol=1e-15)
    if cloud.importance is None:
        assert received.importance is None
    else:
        np.testing.assert_array_equal(received.importance, cloud.importance)


@given(shots)
def test_shots_are_read_as_they_were_written(shot):
    assert shot_from_message(message(shot_to_fields(shot))) == shot


@given(camera_foci())
def test_a_cameras_focus_is_read_as_it_was_written(focus):
    fields = camera_focus_to_fields(focus, "world", STAMP, "a name")
    assert is_plain(fields)
    assert camera_focus_from_message(message(fields)) == focus
    assert fields["dioptres"] == 1 / focus.focus_distance
    assert fields["bracket"] == [shot.focus_distance for shot in focus.shots]
    assert fields["plan_id"] == "a name"
    if focus.device_unit is None:
        assert math.isnan(fields["device_value"])
        assert (fields["device_unit"], fields["device_bracket"]) == ("", [])
    else:
        assert (fields["device_value"], fields["device_unit"]) == (focus.device_value, "steps")
        assert fields["device_bracket"] == [shot.device_value for shot in focus.shots]


@given(plans)
def test_a_plan_is_read_as_it_was_written(plan):
    fields = plan_to_fields(plan, "world", STAMP, "a name")
    assert is_plain(fields)
    assert plan_from_message(message(fields)) == plan
    assert math.isnan(fields["lower_bound"]) == (plan.lower_bound is None)
    assert (fields["shots"], fields["plan_id"]) == (plan.shots, "a name")
    header = {"frame_id": "world", "stamp": {"sec": 5, "nanosec": 6}}
    assert fields["header"] == header
    assert all(math.isnan(fields[kind]["age"]) for kind in ("surface", "rig"))
    assert all(camera["header"] == header for camera in fields["cameras"])
    assert all(camera["plan_id"] == "a name" for camera in fields["cameras"])


def test_every_conversion_has_its_opposite():
    readers = {*dir(reading), *dir(plan_reading)}
    read = {_FROM.sub("", name) for name in readers if _FROM.search(name)}
    written = {_TO.sub("", name) for name in dir(writing) if _TO.search(name)}
    assert read == written - {"plan_input", "time"}  # which nobody plans with
