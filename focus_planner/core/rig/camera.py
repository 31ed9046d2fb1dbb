"""Intrinsics and pose of one camera."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from focus_planner.core.rig.lens import Lens
from focus_planner.core.validation import (
    _FARTHEST,
    _ROUNDING,
    InputError,
    check_array,
    check_number,
    check_whole,
)

# Camera names become ROS topic tokens: ~/cameras/<name>/focus.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")

_UNIT_TOLERANCE = 1e-3

#: A topic's name, which has a camera's in it, has room for 247.
MAX_NAME = 100

#: How many coefficients each model of distortion has; the names are those of CameraInfo.
DISTORTION_COUNTS = {
    "plumb_bob": (4, 5),
    "rational_polynomial": (8, 12, 14),
    "equidistant": (4,),
}

# Those of a telephoto lens are large, and are multiplied with each other.
_LARGEST_COEFFICIENT = 1e30


@dataclass(frozen=True)
class CameraIntrinsics:
    """The images that a camera takes, as ``sensor_msgs/CameraInfo`` describes raw ones.

    Pixels are those of the full resolution, whatever is read out of them; pixel centres have
    whole coordinates.

    Parameters
    ----------
    width, height : int
        Pixels.
    fx, fy, cx, cy : float
        Focal lengths and principal point, pixels.
    distortion_model : str
        "plumb_bob" (k₁, k₂, p₁, p₂ and perhaps k₃), "rational_polynomial" (k₁, k₂, p₁, p₂,
        k₃, ..., k₆, and perhaps the thin prism's s₁, ..., s₄), "equidistant" (k₁, ..., k₄, of a
        fisheye); "" for a pinhole. The formulas are OpenCV's.
    distortion : tuple of float
        The coefficients, in that order. Coefficients of the first two models that are all 0, or
        none at all, are a pinhole's, and are kept as that. Four zeros of a fisheye are not: it
        images what is θ off the axis θ from the principal point, in focal lengths.
    binning : tuple of 2 ints
        How many columns and rows of pixels are read out as one.
    region : tuple of 4 ints, optional
        x_offset, y_offset, width, height of the pixels that are read out; all when absent.

    Raises
    ------
    InputError
        If a value is out of range, the model is unknown or has another number of coefficients,
        the region is not within the image, or binning leaves nothing of it.
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
        check_whole("image.width", self.width, 1)
        check_whole("image.height", self.height, 1)
        check_number("image.fx", self.fx, above=0)
        check_number("image.fy", self.fy, above=0)
        check_number("image.cx", self.cx)
        check_number("image.cy", self.cy)
        object.__setattr__(self, "distortion", _distortion(self))
        if not self.distortion:
            object.__setattr__(self, "distortion_model", "")
        object.__setattr__(self, "region", _region(self))
        object.__setattr__(self, "binning", _binning(self))

    @cached_property
    def pixels_read(self) -> tuple[int, int, int, int]:
        """x_offset, y_offset, width, height of the pixels that reach the image.

        The region without the columns at its right, and the rows at its bottom, that fill no
        whole bin.
        """
        x, y, width, height = self.region or (0, 0, self.width, self.height)
        columns, rows = self.binning
        return x, y, width - width % columns, height - height % rows


def _listed(argument: str, value: object, kind: str) -> tuple[object, ...]:
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        raise InputError(argument, kind, repr(value))
    return tuple(value)


def _distortion(intrinsics: CameraIntrinsics) -> tuple[float, ...]:
    """Return an image's coefficients, none for a pinhole; raise if they are not its model's."""
    name, model = "image.distortion", intrinsics.distortion_model
    listed = _listed(name, intrinsics.distortion, "a list of coefficients")
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
            "rectified images have no distortion, and the fx, fy, cx, cy that rectifying gave them",
        )
    if model != "equidistant" and not any(given):
        return ()
    if len(given) not in DISTORTION_COUNTS[model]:
        counts = " or ".join(map(str, DISTORTION_COUNTS[model]))
        raise InputError(name, f"{counts} coefficients of the model {model}", str(len(given)))
    if any(given[12:]):
        raise InputError(
            name,
            "a sensor that is not tilted: 0 for the last two of 14 coefficients",
            f"{given[12]:g} and {given[13]:g}",
            "calibrate without OpenCV's tilted model",
        )
    return given


def _region(intrinsics: CameraIntrinsics) -> tuple[int, int, int, int] | None:
    """Return the region of an image, None for all of it; raise if it is not within the image."""
    name = "image.region"
    if intrinsics.region is None:
        return None
    listed = _listed(name, intrinsics.region, "x_offset, y_offset, width, height")
    if len(listed) != 4:
        raise InputError(name, "x_offset, y_offset, width, height", f"{len(listed)} numbers")
    x, y, width, height = (
        check_whole(f"{name}[{i}]", number, int(i > 1)) for i, number in enumerate(listed)
    )
    if x + width > intrinsics.width or y + height > intrinsics.height:
        raise InputError(
            name,
            f"pixels of the image, which has {intrinsics.width} × {intrinsics.height}",
            f"{width} × {height} from ({x}, {y}) on",
            "offsets and sizes are in pixels of the full resolution, without binning",
        )
    return (
        None if (width, height) == (intrinsics.width, intrinsics.height) else (x, y, width, height)
    )


def _binning(intrinsics: CameraIntrinsics) -> tuple[int, int]:
    """Return the binning of an image; raise if it leaves no pixel."""
    name = "image.binning"
    listed = _listed(name, intrinsics.binning, "columns and rows that are read out as one")
    if len(listed) != 2:
        raise InputError(name, "columns and rows", f"{len(listed)} numbers")
    columns, rows = (check_whole(f"{name}[{i}]", number, 1) for i, number in enumerate(listed))
    _, _, width, height = intrinsics.region or (0, 0, intrinsics.width, intrinsics.height)
    if columns > width or rows > height:
        raise InputError(name, f"at most {width} × {height}, what is read", f"{columns} × {rows}")
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
        Quaternion x, y, z, w of the optical frame in the rig's frame; normalised here.
    intrinsics : CameraIntrinsics
    lens : Lens

    Raises
    ------
    InputError
        If the name, position or orientation cannot be used.
    """

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    intrinsics: CameraIntrinsics = field(default_factory=CameraIntrinsics)
    lens: Lens = field(default_factory=Lens)

    def __post_init__(self) -> None:
        check_camera_name(self.name)
        position = _numbers(f"camera {self.name}: position", self.position, 3)
        if not all(abs(metres) <= _FARTHEST for metres in position):
            raise InputError(
                f"camera {self.name}: position",
                f"finite metres, up to {_FARTHEST:g}",
                f"{self.position}",
            )
        quaternion = _numbers(f"camera {self.name}: orientation", self.orientation, 4)
        norm = _length(quaternion)
        if not abs(norm - 1) <= _UNIT_TOLERANCE:
            raise InputError(
                f"camera {self.name}: orientation",
                "a unit quaternion x, y, z, w",
                f"{quaternion} of length {norm:g}",
                "the pose was probably never set" if norm == 0 else "",
            )
        object.__setattr__(self, "position", position)
        if abs(norm - 1) > _ROUNDING:  # else saving and loading a rig would move its cameras
            quaternion = tuple(q / norm for q in quaternion)
        object.__setattr__(self, "orientation", quaternion)


def check_camera_name(name: object) -> None:
    """Raise unless a name can be a camera's.

    Raises
    ------
    InputError
        If it could not be a part of a topic's name.
    """
    if not isinstance(name, str) or not _NAME.match(name):
        raise InputError(
            "camera name",
            "letters, digits and underscores, starting with a letter (it names a topic)",
            repr(name),
        )
    if len(name) > MAX_NAME:
        raise InputError(
            "camera name", f"at most {MAX_NAME} characters (it names a topic)", repr(name)
        )


def _numbers(argument: str, values: Sequence[float], count: int) -> tuple[float, ...]:
    """Return that many numbers; of floats, which a message has, without the way through NumPy."""
    floats = isinstance(values, tuple) and all(type(value) is float for value in values)
    if floats and len(values) == count:
        return tuple(values)
    return tuple(check_array(argument, values, (count,)).tolist())


def _length(quaternion: Sequence[float]) -> float:
    """Return a quaternion's length; infinite where its square would overflow."""
    if any(abs(q) > _FARTHEST for q in quaternion):
        return math.inf
    return math.sqrt(sum(q**2 for q in quaternion))
