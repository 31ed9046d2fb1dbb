# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Surfaces: triangle meshes, point clouds, and samples of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import (
    Colours,
    Texture,
    check_colours,
    decode,
    encode,
)
from focus_planner.core.validation import (
    MAX_COORDINATE,
    UNIT_ROUNDING,
    InputError,
    check_array,
    check_finite,
)

# The squares of shorter vectors have too few digits.
_SHORTEST = 1e-150


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
        The relative importance of the surface at each vertex, at least 0, interpolated linearly.
        Uniform when absent.
    notes : tuple of Note
        What was noticed when it was read; plans for it pass them on.
    vertex_colours : (V, 3) array of uint8, optional
        Red, green and blue, as sRGB. Pictures show them; plans do not depend on them.
    texture : Texture, optional
        The same, in more detail; pictures prefer it.

    Raises
    ------
    InputError
        If there is no triangle, a number is not finite, an index is out of range, a triangle
        has no area, a normal has length zero, or no triangle has any importance.
    """

    vertices: FloatArray
    triangles: IntArray
    vertex_normals: FloatArray | None = None
    vertex_importance: FloatArray | None = None
    notes: tuple[Note, ...] = ()
    vertex_colours: Colours | None = None
    texture: Texture | None = None

    __repr__ = brief_repr

    def __post_init__(self) -> None:
        vertices = check_array("mesh vertices", self.vertices, (None, 3))
        triangles = check_array("mesh triangles", self.triangles, (None, 3), np.int64)
        if len(triangles) == 0:
            raise InputError("mesh", "at least one triangle", "none")
        if len(vertices) == 0:
            raise InputError("mesh vertices", "at least one", "none")
        check_finite("mesh vertices", vertices, "vertex", "repair the mesh or its export")
        check_reach("mesh vertices", vertices)
        check_indices(triangles, len(vertices))
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
        if self.vertex_colours is not None:
            colours = check_colours("mesh vertex_colours", self.vertex_colours, len(vertices))
            object.__setattr__(self, "vertex_colours", colours)
        if self.texture is not None and len(self.texture.coordinates) != len(triangles):
            raise InputError(
                "mesh texture",
                f"coordinates of {len(triangles)} triangles",
                str(len(self.texture.coordinates)),
            )

    @cached_property
    def cross_products(self) -> FloatArray:
        """(T, 3) each triangle's outward normal, of length twice its area."""
        return _crosses_and_longest(self.vertices, self.triangles)[0]

    @cached_property
    def cumulative_areas(self) -> FloatArray:
        """(T,) the sums of the triangles' areas up to each, square metres."""
        return np.cumsum(self.areas)

    @cached_property
    def areas(self) -> FloatArray:
        """(T,) the triangles' areas, square metres."""
        areas: FloatArray = np.sqrt(squared_lengths(self.cross_products)) / 2
        return areas

    def colours_of_vertices(self) -> Colours | None:
        """Return (V, 3) the colours of vertices, taken from the texture if they have none.

        Where several triangles meet, it is the mean in linear light; a vertex of no triangle is
        black. None if the mesh has neither colours nor texture.
        """
        if self.vertex_colours is not None or self.texture is None:
            return self.vertex_colours
        corners = self.triangles.ravel()
        light = decode(self.texture.at_corners().reshape(-1, 3))
        count = len(self.vertices)
        sums = [np.bincount(corners, light[:, i], count) for i in range(3)]
        around = np.maximum(np.bincount(corners, minlength=count), 1)
        return encode(np.stack(sums, axis=1) / around[:, None])


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
        The relative importance of the surface around each point, at least 0. Uniform when absent.
    notes : tuple of Note
        What was noticed when it was read; plans for it pass them on.
    colours : (M, 3) array of uint8, optional
        Red, green and blue, as sRGB. Pictures show them; plans do not depend on them.

    Raises
    ------
    InputError
        If there are fewer than ``MIN_POINTS`` points, a number is not finite, a normal has length
        zero, or no point has any importance.
    """

    points: FloatArray
    normals: FloatArray | None = None
    importance: FloatArray | None = None
    notes: tuple[Note, ...] = ()
    colours: Colours | None = None

    __repr__ = brief_repr

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
        check_reach("cloud points", points)
        object.__setattr__(self, "points", points)
        if self.normals is not None:
            normals = check_array("cloud normals", self.normals, points.shape)
            object.__setattr__(self, "normals", _unit("cloud normals", normals))
        if self.importance is not None:
            importance = check_array("cloud importance", self.importance, (len(points),))
            _check_importance("cloud importance", importance, "point", importance)
            object.__setattr__(self, "importance", importance)
        if self.colours is not None:
            colours = check_colours("cloud colours", self.colours, len(points))
            object.__setattr__(self, "colours", colours)


Surface = Mesh | PointCloud


@dataclass(frozen=True, eq=False)
class Samples:
    """Points that represent a surface.

    Attributes
    ----------
    points : (N, 3) array
        Metres.
    normals : (N, 3) array
        Unit length, outward.
    areas : (N,) array
        The surface area that each sample represents, square metres.
    weights : (N,) array
        Each sample's weight in the cost: its area times its importance relative to the greatest,
        square metres.
    patches : (N,) array of int32, or None
        If it is unknown which side of the surface is outside: the patch that each sample belongs
        to. All normals of a patch have the same sign, which may be the wrong one.
    """

    points: FloatArray
    normals: FloatArray
    areas: FloatArray
    weights: FloatArray
    patches: IntArray | None = None

    __repr__ = brief_repr

    def __len__(self) -> int:
        return len(self.points)

    def take(self, which: slice | NDArray[np.int64]) -> Samples:
        """Return the selected samples."""
        patches = None if self.patches is None else self.patches[which]
        return Samples(
            self.points[which], self.normals[which], self.areas[which], self.weights[which], patches
        )


def _frozen(array: NDArray[np.int32]) -> IntArray:
    array.flags.writeable = False
    return array


def _unit(argument: str, vectors: FloatArray) -> FloatArray:
    check_finite(argument, vectors, "normal")
    check_reach(argument, vectors, "components")
    lengths = np.sqrt(squared_lengths(vectors))
    if not (lengths > _SHORTEST).all():
        zero = np.flatnonzero(~(lengths > _SHORTEST))
        raise InputError(
            argument,
            "vectors with a length",
            f"{len(zero)} of {len(vectors)} of length zero (first: {zero[0]})",
            "leave the normals out to have them computed",
        )
    # Vectors of unit length stay as they are, so that recording and replaying changes no bit.
    lengths = np.where(np.abs(lengths - 1) > UNIT_ROUNDING, lengths, 1.0)
    unit: FloatArray = vectors / lengths[:, None]
    unit.flags.writeable = False
    return unit


def _check_importance(
    argument: str, importance: FloatArray, what: str, on_surface: FloatArray
) -> None:
    """Raise unless all are finite and at least 0, and some on the surface are above 0."""
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
            "leave the importance out if all of the surface is equally important",
        )


def check_indices(triangles: NDArray[np.int64], vertices: int) -> None:
    """Raise unless all corners of (T, 3) triangles are among this many vertices.

    Raises
    ------
    InputError
        Names the first triangle that has another.
    """
    if not triangles.size or 0 <= triangles.min() <= triangles.max() < vertices:
        return
    out_of_range = np.flatnonzero(((triangles < 0) | (triangles >= vertices)).any(axis=1))
    first = out_of_range[0]
    raise InputError(
        "mesh triangles",
        f"vertex indices from 0 to {vertices - 1}",
        f"{triangles[first].tolist()} in triangle {first} ({len(out_of_range)} such triangles)",
    )


def check_reach(argument: str, vectors: FloatArray, what: str = "metres") -> None:
    """Raise if components are so large that they must be a mistake.

    Raises
    ------
    InputError
        Tells the largest.
    """
    farthest = float(np.abs(vectors).max())
    if farthest > MAX_COORDINATE:
        raise InputError(argument, f"{what} up to {MAX_COORDINATE:g}", f"{farthest:g}")


def have_area(vertices: FloatArray, triangles: NDArray[Any]) -> NDArray[np.bool_]:
    """Return (T,) whether a triangle's area is not negligible beside its longest side."""
    with np.errstate(over="ignore", invalid="ignore"):  # absurd coordinates are refused elsewhere
        crosses, longest = _crosses_and_longest(vertices, triangles)
        return _not_degenerate(crosses, longest)


def _not_degenerate(crosses: FloatArray, longest: FloatArray) -> NDArray[np.bool_]:
    return np.asarray(np.sqrt(squared_lengths(crosses)) > 1e-12 * longest)


def _crosses_and_longest(
    vertices: FloatArray, triangles: NDArray[Any]
) -> tuple[FloatArray, FloatArray]:
    """Return (T, 3) cross products of triangles' sides, and (T,) their longest sides' squares."""
    # A row per coordinate: NumPy is slow on short rows.
    corners, coordinates = triangles.T.astype(np.intp, order="C"), vertices.T.copy()
    a, b, c = np.take(coordinates, corners, axis=1).transpose(1, 0, 2)
    u, v = b - a, c - a
    longest = np.maximum(_summed_squares(u), _summed_squares(v))
    longest = np.maximum(longest, _summed_squares(c - b))
    (ux, uy, uz), (vx, vy, vz) = u, v
    crosses = np.empty((len(triangles), 3))
    crosses[:, 0] = uy * vz - uz * vy
    crosses[:, 1] = uz * vx - ux * vz
    crosses[:, 2] = ux * vy - uy * vx
    return crosses, longest


def squared_lengths(vectors: FloatArray) -> FloatArray:
    """Return (n,) the squared lengths of (n, 3) vectors; NumPy sums such short rows slowly."""
    return _summed_squares(vectors.T)


def _summed_squares(coordinates: FloatArray) -> FloatArray:
    """Return (n,) the same of (3, n) coordinates."""
    x, y, z = coordinates
    squares: FloatArray = x * x + y * y + z * z
    return squares


def have_direction(vectors: FloatArray) -> NDArray[np.bool_]:
    """Return (n,) whether a vector is one that a normal can be made of."""
    with np.errstate(over="ignore", invalid="ignore"):
        within = (np.abs(vectors) <= MAX_COORDINATE).all(axis=1)
        return np.asarray(within & (np.sqrt((vectors**2).sum(axis=1)) > _SHORTEST))


def _check_areas(mesh: Mesh) -> None:
    """Raise if a triangle's area is negligible compared with its longest side."""
    crosses, longest = _crosses_and_longest(mesh.vertices, mesh.triangles)
    mesh.__dict__["cross_products"] = crosses
    degenerate = np.flatnonzero(~_not_degenerate(crosses, longest))
    if len(degenerate):
        raise InputError(
            "mesh triangles",
            "triangles with an area",
            f"{len(degenerate)} of {len(mesh.triangles)} degenerate (first: {degenerate[0]})",
            "remove them; load_surface leaves them out, with a note",
        )
