# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Static transforms beside scipy's matrices, and what nothing relates."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import header_frame
from focus_planner.messages.frames import HeardFrames, StaticTransform, pose_of_message
from focus_planner.messages.reading import Optics, cloud_from_message, rig_from_message
from focus_planner.messages.transforms import transforms_from_bytes, transforms_to_bytes
from focus_planner.messages.typestore import (
    CLOUD,
    RIG,
    TRANSFORMS,
    definition_of,
    deserialize,
    serialize,
    type_hash,
)
from focus_planner.messages.writing import cloud_to_fields, rig_to_fields
from testing.ros.recorded import in_cdr

RANDOM = np.random.default_rng(7)


def made_up(parent, child):
    q = RANDOM.normal(size=4)
    translation = tuple(RANDOM.normal(size=3).tolist())
    return StaticTransform(parent, child, translation, tuple((q / np.linalg.norm(q)).tolist()))


# world - rig - arm - lidar; rig - cam; alone - far
TREE = HeardFrames(
    tuple(
        made_up(*pair)
        for pair in (
            ("arm", "lidar"),
            ("world", "rig"),
            ("rig", "arm"),
            ("rig", "cam"),
            ("alone", "far"),
        )
    )
)


def matrix(transform):
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat(transform.rotation).as_matrix()
    found[:3, 3] = transform.translation
    return found


def by_hand(*path):
    """The product of matrices along child frames."""
    of_child = {each.child: matrix(each) for each in TREE.transforms}
    product = np.eye(4)
    for step in path:
        product = product @ (
            np.linalg.inv(of_child[step[1:]]) if step[0] == "-" else of_child[step]
        )
    return product


@pytest.mark.parametrize(
    ("target", "source", "path"),
    [
        ("world", "lidar", ("rig", "arm", "lidar")),
        ("lidar", "world", ("-lidar", "-arm", "-rig")),
        ("cam", "lidar", ("-cam", "arm", "lidar")),
        ("rig", "cam", ("cam",)),
        ("cam", "cam", ()),
    ],
)
def test_a_lookup_is_the_product_of_the_matrices_on_the_way(target, source, path):
    found, expected = TREE.lookup(target, source), by_hand(*path)
    np.testing.assert_allclose(found.rotation.as_matrix(), expected[:3, :3], atol=1e-12)
    np.testing.assert_allclose(found.translation, expected[:3, 3], atol=1e-12)
    points = RANDOM.normal(size=(5, 3))
    moved = points @ expected[:3, :3].T + expected[:3, 3]
    np.testing.assert_allclose(found.points(points), moved, atol=1e-12)
    np.testing.assert_allclose(found.directions(points), points @ expected[:3, :3].T, atol=1e-12)


def test_only_what_is_between_two_frames_matters():
    path = TREE.between("cam", "lidar")
    assert [each.child for each in path.transforms] == ["lidar", "arm", "cam"]
    whole, part = TREE.lookup("cam", "lidar"), path.lookup("cam", "lidar")
    np.testing.assert_array_equal(whole.points(np.eye(3)), part.points(np.eye(3)))
    assert TREE.between("world", "far") is None
    assert TREE.lookup("nowhere", "lidar") is None
    assert TREE.between("lidar", "lidar") == HeardFrames()


def test_a_cycle_has_an_end():
    loop = HeardFrames((made_up("a", "b"), made_up("b", "c"), made_up("c", "a")))
    assert loop.between("world", "b") is None
    assert loop.lack("world", "b")


@pytest.mark.parametrize(
    ("frame", "heard", "told"),
    [
        ("far", HeardFrames(), r"expected 'world' \(parameter frame_id\), got 'far'; transform"),
        ("", TREE, r"expected 'world' \(parameter frame_id\), got ''; transform the message"),
        ("sea", TREE, "got 'sea', and /tf_static has no frame 'sea', only arm, lidar, world, rig"),
        (
            "far",
            TREE,
            (
                "got 'far', and on /tf_static 'far' is below 'alone' and 'world' is at the top,"
                " with no transform between the two trees; publish the transform on /tf_static"
            ),
        ),
    ],
)
def test_a_frame_that_nothing_relates_is_refused_in_words(frame, heard, told):
    with pytest.raises(InputError, match=told):
        pose_of_message(SimpleNamespace(frame_id=frame), "world", heard)


def test_a_slash_before_a_name_is_not_part_of_it():
    assert pose_of_message(SimpleNamespace(frame_id="/world"), "world", HeardFrames()) is None
    assert pose_of_message(SimpleNamespace(frame_id="/lidar"), "/world", TREE) is not None


@pytest.mark.parametrize("little", [True, False])
def test_the_frame_of_a_message_is_read_from_its_bytes(little):
    points = RANDOM.normal(size=(20, 3))
    for name in ("lidar", "", "stand/Ä"):
        payload = in_cdr(CLOUD, cloud_to_fields(PointCloud(points), name), little)
        assert header_frame(payload) == name
        for end in range(20):
            assert header_frame(payload[:end]) in {name, ""}
    assert header_frame(b"\x00\x01\x00\x00" + bytes(8) + b"\xff\xff\xff\xff" + bytes(9)) == ""


def test_transforms_are_written_and_read_bit_for_bit():
    assert tuple(transforms_from_bytes(transforms_to_bytes(TREE.transforms))) == TREE.transforms
    with pytest.raises(InputError, match="TFMessage"):
        transforms_from_bytes(transforms_to_bytes(TREE.transforms)[:-9])


def test_the_message_is_that_of_tf2():
    # As programs have it that join a graph of ROS 2 Jazzy by this hash, over Zenoh.
    known = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
    assert type_hash(TRANSFORMS) == known
    built = Path(__file__).parents[2] / "tools" / "tf2_msgs" / "msg" / "TFMessage.msg"
    assert built.read_text() == definition_of(TRANSFORMS).partition("=")[0]


def test_a_cloud_in_another_frame_is_the_same_cloud():
    points, normals = RANDOM.normal(size=(2, 40, 3))
    fields = cloud_to_fields(PointCloud(points, normals), "lidar")
    message = deserialize(CLOUD, serialize(CLOUD, fields))
    cloud = cloud_from_message(message, "world", heard=TREE)
    pose = TREE.lookup("world", "lidar")
    np.testing.assert_array_equal(cloud.points, pose.points(points))
    expected = PointCloud(points, normals).normals
    np.testing.assert_allclose(cloud.normals, pose.directions(expected), atol=1e-12)


def test_a_rig_in_another_frame_is_the_same_rig(rig):
    message = deserialize(RIG, serialize(RIG, rig_to_fields(rig) | {"header": {"frame_id": "arm"}}))
    found = rig_from_message(message, Optics(lens=Lens()), "world", TREE)
    assert found.frame_id == "world"
    expected = by_hand("rig", "arm")
    for moved, camera in zip(found.cameras, rig.cameras, strict=True):
        place = expected[:3, :3] @ camera.position + expected[:3, 3]
        np.testing.assert_allclose(moved.position, place, atol=1e-12)
        turned = expected[:3, :3] @ Rotation.from_quat(camera.orientation).as_matrix()
        np.testing.assert_allclose(
            Rotation.from_quat(moved.orientation).as_matrix(), turned, atol=1e-12
        )


@pytest.fixture
def rig():
    return cylinder_rig(2, 3)
