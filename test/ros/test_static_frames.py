# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A node whose rig and surface come from other frames, over DDS."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from tf2_msgs.msg import TFMessage

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.frames import similarity_from_pose
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import RIG, TRANSFORMS, type_hash
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.run_reading import read_run
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.gated_group import GatedCallbackGroup
from focus_planner.ros.subscriptions import Subscriptions
from testing.ros.calls import until, what_counts
from testing.ros.recorded import assert_reproduced, whole
from testing.ros.static_frames import (
    LATCHED,
    SENSOR_DATA,
    broadcaster,
    camera_info,
    transform,
)

pytestmark = pytest.mark.processes

SAMPLES = 300
HALF = 0.5**0.5
# How the stand is in the world, and the lidar on the stand.
STAND = ((0.3, -0.2, 0.1), (0.0, 0.0, HALF, HALF))
LIDAR = ((1.0, 0.0, 0.5), (0.5, -0.5, 0.5, 0.5))


def pose(at):
    return similarity_from_pose("test", *at)


WORLD_FROM_LIDAR = pose(STAND) @ pose(LIDAR)


def in_lidar(cloud):
    back = WORLD_FROM_LIDAR.inverse()
    normals = None if cloud.normals is None else back.directions(cloud.normals)
    return PointCloud(back.points(cloud.points), normals)


def in_world(cloud):
    """The same cloud, as the planner has it."""
    normals = None if cloud.normals is None else WORLD_FROM_LIDAR.directions(cloud.normals)
    return PointCloud(WORLD_FROM_LIDAR.points(cloud.points), normals)


@pytest.fixture(scope="module")
def cloud(body):
    normals = body.vertices - body.vertices.mean(axis=0)
    return in_lidar(PointCloud(body.vertices, normals))


@pytest.fixture
def publish(named):
    """Publish messages of one topic, each from a node of its own that latches the last."""
    node = named("/graph")
    publishers = {}

    def publish(topic, message, qos=LATCHED):
        if topic not in publishers:
            publishers[topic] = node.create_publisher(type(message), topic, qos)
        publishers[topic].publish(message)

    return publish


def message_of(client, **request):
    return client.plan(**{"samples": SAMPLES, **request}).message


def planned(client, **request):
    response = client.plan(**{"samples": SAMPLES, **request})
    assert response.success, response.message
    return response.plan


def response_of(client, condition=lambda plan: True):
    """Return a plan if there is one, as it should be."""
    response = client.plan(samples=SAMPLES)
    return response.success and condition(response.plan) and response.plan


def once_planned(client, condition=lambda plan: True):
    """Ask until a plan is as it should be: what is latched arrives when it arrives."""
    return until(lambda: response_of(client, condition))


def received(client, kind):
    """Return when the surface or the rig in force arrived."""
    response = client.plan(samples=SAMPLES)
    return getattr(response.plan, kind).received


def assert_alike(one, other):
    """Check that plans are the same but for rounding, and notes."""
    assert one.cost == pytest.approx(other.cost, rel=1e-9)
    for a, b in zip(one.cameras, other.cameras, strict=True):
        assert (a.name, a.status, a.assigned_samples) == (b.name, b.status, b.assigned_samples)
        assert a.focus_distance == pytest.approx(b.focus_distance, rel=1e-9)


def run_of(folder, plan):
    """Return the run of a plan."""
    return read_run(until(lambda: whole(folder).get(plan.plan_id)))


# --- a surface in another frame --------------------------------------------------------------


def test_a_cloud_in_another_frame_is_planned_like_one_in_the_planners(
    client, publish, rig, cloud, named
):
    other = broadcaster(named("/other"))
    client.publish_rig(rig)
    client.publish_cloud(cloud, "lidar")
    told = message_of(client)
    assert "header.frame_id: expected 'world' (parameter frame_id), got 'lidar'" in told
    assert "a transform from lidar to world: nothing was heard on /tf_static" in told

    publish("/tf_static", TFMessage(transforms=[transform("stand", "lidar", *LIDAR)]))
    lacking = "/tf_static has no frame 'world', only stand, lidar; publish the transform"
    until(lambda: lacking in message_of(client))

    other.publish(TFMessage(transforms=[transform("world", "stand", *STAND)]))
    plan = once_planned(client)
    assert plan.surface.topic.endswith("/cloud")
    client.publish_cloud(in_world(cloud))
    assert what_counts(planned(client)) == what_counts(plan)


def test_poses_in_another_frame_are_too(client, publish, body, rig):
    publish("/tf_static", TFMessage(transforms=[transform("world", "table", *STAND)]))
    world_from_table = pose(STAND)
    client.publish_mesh(body)
    moved = []
    for camera in rig.cameras:
        at = world_from_table @ pose((camera.position, camera.orientation))
        moved.append(replace(camera, position=at.position, orientation=at.orientation))
    for send in (client.publish_rig, client.publish_poses):
        before = received(client, "rig")
        send(replace(rig, frame_id="table"))
        plan = once_planned(client, lambda plan, before=before: plan.rig.received != before)
        send(replace(rig, cameras=tuple(moved)))
        assert what_counts(planned(client)) == what_counts(plan)


def test_a_new_calibration_moves_what_was_received_before(client, publish, rig, cloud):
    client.publish_rig(rig)
    publish("/tf_static", TFMessage(transforms=[transform("world", "arm", *LIDAR)]))
    earlier = received(client, "surface")
    client.publish_cloud(cloud, "arm")
    before = once_planned(client, lambda plan: plan.surface.received != earlier)
    pushed = ((1.0, 0.05, 0.5), LIDAR[1])
    publish("/tf_static", TFMessage(transforms=[transform("world", "arm", *pushed)]))
    after = once_planned(client, lambda plan: plan.cost != before.cost)
    moved = PointCloud(pose(pushed).points(cloud.points), pose(pushed).directions(cloud.normals))
    client.publish_cloud(moved)
    assert what_counts(planned(client)) == what_counts(after)


def test_transforms_that_are_not_valid_cost_nothing(planner, client, publish, rig, cloud):
    client.publish_rig(rig)
    good = transform("world", "firm", *LIDAR)
    publish("/tf_static", TFMessage(transforms=[good]))
    earlier = received(client, "surface")
    client.publish_cloud(cloud, "firm")
    plan = once_planned(client, lambda plan: plan.surface.received != earlier)
    bad = [
        transform("world", "firm", orientation=(0, 0, 0, 0)),
        transform("world", "firm", (np.nan, 0, 0)),
        transform("firm", "firm"),
        transform("firm", "world"),
        transform("", "firm"),
        transform("world", "late"),
    ]
    publish("/tf_static", TFMessage(transforms=bad))
    client.publish_cloud(cloud, "late")
    once_planned(client, lambda each: each.surface.received != plan.surface.received)
    client.publish_cloud(cloud, "firm")
    assert what_counts(planned(client)) == what_counts(plan)
    planner.wait_for_log("refused from /tf_static: .*a unit quaternion x, y, z, w")
    planner.wait_for_log("frame world: expected a parent that is not below it, got 'firm'")


def test_a_run_has_the_transforms_that_it_depends_on(start_planner, publish, tmp_path, rig, cloud):
    process = start_planner("-p", f"record_directory:={tmp_path}")
    tree = [
        transform("world", "stand", *STAND),
        transform("stand", "lidar", *LIDAR),
        transform("stand", "lamp"),
    ]
    publish("/tf_static", TFMessage(transforms=tree))
    with PlannerClient(process.name) as client:
        client.publish_rig(rig)
        client.publish_cloud(cloud, "lidar")
        plan = once_planned(client)
        run = run_of(tmp_path, plan)
        assert_reproduced(run)
        kinds = {message.type_name: message for message in run.inputs}
        heard = kinds[TRANSFORMS].read().transforms
        assert kinds[TRANSFORMS].topic == "/tf_static"
        assert [each.child_frame_id for each in heard] == ["lidar", "stand"]
        with AnyReader([run.path]) as bag:
            types = {each.topic: each.msgtype for each in bag.connections}
            (said,) = [each for each in bag.messages() if each[0].topic == "/tf_static"]
            assert len(bag.deserialize(said[2], TRANSFORMS).transforms) == 2
        assert types["/tf_static"] == TRANSFORMS
        client.publish_cloud(cloud, "nowhere")
        before = whole(tmp_path).keys()
        assert "/tf_static has no frame 'nowhere', only world, stand, lidar" in message_of(client)
        (name,) = until(lambda: whole(tmp_path).keys() - before)
        assert_reproduced(read_run(tmp_path / name))


# --- tf2_msgs, and without it ------------------------------------------------------------------


def subscriptions(node, **values):
    settings = Settings.from_values(values)
    ignore = lambda *_: None  # noqa: E731 - three times the same
    return Subscriptions(node, GatedCallbackGroup(), lambda: settings, 99, ignore, ignore, ignore)


def test_the_package_that_is_built_has_the_hash_of_tf2s(make_node):
    node = make_node()
    publisher = node.create_publisher(TFMessage, "/hashed", 1)
    (info,) = until(lambda: node.get_publishers_info_by_topic("/hashed"))
    assert str(info.topic_type_hash) == type_hash(TRANSFORMS)
    node.destroy_publisher(publisher)


def test_an_older_set_up_hears_no_frames_and_says_so(make_node, monkeypatch):
    monkeypatch.setattr("focus_planner.ros.subscriptions.TFMessage", None)
    node = make_node()
    warnings = []
    logger = SimpleNamespace(warning=warnings.append, info=print)
    monkeypatch.setattr(node, "get_logger", lambda: logger)
    inputs = subscriptions(node)
    try:
        topics = {each.topic_name for each in node.subscriptions}
        assert "/tf_static" not in topics
        assert "/here/cloud" in topics
        (told,) = warnings
        assert "messages in other frames than world are refused" in told
        assert "make setup" in told
    finally:
        inputs.destroy()
    with pytest.raises(InputError, match=r"camera_frames: .* tf2_msgs.*; repeat .*make setup"):
        subscriptions(node, camera_frames="cam")


# --- a rig from frames -------------------------------------------------------------------------

IMAGES = CameraIntrinsics(), CameraIntrinsics(640, 480, 500.0, 501.0, 320.0, 240.0)


def frames_of(rig, parent="world", pattern="{}_optical_frame"):
    return [
        transform(parent, pattern.format(c.name), c.position, c.orientation) for c in rig.cameras
    ]


@pytest.fixture(scope="module")
def small_rig(rig):
    cameras = [replace(c, intrinsics=IMAGES[i % 2]) for i, c in enumerate(rig.cameras[:6])]
    return replace(rig, cameras=tuple(cameras), grid=None)


def test_a_rig_from_frames_is_planned_like_the_same_on_its_topic(
    start_planner, publish, tmp_path, body, small_rig
):
    process = start_planner(
        *("-p", "camera_frames:=cam*_optical_frame", "-p", f"record_directory:={tmp_path}")
    )
    with PlannerClient(process.name) as client:
        client.publish_mesh(body)
        until(lambda: "no frame has such a name" in message_of(client))
        publish("/tf_static", TFMessage(transforms=frames_of(small_rig)))
        with PlannerClient(start_planner().name) as other:
            hint = "a rig of cam_0_00_optical_frame, .*: start the planner with -p camera_frames:="
            until(lambda: re.search(hint, message_of(other)))
        *others, last = small_rig.cameras
        for i, camera in enumerate(others):
            info = camera_info(f"{camera.name}_optical_frame", camera.intrinsics)
            publish(f"/{camera.name}/camera_info", info, (LATCHED, SENSOR_DATA)[i % 2])
            if i % 2:
                until(lambda c=camera, info=info: heard(client, publish, c, info))
        missing = f"no CameraInfo of {last.name}_optical_frame; heard on /cam_0_00/camera_info"
        until(lambda: missing in message_of(client))

        def send(stamp):
            info = camera_info(f"{last.name}_link", last.intrinsics, stamp)
            publish(f"/{last.name}/info", info, SENSOR_DATA)

        send(0)
        plan = until(lambda: send(1) or response_of(client))
        run = run_of(tmp_path, plan)
        assert_reproduced(run)
        (composed,) = [message for message in run.inputs if message.type_name == RIG]
        assert composed.topic == f"{process.name}/rig/from/tf_static"
        assert run.rigs()[0].topic == "/tf_static"
        assert plan.rig.topic == "/tf_static"
        until(lambda: client.status().rig.topic == "/tf_static")
        client.publish_rig(small_rig)
        assert_alike(planned(client), plan)
        # The newest counts, and a message that says nothing new is none.
        send(2)
        assert planned(client).rig.topic.endswith("/rig")
        publish(
            "/tf_static",
            TFMessage(
                transforms=[
                    transform(
                        "world",
                        "cam_0_00_optical_frame",
                        (1.3, 0, 0.2),
                        small_rig.cameras[0].orientation,
                    )
                ]
            ),
        )
        once_planned(client, lambda each: each.rig.topic == "/tf_static" and each.cost != plan.cost)


def heard(client, publish, camera, info):
    publish(f"/{camera.name}/camera_info", info)
    return f"{camera.name}_optical_frame," not in message_of(client).partition("no CameraInfo")[2]
