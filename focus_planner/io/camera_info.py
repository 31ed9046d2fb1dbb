# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Camera intrinsics from the YAML files of ROS's camera_calibration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.validation import InputError
from focus_planner.io.files import is_folder, is_there
from focus_planner.io.quoting import abbreviated, kind_of
from focus_planner.io.yaml_values import errors_within, load_yaml, number, value_at

_SUFFIXES = (".yaml", ".yml")


def load_camera_info(path: Path) -> CameraIntrinsics:
    """Read the intrinsics of one camera.

    Reads ``image_width``, ``image_height``, ``camera_matrix``, ``distortion_model`` and
    ``distortion_coefficients``; the last two may be missing. Ignores the rectification and
    projection matrices, which do not affect what the camera sees.

    Raises
    ------
    InputError
        If a value is missing or invalid, or the camera matrix has skew; names the file and the
        key.
    """
    data = load_yaml(path, "the YAML of a camera_calibration")
    where = f"{path}: "
    fx, fy, cx, cy = _pinhole(f"{where}camera_matrix", value_at(where, data, "camera_matrix"))
    model, coefficients = _distortion(where, data)
    with errors_within(str(path)):
        return CameraIntrinsics(
            value_at(where, data, "image_width"),
            value_at(where, data, "image_height"),
            *(fx, fy, cx, cy),
            distortion_model=model,
            distortion=coefficients,
        )


def intrinsics_lookup(path: Path) -> Callable[[str], CameraIntrinsics]:
    """Return a function from a camera's name to its intrinsics.

    Parameters
    ----------
    path : Path
        A file for all cameras, or a folder with a ``NAME.yaml`` for each.

    Raises
    ------
    InputError
        As :func:`load_camera_info`; for a folder, when the function is called.
    """
    if is_folder(path):
        return lambda name: load_camera_info(_file_of(path, name))
    intrinsics = load_camera_info(path)
    return lambda _: intrinsics


def _file_of(folder: Path, name: str) -> Path:
    for suffix in _SUFFIXES:
        if is_there(folder / f"{name}{suffix}"):
            return folder / f"{name}{suffix}"
    raise InputError(str(folder), f"{name}.yaml, a file per camera", "none of that name")


def _pinhole(where: str, matrix: Any) -> tuple[float, float, float, float]:
    values = _data(where, matrix)
    if len(values) != 9:
        raise InputError(f"{where}.data", "9 numbers, row by row", str(len(values)))
    fx, skew, cx, zero, fy, cy, *last = values
    if (skew, zero, last) != (0, 0, [0, 0, 1]):
        raise InputError(
            f"{where}.data", "fx 0 cx, 0 fy cy, 0 0 1", " ".join(f"{value:g}" for value in values)
        )
    return fx, fy, cx, cy


def _distortion(where: str, data: Any) -> tuple[str, tuple[float, ...]]:
    if "distortion_coefficients" not in data:
        return "", ()
    coefficients = _data(f"{where}distortion_coefficients", data["distortion_coefficients"])
    model = value_at(where, data, "distortion_model")
    if not isinstance(model, str):
        raise InputError(f"{where}distortion_model", "a name", abbreviated(model))
    return model, tuple(coefficients)


def _data(where: str, matrix: Any) -> list[float]:
    data = value_at(where, matrix, "data")
    if not isinstance(data, list):
        raise InputError(f"{where}.data", "a list of numbers", kind_of(data))
    return [number(f"{where}.data[{i}]", value) for i, value in enumerate(data)]
