# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Frames of images, as nerfstudio and instant-ngp write them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as PillowImage
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.frames import Similarity
from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.nerfstudio import frames_of_rig, load_nerfstudio
from focus_planner.io.rig_files.transforms import load_transforms
from testing.photogrammetry import nerfstudio_matrices, nerfstudio_pixel
from testing.projection import assert_images_alike

RIG = cylinder_rig(2, 5)
IMAGE = {"w": 640, "h": 480, "fl_x": 500.0, "fl_y": 510.0, "cx": 320.5, "cy": 240.5}


METRES = ImportOptions(scale=1.0)


def frames() -> list[dict[str, Any]]:
    return [
        {"file_path": f"./images/{camera.name}.png", "transform_matrix": matrix}
        for camera, matrix in zip(RIG.cameras, nerfstudio_matrices(RIG), strict=True)
    ]


def write(folder: Path, change: dict[str, Any] | None = None, first: Any = None) -> Path:
    data = {**IMAGE, "frames": frames(), "aabb_scale": 16, **(change or {})}
    if first is not None:
        data["frames"][0] |= first
    path = folder / "transforms.json"
    path.write_text(json.dumps(data, indent="\t"), encoding="utf-8-sig")
    return path


def test_a_cylinder_comes_back(tmp_path: Path) -> None:
    rig, notes = load_nerfstudio(write(tmp_path), ImportOptions())
    (note,) = notes
    assert note == (
        "the poses of most transforms.json have no unit; if it is metres, the cameras span"
        " 1.6 m; otherwise give the metres per unit with --scale"
    )
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
    rig, (note,) = load_nerfstudio(write(tmp_path, moves), METRES)
    assert rig == load_nerfstudio(write(tmp_path), METRES)[0]
    assert told in note
    assert note.startswith("the poses have been moved since the program that found them, such as")


def test_poses_that_were_not_moved_need_no_note(tmp_path: Path) -> None:
    nothing = {"applied_transform": np.eye(4)[:3].tolist(), "applied_scale": 1.0}
    assert load_nerfstudio(write(tmp_path, nothing), METRES)[1] == []


def test_what_is_asked_for_goes_first(tmp_path: Path) -> None:
    image = CameraIntrinsics(10, 10, 9, 9, 5, 5)
    options = ImportOptions(
        cameras="*_00.png", scale=2, intrinsics_of=lambda _: image, frame_id="rig"
    )
    rig, notes = load_nerfstudio(write(tmp_path), options)
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
    rig, _ = load_nerfstudio(write(tmp_path, first=change), METRES)
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
    rig, _ = load_nerfstudio(path, METRES)
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
        ({}, {"camera_model": "ORTHOPHOTO"}, "make perspective pictures of it, or leave it out"),
        ({"equirectangular": True}, None, "camera_model: .* got 'equirectangular'; a picture has"),
        (
            {"is_fisheye": True},
            {"p1": 0.05},
            "tangential terms of a fisheye, without which",
        ),
        ({}, {"distortion_params": [0.1]}, r"distortion_params: expected 6 numbers: k1, .* got 1"),
        ({}, {"fl_x": None, "camera_angle_x": 7.0}, r"camera_angle_x: .* below 180°, got 401.*°"),
        ({}, {"fl_x": "wide"}, r"frames\[0\]\.fl_x: expected a number, got 'wide'"),
        ({"fl_x": -1}, None, r"frames\[0\]: image\.fx: expected a number above 0, got -1"),
    ],
)
def test_what_is_no_rig_is_refused(
    tmp_path: Path, change: dict[str, Any], first: Any, telling: str
) -> None:
    with pytest.raises(InputError, match=telling):
        load_nerfstudio(write(tmp_path, change, first), METRES)


def test_what_it_lacks_is_named(tmp_path: Path) -> None:
    path = write(tmp_path)
    data = json.loads(path.read_text(encoding="utf-8-sig"))
    del data["w"]
    path.write_text(json.dumps(data))
    with pytest.raises(
        InputError, match=r"frames\[0\]\.w: expected the width and .*give --image WxH"
    ):
        load_nerfstudio(path, METRES)
    sized = replace(METRES, size=(640, 480))
    assert load_nerfstudio(path, sized)[0] == load_nerfstudio(write(tmp_path), METRES)[0]


def test_frames_of_images_are_no_transforms(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="read them with focus_planner rig nerfstudio"):
        load_transforms(write(tmp_path))


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


LENSES = {
    "none": {},
    "opencv": {"k1": -0.21, "k2": 0.06, "k3": -0.01, "p1": 0.002, "p2": -0.001},
    "eighth power": {"k1": -0.2, "k2": 0.05, "k3": -0.01, "k4": 0.002},
    "fisheye": {"camera_model": "OPENCV_FISHEYE", "k1": -0.03, "k2": 0.01, "k3": 2e-3, "k4": -1e-3},
    "angle": {"fl_x": None, "fl_y": None, "camera_angle_x": 1.138},
}


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES.keys())
def test_points_are_imaged_where_nerfstudio_has_them(tmp_path: Path, lens: dict[str, Any]) -> None:
    rig, notes = load_nerfstudio(write(tmp_path, lens), METRES)
    own = {**IMAGE, **lens}
    if "camera_angle_x" in lens:
        own["fl_x"] = own["fl_y"] = 320 / math.tan(1.138 / 2)
    within = 0.64 if "k4" in lens and "camera_model" not in lens else 1e-6
    assert_images_alike(rig, RIG, lambda point: nerfstudio_pixel(own, point), within)
    assert [note.startswith("10 of 10 cameras: a radial term") for note in notes] == [True] * (
        within > 0.1
    )


def test_distortion_may_be_a_list(tmp_path: Path) -> None:
    listed = {"distortion_params": [-0.21, 0.06, -0.01, 0.0, 0.002, -0.001]}
    named = load_nerfstudio(write(tmp_path, LENSES["opencv"]), METRES)[0]
    assert load_nerfstudio(write(tmp_path, listed), METRES)[0] == named


def test_a_synthetic_scene_of_blender_has_its_size_in_its_images(tmp_path: Path) -> None:
    frames = [
        {"file_path": f"./train/r_{i}", "rotation": 0.01, "transform_matrix": matrix}
        for i, matrix in enumerate(nerfstudio_matrices(RIG))
    ]
    path = tmp_path / "transforms_train.json"
    path.write_text(json.dumps({"camera_angle_x": 0.6911112070083618, "frames": frames}))
    (tmp_path / "train").mkdir()
    for i in range(len(RIG)):
        PillowImage.new("RGBA", (80, 60)).save(tmp_path / f"train/r_{i}.png")
    rig, _ = load_nerfstudio(path, METRES)
    assert [camera.name for camera in rig.cameras] == [f"r_{i}" for i in range(len(RIG))]
    fx = 40 / math.tan(0.6911112070083618 / 2)
    assert {camera.intrinsics for camera in rig.cameras} == {
        CameraIntrinsics(80, 60, fx, fx, 39.5, 29.5)
    }


def test_a_frames_angle_of_view_goes_before_the_files_focal_length(tmp_path: Path) -> None:
    rig, _ = load_nerfstudio(write(tmp_path, first={"camera_angle_x": math.pi / 2}), METRES)
    assert rig.cameras[0].intrinsics.fx == pytest.approx(320)
    assert rig.cameras[1].intrinsics.fx == 500
    degrees = write(tmp_path, {"fl_x": None, "fl_y": None}, {"x_fov": 90, "y_fov": 60})
    image = load_nerfstudio(degrees, replace(METRES, cameras="*cam_0_00*"))[0].cameras[0].intrinsics
    assert (image.fx, image.fy) == pytest.approx((320, 240 / math.tan(math.pi / 6)))


def test_paths_of_windows_are_paths(tmp_path: Path) -> None:
    windows = {"file_path": "C:\\scan\\images\\cam_9.png"}
    rig, _ = load_nerfstudio(write(tmp_path, first=windows), METRES)
    assert rig.cameras[0].name == "C_scan_images_cam_9"
    only = replace(METRES, cameras="images/cam_1*")
    assert len(load_nerfstudio(write(tmp_path), only)[0]) == 5


def test_lenses_are_those_of_exif_unless_told(tmp_path: Path) -> None:
    (tmp_path / "images").mkdir()
    exif = PillowImage.Exif()
    exif.get_ifd(0x8769)[0x920A] = 35.0
    for camera in RIG.cameras[:4]:
        PillowImage.new("L", (8, 6)).save(tmp_path / f"images/{camera.name}.jpg", exif=exif)
    path = write(tmp_path)
    path.write_text(path.read_text(encoding="utf-8-sig").replace(".png", ".jpg"))
    rig, (note,) = load_nerfstudio(path, METRES)
    assert [camera.lens.focal_length for camera in rig.cameras] == [0.035] * 4 + [0.05] * 6
    assert note == (
        "focal length 35 mm for 4 of 10 cameras, from the EXIF of their images; --focal-length"
        " replaces it"
    )
    assert "lens.focal_length" not in rig.assumed["cam_0_00"]
    assert "lens.focal_length" in rig.assumed["cam_1_04"]
    told = replace(METRES, lens={"focal_length": 0.024, "hyperfocal_distance": 3.0})
    rig, notes = load_nerfstudio(path, told)
    assert notes == []
    assert {camera.lens.focal_length for camera in rig.cameras} == {0.024}
    assert set(rig.assumed.values()) == {frozenset()}


def test_a_rig_can_be_placed(tmp_path: Path) -> None:
    placed = Similarity(Rotation.from_euler("z", 90, degrees=True), np.array([1.0, 2.0, 3.0]), 3.0)
    rig, notes = load_nerfstudio(write(tmp_path), ImportOptions(scale=2.0, transform=placed))
    assert notes == []
    x, y, z = RIG.cameras[3].position
    np.testing.assert_allclose(rig.cameras[3].position, (1 - 6 * y, 2 + 6 * x, 3 + 6 * z))
