# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from frames and CameraInfo, beside those that ``rig transforms`` reads from a file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.io.rig_files.transforms import load_transforms
from focus_planner.messages.frames import HeardFrames, StaticTransform
from focus_planner.messages.reading import Optics, rig_from_message
from focus_planner.messages.typestore import CAMERA_INFO, RIG, deserialize, serialize
from focus_planner.messages.writing import intrinsics_to_fields
from focus_planner.parameters.camera_frames import CameraFrames
from focus_planner.runtime.rig_of_frames import RigOfFrames

IMAGE = CameraIntrinsics(640, 480, 500.0, 501.0, 320.0, 240.0)
RANDOM = np.random.default_rng(3)


def transform(parent, child):
    q = RANDOM.normal(size=4)
    translation = tuple(RANDOM.normal(size=3).tolist())
    return StaticTransform(parent, child, translation, tuple((q / np.linalg.norm(q)).tolist()))


FRAMES = ("cam10_optical_frame", "cam2_optical_frame", "side_link")
HEARD = HeardFrames((transform("world", "rig"), *(transform("rig", frame) for frame in FRAMES)))


def info(frame, image=IMAGE, stamp=0, **changed):
    header = {"frame_id": frame, "stamp": {"sec": stamp}}
    return serialize(CAMERA_INFO, {"header": header} | intrinsics_to_fields(image) | changed)


def composer(frames="cam*_optical_frame", convention="", topics="", **how):
    return RigOfFrames(CameraFrames.from_values(frames, convention, topics), "world", **how)


def rig_of(composed):
    assert composed.lacks == ""
    return rig_from_message(deserialize(RIG, composed.payload), Optics(), "world")


def complete(rig, frames=FRAMES):
    for frame in frames:
        rig.receive_info(f"/{frame}/camera_info", info(frame))
    return rig


def test_it_is_the_rig_that_a_file_of_the_same_transforms_makes(tmp_path):
    path = tmp_path / "tf_static.json"
    messages = [
        {
            "header": {"frame_id": each.parent},
            "child_frame_id": each.child,
            "transform": {
                "translation": dict(zip("xyz", each.translation, strict=True)),
                "rotation": dict(zip("xyzw", each.rotation, strict=True)),
            },
        }
        for each in HEARD.transforms
    ]
    path.write_text(json.dumps({"transforms": messages}))
    expected, _ = load_transforms(
        path, root="world", cameras="*_*", intrinsics_of=lambda _: IMAGE, convention=""
    )
    notes = []
    found = rig_of(
        complete(composer("*_optical_frame side_link", note=notes.append)).compose(HEARD)
    )
    assert [camera.name for camera in found.cameras] == ["side_link", "cam2", "cam10"]
    by_name = {camera.name: camera for camera in expected.cameras}
    for camera in found.cameras:
        assert camera.intrinsics == IMAGE
        np.testing.assert_allclose(camera.position, by_name[camera.name].position, atol=1e-12)
        np.testing.assert_allclose(camera.orientation, by_name[camera.name].orientation, atol=1e-12)
    assert notes == [
        (
            "camera_frames: assumed from their names to be body frames, x forward: side_link; set"
            " camera_convention to decide"
        )
    ]


def test_the_convention_can_be_told():
    optical = rig_of(complete(composer("side_link", "optical")).compose(HEARD))
    body = rig_of(complete(composer("side_link", "body")).compose(HEARD))
    assert optical.cameras[0].position == body.cameras[0].position
    assert optical.cameras[0].orientation != body.cameras[0].orientation


def test_what_was_heard_first_does_not_matter():
    backwards = HeardFrames(HEARD.transforms[::-1])
    assert complete(composer()).compose(HEARD) == complete(composer()).compose(backwards)


def test_only_news_are_news():
    rig = composer()
    assert rig.receive_info("/a", info("cam2_optical_frame"))
    assert not rig.receive_info("/a", info("cam2_optical_frame", stamp=9))
    assert not rig.receive_info("/a", info("cam2_optical_frame", p=[1.0] * 12))
    assert rig.receive_info("/a", info("cam2_optical_frame", k=[7.0] * 9))


@pytest.mark.parametrize("frame", ["cam2_link", "cam2", "cam2_frame", "/cam2_optical_frame"])
def test_intrinsics_may_name_another_frame_of_the_same_camera(frame):
    rig = complete(composer("cam2_optical_frame"), ())
    rig.receive_info("/x", info(frame))
    assert rig_of(rig.compose(HEARD)).cameras[0].name == "cam2"


def test_a_topic_may_tell_the_camera():
    rig = composer(topics="/{camera}/camera_info")
    for name in ("cam2", "cam10"):
        rig.receive_info(f"/{name}/camera_info", info("camera"))
    assert len(rig_of(rig.compose(HEARD))) == 2


@pytest.mark.parametrize(
    ("heard", "told"),
    [
        (True, r"heard, of others, on /left/camera_info \(camera 'left'\)$"),
        (False, r"none heard on camera_info_topics \(/\{camera\}/camera_info\)$"),
    ],
)
def test_topics_that_tell_another_camera_are_told(heard, told):
    rig = composer("cam2*", topics="/{camera}/camera_info")
    if heard:
        rig.receive_info("/left/camera_info", info("camera"))
    with pytest.raises(AssertionError, match=told):
        raise AssertionError(rig.compose(HEARD).lacks)


def test_equal_intrinsics_on_two_topics_are_no_contradiction():
    rig = complete(composer())
    rig.receive_info("/cam2/rect/camera_info", info("cam2_optical_frame", p=[1.0] * 12))
    assert rig_of(rig.compose(HEARD))


def test_a_topic_that_nobody_publishes_any_more_contradicts_none():
    rig = complete(composer())
    rig.receive_info("/moved/camera_info", info("cam2_optical_frame", width=7))
    old = "/cam2_optical_frame/camera_info"
    assert "is not the same on" in rig.compose(HEARD).lacks
    assert rig_of(rig.compose(HEARD, {old})).cameras[0].intrinsics.width == 7
    both = {old, "/moved/camera_info"}
    assert "is not the same on" in rig.compose(HEARD, both).lacks
    # Nor is a rig lost with its drivers.
    assert rig_of(complete(composer()).compose(HEARD, {old}))


def test_frames_that_would_name_the_same_camera_are_told():
    told = composer("cam2 cam2_optical_frame").compose(HEARD).lacks
    assert "both of which make cam2; rename one, or name the frames one by one" in told


UNCALIBRATED = {"k": [0.0] * 9}


@pytest.mark.parametrize(
    ("frames", "heard", "infos", "told"),
    [
        ("cam*", HeardFrames(), {}, "no frame has such a name: nothing was heard on /tf_static"),
        ("eye*", HEARD, {}, "no frame has such a name, only world, rig, cam10_optical_frame"),
        (
            "eye",
            HEARD,
            {"/e": info("eye")},
            "no transform from eye to world: /tf_static has no frame 'eye', only world, rig",
        ),
        (
            "cam*",
            HeardFrames(HEARD.transforms[1:]),
            {},
            (
                r"no transform from cam2_optical_frame \(and 1 more\) to world: /tf_static has no"
                " frame 'world'"
            ),
        ),
        ("cam*", HEARD, {}, "no CameraInfo of cam2_optical_frame, cam10_optical_frame; none heard"),
        (
            "cam*",
            HEARD,
            {"/b": info("cam10_optical_frame")},
            r"no CameraInfo of cam2_optical_frame; heard on /b \(cam10_optical_frame\)$",
        ),
        (
            "cam2*",
            HEARD,
            {"/b": info("camera")},
            (
                r"no CameraInfo of cam2_optical_frame; heard, of others, on /b \(frame 'camera'\):"
                " set the driver's frame_id, or name topics with camera_info_topics$"
            ),
        ),
        (
            "cam*",
            HEARD,
            {"/b": info("cam10_optical_frame"), "/c": info("")},
            r"no CameraInfo of cam2_optical_frame; heard, of others, on /c \(frame ''\): set the",
        ),
        (
            "cam3_optical cam2*",
            HEARD,
            {"/b": info("cam2_optical_frame")},
            "has no frame 'cam3_optical' \\(did you mean cam2_optical_frame\\?\\), only world, rig",
        ),
        (
            "cam2*",
            HEARD,
            {"/b": info("cam2_optical_frame", **UNCALIBRATED)},
            (
                "/b: CameraInfo: expected that of a calibrated camera, got 640 × 480 pixels and fx"
                " 0; give the camera's driver its calibration"
            ),
        ),
        (
            "cam2*",
            HEARD,
            {"/b": info("cam2_optical_frame"), "/c": info("cam2_optical_frame", width=7)},
            (
                "CameraInfo of cam2_optical_frame is not the same on /b and /c: choose with"
                " camera_info_topics"
            ),
        ),
        (
            "cam*",
            HEARD,
            {f"/{i}": info(f"cam{i}_optical_frame") for i in (2, 10, 11)},
            r"no transform of cam11_optical_frame \(/11\), whose CameraInfo was heard",
        ),
        ("cam2*", HEARD, {"/b": b"\x00\x01\x00\x00"}, "no CameraInfo of cam2_optical_frame"),
        ("cam2*", HEARD, {"/b": bytes(20_000)}, "no CameraInfo of cam2_optical_frame"),
    ],
)
def test_what_is_missing_is_told(frames, heard, infos, told):
    rig = composer(frames)
    for topic, payload in infos.items():
        rig.receive_info(topic, payload)
    composed = rig.compose(heard)
    assert composed.payload == b""
    listed = frames.replace(" ", ", ")
    assert composed.lacks.startswith(f"the rig of camera_frames ({listed}): ")
    with pytest.raises(AssertionError, match=told):
        raise AssertionError(composed.lacks)
