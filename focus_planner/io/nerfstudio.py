"""Rigs from the ``transforms.json`` of nerfstudio and instant-ngp: images with poses."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.camera import MAX_PIXELS, Camera, CameraIntrinsics
from focus_planner.core.rig.frames import Similarity, similarity_from_matrix, similarity_from_pose
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError, check_number, check_whole, first_few
from focus_planner.io.json_values import read_json
from focus_planner.io.names import camera_names
from focus_planner.io.quoting import abbreviated
from focus_planner.io.yaml_values import errors_within, number, value_at

#: Its cameras look along -z, with y up.
_CAMERA_FROM_OPTICAL = Similarity(Rotation.from_quat([1.0, 0.0, 0.0, 0.0]))
_PIXEL_CENTRE = 0.5  # the first pixel's centre in its images; here it is 0
_PINHOLE = {"PINHOLE", "SIMPLE_PINHOLE"}
_PERSPECTIVE = {"OPENCV", "SIMPLE_RADIAL", "RADIAL"}
_COEFFICIENTS = {
    "plumb_bob": ("k1", "k2", "p1", "p2", "k3"),
    "equidistant": ("k1", "k2", "k3", "k4"),
}


def nerfstudio_frames(text: str) -> dict[str, Any] | None:
    """Return the contents of a ``transforms.json``; None if the text is something else."""
    if not text.lstrip().startswith("{"):
        return None
    try:
        data = read_json("transforms.json", text, "JSON")
    except InputError:
        return None  # it may be YAML
    return data if isinstance(data, dict) and isinstance(data.get("frames"), list) else None


def rig_of_frames(
    where: str,
    data: Mapping[str, Any],
    *,
    cameras: str = "",
    scale: float | None = None,
    intrinsics_of: Callable[[str], CameraIntrinsics] | None = None,
    lens: Lens | None = None,
    frame_id: str = "",
) -> tuple[Rig, list[str]]:
    """Return a rig with a camera for every frame.

    Parameters
    ----------
    where : str
        The file, for errors.
    data : mapping
        Its contents.
    cameras : str
        A pattern for the paths of the images to use; all by default.
    scale : float, optional
        Metres per unit of the poses. By default 1, with a note: most were made without a unit.
    intrinsics_of : callable, optional
        A function from a camera's name to its intrinsics; by default those of the file.
    lens : Lens, optional
        Shared by all cameras.
    frame_id : str
        The frame's name in the rig; ``world`` by default.

    Returns
    -------
    rig : Rig
        Cameras in the order of the frames, named by their images.
    notes : list of str
        Assumptions that were made.

    Raises
    ------
    InputError
        If a frame has no pose, or a camera that cannot be represented exactly.
    """
    frames = [(f"{where}: frames[{i}]", frame) for i, frame in enumerate(data["frames"])]
    paths = [_path(at, frame) for at, frame in frames]
    chosen = [i for i, path in enumerate(paths) if not cameras or fnmatchcase(path, cameras)]
    if not chosen:
        got = f"only {first_few(paths)}" if paths else "none"
        raise InputError(f"{where}: frames", f"some that match {cameras or '*'}", got)
    names = camera_names(f"{where}: frames", [re.sub(r"\.\w+$", "", paths[i]) for i in chosen])
    to_metres = Similarity(scale=1.0 if scale is None else check_number("scale", scale, above=0))
    made = []
    for name, (at, frame) in zip(names, (frames[i] for i in chosen), strict=True):
        pose = to_metres @ _pose(at, frame)
        with errors_within(at):
            image = intrinsics_of(name) if intrinsics_of else _intrinsics(at, {**data, **frame})
            made.append(Camera(name, pose.position, pose.orientation, image, lens or Lens()))
    notes = []
    if scale is None:
        notes.append("one unit of the poses is taken for a metre; otherwise set --scale")
    notes.extend(_moved_before(data))
    return Rig(tuple(made), frame_id or "world"), notes


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
        pose = _of_camera(camera) @ _CAMERA_FROM_OPTICAL.inverse()
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
        "cx": (image.cx + _PIXEL_CENTRE - x) / columns,
        "cy": (image.cy + _PIXEL_CENTRE - y) / rows,
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


def _pose(where: str, frame: Mapping[str, Any]) -> Similarity:
    matrix = value_at(where, frame, "transform_matrix")
    rig_from_camera = similarity_from_matrix(f"{where}.transform_matrix", matrix)
    return rig_from_camera @ _CAMERA_FROM_OPTICAL


def _intrinsics(where: str, data: Mapping[str, Any]) -> CameraIntrinsics:
    """Return the intrinsics of a frame, which may override the file's."""

    def value(name: str, default: float | None = None) -> float:
        if name not in data and default is None:
            raise InputError(
                f"{where}.{name}", "a value", "none", "add it, or give --image and --fx"
            )
        return float(number(f"{where}.{name}", data.get(name, default)))

    width, height = (
        check_whole(f"{where}.{name}", _whole(value(name)), 1, MAX_PIXELS) for name in ("w", "h")
    )
    fx = value("fl_x", _from_angle(width, data.get("camera_angle_x")))
    fy = value("fl_y", _from_angle(height, data.get("camera_angle_y")) or fx)
    model = _distortion_model(where, data)
    known = _COEFFICIENTS.get(model, ())
    others = [n for n in ("k1", "k2", "k3", "k4", "p1", "p2") if n not in known and value(n, 0.0)]
    if others:
        raise InputError(
            where,
            "a camera that sensor_msgs/CameraInfo can represent exactly",
            f"{data.get('camera_model', 'OPENCV')} with {', '.join(others)}",
            "undistort the images",
        )
    return CameraIntrinsics(
        width,
        height,
        fx,
        fy,
        value("cx", width / 2) - _PIXEL_CENTRE,
        value("cy", height / 2) - _PIXEL_CENTRE,
        distortion_model=model,
        distortion=tuple(value(name, 0.0) for name in known),
    )


def _whole(value: float) -> float | int:
    return int(value) if value.is_integer() else value


def _from_angle(size: int, angle: Any) -> float | None:
    """Return the focal length of an angle of view, radians, in pixels."""
    if isinstance(angle, (int, float)) and 0 < angle < math.pi:
        return size / 2 / math.tan(angle / 2)
    return None


def _distortion_model(where: str, data: Mapping[str, Any]) -> str:
    name = data.get("camera_model", "OPENCV_FISHEYE" if data.get("is_fisheye") else "OPENCV")
    if not isinstance(name, str):
        raise InputError(f"{where}: camera_model", "a name", abbreviated(name))
    if name == "OPENCV_FISHEYE":
        return "equidistant"
    if name in _PINHOLE:
        return ""
    if name in _PERSPECTIVE:
        return "plumb_bob" if any(data.get(key) for key in ("k1", "k2", "k3", "p1", "p2")) else ""
    known = ", ".join(sorted({*_PINHOLE, *_PERSPECTIVE, "OPENCV_FISHEYE"}))
    raise InputError(f"{where}: camera_model", f"one of {known}", abbreviated(name))
