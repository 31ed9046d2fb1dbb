# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Triangles of polygons."""

from __future__ import annotations

from typing import Any

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

_TOLERANCE = 1e-9  # of a polygon's area


def triangulate(
    vertices: NDArray[Any], corners: NDArray[np.int64], counts: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the triangles of polygons, one polygon's after the other's.

    Convex polygons become fans around their first corner, concave ones of four corners fans around
    the corner where they turn back; others are cut by ear clipping in the plane that fits them. A
    polygon of fewer than three corners becomes one triangle without area.

    Parameters
    ----------
    vertices : (V, 3) array
    corners : (sum of counts,) array of int
        The vertices of all polygons, one polygon after the other, in its order.
    counts : (P,) array of int
        Corners of each polygon, at least 1.

    Returns
    -------
    (T, 3) array of int
    """
    if (counts == 3).all():
        return corners.reshape(-1, 3)
    starts = np.cumsum(counts) - counts
    shares = np.maximum(counts - 2, 1)
    firsts = np.cumsum(shares) - shares
    triangles = np.zeros((int(shares.sum()), 3), dtype=np.int64)
    made = np.ones(len(triangles), dtype=bool)
    for count in np.unique(counts):
        which = np.flatnonzero(counts == count)
        polygons = corners[starts[which, None] + np.arange(count)]
        rows = firsts[which, None] + np.arange(max(count - 2, 1))
        if count < 4:
            triangles[rows] = _fans(polygons)
            continue
        reflex = _reflex(vertices, polygons)
        if count == 4:  # the diagonal from the corner where it turns back lies within it
            order = (np.arange(4) + reflex.argmax(axis=1)[:, None]) % 4
            triangles[rows] = _fans(np.take_along_axis(polygons, order, axis=1))
            continue
        triangles[rows] = _fans(polygons)
        for i in np.flatnonzero(reflex.any(axis=1)):
            ears = _ears(vertices, polygons[i])
            triangles[rows[i, : len(ears)]] = ears
            # Corners on a straight side take no triangle. Without ears the fan stays.
            made[rows[i, len(ears) :]] = len(ears) == 0
    return triangles[made]


def triangulate_corners(
    vertices: NDArray[Any], corners: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return what the triangles of :func:`triangulate` were made of.

    Returns
    -------
    places : (T, 3) array of int
        Which of ``corners`` each triangle has.
    polygons : (T,) array of int
        The polygon that each triangle is of.
    """
    alone = np.arange(len(corners))
    if (counts == 3).all():
        places = alone.reshape(-1, 3)
    else:
        places = triangulate(vertices[corners], alone, counts)
    return places, np.repeat(np.arange(len(counts)), counts)[places[:, 0]]


def _fans(polygons: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (P, max(n − 2, 1), 3) the triangles from the first of (P, n) corners to all others."""
    count = polygons.shape[1]
    if count < 3:
        polygons = polygons[:, [0, 0, count - 1]]
        count = 3
    second = np.arange(1, count - 1)
    fans = np.empty((len(polygons), count - 2, 3), dtype=np.int64)
    fans[:, :, 0] = polygons[:, :1]
    fans[:, :, 1], fans[:, :, 2] = polygons[:, second], polygons[:, second + 1]
    return fans


def _reflex(vertices: NDArray[Any], polygons: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (P, n) the corners where a polygon turns back, in the plane that fits it best.

    A fan of it would cover what is outside it, or the same place twice.
    """
    if len(vertices) == 0 or polygons.min() < 0 or polygons.max() >= len(vertices):
        return np.zeros(polygons.shape, dtype=bool)  # which is refused as a mesh
    with np.errstate(over="ignore", invalid="ignore"):
        points = vertices[polygons].astype(np.float64)
        normals = _normals(points)
        sides = np.roll(points, -1, axis=1) - points
        turns = (np.cross(np.roll(sides, 1, axis=1), sides) * normals[:, None]).sum(axis=2)
        return np.asarray(turns < -_TOLERANCE * (normals**2).sum(axis=1)[:, None])


def _normals(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (P, 3) the normals of (P, n, 3) corners, of length twice the area (Newell)."""
    points = points - points[:, :1]
    return np.asarray(np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1))


def _ears(vertices: NDArray[Any], polygon: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (m, 3) the triangles of one polygon by ear clipping, m at most n − 2."""
    points = vertices[polygon].astype(np.float64)
    normal = _normals(points[None])[0]
    dropped = int(np.abs(normal).argmax())
    flat = np.ascontiguousarray(np.delete(points - points[0], dropped, axis=1))
    clipped = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], dtype=np.uint32))
    ears = np.asarray(clipped, dtype=np.int64).reshape(-1, 3)[: len(polygon) - 2]
    a, b, c = (points[ears[:, i]] for i in range(3))
    turned = (np.cross(b - a, c - a) * normal).sum(axis=1) < 0
    ears[turned] = ears[turned][:, ::-1]
    return polygon[ears]
