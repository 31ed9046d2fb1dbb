# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Runs that a running node records, and the inputs sent to it."""

from __future__ import annotations

from dataclasses import replace

from focus_planner.core.surface.surface import PointCloud
from focus_planner.messages.typestore import CLOUD, MESH, POSES, RIG, _store, message_of
from focus_planner.messages.writing import (
    cloud_to_fields,
    mesh_to_bytes,
    poses_to_fields,
    rig_to_fields,
)
from focus_planner.recording.naming import PARTIAL
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run_reading import read_run
from testing.ros.calls import until

TYPES = {"mesh": MESH, "cloud": CLOUD, "camera_poses": POSES, "rig": RIG}


def whole(folder):
    """Return the finished runs in the order of time."""
    found = sorted(folder.iterdir()) if folder.exists() else []
    return {path.name: path for path in found if not path.name.endswith(PARTIAL)}


def recorded(client, folder, **request):
    """Request a plan; return the response and its run."""
    before = whole(folder).keys()
    answer = client.plan(**request)
    (name,) = until(lambda: whole(folder).keys() - before)
    if answer.success:
        assert name == answer.plan.plan_id
    assert not list(folder.glob(f"*{PARTIAL}"))
    return answer, read_run(folder / name)


def assert_reproduced(run):
    """Check that a run is whole, and its plan the same to the bit when it is planned again."""
    assert run.fault == ""
    assert differences(run, plan_run(run)) == []


# Of each input a payload, in either byte order.


def mesh_payload(body, rig, little):
    return mesh_to_bytes(body, big_endian=not little)


def cloud_payload(body, rig, little):
    cloud = PointCloud(body.vertices + 1e-4, importance=1.0 + body.vertices[:, 2].clip(0))
    return in_cdr(CLOUD, cloud_to_fields(cloud, "world"), little)


def poses_payload(body, rig, little):
    return in_cdr(POSES, poses_to_fields(rig), little)


def rig_payload(body, rig, little):
    return in_cdr(RIG, rig_to_fields(rig), little)


def in_cdr(type_name, fields, little):
    """Return a message serialized in either byte order."""
    message = message_of(type_name, fields)
    return bytes(_store().serialize_cdr(message, type_name, little_endian=little))


def moved(rig, factor):
    """Return a rig whose cameras are so many times as far from the origin."""
    cameras = [replace(c, position=tuple(factor * x for x in c.position)) for c in rig.cameras]
    return replace(rig, cameras=tuple(cameras))
