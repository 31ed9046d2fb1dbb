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

import re
from pathlib import Path

import pytest

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.validation import InputError
from focus_planner.io.camera_info import intrinsics_lookup, load_camera_info

# As camera_calibration writes it.
CALIBRATION = """image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [501.5, 0., 319.25,
           0., 502.5, 239.75,
           0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 1e-2, 0.001, -0.002, 0.]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [480., 0., 320., 0., 0., 481., 240., 0., 0., 0., 1., 0.]
"""
IMAGE = CameraIntrinsics(
    *(640, 480, 501.5, 502.5, 319.25, 239.75),
    distortion_model="plumb_bob",
    distortion=(-0.25, 0.01, 0.001, -0.002, 0.0),
)


def file(folder: Path, text: str, name: str = "camera.yaml") -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_what_camera_calibration_writes_is_read(tmp_path: Path) -> None:
    assert load_camera_info(file(tmp_path, CALIBRATION)) == IMAGE


def test_coefficients_may_be_missing(tmp_path: Path) -> None:
    text = CALIBRATION[: CALIBRATION.index("distortion_model")]
    assert load_camera_info(file(tmp_path, text)) == CameraIntrinsics(
        640, 480, 501.5, 502.5, 319.25, 239.75
    )


def test_a_fisheye_is_one(tmp_path: Path) -> None:
    text = CALIBRATION.replace("plumb_bob", "equidistant").replace(", 0.]", "]")
    intrinsics = load_camera_info(file(tmp_path, text))
    assert (intrinsics.distortion_model, len(intrinsics.distortion)) == ("equidistant", 4)


def test_one_file_is_all_cameras_and_a_folder_each_ones(tmp_path: Path) -> None:
    path = file(tmp_path, CALIBRATION, "left.yaml")
    file(tmp_path, CALIBRATION.replace("640", "641"), "right.yml")
    assert intrinsics_lookup(path)("any") == IMAGE
    of_name = intrinsics_lookup(tmp_path)
    assert of_name("left") == IMAGE
    assert of_name("right").width == 641
    telling = f"{tmp_path}: expected middle.yaml, a file per camera, got none of that name"
    with pytest.raises(InputError, match=re.escape(telling)):
        of_name("middle")


@pytest.mark.parametrize(
    ("old", "new", "telling"),
    [
        ("image_width: 640\n", "", "camera.yaml: image_width: expected a value, got none"),
        ("640", "0", "camera.yaml: image.width: expected a whole number of at least 1, got 0"),
        ("640", "640.5", "camera.yaml: image.width: expected a whole number"),
        ("camera_matrix:", "matrix:", "camera.yaml: camera_matrix: expected a value, got none"),
        ("501.5, 0.", "501.5, 0.1", "camera_matrix.data: expected fx 0 cx, 0 fy cy, 0 0 1, got"),
        ("501.5, 0.", "501.5", "camera_matrix.data: expected 9 numbers, row by row, got 8"),
        ("501.5", "wide", "camera_matrix.data[0]: expected a number, got 'wide'"),
        ("[501.5", "{501.5", "expected YAML, got line"),
        ("plumb_bob", "7", "camera.yaml: distortion_model: expected a name, got 7"),
        ("plumb_bob", "fov", "image.distortion_model: expected one of plumb_bob, "),
        ("distortion_model: plumb_bob\n", "", "distortion_model: expected a value, got none"),
        ("-0.25, 1e-2, ", "", "image.distortion: expected 4 or 5 coefficients"),
        (CALIBRATION, "640\n", "camera.yaml: expected camera_matrix and its value, got a number"),
        (CALIBRATION, "", "expected the YAML of a camera_calibration, got an empty file"),
    ],
)
def test_what_is_no_calibration_is_refused(
    tmp_path: Path, old: str, new: str, telling: str
) -> None:
    with pytest.raises(InputError, match=re.escape(telling)):
        load_camera_info(file(tmp_path, CALIBRATION.replace(old, new, 1)))
