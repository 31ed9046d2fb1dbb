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

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.frames import BODY_FROM_OPTICAL, Similarity, similarity_from_pose
from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.transforms import load_transforms

RIG = cylinder_rig(2, 6)
HALF = math.sqrt(0.5)
COMMAND = "static_transform_publisher"
XYZ = "--x 1 --y 2 --z 3"
QZ = f"--qz {HALF} --qw {HALF}"
# As ros2 topic echo /tf_static prints it.
ECHOED = """transforms:
- header:
    stamp:
      sec: 1764000000
      nanosec: 0
    frame_id: world
  child_frame_id: rig
  transform:
    translation:
      x: 0.0
      y: 0.0
      z: 1.0
    rotation:
      x: 0.0
      y: 0.0
      z: 0.7071067811865475
      w: 0.7071067811865476
---
transforms:
- header:
    stamp:
      sec: 1764000000
      nanosec: 0
    frame_id: rig
  child_frame_id: left_optical_frame
  transform:
    translation:
      x: 2.0
      y: 0.0
      z: 0.0
    rotation:
      x: 0.0
      y: 0.0
      z: 0.0
      w: 1.0
---
"""


def stamped(parent: str, child: str, at: Similarity) -> dict[str, Any]:
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", at.position, strict=True)),
            "rotation": dict(zip("xyzw", at.orientation, strict=True)),
        },
    }


def file(folder: Path, text: str) -> Path:
    path = folder / "tf.txt"
    path.write_text(text)
    return path


def names(rig: Rig) -> list[str]:
    return [camera.name for camera in rig.cameras]


def assert_same(rig: Rig, expected: Rig) -> None:
    assert names(rig) == names(expected)
    for own, other in zip(rig.cameras, expected.cameras, strict=True):
        np.testing.assert_allclose(own.position, other.position, atol=1e-12)
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(expected), atol=1e-12)


def poses_of(rig: Rig) -> dict[str, Similarity]:
    return {
        camera.name: similarity_from_pose("", camera.position, camera.orientation)
        for camera in rig.cameras
    }


@pytest.mark.parametrize("dump", [json.dumps, yaml.safe_dump])
@pytest.mark.parametrize("wrapped", [False, True])
def test_a_cylinder_comes_back(tmp_path: Path, dump: Any, wrapped: bool) -> None:
    messages = [stamped("/booth", f"/{name}_optical", at) for name, at in poses_of(RIG).items()]
    path = file(tmp_path, dump({"transforms": messages} if wrapped else messages))
    rig, notes = load_transforms(path)
    assert_same(rig, RIG)
    assert (rig.frame_id, notes) == ("booth", [])


def test_chains_of_body_frames_are_composed(tmp_path: Path) -> None:
    """Each camera hangs as a body frame from a mount that hangs from a turned stand."""
    stand = similarity_from_pose("", (1, 2, 3), (0.6, 0, 0, 0.8))
    mount = similarity_from_pose("", (0.1, 0, 0), (0, HALF, 0, HALF))
    messages = [stamped("floor", "stand", stand)]
    for name, at in poses_of(RIG).items():
        link = mount.inverse() @ at @ BODY_FROM_OPTICAL.inverse()
        messages += [stamped("stand", f"m{name}", mount), stamped(f"m{name}", name, link)]
    path = file(tmp_path, json.dumps(messages))
    rig, notes = load_transforms(path, root="stand")
    assert_same(rig, RIG)
    assert rig.frame_id == "stand"
    (note,) = notes
    assert note.startswith(
        "assumed from their names to be body frames, x forward: cam_0_00, cam_0_01,"
    )
    assert note.endswith(" cam_0_05 and 6 more; set --convention to decide")
    in_floor, _ = load_transforms(path, convention="body", frame_id="hall")
    expected = [stand @ at for at in poses_of(RIG).values()]
    np.testing.assert_allclose(
        [camera.position for camera in in_floor.cameras], [at.position for at in expected]
    )
    assert in_floor.frame_id == "hall"


def test_what_ros_echoes_is_read(tmp_path: Path) -> None:
    rig, notes = load_transforms(file(tmp_path, ECHOED))
    assert (names(rig), rig.frame_id, notes) == (["left"], "world", [])
    np.testing.assert_allclose(rig.cameras[0].position, [0, 2, 1], atol=1e-15)
    np.testing.assert_allclose(rig.cameras[0].orientation, [0, 0, HALF, HALF], atol=1e-15)


@pytest.mark.parametrize(
    "line",
    [
        "1 2 3 0 0 0.7071067811865476 0.7071067811865476 rig cam",
        "1 2 3 1.5707963267948966 0 0 rig cam",
        "--x 1 --y 2e0 --z 3 --yaw 1.5707963267948966 --frame-id rig --child-frame-id cam",
        f"ros2 run tf2_ros {COMMAND} --child-frame-id cam --frame-id /rig {XYZ} {QZ} &",
        f"{COMMAND} 1 2 3 0 0 0.7071067811865476 0.7071067811865476 rig cam # it",
    ],
)
def test_lines_and_commands_are_read(tmp_path: Path, line: str) -> None:
    """A camera at (1, 2, 3), its body turned to look along +y."""
    rig, _ = load_transforms(file(tmp_path, f"\n# a rig\n{line}\n"))
    (camera,) = rig.cameras
    assert (camera.name, camera.position, rig.frame_id) == ("cam", (1, 2, 3), "rig")
    right, down, forward = camera_rotations(rig)[0].T
    np.testing.assert_allclose(forward, [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(right, [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(down, [0, 0, -1], atol=1e-12)


@pytest.mark.parametrize(
    ("frame", "convention", "forward"),
    [
        ("cam", "", [1, 0, 0]),
        ("cam_optical", "", [0, 0, 1]),
        ("cam_optical_frame", "", [0, 0, 1]),
        ("cam/optical_frame", "", [0, 0, 1]),
        ("cam_biooptical", "", [1, 0, 0]),
        ("cam", "optical", [0, 0, 1]),
        ("cam_optical_frame", "body", [1, 0, 0]),
    ],
)
def test_conventions(tmp_path: Path, frame: str, convention: str, forward: list[int]) -> None:
    path = file(tmp_path, f"0 0 0 0 0 0 1 rig {frame}\n")
    rig, notes = load_transforms(path, convention=convention)
    np.testing.assert_allclose(camera_rotations(rig)[0][:, 2], forward, atol=1e-15)
    assert bool(notes) == (not convention and forward == [1, 0, 0])


TREE = """0 0 0 0 0 0 1 world rig
1 0 0 0 0 0 1 rig ns/left
0 0 0 0 0 0 1 ns/left ns/left_optical_frame
2 0 0 0 0 0 1 rig ns/right
0 0 0 0 0 0 1 ns/right ns/right_optical_frame
0 0 5 0 0 0 1 rig lamp
0 0 0 0 0 0 1 moon crater
"""


def test_frames_can_be_chosen(tmp_path: Path) -> None:
    path = file(tmp_path, TREE)
    rig, notes = load_transforms(path, root="rig")
    assert names(rig) == ["left", "right"]
    assert notes == ["not used as cameras: lamp, crater; select the cameras' frames with --cameras"]
    rig, notes = load_transforms(path, root="/lamp", cameras="ns/*_frame")
    assert [camera.position for camera in rig.cameras] == [(1, 0, -5), (2, 0, -5)]
    assert notes == []
    rig, notes = load_transforms(path, root="moon")
    assert names(rig) == ["crater"]


def test_images_and_lenses_are_given(tmp_path: Path) -> None:
    images = {"left": CameraIntrinsics(640, 480), "right": CameraIntrinsics(320, 240)}
    path = file(tmp_path, TREE)
    rig, _ = load_transforms(path, root="rig", intrinsics_of=images.__getitem__, lens=Lens(0.02))
    assert {camera.name: camera.intrinsics for camera in rig.cameras} == images
    assert {camera.lens for camera in rig.cameras} == {Lens(0.02)}


def test_millimetres_are_refused_unless_there_is_a_scale(tmp_path: Path) -> None:
    path = file(tmp_path, "0 0 0 0 0 0 1 rig a\n1500 -2000 0 0 0 0 1 rig b\n")
    telling = (
        "tf.txt: translations: expected metres, cameras at most 100 m apart, got 2000 m; give"
        " --scale 0.001 if they are millimetres, --scale 1 if they are metres"
    )
    with pytest.raises(InputError, match=re.escape(telling)):
        load_transforms(path)
    assert load_transforms(path, scale=0.001)[0].cameras[1].position == (1.5, -2, 0)
    assert load_transforms(path, scale=1)[0].cameras[1].position == (1500, -2000, 0)
    with pytest.raises(InputError, match="scale: expected a number above 0, got 0"):
        load_transforms(path, scale=0)


# --- what is wrong -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "options", "telling"),
    [
        (
            TREE,
            {},
            "tf.txt: frames: expected one tree, got 2, with the roots world, moon; add the transf",
        ),
        (TREE, {"root": "rigg"}, "root: expected one of world, rig, ns/left, ns/left_optical_fra"),
        (TREE, {"root": "rigg"}, "and 3 more, got 'rigg'; did you mean rig?"),
        (
            TREE,
            {"root": "rig", "cameras": "c*r"},
            "frame crater: expected a frame of the tree below",
        ),
        (TREE, {"root": "rig", "cameras": "c*r"}, "below rig, got one below moon"),
        (TREE, {"root": "rig", "cameras": "x*"}, "cameras: expected frames that match x*, got onl"),
        (TREE, {"root": "crater"}, "tf.txt: root crater: expected cameras in its tree, got none"),
        (TREE, {"root": "rig", "convention": "up"}, "convention: expected one of optical, body"),
        ("1 2 3 rig a\n", {}, "line 1: expected x y z qx qy qz qw parent child, or x y z yaw"),
        ("1 2 3 rig a\n", {}, "pitch roll parent child, got 5 words"),
        ("0 0 0 0 0 0 2 rig a\n", {}, "line 1: rotation: expected a unit quaternion x, y, z, w"),
        ("0 0 0 0 0 up 1 rig a\n", {}, "line 1: expected a number, got 'up'"),
        ("0 0 0 0 0 0 1 rig a\nrig a\n", {}, "line 2: expected x y z"),
        ("0 0 0 0 0 0 1 rig '\n", {}, "line 1: expected words, got no closing quotation"),
        ("0 0 inf 0 0 0 1 rig a\n", {}, "line 1: expected a number, got inf"),
        ("0 0 0 0 0 0 1 a b\n0 0 0 0 0 0 1 b a\n", {}, "frame b: expected a tree, got a cycle"),
        ("0 0 0 0 0 0 1 a c\n0 0 0 0 0 0 1 b c\n", {}, "frame c: expected one parent, got two"),
        ("0 0 0 0 0 0 1 a c\n0 0 1 0 0 0 1 a c\n", {}, "frame c: expected one pose in a, got"),
        ("--x 1 --frame-id a\n", {}, "line 1: expected a frame's name, got nothing"),
        ("--x 1 --frame-id\n", {}, "line 1: expected a value after each of --x --y --z"),
        ("--up 1 --frame-id a\n", {}, "--child-frame-id, got also up"),
        (
            *("--qz 1 --yaw 1 --frame-id a --child-frame-id b\n", {}),
            "line 1: expected either a quaternion or roll, pitch and yaw, got both",
        ),
        ("", {}, "tf.txt: expected a list of transforms, got an empty file"),
        ("# nothing\n", {}, "tf.txt: expected a list of transforms, got none"),
        ("transforms: []\n", {}, "tf.txt: expected a list of transforms, got none"),
        ("transforms: 7\n", {}, "tf.txt: transforms: expected a list of transforms, got a number"),
        ("7\n", {}, "tf.txt: transforms: expected a list of transforms, got a number"),
        ("- 7\n", {}, "tf.txt: transforms[0]: expected transform and its value, got a number"),
        ("[{\n", {}, "tf.txt: expected YAML, got line 2"),
        (ECHOED.replace("y: 0.0", "v: 0.0"), {}, "[0].transform.translation.y: expected a value"),
        (ECHOED.replace("x: 2.0", "x: far"), {}, "[1].transform.translation.x: expected a number"),
        (ECHOED.replace("    frame_id: rig\n", ""), {}, "transforms[1].header.frame_id: expected"),
        (
            ECHOED.replace("frame_id: rig\n", "frame_id: ''\n"),
            {},
            "expected a frame's name, got ''",
        ),
        (ECHOED.replace("z: 0.707", "z: 0.72"), {}, "[0]: rotation: expected a unit quaternion"),
    ],
)
def test_what_is_no_list_of_transforms_is_refused(
    tmp_path: Path, text: str, options: dict[str, str], telling: str
) -> None:
    path = file(tmp_path, text)
    with pytest.raises(InputError, match=re.escape(telling)):
        load_transforms(path, **options)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.yaml: expected a list of transforms, got no"):
        load_transforms(tmp_path / "none.yaml")
