# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from the ``transforms.json`` of nerfstudio, instant-ngp and Blender: images with poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from focus_planner.core.rig.camera import MAX_PIXELS, Camera
from focus_planner.core.rig.frames import (
    OPENGL_FROM_OPTICAL,
    Similarity,
    similarity_from_matrix,
    similarity_from_pose,
)
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError, check_number, check_whole
from focus_planner.io.files import read_text
from focus_planner.io.json_values import read_json
from focus_planner.io.quoting import abbreviated
from focus_planner.io.rig_files.camera_models import (
    PIXEL_CENTRE,
    BrownCamera,
    Closest,
    closest_intrinsics,
)
from focus_planner.io.rig_files.found import FoundCamera, ImportOptions, rig_of_found
from focus_planner.io.rig_files.image_files import ImageFiles
from focus_planner.io.yaml_values import number, numbers, value_at

_WHAT = "the frames of a transforms.json"
_FISHEYE = "OPENCV_FISHEYE"
_MODELS = ("OPENCV", _FISHEYE, "PINHOLE", "RADIAL", "SIMPLE_PINHOLE", "SIMPLE_RADIAL")
# Keys by which instant-ngp tells a camera that has no single focal length.
_OTHER_CAMERAS = ("equirectangular", "latlong", "orthographic", "ftheta_p0")
_COEFFICIENTS = {
    "plumb_bob": ("k1", "k2", "p1", "p2", "k3"),
    "equidistant": ("k1", "k2", "k3", "k4"),
}
_IN_ORDER = ("k1", "k2", "k3", "k4", "p1", "p2")  # of nerfstudio's distortion_params


def load_nerfstudio(path: str | PathLike[str], options: ImportOptions) -> tuple[Rig, list[str]]:
    """Return a rig with a camera for every frame of a ``transforms.json``.

    Parameters
    ----------
    path : path
    options : ImportOptions
        The pattern of cameras is one for the paths of images.

    Returns
    -------
    rig : Rig
        Cameras in the order of the frames, named by their images.
    notes : list of str
        Assumptions that were made.

    Raises
    ------
    InputError
        If a frame has no pose, nothing tells its image, or its camera cannot be represented.
    """
    path = Path(path)
    where = str(path)
    data = nerfstudio_frames(read_text(path, _WHAT))
    if data is None:
        raise InputError(where, f"{_WHAT}: JSON with a list of them", "something else")
    files = ImageFiles(path.parent, options.image_folder, options.size)
    found = [
        _found(f"{where}: frames[{i}]", data, frame, files)
        for i, frame in enumerate(data["frames"])
    ]
    rig, notes = rig_of_found(
        f"{where}: frames",
        found,
        options,
        told_by="the EXIF of their images",
        without_unit="the poses of most transforms.json have no unit",
    )
    return rig, [*notes, *_moved_before(data)]


def nerfstudio_frames(text: str) -> dict[str, Any] | None:
    """Return the contents of a ``transforms.json``; None if the text is something else."""
    if not text.lstrip().startswith("{"):
        return None
    try:
        data = read_json("transforms.json", text, "JSON")
    except InputError:
        return None  # it may be YAML
    return data if isinstance(data, dict) and isinstance(data.get("frames"), list) else None


def frames_of_rig(
    cameras: Sequence[Camera], images: Sequence[str], masks: Sequence[str]
) -> dict[str, Any]:
    """Return the contents of a ``transforms.json`` with a frame for every picture.

    Parameters
    ----------
    cameras : sequence of Camera
        That took each picture.
    images, masks : sequence of str
        The paths of the pictures and of their masks.

    Raises
    ------
    InputError
        If nerfstudio has no camera like these.
    """
    fisheye = {camera.intrinsics.distortion_model == "equidistant" for camera in cameras}
    if len(fisheye) > 1:
        raise InputError("cameras", "only fisheyes or none, for nerfstudio", "both")
    frames = []
    for camera, image, mask in zip(cameras, images, masks, strict=True):
        pose = _of_camera(camera) @ OPENGL_FROM_OPTICAL.inverse()
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = pose.rotation.as_matrix(), pose.position
        frame = {"file_path": image, "mask_path": mask, "transform_matrix": matrix.tolist()}
        frames.append(frame | _intrinsics_of(camera))
    return {"camera_model": "OPENCV_FISHEYE" if True in fisheye else "OPENCV", "frames": frames}


def _of_camera(camera: Camera) -> Similarity:
    return similarity_from_pose(f"camera {camera.name}", camera.position, camera.orientation)


def _intrinsics_of(camera: Camera) -> dict[str, float]:
    """Return the intrinsics of the pixels that are read out."""
    image = camera.intrinsics
    known = _COEFFICIENTS.get(image.distortion_model, ())
    if image.distortion and (not known or len(image.distortion) > len(known)):
        raise InputError(
            f"camera {camera.name}",
            "a distortion model of nerfstudio's: plumb_bob or equidistant",
            image.distortion_model,
            "undistort its pictures",
        )
    x, y, width, height = image.pixels_read
    columns, rows = image.binning
    return {
        "fl_x": image.fx / columns,
        "fl_y": image.fy / rows,
        "cx": (image.cx + PIXEL_CENTRE - x) / columns,
        "cy": (image.cy + PIXEL_CENTRE - y) / rows,
        "w": width // columns,
        "h": height // rows,
        **dict(zip(known, image.distortion, strict=False)),
    }


def with_masks(where: str, data: Mapping[str, Any], masks: Mapping[str, str]) -> dict[str, Any]:
    """Return the contents of a ``transforms.json`` with a mask for every frame.

    Parameters
    ----------
    where : str
        The file, for errors.
    data : mapping
    masks : mapping of str to str
        The paths of masks, by the names of their pictures' files without ending.

    Raises
    ------
    InputError
        If there is no mask for a frame: nerfstudio takes one for every frame or for none.
    """
    frames = []
    for i, frame in enumerate(data["frames"]):
        name = PurePosixPath(_path(f"{where}: frames[{i}]", frame)).stem
        if name not in masks:
            raise InputError(
                f"{where}: frames[{i}].file_path",
                "a picture of the plan",
                f"none of them is called {abbreviated(name)}",
                "say with --images what the pictures are called",
            )
        frames.append({**frame, "mask_path": masks[name]})
    return {**data, "frames": frames}


def _moved_before(data: Mapping[str, Any]) -> Iterator[str]:
    """Yield a note if the poses were moved after another program had found them.

    nerfstudio keeps how, but its poses have been moved already, and so has the cloud beside them,
    if a newer version wrote it.
    """
    moves = list(_moves(data))
    if moves:
        yield (
            f"the poses have been moved since the program that found them, such as COLMAP:"
            f" {' and '.join(moves)}; they are used as they are, with which the cloud agrees that"
            " newer versions of nerfstudio write beside them; move a surface of that program in the"
            " same way, or make the rig of its own model with focus_planner rig colmap"
        )


def _moves(data: Mapping[str, Any]) -> Iterator[str]:
    """Yield the changes of coordinates that were applied, in words."""
    matrix = data.get("applied_transform")
    if matrix is not None:
        try:
            rows = np.array(matrix, dtype=np.float64)[:3]
        except (TypeError, ValueError):
            rows = np.empty(0)
        if rows.shape != (3, 4):
            yield "by its applied_transform"
        elif not np.array_equal(rows, np.eye(3, 4)):
            yield f"(x, y, z) became ({', '.join(map(_sum, rows.tolist()))})"
    scale = data.get("applied_scale", 1.0)
    if scale != 1.0:
        yield f"all was multiplied by {abbreviated(scale)}"


def _sum(row: list[float]) -> str:
    """Return a row of a matrix as a sum: ``-z``, ``0.5 x + 0.5 y - 1``."""
    terms = [
        (factor, name) for factor, name in zip(row, ("x", "y", "z", ""), strict=True) if factor
    ]
    text = ""
    for factor, name in terms:
        size = f"{abs(factor):.4g}"
        term = " ".join(filter(None, ("" if size == "1" and name else size, name)))
        sign = "-" if factor < 0 else "+"
        text += f" {sign} {term}" if text else f"{'-' * (factor < 0)}{term}"
    return text or "0"


def _path(where: str, frame: Any) -> str:
    path = value_at(where, frame, "file_path")
    if not isinstance(path, str):
        raise InputError(f"{where}.file_path", "the path of an image", abbreviated(path))
    return path.replace("\\", "/").removeprefix("./")


def _found(where: str, data: Mapping[str, Any], frame: Any, files: ImageFiles) -> FoundCamera:
    path = _path(where, frame)
    return FoundCamera(
        where,
        path,
        _pose(where, frame),
        lambda: _image(where, data, frame, path, files),
        lambda: files.focal_length(path),
    )


def _pose(where: str, frame: Mapping[str, Any]) -> Similarity:
    matrix = value_at(where, frame, "transform_matrix")
    if isinstance(matrix, list) and len(matrix) == 3:
        matrix = [*matrix, [0, 0, 0, 1]]  # as some programs shorten it
    pose = similarity_from_matrix(f"{where}.transform_matrix", matrix)
    return pose @ OPENGL_FROM_OPTICAL


def _image(
    where: str, data: Mapping[str, Any], frame: Mapping[str, Any], path: str, files: ImageFiles
) -> Closest:
    """Return the camera of a frame, which may override each value of the file."""
    both = {**data, **frame}
    is_fisheye = _is_fisheye(where, both)
    width, height = _size(where, both, path, files)
    # As one: a frame's angle of view goes before the file's focal length.
    of_frame = _focal_lengths(where, frame, width, height)
    fx, fy = of_frame or _focal_lengths(where, data, width, height) or (None, None)
    if fx is None or fy is None:
        raise InputError(f"{where}.fl_x", "a value", "none", "add it, or give --image and --fx")
    k1, k2, k3, k4, p1, p2 = _distortion(where, both)
    return closest_intrinsics(
        where,
        BrownCamera(
            width,
            height,
            fx,
            fy,
            _value(where, both, "cx", width / 2) - PIXEL_CENTRE,
            _value(where, both, "cy", height / 2) - PIXEL_CENTRE,
            radial=(k1, k2, k3, k4),
            tangential=(p1, p2, 0.0, 0.0),
            is_fisheye=is_fisheye,
        ),
    )


def _value(where: str, data: Mapping[str, Any], name: str, default: float) -> float:
    value = data.get(name)
    return check_number(
        f"{where}.{name}", number(f"{where}.{name}", default if value is None else value)
    )


def _size(where: str, data: Mapping[str, Any], path: str, files: ImageFiles) -> tuple[int, int]:
    if data.get("w") is None or data.get("h") is None:
        return files.size(f"{where}.w", path)
    width, height = (
        check_whole(f"{where}.{name}", _whole(_value(where, data, name, 0.0)), 1, MAX_PIXELS)
        for name in ("w", "h")
    )
    return width, height


def _whole(value: float) -> float | int:
    return int(value) if value.is_integer() else value


def _focal_lengths(
    where: str, data: Mapping[str, Any], width: int, height: int
) -> tuple[float, float] | None:
    """Return the focal lengths, pixels, that a frame or the file tells; one stands for both."""
    along_x = _focal_length(where, data, "x", width)
    along_y = _focal_length(where, data, "y", height)
    one = along_x or along_y
    return None if one is None else (one, along_y or one)


def _focal_length(where: str, data: Mapping[str, Any], axis: str, size: int) -> float | None:
    if data.get(f"fl_{axis}") is not None:
        return _value(where, data, f"fl_{axis}", 0.0)
    for name, to_radians in ((f"camera_angle_{axis}", 1.0), (f"{axis}_fov", math.pi / 180)):
        if data.get(name) is not None:
            angle = to_radians * _value(where, data, name, 0.0)
            if not 0 < angle < math.pi:
                expected = "an angle of view above 0 and below 180°"
                raise InputError(f"{where}.{name}", expected, f"{math.degrees(angle):g}°")
            return size / 2 / math.tan(angle / 2)
    return None


def _distortion(where: str, data: Mapping[str, Any]) -> tuple[float, ...]:
    """Return k1, ..., k4, p1 and p2."""
    listed = data.get("distortion_params")
    if listed is None:
        return tuple(_value(where, data, name, 0.0) for name in _IN_ORDER)
    at = f"{where}.distortion_params"
    values = numbers(at, listed)
    if len(values) != len(_IN_ORDER):
        raise InputError(at, "6 numbers: " + ", ".join(_IN_ORDER), str(len(values)))
    return tuple(check_number(at, value) for value in values)


def _is_fisheye(where: str, data: Mapping[str, Any]) -> bool:
    name = data.get("camera_model", _FISHEYE if data.get("is_fisheye") else "OPENCV")
    if not isinstance(name, str):
        raise InputError(f"{where}: camera_model", "a name", abbreviated(name))
    other = next((key for key in _OTHER_CAMERAS if data.get(key)), None)
    if name in _MODELS and other is None:
        return name == _FISHEYE
    raise InputError(
        f"{where}: camera_model",
        f"one of {', '.join(_MODELS)}",
        abbreviated(other or name),
        "a picture has to have one optical axis, along which it is focused: make perspective"
        " pictures of it, or leave it out with --cameras",
    )
