"""What the planner works on: lenses, cameras, rigs, surfaces, samples.

Metres everywhere; quaternions are x, y, z, w; a camera's frame is the optical frame (z forward,
x right, y down). See "Conventions" in the README.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.checks import (
    InputError,
    check_array,
    check_finite,
    check_number,
    check_whole,
)
from focus_planner.core.lens_table import MAX_FOCUS_STEPS, LensTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]

# Camera names become ROS topic tokens: ~/cameras/<name>/focus.
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_UNIT_TOLERANCE = 1e-3
_FARTHEST = 1e8
_FARTHEST_FOCUS = 1e12
# The square of what is shorter has next to no digits.
_SHORTEST = 1e-150
#: kernels/k_view.py numbers cameras with 18 bits.
MAX_CAMERAS = 250_000
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
_ROUNDING = 1e-15  # of the length of what was just normalised


class CameraStatus(IntEnum):
    """What a plan says of one camera; equal to the constants of ``CameraFocus.msg``."""

    UNKNOWN = 0
    PLANNED = 1
    UNASSIGNED = 2
    SEES_NOTHING = 3


@dataclass(frozen=True)
class Lens:
    """A thin lens with a shallow depth of field.

    Parameters
    ----------
    focal_length : float
        F, metres.
    hyperfocal_distance : float
        H = F² / (f-number · circle of confusion), metres, as in the paper's D_N and D_F
        (Sec. 4.2); texts that add F to it mean the same lens.
    min_focus, max_focus : float
        The distances that the lens can be set to, metres; 0 and inf for no limit.
    focus_distances : sequence of float, optional
        The only distances that the lens can be set to, metres, within the limits; made ascending
        and unique here.
    focus_steps : int, optional
        Instead of ``focus_distances``: how many positions the lens has between its limits,
        equally spaced in dioptres, both limits included. The position at infinity, of a lens
        without ``max_focus``, counts but is never planned: plans name finite distances.
    table : LensTable, optional
        What the lens's driver wants to be told. Its distances limit the lens too; a table of
        whole values is a list of distances itself, instead of the other two.

    Raises
    ------
    InputError
        If a value is out of range, the limits leave no distance, or two of distances, steps and a
        table of whole values are given.
    """

    focal_length: float = 0.050
    hyperfocal_distance: float = 10.0
    min_focus: float = 0.0
    max_focus: float = math.inf
    focus_distances: tuple[float, ...] | None = None
    focus_steps: int | None = None
    table: LensTable | None = None

    def __post_init__(self) -> None:
        check_number("lens.focal_length", self.focal_length, above=0)
        check_number("lens.hyperfocal_distance", self.hyperfocal_distance, above=self.focal_length)
        check_number("lens.min_focus", self.min_focus, at_least=0)
        for name in ("focal_length", "hyperfocal_distance", "min_focus"):
            _check_optical_reach(f"lens.{name}", getattr(self, name))
        check_number("lens.max_focus", self.max_focus, above=self.focal_length, infinite=True)
        if self.min_focus > self.max_focus:
            raise InputError(
                "lens.min_focus",
                f"at most max_focus ({self.max_focus:g} m)",
                f"{self.min_focus:g} m",
            )
        if self.table is not None:
            _check_table(self, self.table)
        if self.focus_distances is not None:
            object.__setattr__(self, "focus_distances", _listed_distances(self))
        if self.focus_steps is not None:
            _check_steps(self)

    @property
    def focus_limits(self) -> tuple[float, float]:
        """The nearest and farthest distance that limits and table leave, metres."""
        if self.table is None:
            return self.min_focus, self.max_focus
        return max(self.min_focus, self.table.nearest), min(self.max_focus, self.table.farthest)

    @cached_property
    def settable_distances(self) -> FloatArray | None:
        """(n,) all distances that the lens can be set to, metres, ascending; None for a range."""
        if self.focus_steps is not None:
            settable = _steps(*self.focus_limits, self.focus_steps)
        elif self.focus_distances is not None:
            settable = np.array(self.focus_distances)
        elif self.table is not None and self.table.settable_distances is not None:
            settable = _within(self.table.settable_distances, self)
        else:
            return None
        settable.flags.writeable = False
        return settable


def _check_optical_reach(argument: str, metres: float) -> None:
    """Raise if a lens's products with other distances would overflow."""
    if metres > _FARTHEST_FOCUS:
        raise InputError(argument, f"metres up to {_FARTHEST_FOCUS:g}", f"{metres:g}")


def _steps(nearest: float, farthest: float, count: int) -> FloatArray:
    """Return the finite ones of so many distances, equally spaced in dioptres."""
    dioptres = np.linspace(1 / nearest, 1 / farthest, count)
    finite = 1 / dioptres[dioptres > 0]
    # 1 / (1 / x) need not be x, and the limits are positions themselves.
    finite[0] = nearest
    if dioptres[-1] > 0:
        finite[-1] = farthest
    return np.unique(np.clip(finite, nearest, farthest))


def _within(distances: FloatArray, lens: Lens) -> FloatArray:
    """Return those distances that the lens's limits leave."""
    nearest, farthest = lens.focus_limits
    left = (distances >= nearest) & (distances <= farthest) & (distances > lens.focal_length)
    some: FloatArray = distances[left]
    return some


def _check_table(lens: Lens, table: LensTable) -> None:
    """Raise if a lens's table contradicts what else is said of it."""
    if not isinstance(table, LensTable):
        raise InputError("lens.table", "a LensTable", repr(table))
    settable = table.settable_distances
    listed = lens.focus_distances is not None or lens.focus_steps is not None
    if settable is not None and listed:
        raise InputError(
            "lens.table",
            "a table of whole values, focus_distances or focus_steps",
            "two of them",
            "a table of whole values says itself what the lens can be set to",
        )
    nearest, farthest = lens.focus_limits
    if nearest > farthest or farthest <= lens.focal_length:
        has = f"{table.nearest:g} to {table.farthest:g} m"
    elif settable is not None and not len(_within(settable, lens)):
        has = f"none of {len(settable)} whole values there"
    else:
        return
    raise InputError(
        "lens.table",
        f"distances from min_focus ({lens.min_focus:g} m) to max_focus ({lens.max_focus:g} m),"
        f" above focal_length ({lens.focal_length:g} m)",
        has,
    )


def _listed_distances(lens: Lens) -> tuple[float, ...]:
    """Return a lens's list of distances, ascending and unique; raise if it is none."""
    name, given = "lens.focus_distances", lens.focus_distances
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise InputError(name, "a list of distances in metres", repr(given))
    listed = sorted(
        {
            check_number(f"{name}[{i}]", distance, above=lens.focal_length)
            for i, distance in enumerate(given)
        }
    )
    if not 0 < len(listed) <= MAX_FOCUS_STEPS:
        raise InputError(
            name,
            f"1 to {MAX_FOCUS_STEPS} distances",
            str(len(listed)),
            "leave it out for a lens that takes every distance between its limits",
        )
    _check_optical_reach(name, listed[0])
    nearest, farthest = lens.focus_limits
    if not nearest <= listed[0] <= listed[-1] <= farthest:
        raise InputError(
            name,
            f"distances from min_focus ({nearest:g} m) to max_focus ({farthest:g} m)"
            + (", as the lens's table leaves them" if lens.table else ""),
            f"{listed[0]:g} to {listed[-1]:g} m",
        )
    return tuple(listed)


def _check_steps(lens: Lens) -> None:
    name, steps = "lens.focus_steps", lens.focus_steps
    if lens.focus_distances is not None:
        raise InputError(name, "focus_distances or focus_steps", "both")
    if check_whole(name, steps, 2) > MAX_FOCUS_STEPS:
        raise InputError(name, f"at most {MAX_FOCUS_STEPS}", str(steps))
    if lens.focus_limits[0] <= lens.focal_length:
        raise InputError(
            "lens.min_focus",
            f"a number above focal_length ({lens.focal_length:g} m), with focus_steps",
            f"{lens.focus_limits[0]:g}",
            "the steps are counted from the nearest distance that the lens can be set to",
        )


@dataclass(frozen=True)
class Image:
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


def _distortion(image: Image) -> tuple[float, ...]:
    """Return an image's coefficients, none for a pinhole; raise if they are not its model's."""
    name, model = "image.distortion", image.distortion_model
    listed = _listed(name, image.distortion, "a list of coefficients")
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


def _region(image: Image) -> tuple[int, int, int, int] | None:
    """Return the region of an image, None for all of it; raise if it is not within the image."""
    name = "image.region"
    if image.region is None:
        return None
    listed = _listed(name, image.region, "x_offset, y_offset, width, height")
    if len(listed) != 4:
        raise InputError(name, "x_offset, y_offset, width, height", f"{len(listed)} numbers")
    x, y, width, height = (
        check_whole(f"{name}[{i}]", number, int(i > 1)) for i, number in enumerate(listed)
    )
    if x + width > image.width or y + height > image.height:
        raise InputError(
            name,
            f"pixels of the image, which has {image.width} × {image.height}",
            f"{width} × {height} from ({x}, {y}) on",
            "offsets and sizes are in pixels of the full resolution, without binning",
        )
    return None if (width, height) == (image.width, image.height) else (x, y, width, height)


def _binning(image: Image) -> tuple[int, int]:
    """Return the binning of an image; raise if it leaves no pixel."""
    name = "image.binning"
    listed = _listed(name, image.binning, "columns and rows that are read out as one")
    if len(listed) != 2:
        raise InputError(name, "columns and rows", f"{len(listed)} numbers")
    columns, rows = (check_whole(f"{name}[{i}]", number, 1) for i, number in enumerate(listed))
    _, _, width, height = image.region or (0, 0, image.width, image.height)
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
    image : Image
    lens : Lens

    Raises
    ------
    InputError
        If the name, position or orientation cannot be used.
    """

    name: str
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    image: Image = field(default_factory=Image)
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


@dataclass(frozen=True)
class Grid:
    """The places of a rig's cameras on a cylinder.

    Camera ``row * columns + column`` stands in that row (from the bottom) and column; the last
    column is the first one's neighbour.
    """

    rows: int
    columns: int

    def __post_init__(self) -> None:
        check_whole("grid.rows", self.rows, 1)
        check_whole("grid.columns", self.columns, 1)


@dataclass(frozen=True)
class Rig:
    """The cameras of one capture, in one frame.

    Raises
    ------
    InputError
        If there is no camera, a name occurs twice, or the grid does not fit the cameras.
    """

    cameras: tuple[Camera, ...]
    frame_id: str = "world"
    grid: Grid | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "cameras", tuple(self.cameras))
        if not self.cameras:
            raise InputError("rig", "at least one camera", "none")
        if len(self.cameras) > MAX_CAMERAS:
            raise InputError("rig", f"at most {MAX_CAMERAS} cameras", str(len(self.cameras)))
        names = [camera.name for camera in self.cameras]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError("rig", "unique camera names", f"{twice!r} {names.count(twice)} times")
        if self.grid is not None and self.grid.rows * self.grid.columns != len(self.cameras):
            raise InputError(
                "rig.grid",
                f"rows × columns = {len(self.cameras)}, the number of cameras",
                f"{self.grid.rows} × {self.grid.columns}",
            )

    def __len__(self) -> int:
        return len(self.cameras)


@dataclass(frozen=True)
class CostModel:
    """The constants of the pointwise cost (paper, Eq. 1).

    Parameters
    ----------
    projected_area_weight, axis_deviation_weight, focus_weight : float
        w₁, w₂, w₃; their sum is at most 1, the cost of a sample that no camera sees.
    projected_area_scale : float
        ε₁, 1/m².
    axis_deviation_limit : float
        ε₂, metres.
    """

    projected_area_weight: float = 1 / 3
    axis_deviation_weight: float = 1 / 3
    focus_weight: float = 1 / 3
    projected_area_scale: float = 1.0
    axis_deviation_limit: float = 0.75

    def __post_init__(self) -> None:
        weights = (self.projected_area_weight, self.axis_deviation_weight, self.focus_weight)
        check_number("projected_area_weight", weights[0], at_least=0)
        check_number("axis_deviation_weight", weights[1], at_least=0)
        check_number("focus_weight", weights[2], at_least=0)
        if sum(weights) > 1 + 1e-9:
            raise InputError("cost weights", "a sum of at most 1", f"{sum(weights):g}")
        check_number("projected_area_scale", self.projected_area_scale, at_least=0)
        check_number("axis_deviation_limit", self.axis_deviation_limit, above=0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Parameters
    ----------
    vertices : (V, 3) array
        Metres.
    triangles : (T, 3) array of int
        Indices of vertices, counter-clockwise seen from outside.
    vertex_normals : (V, 3) array, optional
        Outward; they need not have unit length.
    vertex_importance : (V,) array, optional
        How much the surface at each vertex counts, at least 0 and linear in between; only ratios
        matter. All counts the same when absent.

    Raises
    ------
    InputError
        If there is no triangle, a number is not finite, an index is out of range, a triangle
        has no area, a normal has no length, or no triangle has any importance.
    """

    vertices: FloatArray
    triangles: IntArray
    vertex_normals: FloatArray | None = None
    vertex_importance: FloatArray | None = None

    def __post_init__(self) -> None:
        vertices = check_array("mesh vertices", self.vertices, (None, 3))
        triangles = check_array("mesh triangles", self.triangles, (None, 3), np.int64)
        if len(triangles) == 0:
            raise InputError("mesh", "at least one triangle", "none")
        if len(vertices) == 0:
            raise InputError("mesh vertices", "at least one", "none")
        check_finite("mesh vertices", vertices, "vertex", "repair the mesh or its export")
        _check_reach("mesh vertices", vertices)
        out_of_range = np.flatnonzero(((triangles < 0) | (triangles >= len(vertices))).any(axis=1))
        if len(out_of_range):
            first = out_of_range[0]
            raise InputError(
                "mesh triangles",
                f"vertex indices from 0 to {len(vertices) - 1}",
                f"{triangles[first].tolist()} in triangle {first}"
                f" ({len(out_of_range)} such triangles)",
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", _frozen(triangles.astype(np.int32)))
        _check_areas(self)
        if self.vertex_normals is not None:
            normals = check_array("mesh vertex_normals", self.vertex_normals, vertices.shape)
            object.__setattr__(self, "vertex_normals", _unit("mesh vertex_normals", normals))
        if self.vertex_importance is not None:
            name = "mesh vertex_importance"
            importance = check_array(name, self.vertex_importance, (len(vertices),))
            _check_importance(name, importance, "vertex", importance[triangles])
            object.__setattr__(self, "vertex_importance", importance)

    @cached_property
    def cross_products(self) -> FloatArray:
        """(T, 3) each triangle's outward normal, of length twice its area."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return np.cross(b - a, c - a)


@dataclass(frozen=True, eq=False)
class PointCloud:
    """A surface given by points on it.

    Parameters
    ----------
    points : (M, 3) array
        Metres.
    normals : (M, 3) array, optional
        Outward; they need not have unit length. Estimated from the points when absent.
    importance : (M,) array, optional
        How much the surface at each point counts, at least 0; only ratios matter. All counts
        the same when absent.

    Raises
    ------
    InputError
        If there are too few points to tell a surface, a number is not finite, a normal has no
        length, or no point has any importance.
    """

    points: FloatArray
    normals: FloatArray | None = None
    importance: FloatArray | None = None

    MIN_POINTS = 16

    def __post_init__(self) -> None:
        points = check_array("cloud points", self.points, (None, 3))
        if len(points) < self.MIN_POINTS:
            raise InputError(
                "cloud",
                f"at least {self.MIN_POINTS} points",
                "an empty cloud" if len(points) == 0 else f"{len(points)}",
            )
        check_finite("cloud points", points, "point", "remove the invalid points first")
        _check_reach("cloud points", points)
        object.__setattr__(self, "points", points)
        if self.normals is not None:
            normals = check_array("cloud normals", self.normals, points.shape)
            object.__setattr__(self, "normals", _unit("cloud normals", normals))
        if self.importance is not None:
            importance = check_array("cloud importance", self.importance, (len(points),))
            _check_importance("cloud importance", importance, "point", importance)
            object.__setattr__(self, "importance", importance)


Surface = Mesh | PointCloud


@dataclass(frozen=True, eq=False)
class Samples:
    """Points that stand for a surface.

    Attributes
    ----------
    points : (N, 3) array
        Metres.
    normals : (N, 3) array
        Unit length, outward.
    areas : (N,) array
        The surface area that each sample stands for, square metres.
    weights : (N,) array
        What each sample counts in the cost: its area times its importance, the greatest
        importance being 1; square metres.
    """

    points: FloatArray
    normals: FloatArray
    areas: FloatArray
    weights: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    def take(self, which: slice | NDArray[np.int64]) -> Samples:
        """Return some of the samples."""
        return Samples(*(getattr(self, part.name)[which] for part in fields(self)))


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


def _check_reach(argument: str, vectors: FloatArray, what: str = "metres") -> None:
    """Raise if numbers are none of this world: their squares would overflow."""
    farthest = float(np.abs(vectors).max())
    if farthest > _FARTHEST:
        raise InputError(argument, f"{what} up to {_FARTHEST:g}", f"{farthest:g}")


def _frozen(array: NDArray[np.int32]) -> IntArray:
    array.flags.writeable = False
    return array


def _unit(argument: str, vectors: FloatArray) -> FloatArray:
    check_finite(argument, vectors, "normal")
    _check_reach(argument, vectors, "components")
    lengths = np.sqrt((vectors**2).sum(axis=1))
    if not (lengths > _SHORTEST).all():
        zero = np.flatnonzero(~(lengths > _SHORTEST))
        raise InputError(
            argument,
            "vectors with a length",
            f"{len(zero)} of {len(vectors)} of length zero (first: {zero[0]})",
            "leave the normals out and they are computed",
        )
    # Of unit length already: else what a recorded run says would not be what was planned with.
    lengths = np.where(np.abs(lengths - 1) > _ROUNDING, lengths, 1.0)
    unit: FloatArray = vectors / lengths[:, None]
    unit.flags.writeable = False
    return unit


def _check_importance(
    argument: str, importance: FloatArray, what: str, on_surface: FloatArray
) -> None:
    """Raise unless each is a finite number of at least 0, and one on the surface is above."""
    check_finite(argument, importance, what)
    below = np.flatnonzero(importance < 0)
    if len(below):
        raise InputError(
            argument,
            "numbers of at least 0",
            f"{len(below)} of {len(importance)} below"
            f" (first: {importance[below[0]]:g} of {what} {below[0]})",
        )
    if not on_surface.any():
        raise InputError(
            argument,
            "some above 0",
            "0 all over the surface",
            "leave the importance out and all of it counts the same",
        )


def _check_areas(mesh: Mesh) -> None:
    """Raise if a triangle's area is nothing beside its longest side."""
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    longest = np.maximum(
        np.maximum(((b - a) ** 2).sum(axis=1), ((c - a) ** 2).sum(axis=1)),
        ((c - b) ** 2).sum(axis=1),
    )
    twice_area = np.sqrt((mesh.cross_products**2).sum(axis=1))
    degenerate = np.flatnonzero(~(twice_area > 1e-12 * longest))
    if len(degenerate):
        raise InputError(
            "mesh triangles",
            "triangles with an area",
            f"{len(degenerate)} of {len(mesh.triangles)} degenerate (first: {degenerate[0]})",
            "remove them, for instance with trimesh's nondegenerate_faces",
        )
