# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A camera: its intrinsics, pose and lens."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.names import MAX_NAME, is_camera_name, proposed_name
from focus_planner.core.rig.plausible import check_sensor
from focus_planner.core.validation import (
    MAX_COORDINATE,
    UNIT_ROUNDING,
    InputError,
    check_array,
    check_number,
    check_whole,
    shown,
)

_UNIT_TOLERANCE = 1e-3

#: The numbers of coefficients that each distortion model may have; names as in CameraInfo.
DISTORTION_COUNTS = {
    "plumb_bob": (4, 5),
    "rational_polynomial": (8, 12, 14),
    "equidistant": (4,),
}

#: Of an image's width and height: CameraInfo has 32 bits.
MAX_PIXELS = 2**32 - 1
# Pixels: beyond these nothing is an image, and quotients overflow.
_SHORTEST_FOCAL, _LARGEST_FOCAL, _FARTHEST_CENTRE = 1e-6, 1e12, 1e12
# Telephoto lenses have large coefficients, but their products must not overflow.
_LARGEST_COEFFICIENT = 1e30


@dataclass(frozen=True)
class CameraIntrinsics:
    """A camera's projection and distortion, as ``sensor_msgs/CameraInfo`` describes raw images.

    All values are in pixels of the full resolution, before cropping and binning; pixel centres
    have integer coordinates.

    Parameters
    ----------
    width, height : int
        Pixels.
    fx, fy, cx, cy : float
        Focal lengths and principal point, pixels.
    distortion_model : str
        "plumb_bob" (k₁, k₂, p₁, p₂, optionally k₃), "rational_polynomial" (k₁, k₂, p₁, p₂,
        k₃, ..., k₆, optionally the thin-prism terms s₁, ..., s₄), "equidistant" (the fisheye
        model: k₁, ..., k₄); "" for a pinhole. The formulas are OpenCV's.
    distortion : tuple of float
        The coefficients, in that order. For the first two models, no coefficients or only zeros
        mean a pinhole, and are stored as one. Not so for a fisheye: with four zeros it images a
        ray at θ from the axis θ focal lengths from the principal point.
    binning : tuple of 2 ints
        Columns and rows per bin.
    region : tuple of 4 ints, optional
        Region of interest: x_offset, y_offset, width, height. The whole image by default.

    Raises
    ------
    InputError
        If a value is out of range, the model is unknown or the number of coefficients is wrong
        for it, the region is not within the image, or a bin is larger than the region.
    """

    width: int = 580
    height: int = 870
    fx: float = 1190.732
    fy: float = 1190.732
    cx: float = 284.813
    cy: float = 434.440
    distortion_model: str = ""
    distortion: tuple[float, ...] = ()
    binning: tuple[int, int] = (1, 1)
    region: tuple[int, int, int, int] | None = None

    def __post_init__(self) -> None:
        check_whole("image.width", self.width, 1, MAX_PIXELS)
        check_whole("image.height", self.height, 1, MAX_PIXELS)
        for name in ("fx", "fy"):
            check_number(f"image.{name}", getattr(self, name), above=0, at_most=_LARGEST_FOCAL)
            check_number(f"image.{name}", getattr(self, name), at_least=_SHORTEST_FOCAL)
        for name in ("cx", "cy"):
            centre = check_number(f"image.{name}", getattr(self, name))
            if abs(centre) > _FARTHEST_CENTRE:
                expected = f"pixels up to {_FARTHEST_CENTRE:g}"
                raise InputError(f"image.{name}", expected, f"{centre:g}")
        object.__setattr__(self, "distortion", _checked_distortion(self))
        if not self.distortion:
            object.__setattr__(self, "distortion_model", "")
        object.__setattr__(self, "region", _checked_region(self))
        object.__setattr__(self, "binning", _checked_binning(self))

    @cached_property
    def pixels_read(self) -> tuple[int, int, int, int]:
        """x_offset, y_offset, width, height of the pixels that are read out.

        The region, less the columns at its right and the rows at its bottom that do not fill a
        bin.
        """
        x, y, width, height = self.region or (0, 0, self.width, self.height)
        columns, rows = self.binning
        return x, y, width - width % columns, height - height % rows


def _as_tuple(argument: str, value: object, kind: str) -> tuple[object, ...]:
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        raise InputError(argument, kind, shown(value))
    return tuple(value)


def _checked_distortion(intrinsics: CameraIntrinsics) -> tuple[float, ...]:
    """Return the coefficients, none for a pinhole; raise if the model does not take them."""
    name, model = "image.distortion", intrinsics.distortion_model
    listed = _as_tuple(name, intrinsics.distortion, "a list of coefficients")
    given = tuple(check_number(f"{name}[{i}]", number) for i, number in enumerate(listed))
    if any(abs(number) > _LARGEST_COEFFICIENT for number in given):
        raise InputError(
            name, f"coefficients up to {_LARGEST_COEFFICIENT:g}", f"{max(given, key=abs):g}"
        )
    if model not in DISTORTION_COUNTS and (model != "" or any(given)):
        raise InputError(
            "image.distortion_model",
            "one of " + ", ".join(DISTORTION_COUNTS),
            repr(model),
            "for rectified images leave distortion out and give the rectified fx, fy, cx, cy",
        )
    if model != "equidistant" and not any(given):
        return ()
    if len(given) not in DISTORTION_COUNTS[model]:
        counts = " or ".join(map(str, DISTORTION_COUNTS[model]))
        raise InputError(name, f"{counts} coefficients of the model {model}", str(len(given)))
    if any(given[12:]):
        raise InputError(
            name,
            "0 for the last two of 14 coefficients (tilted sensors are not supported)",
            f"{given[12]:g} and {given[13]:g}",
            "calibrate without OpenCV's tilted model",
        )
    return given


def _checked_region(intrinsics: CameraIntrinsics) -> tuple[int, int, int, int] | None:
    """Return the region of interest, None for the whole image; raise if it exceeds the image."""
    name = "image.region"
    if intrinsics.region is None:
        return None
    listed = _as_tuple(name, intrinsics.region, "x_offset, y_offset, width, height")
    if len(listed) != 4:
        raise InputError(name, "x_offset, y_offset, width, height", f"{len(listed)} numbers")
    x, y, width, height = (
        check_whole(f"{name}[{i}]", number, int(i > 1), MAX_PIXELS)
        for i, number in enumerate(listed)
    )
    if x + width > intrinsics.width or y + height > intrinsics.height:
        raise InputError(
            name,
            f"a region within the image of {intrinsics.width} × {intrinsics.height} pixels",
            f"{width} × {height} at ({x}, {y})",
            "offsets and sizes are in pixels of the full resolution, before binning",
        )
    return (
        None if (width, height) == (intrinsics.width, intrinsics.height) else (x, y, width, height)
    )


def _checked_binning(intrinsics: CameraIntrinsics) -> tuple[int, int]:
    """Return columns and rows per bin; raise if a bin is larger than the region."""
    name = "image.binning"
    listed = _as_tuple(name, intrinsics.binning, "columns and rows per bin")
    if len(listed) != 2:
        raise InputError(name, "columns and rows per bin", f"{len(listed)} numbers")
    columns, rows = (
        check_whole(f"{name}[{i}]", number, 1, MAX_PIXELS) for i, number in enumerate(listed)
    )
    _, _, width, height = intrinsics.region or (0, 0, intrinsics.width, intrinsics.height)
    if columns > width or rows > height:
        raise InputError(
            name, f"at most {width} × {height}, the size of the region", f"{columns} × {rows}"
        )
    return columns, rows


@dataclass(frozen=True)
class Camera:
    """One camera of a rig.

    Parameters
    ----------
    name : str
        Unique in the rig; letters, digits and underscores, starting with a letter.
    position : tuple of 3 floats
        Centre of projection in the rig's frame, metres.
    orientation : tuple of 4 floats
        Unit quaternion x, y, z, w of the optical frame in the rig's frame. Normalised exactly
        here.
    intrinsics : CameraIntrinsics
    lens : Lens

    Raises
    ------
    InputError
        If the name, position or orientation is invalid.
    """

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    intrinsics: CameraIntrinsics = field(default_factory=CameraIntrinsics)
    lens: Lens = field(default_factory=Lens)

    __repr__ = brief_repr

    def __post_init__(self) -> None:
        check_camera_name(self.name)
        position = _floats(f"camera {self.name}: position", self.position, 3)
        if not all(abs(metres) <= MAX_COORDINATE for metres in position):
            raise InputError(
                f"camera {self.name}: position",
                f"finite coordinates up to {MAX_COORDINATE:g} m",
                f"{position}",
            )
        quaternion = _floats(f"camera {self.name}: orientation", self.orientation, 4)
        norm = _norm(quaternion)
        if not abs(norm - 1) <= _UNIT_TOLERANCE:
            raise InputError(
                f"camera {self.name}: orientation",
                "a unit quaternion x, y, z, w",
                f"{quaternion} of norm {norm:g}",
                "the pose was probably never set" if norm == 0 else "",
            )
        _check_sensor(self)
        object.__setattr__(self, "position", position)
        if abs(norm - 1) > UNIT_ROUNDING:  # so that saving and loading a rig changes no bit
            quaternion = tuple(q / norm for q in quaternion)
        object.__setattr__(self, "orientation", quaternion)


def _check_sensor(camera: Camera) -> None:
    """Raise if the focal length, in metres and in pixels, makes a sensor larger than any."""
    f, image = camera.lens.focal_length, camera.intrinsics
    diagonal = f * math.hypot(image.width / image.fx, image.height / image.fy)
    check_sensor(f"camera {camera.name}: lens.focal_length", f, diagonal)


def check_camera_name(name: object, taken: Collection[str] = ()) -> None:
    """Raise unless a camera can have this name.

    Parameters
    ----------
    name : object
    taken : collection of str
        The names of the rig's other cameras, for the name that the error proposes.

    Raises
    ------
    InputError
        If it cannot be part of a topic's name; proposes one that can.
    """
    if not isinstance(name, str) or not is_camera_name(name):
        text = name if isinstance(name, str) else shown(name) if type(name) is int else None
        raise InputError(
            "camera name",
            "letters, digits and underscores, starting with a letter (it names a topic)",
            shown(name),
            "" if text is None else f"name it {proposed_name(text, taken)}",
        )
    if len(name) > MAX_NAME:
        raise InputError(
            "camera name", f"at most {MAX_NAME} characters (it names a topic)", repr(name)
        )


def _floats(argument: str, values: Sequence[float], count: int) -> tuple[float, ...]:
    """Return ``count`` floats. Tuples of floats, as messages have, skip the detour via NumPy."""
    floats = isinstance(values, tuple) and all(type(value) is float for value in values)
    if floats and len(values) == count:
        return tuple(values)
    return tuple(check_array(argument, values, (count,)).tolist())


def _norm(quaternion: Sequence[float]) -> float:
    """Return the quaternion's norm; inf where its square would overflow."""
    if any(abs(q) > MAX_COORDINATE for q in quaternion):
        return math.inf
    return math.sqrt(sum(q**2 for q in quaternion))
