# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From arrays as people have them to a valid surface, and notes on what was left out.

A mesh or a cloud from a file or a message may have triangles without area, points that a depth
camera did not see, normals that were never filled in. Its geometry decides what it is: what is not
geometry is left out and counted. A surface that is wrong otherwise, such as one whose triangles
name vertices that do not exist, is refused by :class:`Mesh` and :class:`PointCloud`.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours, Texture
from focus_planner.core.surface.open3d import estimated_normals
from focus_planner.core.surface.surface import (
    Mesh,
    PointCloud,
    check_indices,
    check_reach,
    have_area,
    have_direction,
)
from focus_planner.core.validation import InputError, check_array

_Mask = NDArray[np.bool_]
# As many as estimate the normals of a cloud that has none.
_NEIGHBOURS = 12


def clean_mesh(
    vertices: NDArray[Any],
    triangles: NDArray[Any],
    normals: NDArray[Any] | None = None,
    importance: NDArray[Any] | None = None,
    notes: tuple[Note, ...] = (),
    colours: Colours | None = None,
    texture: Texture | None = None,
) -> Mesh:
    """Return the mesh without what is no surface.

    Triangles without area or with a corner that is not finite are left out. Vertex normals that
    are zero or not finite are computed from the triangles around them; if all are, the mesh has
    none. What the other arrays say of vertices in no triangle does not matter. A mesh with nothing
    wrong keeps its arrays as they are.

    Parameters
    ----------
    vertices : (V, 3) array
        Metres.
    triangles : (T, 3) array of int
    normals : (V, 3) array, optional
        Outward.
    importance : (V,) array, optional
    notes : tuple of Note
        What is known of the mesh already.
    colours : (V, 3) array of uint8, optional
    texture : Texture, optional
        With coordinates of all triangles.

    Raises
    ------
    InputError
        If no triangle is left, or as :class:`Mesh` does.
    """
    with suppress(InputError):  # most have nothing wrong, and are looked at once
        return Mesh(vertices, triangles, normals, importance, notes, colours, texture)
    return _cleaned_mesh(vertices, triangles, normals, importance, notes, colours, texture)


def _cleaned_mesh(
    vertices: NDArray[Any],
    triangles: NDArray[Any],
    normals: NDArray[Any] | None,
    importance: NDArray[Any] | None,
    notes: tuple[Note, ...],
    colours: Colours | None,
    texture: Texture | None,
) -> Mesh:
    """Return the same of a mesh that has something wrong."""
    vertices = check_array("mesh vertices", vertices, (None, 3))
    triangles = check_array("mesh triangles", triangles, (None, 3), np.int64)
    if len(triangles) == 0 or len(vertices) == 0:
        return Mesh(vertices, triangles)
    check_indices(triangles, len(vertices))
    finite = np.isfinite(vertices).all(axis=1)
    whole = finite[triangles].all(axis=1)
    kept = whole.copy()
    kept[whole] = have_area(vertices, triangles[whole])
    if not kept.any():  # whose reason Mesh tells
        return Mesh(vertices, triangles, normals, importance, notes)
    found = [*notes, *_left_out_triangles(len(triangles), whole, kept)]
    if not kept.all():
        triangles = triangles[kept]
        texture = None if texture is None else texture.take(kept)
    if normals is not None:
        normals = check_array("mesh vertex_normals", normals, vertices.shape)
    if not _all_valid(finite, normals, importance):
        used = np.zeros(len(vertices), dtype=bool)
        used[triangles] = True
        if normals is not None:
            found += _unused_normals(normals, used)
        triangles = (np.cumsum(used) - 1)[triangles]
        vertices, normals, importance, colours = (
            _rows(array, used) for array in (vertices, normals, importance, colours)
        )
    check_reach("mesh vertices", vertices)
    if normals is not None:
        normals, note = _complete_vertex_normals(vertices, triangles, normals)
        found += note
    return Mesh(vertices, triangles, normals, importance, tuple(found), colours, texture)


def clean_cloud(
    points: NDArray[Any],
    normals: NDArray[Any] | None = None,
    importance: NDArray[Any] | None = None,
    notes: tuple[Note, ...] = (),
    colours: Colours | None = None,
) -> PointCloud:
    """Return the cloud without what is no surface.

    Points that are not finite are left out. Normals that are zero or not finite are estimated
    from the points around them and turned to agree with their neighbours' normals; if all are, the
    cloud has none. A cloud with nothing wrong keeps its arrays as they are.

    Parameters
    ----------
    points : (M, 3) array
        Metres.
    normals : (M, 3) array, optional
        Outward.
    importance : (M,) array, optional
    notes : tuple of Note
        What is known of the cloud already.
    colours : (M, 3) array of uint8, optional

    Raises
    ------
    InputError
        If too few points are left, or as :class:`PointCloud` does.
    """
    points = check_array("cloud points", points, (None, 3))
    if normals is not None:
        normals = check_array("cloud normals", normals, points.shape)
    finite = np.isfinite(points).all(axis=1)
    found = list(notes)
    if not finite.all():
        count, left = int(finite.sum()), int((~finite).sum())
        if count < PointCloud.MIN_POINTS:
            raise InputError(
                "cloud",
                f"at least {PointCloud.MIN_POINTS} points",
                f"{count} that are finite, of {len(points)}",
            )
        found.append(_left_out(f"{left:,} of {len(points):,} points, which are not finite numbers"))
        points, normals, importance, colours = (
            _rows(array, finite) for array in (points, normals, importance, colours)
        )
    if len(points) >= PointCloud.MIN_POINTS and normals is not None:
        check_reach("cloud points", points)
        normals, note = _complete_point_normals(points, normals)
        found += note
    return PointCloud(points, normals, importance, tuple(found), colours)


def _rows(array: Any, chosen: _Mask) -> Any:
    return None if array is None else np.asarray(array)[chosen]


def _all_valid(finite: _Mask, normals: FloatArray | None, importance: NDArray[Any] | None) -> bool:
    """Return whether no vertex, used or not, has anything that Mesh would refuse."""
    return bool(
        finite.all()
        and (normals is None or have_direction(normals).all())
        and (importance is None or (np.isfinite(importance) & (importance >= 0)).all())
    )


def _left_out(what: str, remedy: str = "the rest is planned for") -> Note:
    return Note("left_out", f"left out: {what}; {remedy}")


def _left_out_triangles(count: int, whole: _Mask, kept: _Mask) -> list[Note]:
    broken, flat = int((~whole).sum()), int((whole & ~kept).sum())
    notes = []
    if broken:
        what = f"{broken:,} of {count:,} triangles, with corners that are not finite numbers"
        notes.append(_left_out(what, "repair the mesh, or expect a hole there"))
    if flat:
        notes.append(_left_out(f"{flat:,} of {count:,} triangles, which have no area"))
    return notes


def _complete_vertex_normals(
    vertices: FloatArray, triangles: NDArray[np.int64], normals: FloatArray
) -> tuple[FloatArray | None, list[Note]]:
    missing = ~have_direction(normals)
    if not missing.any():
        return normals, []
    if missing.all():
        return None, [_no_normals("vertices", len(vertices), "those of the triangles")]
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    crosses = np.cross(b - a, c - a)
    sums = np.zeros(vertices.shape)
    longest = np.zeros(vertices.shape)
    for corner in range(3):
        np.add.at(sums, triangles[:, corner], crosses)
        longest[triangles[:, corner]] = crosses
    # Triangles back to back cancel: either side is as good.
    around = np.where(have_direction(sums)[:, None], sums, longest)
    completed = np.where(missing[:, None], around, normals)
    return completed, [_some_normals(missing, "vertices", "computed from the triangles around")]


def _complete_point_normals(
    points: FloatArray, normals: FloatArray
) -> tuple[FloatArray | None, list[Note]]:
    missing = ~have_direction(normals)
    if not missing.any():
        return normals, []
    if missing.all():
        return None, [_no_normals("points", len(points), "estimates from the points")]
    # Here, as it takes time to load: surfaces are also read where nothing is planned.
    from scipy.spatial import KDTree  # noqa: PLC0415

    estimated = estimated_normals(points, min(_NEIGHBOURS, len(points)))[missing]
    given = normals[~missing]
    units = given / np.sqrt((given**2).sum(axis=1, keepdims=True))
    # A list of numbers of neighbours, so that one neighbour is a column too.
    nearest = KDTree(points[~missing]).query(
        points[missing], k=[*range(1, min(_NEIGHBOURS, len(given)) + 1)]
    )[1]
    around = units[nearest].sum(axis=1)
    sides = np.where((estimated * around).sum(axis=1) < 0, -1.0, 1.0)
    completed = normals.copy()
    completed[missing] = sides[:, None] * estimated
    return completed, [_some_normals(missing, "points", "estimated from the points around")]


def _unused_normals(normals: FloatArray, used: _Mask) -> list[Note]:
    bad = int((~have_direction(normals) & ~used).sum())
    if not bad:
        return []
    what = (
        f"the normals of {bad:,} of {len(used):,} vertices, which are missing, zero or not finite"
    )
    return [_left_out(what, "no triangle has these vertices")]


def _no_normals(what: str, count: int, instead: str) -> Note:
    return Note(
        "left_out",
        f"left out: the normals of all {count:,} {what}, which are missing, zero or not finite;"
        f" {instead} are used instead",
    )


def _some_normals(missing: _Mask, what: str, how: str) -> Note:
    return Note(
        "left_out",
        f"left out: the normals of {missing.sum():,} of {len(missing):,} {what}, which are"
        f" missing, zero or not finite; they are {how} instead",
    )
