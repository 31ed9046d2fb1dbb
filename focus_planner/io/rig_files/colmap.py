# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from COLMAP's sparse models: cameras and images, as text or binary.

The formats are described in COLMAP's documentation, "Output Format". The rigs and frames of
COLMAP 3.12 and later are not read, because images have their poses either way.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.frames import Similarity, similarity_from_pose
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    DIGITS,
    THE_REST,
    is_folder,
    is_there,
    read_bytes,
    read_text,
    unfinished_line,
    unreadable,
)
from focus_planner.io.names import camera_names, matches
from focus_planner.io.quoting import key_name, word
from focus_planner.io.rig_files.alignment import finite_numbers
from focus_planner.io.yaml_values import errors_within


class _Model(NamedTuple):
    """One of COLMAP's camera models, and CameraInfo's model that can represent it or part of it."""

    name: str
    parameters: str
    distortion_model: str = ""


# In the order of COLMAP's model ids. Parameters with the same meaning have the same name here.
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
_MODEL_BY_NAME = {model.name: model for model in _MODELS}
_COEFFICIENTS = {
    "": "",
    "plumb_bob": "k1 k2 p1 p2 k3",
    "rational_polynomial": "k1 k2 p1 p2 k3 k4 k5 k6",
    "equidistant": "k1 k2 k3 k4",
}
_PIXEL_CENTRE = 0.5  # the first pixel's centre in COLMAP; here it is 0
_TEXT = "COLMAP's text"
_PRINTED = 1e-6  # how exactly texts have the numbers of binary files
_POINT_BYTES = 24  # x, y, point3D_id


class _PosedImage(NamedTuple):
    """An image of the model with its pose."""

    name: str
    camera: int
    camera_from_model: Similarity


class _Contents(NamedTuple):
    """The intrinsics by COLMAP's camera id, the images, and what was noticed."""

    intrinsics: dict[int, CameraIntrinsics]
    images: list[_PosedImage]
    notes: tuple[Note, ...] = ()


def load_colmap(
    folder: str | PathLike[str],
    *,
    images: str = "*",
    rig_from_model: Similarity | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Read a sparse model; every image becomes a camera of the rig.

    Parameters
    ----------
    folder : path
        With ``cameras.bin`` and ``images.bin``, or ``cameras.txt`` and ``images.txt``; if with
        both, they must say the same.
    images : str
        A pattern for the names of the images to use, such as ``cam*/0001.jpg``.
    rig_from_model : Similarity, optional
        The transform from the model's frame to the rig's, in metres; the identity by default.
    lens : Lens, optional
        Shared by all cameras.
    frame_id : str

    Returns
    -------
    Rig
        Cameras sorted by image name; see :func:`~focus_planner.io.names.camera_names` for their
        own names.

    Raises
    ------
    InputError
        If files are missing, truncated or contradict each other, a camera model cannot be
        represented exactly, or two images would give cameras of the same name.
    """
    where = str(folder)
    intrinsics_of, posed_images, notes = _read(Path(folder))
    chosen = _matching(where, posed_images, images)
    names = camera_names(f"{where}: images", [_without_suffix(image.name) for image in chosen])
    to_rig, shared_lens = rig_from_model or Similarity(), lens or Lens()
    cameras = []
    for name, image in zip(names, chosen, strict=True):
        with errors_within(f"{where}: image {image.name}"):
            if image.camera not in intrinsics_of:
                raise InputError("camera", "one of the model's cameras", str(image.camera))
            intrinsics = intrinsics_of[image.camera]
            at = to_rig @ image.camera_from_model.inverse()
            cameras.append(Camera(name, at.position, at.orientation, intrinsics, shared_lens))
    return Rig(tuple(cameras), frame_id, notes=notes)


def _matching(where: str, posed_images: list[_PosedImage], pattern: str) -> list[_PosedImage]:
    """Return the images whose names match, sorted by name."""
    chosen = [image for image in posed_images if matches(image.name, pattern)]
    if not chosen:
        example = f", for example {posed_images[0].name}" if posed_images else ""
        got = f"none among {len(posed_images)}{example}"
        raise InputError(f"{where}: images", f"some that match {pattern}", got)
    return sorted(chosen, key=lambda image: image.name)


def _read(folder: Path) -> _Contents:
    """Return the intrinsics by COLMAP's camera id, and the images."""
    binary = [folder / "cameras.bin", folder / "images.bin"]
    text = [folder / "cameras.txt", folder / "images.txt"]
    of_binary, of_text = (sum(is_there(path) for path in paths) for paths in (binary, text))
    if of_binary == of_text == 2:
        model = _read_binary(*binary)
        _check_the_same(folder, model, _read_text(*text))
        return model
    if of_binary > of_text:
        return _read_binary(*binary)
    if of_text:  # a single binary file beside it is left from another model
        return _read_text(*text)
    expected = "a sparse model: cameras and images, .bin or .txt"
    if not is_folder(folder):
        raise InputError(str(folder), expected, "a file" if is_there(folder) else "no such folder")
    below = sorted(
        path.parent
        for name in ("cameras.bin", "cameras.txt")
        for below_it in ("", "*/", "*/*/")  # not all of a disk
        for path in folder.glob(below_it + name)
    )
    remedy = f"did you mean {below[0]}?" if below else ""
    raise InputError(str(folder), expected, "a folder without them", remedy)


def _check_the_same(folder: Path, one: _Contents, other: _Contents) -> None:
    """Raise if the binary and the text of a model differ: which of them is stale, nobody knows."""
    cameras, others = one.intrinsics, other.intrinsics
    poses = {image.name: image for image in one.images}
    posed = {image.name: image for image in other.images}
    if cameras.keys() != others.keys():
        differs = "cameras"
    elif poses.keys() != posed.keys():
        differs = "names of images"
    elif not all(_same_intrinsics(cameras[i], others[i]) for i in cameras):
        differs = "intrinsics"
    elif not all(_same_pose(poses[name], posed[name]) for name in poses):
        differs = "poses"
    else:
        return
    raise InputError(
        str(folder),
        "one model",
        f"two, binary and text, with different {differs}",
        "remove the files of the one that is out of date",
    )


def _same_intrinsics(one: CameraIntrinsics, other: CameraIntrinsics) -> bool:
    pairs = ((c.fx, c.fy, c.cx, c.cy, c.width, c.height, *c.distortion) for c in (one, other))
    return one.distortion_model == other.distortion_model and _close(*pairs)


def _same_pose(one: _PosedImage, other: _PosedImage) -> bool:
    a, b = one.camera_from_model, other.camera_from_model
    turn = float((a.rotation.inv() * b.rotation).magnitude())
    return one.camera == other.camera and _close((*a.translation, turn), (*b.translation, 0.0))


def _close(one: Sequence[float], other: Sequence[float]) -> bool:
    return len(one) == len(other) and bool(np.allclose(one, other, rtol=_PRINTED, atol=_PRINTED))


# --- camera models -----------------------------------------------------------------------------


def _intrinsics(
    where: str, model: _Model, width: int, height: int, parameters: list[float]
) -> CameraIntrinsics:
    """Return the exact equivalent of COLMAP's camera; raise if there is none."""
    values = dict(zip(model.parameters.split(), parameters, strict=True))
    if "f" in values:
        values["fx"] = values["fy"] = values.pop("f")
    if "fx" not in values:
        raise _unsupported(where, model.name)
    fx, fy, cx, cy = (values.pop(name) for name in ("fx", "fy", "cx", "cy"))
    coefficients = tuple(
        values.pop(name, 0.0) for name in _COEFFICIENTS[model.distortion_model].split()
    )
    beyond = [f"{name} = {value:g}" for name, value in values.items() if value != 0]
    if beyond:
        raise _unsupported(where, f"{model.name} with {', '.join(beyond)}")
    with errors_within(where):
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


def _unsupported(where: str, got: str) -> InputError:
    return InputError(
        where,
        "a camera model that sensor_msgs/CameraInfo can represent exactly",
        got,
        "estimate the cameras as OPENCV, FULL_OPENCV or OPENCV_FISHEYE,"
        " or undistort the images with colmap image_undistorter",
    )


def _without_suffix(name: str) -> str:
    return re.sub(r"\.\w+$", "", name.replace("\\", "/"))


# --- text --------------------------------------------------------------------------------------


def _read_text(cameras: Path, images: Path) -> _Contents:
    intrinsics, posed = dict(_cameras_of_text(cameras)), list(_images_of_text(images))
    _check_announced(cameras, "cameras", len(intrinsics))
    _check_announced(images, "images", len(posed))
    notes = (
        *unfinished_line(cameras, read_text(cameras, _TEXT).encode(), DIGITS),
        *unfinished_line(images, read_text(images, _TEXT).encode(), THE_REST),
    )
    return _Contents(intrinsics, posed, notes)


def _check_announced(path: Path, what: str, count: int) -> None:
    """Raise if there are fewer than a comment announces, as COLMAP writes it."""
    found = re.search(
        rf"^#\s*Number of {what}: *(\d{{1,18}})", read_text(path, _TEXT), re.MULTILINE
    )
    if found and count < int(found[1]):
        raise unreadable(path, "txt", f"{count} {what} of the {found[1]} announced")


def _cameras_of_text(path: Path) -> Iterator[tuple[int, CameraIntrinsics]]:
    for number, line in _lines(path):
        where = f"{path}: line {number}"
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) < 4:
            raise InputError(where, "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", f"{len(words)} words")
        model = _MODEL_BY_NAME.get(words[1])
        if model is None:
            raise InputError(where, "a camera model of COLMAP", key_name(words[1]))
        parameters = finite_numbers(where, words[4:])
        _check_count(where, model, len(parameters))
        width, height = _integer(where, words[2]), _integer(where, words[3])
        yield _integer(where, words[0]), _intrinsics(where, model, width, height, parameters)


def _images_of_text(path: Path) -> Iterator[_PosedImage]:
    lines = _lines(path)
    for number, line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        where = f"{path}: line {number}"
        words = line.split(maxsplit=9)
        if len(words) < 10:
            expected = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
            raise InputError(where, expected, f"{len(words)} words")
        name = words[9].strip()
        yield _posed_image(
            name, _integer(where, words[8]), where, finite_numbers(where, words[1:8])
        )
        _, points = next(lines, (0, ""))
        _check_points(f"{path}: line {number + 1}", name, points)


def _check_points(where: str, name: str, line: str) -> None:
    """Raise unless a line has an image's points: it may be the line of the next image."""
    words = line.split()
    try:
        points = [(float(x), float(y), int(i)) for x, y, i in zip(*[iter(words)] * 3, strict=True)]
        good = all(math.isfinite(x) and math.isfinite(y) and i >= -1 for x, y, i in points)
    except ValueError:
        good = False
    if not good:
        raise InputError(
            where,
            f"the points of {name}: X Y POINT3D_ID each",
            "something else",
            "each image's line is followed by one with its points, empty if it has none",
        )


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    return enumerate(read_text(path, _TEXT).split("\n"), start=1)


def _posed_image(name: str, camera: int, where: str, values: list[float]) -> _PosedImage:
    w, x, y, z, *translation = values
    return _PosedImage(name, camera, similarity_from_pose(where, translation, (x, y, z, w)))


def _integer(where: str, text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise InputError(where, "a whole number", word(text))
    return int(text)


def _check_count(where: str, model: _Model, count: int) -> None:
    wanted = model.parameters.split()
    if count != len(wanted):
        raise InputError(
            where, f"{len(wanted)} parameters of {model.name}: {' '.join(wanted)}", str(count)
        )


# --- binary ------------------------------------------------------------------------------------


class _ByteReader:
    """Reads little-endian numbers from a file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._bytes = read_bytes(path, "COLMAP's binary")
        self._at = 0

    def take(self, layout: str) -> tuple[int | float, ...]:
        start = self._at
        self.skip(struct.calcsize(f"<{layout}"))
        return struct.unpack_from(f"<{layout}", self._bytes, start)

    def integer(self, layout: str) -> int:
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


def _read_binary(cameras: Path, images: Path) -> _Contents:
    return _Contents(dict(_cameras_of_binary(cameras)), list(_images_of_binary(images)))


def _cameras_of_binary(path: Path) -> Iterator[tuple[int, CameraIntrinsics]]:
    data = _ByteReader(path)
    for _ in range(data.integer("Q")):
        camera, model_id = data.integer("I"), data.integer("i")
        where = f"{path}: camera {camera}"
        if not 0 <= model_id < len(_MODELS):
            raise InputError(where, "a camera model of COLMAP", f"number {model_id}")
        model = _MODELS[model_id]
        width, height = data.integer("Q"), data.integer("Q")
        count = len(model.parameters.split())
        yield camera, _intrinsics(where, model, width, height, list(data.take(f"{count}d")))
    data.check_at_end()


def _images_of_binary(path: Path) -> Iterator[_PosedImage]:
    data = _ByteReader(path)
    for _ in range(data.integer("Q")):
        image = data.integer("I")
        values = list(data.take("7d"))
        camera, name = data.integer("I"), data.name()
        yield _posed_image(name, camera, f"{path}: image {image}", values)
        data.skip(_POINT_BYTES * data.integer("Q"))
    data.check_at_end()
