# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from RealityScan, formerly RealityCapture: a registration as CSV, or XMP files of images.

The conventions are those of Epic's "Camera Geometry in RealityScan". Lengths in the image are in
units of its larger side: the focal length times 36, the principal point from the middle. Tangential
coefficients t1 and t2 are OpenCV's p2 and p1.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.frames import (
    OPENGL_FROM_OPTICAL,
    Similarity,
    similarity_from_matrix,
)
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import MAX_COORDINATE, InputError, check_number, first_few
from focus_planner.io.files import is_folder, read_text
from focus_planner.io.quoting import key_name
from focus_planner.io.rig_files.camera_models import (
    PIXEL_CENTRE,
    BrownCamera,
    Closest,
    closest_intrinsics,
)
from focus_planner.io.rig_files.found import FoundCamera, ImportOptions, rig_of_found
from focus_planner.io.rig_files.image_files import ImageFiles
from focus_planner.io.xml_values import read_xml, text_number, text_numbers

_CSV = "cameras exported by RealityScan, as CSV with a line of titles that begins with #name"
_XMP = "XMP files of RealityScan, with a pose each"
_FILM = 36.0  # millimetres along the larger side of an image of 35 mm film
_POSITION = ("x", "y", "alt")
_ANGLES = (("heading", "yaw"), ("pitch",), ("roll",))
_COEFFICIENTS = ("k1", "k2", "k3", "k4", "t1", "t2")
_XCR = "{http://www.capturingreality.com/ns/xcr/1.1#}"
_DESCRIPTION = "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}Description"
_DISTORTED = ("brown3", "brown4", "brown3t2", "brown4t2")
_MODELS = ("none", "perspective", "division", *_DISTORTED)
_MAX_FILES = 250_000


class _Line(NamedTuple):
    """A line of a CSV file: its place, and its values by title."""

    where: str
    values: Mapping[str, str]


@dataclass(frozen=True)
class _Image:
    """What RealityScan tells of an image, in units of its larger side."""

    focal_length: float
    centre: tuple[float, float]
    is_division: bool
    coefficients: tuple[float, ...]

    def closest(self, where: str, size: tuple[int, int]) -> Closest:
        """Return its camera, given width and height in pixels."""
        width, height = size
        largest = max(size)
        focal_length = self.focal_length * largest
        cx, cy = (
            middle / 2 + largest * offset - PIXEL_CENTRE
            for middle, offset in zip(size, self.centre, strict=True)
        )
        k1, k2, k3, k4, t1, t2 = self.coefficients
        if self.is_division:
            # x / (1 + k1 r²): with a denominator and nothing else.
            model, coefficients = "rational_polynomial", (0.0,) * 5 + (k1, 0.0, 0.0)
            return Closest(
                CameraIntrinsics(
                    *(width, height, focal_length, focal_length, cx, cy),
                    distortion_model=model,
                    distortion=coefficients,
                )
            )
        return closest_intrinsics(
            where,
            BrownCamera(
                *(width, height, focal_length, focal_length, cx, cy),
                radial=(k1, k2, k3, k4),
                tangential=(t2, t1, 0.0, 0.0),
            ),
        )


def load_realitycapture(path: str | PathLike[str], options: ImportOptions) -> tuple[Rig, list[str]]:
    """Return a rig with a camera for every line of a CSV file, or every XMP file of a folder.

    Parameters
    ----------
    path : path
        Of a file, "Internal/External camera parameters" or one without the internal ones, or of a
        folder.
    options : ImportOptions
        The pattern of cameras is one for the names of images.

    Returns
    -------
    rig : Rig
        Cameras in the order of the file, or sorted by name; named by their images.
    notes : list of str
        Assumptions that were made.

    Raises
    ------
    InputError
        If there is no camera, nothing tells its image, or it cannot be represented.
    """
    path = Path(path)
    of_folder = is_folder(path)
    files = ImageFiles(path if of_folder else path.parent, options.image_folder, options.size)
    found = list(_of_folder(path, files) if of_folder else _of_table(path, files))
    what = f"{path}: {'XMP files' if of_folder else 'lines'}"
    rig, notes = rig_of_found(
        what,
        found,
        options,
        told_by="the EXIF of their images",
        without_unit="a registration is in metres only if its project was scaled or referenced",
    )
    return rig, notes


# --- CSV ---------------------------------------------------------------------------------------


def _of_table(path: Path, files: ImageFiles) -> Iterator[FoundCamera]:
    for line in _lines(path):
        name = line.values["name"].replace("\\", "/")
        yield FoundCamera(
            line.where,
            name,
            _pose_of_line(line),
            partial(_closest_of_line, line, name, files),
            partial(files.focal_length, name),
        )


def _closest_of_line(line: _Line, name: str, files: ImageFiles) -> Closest:
    return _image_of_line(line).closest(line.where, files.size(line.where, name))


def _lines(path: Path) -> Iterator[_Line]:
    """Yield the lines with a camera; those before the titles are comments."""
    titles: list[str] | None = None
    rows = csv.reader(read_text(path, _CSV).split("\n"))
    try:
        for row in rows:
            words = [word.strip() for word in row]
            where = f"{path}: line {rows.line_num}"
            if not any(words):
                continue
            if titles is None:
                titles = _titles(where, words)
            elif len(words) != len(titles):
                raise InputError(where, f"{len(titles)} values, as titles", str(len(words)))
            elif not words[0].startswith("#"):
                yield _Line(where, dict(zip(titles, words, strict=True)))
    except csv.Error as error:
        raise InputError(f"{path}: line {rows.line_num}", _CSV, str(error)) from None
    if titles is None:
        raise InputError(str(path), _CSV, "no such line")


def _titles(where: str, words: list[str]) -> list[str] | None:
    """Return the titles, None for a comment before them."""
    titles = [word.lstrip("#").strip().lower() for word in words]
    if titles[0] != "name":
        if words[0].startswith("#"):
            return None
        raise InputError(where, _CSV, "another line")
    angles = [next((name for name in names if name in titles), None) for names in _ANGLES]
    lacking = [
        *(name for name in _POSITION if name not in titles),
        *(names[0] for names, found in zip(_ANGLES, angles, strict=True) if found is None),
    ]
    if lacking:
        listed = ", ".join(key_name(title) for title in titles[:20])
        raise InputError(
            where,
            "titles with name, x, y, alt, heading, pitch and roll",
            f"none of {', '.join(lacking)} among {listed}",
            "export the registration as Internal/External camera parameters",
        )
    return titles


def _value(line: _Line, name: str, default: float | None = None) -> float:
    if name not in line.values:
        if default is not None:
            return default
        raise InputError(
            f"{line.where}: {name}",
            "the focal length",
            "no such title",
            "export Internal/External camera parameters, or give --image and --fx",
        )
    return check_number(f"{line.where}: {name}", text_number(line.where, line.values[name]))


def _pose_of_line(line: _Line) -> Similarity:
    """Return the pose of the optical frame.

    Yaw, pitch and roll are those of an aircraft, whose axes are nose, right wing, ground, in a
    frame north, east, down. Its camera looks at the ground, with the nose up in the image: of
    OpenGL's camera x is the right wing, y the nose. In east, north, up that is a turn about z by
    -yaw, about the new x by pitch, about the new y by roll.
    """
    x, y, z = (_value(line, name) for name in _POSITION)
    yaw, pitch, roll = (
        math.radians(_value(line, next(name for name in names if name in line.values)))
        for names in _ANGLES
    )
    turn = Rotation.from_euler("ZXY", [-yaw, pitch, roll])
    for value in (x, y, z):
        check_number(line.where, value, at_least=-MAX_COORDINATE, at_most=MAX_COORDINATE)
    return Similarity(turn, np.array([x, y, z])) @ OPENGL_FROM_OPTICAL


def _image_of_line(line: _Line) -> _Image:
    coefficients = tuple(_value(line, name, 0.0) for name in _COEFFICIENTS)
    return _Image(
        check_number(f"{line.where}: f", _value(line, "f") / _FILM, above=0),
        (_value(line, "px", 0.0), _value(line, "py", 0.0)),
        # The file does not name the model; only that of division has a single coefficient.
        is_division=coefficients[0] != 0 and not any(coefficients[1:]),
        coefficients=coefficients,
    )


# --- XMP ---------------------------------------------------------------------------------------


def _of_folder(folder: Path, files: ImageFiles) -> Iterator[FoundCamera]:
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".xmp")
    if not paths:
        raise InputError(str(folder), _XMP, "a folder without any", "export them beside the images")
    if len(paths) > _MAX_FILES:
        raise InputError(str(folder), f"at most {_MAX_FILES:,} XMP files", f"{len(paths):,}")
    read = {path: _description(path) for path in paths}
    posed = {path: found for path, found in read.items() if found is not None}
    if not posed:
        got = f"none with xcr:Rotation and xcr:Position: {first_few(path.name for path in paths)}"
        raise InputError(str(folder), _XMP, got, "align the images, and export them again")
    components = {
        values.get("ComponentId", "")
        for values in posed.values()
        if values.get("Coordinates", "absolute").lower() != "absolute"
    }
    if len(components) > 1:
        got = f"{len(components)} components, each in coordinates of its own"
        raise InputError(
            str(folder),
            "cameras of one component",
            got,
            "merge them, or move away all files but those of one",
        )
    for path, description in posed.items():
        name = PurePosixPath(path.stem).as_posix()
        where = str(path)
        yield FoundCamera(
            where,
            name,
            _pose_of(where, description),
            partial(_closest_of, where, description, name, files),
            partial(files.focal_length, name),
        )


def _closest_of(where: str, values: Mapping[str, str], name: str, files: ImageFiles) -> Closest:
    return _image_of(where, values).closest(where, files.size(where, name))


def _description(path: Path) -> Mapping[str, str] | None:
    """Return the values of a file by name; None if it has no pose: other programs' have none."""
    root = read_xml(str(path), read_text(path, _XMP), _XMP)
    values: dict[str, str] = {}
    for element in root.iter(_DESCRIPTION):
        values |= _own(element)
    return values if {"Rotation", "Position"} <= values.keys() else None


def _own(element: Element) -> dict[str, str]:
    """Return the values of a description, which are its attributes or elements."""
    attributes = {key: value for key, value in element.items() if key.startswith(_XCR)}
    elements = {each.tag: each.text or "" for each in element if each.tag.startswith(_XCR)}
    return {key.removeprefix(_XCR): value for key, value in {**attributes, **elements}.items()}


def _pose_of(where: str, values: Mapping[str, str]) -> Similarity:
    """Return the pose; the file has the turn of the world into the optical frame."""
    r = text_numbers(f"{where}: xcr:Rotation", values["Rotation"], 9)
    position = text_numbers(f"{where}: xcr:Position", values["Position"], 3)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.reshape(r, (3, 3)).T, position
    return similarity_from_matrix(where, matrix)


def _image_of(where: str, values: Mapping[str, str]) -> _Image:
    def value(name: str, default: float | None = None) -> float:
        if name not in values:
            if default is not None:
                return default
            remedy = "export XMP files with calibration, or give --image and --fx"
            raise InputError(f"{where}: xcr:{name}", "a value", "none", remedy)
        (found,) = text_numbers(f"{where}: xcr:{name}", values[name], 1)
        return check_number(f"{where}: xcr:{name}", found)

    for name, wanted in (("Skew", 0.0), ("AspectRatio", 1.0)):
        if value(name, wanted) != wanted:
            got = f"{value(name, wanted):g}"
            raise InputError(f"{where}: xcr:{name}", f"{wanted:g}", got, "give --image and --fx")
    model = values.get("DistortionModel", "none").lower()
    if model not in _MODELS:
        at = f"{where}: xcr:DistortionModel"
        raise InputError(at, f"one of {', '.join(_MODELS)}", key_name(model))
    # The name has been misspelt ever since.
    listed = values.get("DistortionCoeficients", "0 0 0 0 0 0")
    coefficients = tuple(
        check_number(where, each)
        for each in text_numbers(f"{where}: xcr:DistortionCoeficients", listed, 6)
    )
    return _Image(
        check_number(f"{where}: xcr:FocalLength35mm", value("FocalLength35mm") / _FILM, above=0),
        (value("PrincipalPointU", 0.0), value("PrincipalPointV", 0.0)),
        is_division=model == "division",
        coefficients=(0.0,) * 6 if model in ("none", "perspective") else coefficients,
    )
