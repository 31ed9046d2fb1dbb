# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from Kalibr: the camchain YAML of its calibration of several cameras.

``T_cn_cnm1`` of a camera transforms points from the frame of the one before it into its own, and
``T_cam_imu`` those of the IMU; OpenVINS has its inverse, ``T_imu_cam``. All frames are optical,
lengths are metres, and pixel centres have integer coordinates.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.frames import Similarity, similarity_from_matrix
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError, check_whole
from focus_planner.io.names import camera_names
from focus_planner.io.quoting import abbreviated
from focus_planner.io.rig_files.camera_models import Closest
from focus_planner.io.rig_files.found import FoundCamera, ImportOptions, rig_of_found
from focus_planner.io.yaml_values import errors_within, load_yaml, value_at, vector

_WHAT = "the camchain YAML of Kalibr"
_CAMERA = re.compile(r"cam(\d{1,6})")
_DISTORTIONS = {"radtan": "plumb_bob", "equidistant": "equidistant", "none": ""}
_IMAGE_TOPIC = re.compile(r"/(image\w*|compressed)$")


def load_kalibr(path: str | PathLike[str], options: ImportOptions) -> tuple[Rig, list[str]]:
    """Return the rig of a camchain, in the optical frame of its first camera.

    Parameters
    ----------
    path : path
    options : ImportOptions
        The pattern of cameras is one for their names.

    Returns
    -------
    rig : Rig
        Cameras in the order of the chain, named by their topics, or cam0, cam1, ...
    notes : list of str
        Assumptions that were made.

    Raises
    ------
    InputError
        If a camera has no transform, or a model that cannot be represented.
    """
    path = Path(path)
    where = str(path)
    chain = _chain(where, load_yaml(path, _WHAT))
    names = _names(chain)
    found = [
        FoundCamera(at, name, pose, partial(_image, at, data))
        for (at, data), name, pose in zip(chain, names, _poses(chain), strict=True)
    ]
    rig, notes = rig_of_found(f"{where}: cameras", found, options)
    if options.transform is not None:
        return rig, notes
    (first,) = camera_names(f"{where}: cam0", names[:1])
    told = (
        f"poses are in the optical frame of {first}: z is where it looks, y is down; give"
        " --transform with its pose in the frame of the surface"
    )
    frame_id = options.frame_id or f"{first}_optical_frame"
    return replace(rig, frame_id=frame_id), [told, *notes]


def _chain(where: str, data: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the cameras in the order of their numbers, each with its place."""
    if not isinstance(data, Mapping):
        raise InputError(where, f"{_WHAT}: cam0, cam1, ...", "something else")
    numbers = sorted(int(m[1]) for key in data if (m := _CAMERA.fullmatch(str(key))))
    if not numbers or numbers != list(range(len(numbers))):
        got = "none" if not numbers else "some of the numbers are missing"
        raise InputError(where, f"{_WHAT}: cam0, cam1, ...", got)
    chain = [(f"{where}: cam{i}", data.get(f"cam{i}")) for i in numbers]
    for at, camera in chain:
        value_at(at, camera, "camera_model")
    return [(at, camera) for at, camera in chain if isinstance(camera, Mapping)]


def _names(chain: list[tuple[str, Mapping[str, Any]]]) -> list[str]:
    """Return the topics of the cameras if they tell them apart, else cam0, cam1, ..."""
    topics = [data.get("rostopic") for _, data in chain]
    names = [_IMAGE_TOPIC.sub("", topic).strip("/") for topic in topics if isinstance(topic, str)]
    if len({*filter(None, names)}) == len(chain):
        return names
    return [f"cam{i}" for i in range(len(chain))]


def _poses(chain: list[tuple[str, Mapping[str, Any]]]) -> Iterator[Similarity]:
    """Yield the pose of every camera in the frame of the first."""
    first_from_camera = Similarity()
    by_imu = all("T_cam_imu" in data or "T_imu_cam" in data for _, data in chain)
    for i, (where, data) in enumerate(chain):
        if i and ("T_cn_cnm1" in data or not by_imu):
            camera_from_previous = _transform(where, data, "T_cn_cnm1")
            first_from_camera = first_from_camera @ camera_from_previous.inverse()
        elif i:
            first_from_camera = _from_imu(*chain[0]) @ _from_imu(where, data).inverse()
        yield first_from_camera


def _from_imu(where: str, data: Mapping[str, Any]) -> Similarity:
    """Return the transform from the IMU to a camera; OpenVINS writes the inverse."""
    if "T_cam_imu" in data:
        return _transform(where, data, "T_cam_imu")
    return _transform(where, data, "T_imu_cam").inverse()


def _transform(where: str, data: Mapping[str, Any], key: str) -> Similarity:
    return similarity_from_matrix(f"{where}.{key}", value_at(where, data, key))


def _image(where: str, data: Mapping[str, Any]) -> Closest:
    model, distortion = (_word(where, data, key) for key in ("camera_model", "distortion_model"))
    if model != "pinhole" or distortion not in _DISTORTIONS:
        raise InputError(
            where,
            f"a pinhole with the distortion {', '.join(_DISTORTIONS)}",
            f"{model} with {distortion}",
            "calibrate it as pinhole-radtan or, if it is a fisheye, pinhole-equi",
        )
    width, height = (
        check_whole(f"{where}.resolution", size, 1)
        for size in vector(f"{where}.resolution", value_at(where, data, "resolution"), 2)
    )
    fx, fy, cx, cy = vector(f"{where}.intrinsics", value_at(where, data, "intrinsics"), 4)
    coefficients: tuple[Any, ...] = ()
    if distortion != "none":
        listed = value_at(where, data, "distortion_coeffs")
        coefficients = vector(f"{where}.distortion_coeffs", listed, 4)
    with errors_within(where):
        return Closest(
            CameraIntrinsics(
                *(width, height, fx, fy, cx, cy),
                distortion_model=_DISTORTIONS[distortion],
                distortion=coefficients,
            )
        )


def _word(where: str, data: Mapping[str, Any], key: str) -> str:
    value = value_at(where, data, key)
    if not isinstance(value, str):
        raise InputError(f"{where}.{key}", "a name", abbreviated(value))
    return value
