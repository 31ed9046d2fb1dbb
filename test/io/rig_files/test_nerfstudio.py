"""Frames of images, as nerfstudio and instant-ngp write them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.nerfstudio import frames_of_rig
from focus_planner.io.rig_files.transforms import load_transforms

RIG = cylinder_rig(2, 5)
IMAGE = {"w": 640, "h": 480, "fl_x": 500.0, "fl_y": 510.0, "cx": 320.5, "cy": 240.5}


def frames() -> list[dict[str, Any]]:
    """Return the frames of a rig: x right, y up, z back."""
    found = []
    for camera, rig_from_optical in zip(RIG.cameras, camera_rotations(RIG), strict=True):
        right, down, forward = rig_from_optical.T
        matrix = np.eye(4)
        matrix[:3, :3] = np.column_stack([right, -down, -forward])
        matrix[:3, 3] = camera.position
        path = f"./images/{camera.name}.png"
        found.append({"file_path": path, "transform_matrix": matrix.tolist()})
    return found


def write(folder: Path, change: dict[str, Any] | None = None, first: Any = None) -> Path:
    data = {**IMAGE, "frames": frames(), "aabb_scale": 16, **(change or {})}
    if first is not None:
        data["frames"][0] |= first
    path = folder / "transforms.json"
    path.write_text(json.dumps(data, indent="\t"), encoding="utf-8-sig")
    return path


def test_a_cylinder_comes_back(tmp_path: Path) -> None:
    rig, notes = load_transforms(write(tmp_path))
    assert notes == ["one unit of the poses is taken for a metre; otherwise set --scale"]
    assert [camera.name for camera in rig.cameras] == [camera.name for camera in RIG.cameras]
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(RIG), atol=1e-9)
    for camera, expected in zip(rig.cameras, RIG.cameras, strict=True):
        np.testing.assert_allclose(camera.position, expected.position)
        assert camera.intrinsics == CameraIntrinsics(640, 480, 500, 510, 320, 240)
    assert rig.frame_id == "world"


@pytest.mark.parametrize(
    ("moves", "told"),
    [
        ({"applied_transform": [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]]}, "(x, z, -y)"),
        (
            {"applied_transform": [[0.5, -0.25, 0, -2], [0, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]},
            "(0.5 x - 0.25 y - 2, 0, z + 1)",
        ),
        ({"applied_scale": 0.25}, ": all was multiplied by 0.25;"),
        (
            {"applied_transform": np.eye(3, 4)[[1, 0, 2]].tolist(), "applied_scale": 2},
            "(y, x, z) and all was multiplied by 2;",
        ),
        ({"applied_transform": "yes"}, ": by its applied_transform;"),
        ({"applied_transform": [[1, 0], [0, 1]]}, ": by its applied_transform;"),
    ],
)
def test_poses_that_were_moved_are_kept_and_told(
    tmp_path: Path, moves: dict[str, Any], told: str
) -> None:
    rig, (note,) = load_transforms(write(tmp_path, moves), scale=1)
    assert rig == load_transforms(write(tmp_path), scale=1)[0]
    assert told in note
    assert note.startswith("the poses have been moved since the program that found them, such as")


def test_poses_that_were_not_moved_need_no_note(tmp_path: Path) -> None:
    nothing = {"applied_transform": np.eye(4)[:3].tolist(), "applied_scale": 1.0}
    assert load_transforms(write(tmp_path, nothing), scale=1)[1] == []


def test_what_is_asked_for_goes_first(tmp_path: Path) -> None:
    image = CameraIntrinsics(10, 10, 9, 9, 5, 5)
    rig, notes = load_transforms(
        write(tmp_path),
        cameras="*_00.png",
        scale=2,
        intrinsics_of=lambda _: image,
        frame_id="rig",
    )
    assert notes == []
    assert len(rig.cameras) == 2
    np.testing.assert_allclose(rig.cameras[0].position, 2 * np.array(RIG.cameras[0].position))
    assert rig.cameras[0].intrinsics == image
    assert rig.frame_id == "rig"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"fl_x": 400}, {"fx": 400}),
        ({"w": 320, "cx": 160.5}, {"width": 320, "cx": 160}),
        (
            {"k1": 0.1, "k2": 0.2, "p1": 0.3, "p2": 0.4, "camera_model": "OPENCV"},
            {"distortion_model": "plumb_bob", "distortion": (0.1, 0.2, 0.3, 0.4, 0.0)},
        ),
        (
            {"k1": 0.1, "k4": 0.4, "camera_model": "OPENCV_FISHEYE"},
            {"distortion_model": "equidistant", "distortion": (0.1, 0, 0, 0.4)},
        ),
        ({"k1": 0.0, "camera_model": "PINHOLE"}, {"distortion_model": ""}),
    ],
)
def test_a_frame_may_override_the_file(
    tmp_path: Path, change: dict[str, Any], expected: dict[str, Any]
) -> None:
    rig, _ = load_transforms(write(tmp_path, first=change))
    given = {name: getattr(rig.cameras[0].intrinsics, name) for name in expected}
    assert given == expected
    assert rig.cameras[1].intrinsics == CameraIntrinsics(640, 480, 500, 510, 320, 240)


def test_an_angle_of_view_is_a_focal_length(tmp_path: Path) -> None:
    angle = 2 * math.atan(320 / 500)
    path = write(tmp_path, {"camera_angle_x": angle})
    data = json.loads(path.read_text(encoding="utf-8-sig"))
    for name in ("fl_x", "fl_y", "cx", "cy"):
        del data[name]
    path.write_text(json.dumps(data))
    rig, _ = load_transforms(path)
    image = rig.cameras[0].intrinsics
    assert (image.fx, image.fy) == (pytest.approx(500), pytest.approx(500))
    assert (image.cx, image.cy) == (319.5, 239.5)


@pytest.mark.parametrize(
    ("change", "first", "telling"),
    [
        ({"frames": []}, None, "frames: expected some that match .*, got none"),
        ({}, {"transform_matrix": [[1]]}, r"frames\[0\]\.transform_matrix: expected shape"),
        ({}, {"file_path": 7}, r"frames\[0\]\.file_path: expected the path of an image, got 7"),
        ({}, {"file_path": "./images/cam_0_01.png"}, "names that differ"),
        ({}, {"camera_model": "EQUIRECTANGULAR"}, r"frames\[0\]: camera_model: expected one of"),
        ({}, {"k1": 0.1, "k4": 0.1}, r"frames\[0\]: expected a camera .* got OPENCV with k4"),
        ({}, {"fl_x": "wide"}, r"frames\[0\]\.fl_x: expected a number, got 'wide'"),
        ({"fl_x": -1}, None, r"frames\[0\]: image\.fx: expected a number above 0, got -1"),
    ],
)
def test_what_is_no_rig_is_refused(
    tmp_path: Path, change: dict[str, Any], first: Any, telling: str
) -> None:
    with pytest.raises(InputError, match=telling):
        load_transforms(write(tmp_path, change, first))


def test_what_it_lacks_is_named(tmp_path: Path) -> None:
    path = write(tmp_path)
    data = json.loads(path.read_text(encoding="utf-8-sig"))
    del data["w"]
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"frames\[0\]\.w: expected a value, got none; add it, or"):
        load_transforms(path)
    with pytest.raises(InputError, match="a tree of frames for --root and --convention"):
        load_transforms(path, root="world")


def test_frames_are_of_the_pixels_that_are_read_out() -> None:
    image = CameraIntrinsics(
        *(640, 480, 500.0, 510.0, 311.0, 247.0),
        distortion_model="plumb_bob",
        distortion=(-0.2, 0.08, 0.002, -0.001, 0.01),
        region=(11, 7, 301, 202),
        binning=(2, 3),
    )
    camera = replace(RIG.cameras[0], intrinsics=image)
    (frame,) = frames_of_rig([camera], ["images/a.jpg"], ["masks/a.png"])["frames"]
    assert (frame["w"], frame["h"]) == (150, 67)
    assert [frame[k] for k in ("k1", "k2", "p1", "p2", "k3")] == list(image.distortion)
    # The centre of pixel 40, 20 is that of two columns and three rows of the sensor.
    ray = [(11 + 2 * 40 + 0.5 - 311.0) / 500.0, (7 + 3 * 20 + 1 - 247.0) / 510.0]
    found = [(40.5 - frame["cx"]) / frame["fl_x"], (20.5 - frame["cy"]) / frame["fl_y"]]
    assert found == pytest.approx(ray, abs=1e-12)
