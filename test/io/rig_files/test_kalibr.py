# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Kalibr's camchains; its conventions are those of its wiki and of kalibr_common/ConfigReader."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from focus_planner.core.rig.frames import similarity_from_pose
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import dome_rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.kalibr import load_kalibr
from testing.photogrammetry import kalibr_chain, nerfstudio_pixel
from testing.projection import assert_images_alike

RIG = dome_rig(2, 4, radius=1.1, lowest=5.0, highest=55.0)
IMAGE: dict[str, Any] = {
    "camera_model": "pinhole",
    "intrinsics": [700.0, 710.0, 331.0, 243.5],
    "distortion_model": "radtan",
    "distortion_coeffs": [-0.28, 0.07, 0.0009, -0.0005],
    "resolution": [640, 480],
}
TOPICS = [f"/rig/cam{i}/image_raw" for i in range(len(RIG))]
#: The frame that Kalibr does not know.
PLACED = ImportOptions(
    transform=similarity_from_pose("first", RIG.cameras[0].position, RIG.cameras[0].orientation)
)


def write(folder: Path, change: Any = None, topics: Any = TOPICS, image: Any = IMAGE) -> Path:
    chain = yaml.safe_load(kalibr_chain(RIG, image, topics))
    if change is not None:
        change(chain)
    path = folder / "camchain.yaml"
    path.write_text(yaml.safe_dump(chain))
    return path


def test_a_chain_comes_back(tmp_path: Path) -> None:
    rig, notes = load_kalibr(write(tmp_path), PLACED)
    assert (notes, rig.frame_id) == ([], "world")
    assert [camera.name for camera in rig.cameras] == [f"cam{i}" for i in range(len(RIG))]
    np.testing.assert_allclose(camera_positions(rig), camera_positions(RIG), atol=1e-9)
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(RIG), atol=1e-9)


def test_the_frame_is_that_of_the_first_camera(tmp_path: Path) -> None:
    rig, notes = load_kalibr(write(tmp_path), ImportOptions())
    (note,) = notes
    assert note == (
        "poses are in the optical frame of rig_cam0: z is where it looks, y is down; give"
        " --transform with its pose in the frame of the surface"
    )
    assert rig.frame_id == "rig_cam0_optical_frame"
    assert rig.cameras[0].position == (0, 0, 0)
    assert rig.cameras[0].orientation == (0, 0, 0, 1)


@pytest.mark.parametrize("model", ["radtan", "equidistant", "none"])
def test_points_are_imaged_where_kalibr_has_them(tmp_path: Path, model: str) -> None:
    k = [-0.02, 0.01, -0.003, 0.001] if model == "equidistant" else IMAGE["distortion_coeffs"]
    coefficients = [] if model == "none" else k
    image = {**IMAGE, "distortion_model": model, "distortion_coeffs": coefficients}
    names = {
        "radtan": ("k1", "k2", "p1", "p2"),
        "equidistant": ("k1", "k2", "k3", "k4"),
        "none": (),
    }[model]
    # The formulas are those of nerfstudio too, whose pixels begin at a corner.
    own: Any = dict(zip(("fl_x", "fl_y", "cx", "cy"), IMAGE["intrinsics"], strict=True))
    own |= dict(zip(names, k, strict=False))
    own["camera_model"] = "OPENCV_FISHEYE" if model == "equidistant" else "OPENCV"
    rig, _ = load_kalibr(write(tmp_path, image=image), PLACED)
    assert_images_alike(rig, RIG, lambda point: nerfstudio_pixel(own, point), corner=0.0)


@pytest.mark.parametrize("key", ["T_cam_imu", "T_imu_cam"])
def test_transforms_from_the_imu_do_as_well(tmp_path: Path, key: str) -> None:
    camera_from_imu = np.array([[0, 1, 0, 0.1], [0, 0, 1, 0.2], [1, 0, 0, 0.3], [0, 0, 0, 1.0]])

    def through_imu(chain: dict[str, Any]) -> None:
        camera = camera_from_imu
        for i in range(len(chain)):
            if i:
                camera = np.array(chain[f"cam{i}"].pop("T_cn_cnm1")) @ camera
            told = camera if key == "T_cam_imu" else np.linalg.inv(camera)
            chain[f"cam{i}"][key] = told.tolist()

    rig, _ = load_kalibr(write(tmp_path, through_imu), PLACED)
    np.testing.assert_allclose(camera_positions(rig), camera_positions(RIG), atol=1e-9)


def test_a_chain_that_begins_like_opencvs_is_read(tmp_path: Path) -> None:
    path = write(tmp_path)
    path.write_text(f"%YAML:1.0\n---\n{path.read_text()}")
    assert len(load_kalibr(path, PLACED)[0]) == len(RIG)


def test_topics_that_do_not_tell_cameras_apart_name_none(tmp_path: Path) -> None:
    rig, _ = load_kalibr(write(tmp_path, topics=["/image"] * len(RIG)), PLACED)
    assert [camera.name for camera in rig.cameras] == [f"cam{i}" for i in range(len(RIG))]
    names = ["front", "Süd", "left", "right", "a", "b", "c", "d"][: len(RIG)]
    rig, _ = load_kalibr(write(tmp_path, topics=[f"/{name}/image_mono" for name in names]), PLACED)
    assert [camera.name for camera in rig.cameras][:2] == ["front", "Sud"]
    rig, _ = load_kalibr(write(tmp_path), replace(PLACED, cameras="*cam[12]"))
    assert len(rig) == 2


@pytest.mark.parametrize(
    ("change", "telling"),
    [
        (
            lambda c: c["cam1"].update(camera_model="omni"),
            "cam1: expected a pinhole .* omni with",
        ),
        (
            lambda c: c["cam1"].update(distortion_model="fov"),
            "got pinhole with fov; calibrate",
        ),
        (lambda c: c["cam1"].update(camera_model=3), r"cam1.camera_model: expected a name, got 3"),
        (lambda c: c["cam1"].pop("T_cn_cnm1"), r"cam1.T_cn_cnm1: expected a value, got none"),
        (lambda c: c["cam1"].update(T_cn_cnm1=[[1]]), r"cam1.T_cn_cnm1: expected shape \(4, 4\)"),
        (lambda c: c["cam1"].update(resolution=[640]), "cam1.resolution: expected a list of 2 num"),
        (
            lambda c: c["cam1"].update(intrinsics="f"),
            "cam1.intrinsics: expected a list of 4",
        ),
        (
            lambda c: c["cam1"].update(intrinsics=[0, 1, 1, 1]),
            r"cam1: image\.fx: expected a num",
        ),
        (
            lambda c: c["cam1"].update(distortion_coeffs=[1]),
            "distortion_coeffs: expected a list",
        ),
        (lambda c: c.pop("cam3"), "camchain YAML of Kalibr: cam0, cam1, .* numbers are missing"),
        (lambda c: c.update(cam1=7), "cam1: expected camera_model and its value, got a"),
        (dict.clear, "camchain YAML of Kalibr: cam0, cam1, ..., got none"),
    ],
)
def test_what_is_no_rig_is_refused(tmp_path: Path, change: Any, telling: str) -> None:
    with pytest.raises(InputError, match=telling) as caught:
        load_kalibr(write(tmp_path, change), PLACED)
    assert "\n" not in str(caught.value)
