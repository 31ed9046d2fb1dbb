"""Rigs out of COLMAP's sparse models: cameras and images, in text or binary.

The formats are those of COLMAP's documentation, "Output Format". Its rigs and frames (from 3.12
on) are not read: images hold their poses with and without them.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator
from fnmatch import fnmatchcase
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.frames import Similarity, similarity_from_matrix, similarity_from_pose
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.files import check_ended, check_readable, read_text, unreadable
from focus_planner.io.names import camera_names
from focus_planner.io.yaml_values import within


class _Model(NamedTuple):
    """A camera model of COLMAP, and the one of CameraInfo that holds it, or a part of it."""

    name: str
    parameters: str
    distortion_model: str = ""


# A model's number is its place. Parameters of one meaning have one name here.
_MODELS = (
    _Model("SIMPLE_PINHOLE", "f cx cy"),
    _Model("PINHOLE", "fx fy cx cy"),
    _Model("SIMPLE_RADIAL", "f cx cy k1", "plumb_bob"),
    _Model("RADIAL", "f cx cy k1 k2", "plumb_bob"),
    _Model("OPENCV", "fx fy cx cy k1 k2 p1 p2", "plumb_bob"),
    _Model("OPENCV_FISHEYE", "fx fy cx cy k1 k2 k3 k4", "equidistant"),
    _Model("FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6", "rational_polynomial"),
    _Model("FOV", "fx fy cx cy omega"),
    _Model("SIMPLE_RADIAL_FISHEYE", "f cx cy k1", "equidistant"),
    _Model("RADIAL_FISHEYE", "f cx cy k1 k2", "equidistant"),
    _Model("THIN_PRISM_FISHEYE", "fx fy cx cy k1 k2 p1 p2 k3 k4 sx1 sy1", "equidistant"),
    _Model(
        "RAD_TAN_THIN_PRISM_FISHEYE",
        "fx fy cx cy k1 k2 k3 k4 k5 k6 p1 p2 s1 s2 s3 s4",
        "equidistant",
    ),
    _Model("SIMPLE_DIVISION", "f cx cy k"),
    _Model("DIVISION", "fx fy cx cy k"),
    _Model("SIMPLE_FISHEYE", "f cx cy", "equidistant"),
    _Model("FISHEYE", "fx fy cx cy", "equidistant"),
    _Model("EUCM", "fx fy cx cy alpha beta"),
    _Model("EQUIRECTANGULAR", "w h"),
)
_MODEL_OF = {model.name: model for model in _MODELS}
_COEFFICIENTS = {
    "": "",
    "plumb_bob": "k1 k2 p1 p2 k3",
    "rational_polynomial": "k1 k2 p1 p2 k3 k4 k5 k6",
    "equidistant": "k1 k2 k3 k4",
}
_PIXEL_CENTRE = 0.5  # of the first pixel in COLMAP; ours is at 0
_POINT_BYTES = 24  # x, y, point3D_id


class _Shot(NamedTuple):
    """An image of the model."""

    name: str
    camera: int
    camera_from_model: Similarity


def load_colmap(
    folder: str | PathLike[str],
    *,
    images: str = "*",
    rig_from_model: Similarity | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Read a sparse model; every image is a camera of the rig.

    Parameters
    ----------
    folder : path
        With ``cameras.bin`` and ``images.bin``, or else ``cameras.txt`` and ``images.txt``.
    images : str
        A pattern (``cam*/0001.jpg``) of the names of the images to take.
    rig_from_model : Similarity, optional
        Takes the model's points to the rig's frame, in metres; the identity by default.
    lens : Lens, optional
        That of all cameras.
    frame_id : str

    Returns
    -------
    Rig
        Cameras by name of image, and named as in
        :func:`~focus_planner.io.names.camera_names`.

    Raises
    ------
    InputError
        If files are missing, cut off or contradict each other, a camera model cannot be held
        exactly, or images would have the same name as cameras.
    """
    where = str(folder)
    image_of, shots = _read(Path(folder))
    chosen = _matching(where, shots, images)
    names = camera_names(f"{where}: images", [_without_suffix(shot.name) for shot in chosen])
    to_rig, of_all = rig_from_model or Similarity(), lens or Lens()
    cameras = []
    for name, shot in zip(names, chosen, strict=True):
        with within(f"{where}: image {shot.name}"):
            if shot.camera not in image_of:
                raise InputError("camera", "one that the model has", str(shot.camera))
            at = to_rig @ shot.camera_from_model.inverse()
            cameras.append(Camera(name, at.position, at.orientation, image_of[shot.camera], of_all))
    return Rig(tuple(cameras), frame_id)


def _matching(where: str, shots: list[_Shot], pattern: str) -> list[_Shot]:
    """Return the images whose names match, by name."""
    chosen = [shot for shot in shots if fnmatchcase(shot.name, pattern)]
    if not chosen:
        got = f"none of {len(shots)}" + (f", {shots[0].name} among them" if shots else "")
        raise InputError(f"{where}: images", f"some that match {pattern}", got)
    return sorted(chosen, key=lambda shot: shot.name)


def load_alignment(path: Path) -> Similarity:
    """Read a 4 × 4 matrix that takes a model to a rig: 16 numbers, row by row.

    Raises
    ------
    InputError
        If there are not 16, or they do more than turn, move and scale.
    """
    words = re.split(r"[\s,;]+", read_text(path, "16 numbers, a 4 × 4 matrix row by row").strip())
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise InputError(str(path), "16 numbers, a 4 × 4 matrix row by row", str(error)) from None
    if len(numbers) != 16:
        raise InputError(str(path), "16 numbers, a 4 × 4 matrix row by row", f"{len(numbers)}")
    return similarity_from_matrix(str(path), [numbers[i : i + 4] for i in range(0, 16, 4)])


def _read(folder: Path) -> tuple[dict[int, CameraIntrinsics], list[_Shot]]:
    """Return the model's cameras by their number, and its images."""
    for suffix, read in ((".bin", _read_binary), (".txt", _read_text)):
        cameras, images = folder / f"cameras{suffix}", folder / f"images{suffix}"
        if cameras.exists() or images.exists():
            return read(cameras, images)
    expected = "a sparse model: cameras and images, .bin or .txt"
    if not folder.is_dir():
        raise InputError(str(folder), expected, "a file" if folder.exists() else "no such folder")
    below = sorted(
        path.parent for name in ("cameras.bin", "cameras.txt") for path in folder.rglob(name)
    )
    remedy = f"did you mean {below[0]}?" if below else ""
    raise InputError(str(folder), expected, "a folder without", remedy)


# --- camera models -----------------------------------------------------------------------------


def _image(
    where: str, model: _Model, width: int, height: int, parameters: list[float]
) -> CameraIntrinsics:
    """Return COLMAP's camera as ours, exactly, or raise."""
    values = dict(zip(model.parameters.split(), parameters, strict=True))
    if "f" in values:
        values["fx"] = values["fy"] = values.pop("f")
    if "fx" not in values:
        raise _not_ours(where, model.name)
    fx, fy, cx, cy = (values.pop(name) for name in ("fx", "fy", "cx", "cy"))
    coefficients = tuple(
        values.pop(name, 0.0) for name in _COEFFICIENTS[model.distortion_model].split()
    )
    beyond = [f"{name} = {value:g}" for name, value in values.items() if value != 0]
    if beyond:
        raise _not_ours(where, f"{model.name} with {', '.join(beyond)}")
    with within(where):
        return CameraIntrinsics(
            width,
            height,
            fx,
            fy,
            cx - _PIXEL_CENTRE,
            cy - _PIXEL_CENTRE,
            distortion_model=model.distortion_model,
            distortion=coefficients,
        )


def _not_ours(where: str, got: str) -> InputError:
    return InputError(
        where,
        "a camera model that sensor_msgs/CameraInfo can hold exactly",
        got,
        "estimate the cameras as OPENCV, FULL_OPENCV or OPENCV_FISHEYE,"
        " or undistort the images with colmap image_undistorter",
    )


def _without_suffix(name: str) -> str:
    return re.sub(r"\.\w+$", "", name.replace("\\", "/"))


# --- text --------------------------------------------------------------------------------------


def _read_text(cameras: Path, images: Path) -> tuple[dict[int, CameraIntrinsics], list[_Shot]]:
    return dict(_cameras_of_text(cameras)), list(_images_of_text(images))


def _cameras_of_text(path: Path) -> Iterator[tuple[int, CameraIntrinsics]]:
    for number, line in _lines(path):
        where = f"{path}: line {number}"
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) < 4:
            raise InputError(where, "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", repr(line))
        model = _MODEL_OF.get(words[1])
        if model is None:
            raise InputError(where, "a camera model of COLMAP", words[1])
        parameters = _floats(where, words[4:])
        _check_count(where, model, len(parameters))
        width, height = _whole(where, words[2]), _whole(where, words[3])
        yield _whole(where, words[0]), _image(where, model, width, height, parameters)


def _images_of_text(path: Path) -> Iterator[_Shot]:
    lines = _lines(path)
    for number, line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        where = f"{path}: line {number}"
        words = line.split(maxsplit=9)
        if len(words) < 10:
            expected = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
            raise InputError(where, expected, repr(line[:60]))
        name = words[9].strip()
        yield _shot(name, _whole(where, words[8]), where, _floats(where, words[1:8]))
        _, points = next(lines, (0, ""))
        if len(points.split()) % 3:
            raise InputError(
                f"{path}: line {number + 1}",
                f"the points of {name}: X Y POINT3D_ID each",
                repr(points[:60]),
                "after the line of each image comes one of its points, an empty one if it has none",
            )


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    text = read_text(path, "COLMAP's text")
    check_ended(path, "txt", text.encode())
    return enumerate(text.split("\n"), start=1)


def _shot(name: str, camera: int, where: str, values: list[float]) -> _Shot:
    w, x, y, z, *translation = values
    return _Shot(name, camera, similarity_from_pose(where, translation, (x, y, z, w)))


def _floats(where: str, words: list[str]) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise InputError(where, "numbers", str(error)) from None
    if not all(map(math.isfinite, values)):
        raise InputError(where, "finite numbers", " ".join(words))
    return values


def _whole(where: str, word: str) -> int:
    if not re.fullmatch(r"[0-9]+", word):
        raise InputError(where, "a whole number", repr(word))
    return int(word)


def _check_count(where: str, model: _Model, count: int) -> None:
    wanted = model.parameters.split()
    if count != len(wanted):
        raise InputError(
            where, f"{len(wanted)} parameters of {model.name}: {' '.join(wanted)}", str(count)
        )


# --- binary ------------------------------------------------------------------------------------


class _Bytes:
    """Reads little-endian numbers off a file's bytes."""

    def __init__(self, path: Path) -> None:
        check_readable(path, "COLMAP's binary")
        self._path = path
        self._bytes = path.read_bytes()
        self._at = 0

    def take(self, layout: str) -> tuple[int | float, ...]:
        start = self._at
        self.skip(struct.calcsize(f"<{layout}"))
        return struct.unpack_from(f"<{layout}", self._bytes, start)

    def whole(self, layout: str) -> int:
        return int(self.take(layout)[0])

    def name(self) -> str:
        end = self._bytes.find(b"\0", self._at)
        if end < 0:
            raise unreadable(self._path, "bin", "a name without an end")
        name = self._bytes[self._at : end]
        self._at = end + 1
        return name.decode(errors="replace")

    def skip(self, count: int) -> None:
        self._at += count
        if self._at > len(self._bytes):
            raise unreadable(self._path, "bin", f"only {len(self._bytes)} bytes")

    def check_at_end(self) -> None:
        if self._at != len(self._bytes):
            raise unreadable(self._path, "bin", f"{len(self._bytes) - self._at} bytes too many")


def _read_binary(cameras: Path, images: Path) -> tuple[dict[int, CameraIntrinsics], list[_Shot]]:
    return dict(_cameras_of_binary(cameras)), list(_images_of_binary(images))


def _cameras_of_binary(path: Path) -> Iterator[tuple[int, CameraIntrinsics]]:
    data = _Bytes(path)
    for _ in range(data.whole("Q")):
        camera, model_id = data.whole("I"), data.whole("i")
        where = f"{path}: camera {camera}"
        if not 0 <= model_id < len(_MODELS):
            raise InputError(where, "a camera model of COLMAP", f"number {model_id}")
        model = _MODELS[model_id]
        width, height = data.whole("Q"), data.whole("Q")
        count = len(model.parameters.split())
        yield camera, _image(where, model, width, height, list(data.take(f"{count}d")))
    data.check_at_end()


def _images_of_binary(path: Path) -> Iterator[_Shot]:
    data = _Bytes(path)
    for _ in range(data.whole("Q")):
        image = data.whole("I")
        values = list(data.take("7d"))
        camera, name = data.whole("I"), data.name()
        yield _shot(name, camera, f"{path}: image {image} ({name})", values)
        data.skip(_POINT_BYTES * data.whole("Q"))
    data.check_at_end()
