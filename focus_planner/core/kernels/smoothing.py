# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Points moved onto the surface that is fitted to their neighbours, thinned, and their areas."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.local_fit import ASIDE, COUNT, FITTED, IMPORTANCE, fit
from focus_planner.core.kernels.point_grid import RUNS, runs_near

_SIDES = 16  # of the polygon that a cell is cut from
# Each neighbour cuts off a corner, and adds one at most.
_MAX_CORNERS = 128
# A neighbour whose normal is at more than 60° is on another sheet, or beyond a sharp edge.
_MIN_COSINE = 0.5


@parallel_kernel
def project(grid, averages, places, facing, radius, curved, few, moved, turned, kept):
    """Move places onto the surface fitted to the points around them.

    Fills (n, 3) places, (n, 3) normals and (n, 5): the number of points, the importance, and the
    way to the mean of the points; only the number where it is less than ``few``.
    """
    for p in prange(len(places)):
        fitted, work = np.zeros(FITTED), np.empty((RUNS, 2), dtype=np.int64)
        fit(grid, averages, places[p], facing[p], radius, True, curved, few, work, fitted)
        moved[p], turned[p] = fitted[:3], fitted[3:6]
        kept[p, 0], kept[p, 1] = fitted[COUNT], fitted[IMPORTANCE]
        kept[p, 2:] = fitted[ASIDE:]


@kernel
def thin(grid, normals, distance, signed):
    """Return (M,) which points to keep, so that none has another of its sheet within a distance.

    The distance is at most a cube's side. Points are taken in the grid's order.
    """
    kept = np.zeros(len(grid.points), dtype=np.bool_)
    work = np.empty((RUNS, 2), dtype=np.int64)
    for i in range(len(grid.points)):
        runs_near(grid, grid.points[i], work)
        free = True
        for run in range(RUNS):
            # Later points are not decided yet.
            for j in range(work[run, 0], min(work[run, 1], i)):
                if kept[j] and _near(grid.points, i, j, distance):
                    cosine = _cosine(normals, i, j)
                    if cosine > 0 or not signed:
                        free = False
                        break
            if not free:
                break
        kept[i] = free
    return kept


@kernel
def _near(points, i, j, distance):
    square = 0.0
    for a in range(3):
        square += (points[i, a] - points[j, a]) ** 2
    return square < distance * distance


@kernel
def _cosine(normals, i, j):
    return (
        normals[i, 0] * normals[j, 0]
        + normals[i, 1] * normals[j, 1]
        + normals[i, 2] * normals[j, 2]
    )


@parallel_kernel
def cell_areas(grid, normals, first, second, rims, reach, areas):
    """Fill the areas of points' Voronoi cells, within ``reach``, in their tangent planes.

    ``first`` and ``second`` are (M, 3) tangents, ``rims`` the way to the rim of the surface, which
    cuts the cell: zeros where it is far. A neighbour is rolled into the plane at its distance in
    space; those within twice the reach, at most a cube's side, can cut the cell. Neighbours more
    above or below the plane than beside the point are of another sheet.
    """
    for p in prange(len(areas)):
        work = np.empty((RUNS, 2), dtype=np.int64)
        corners, cut = np.empty((_MAX_CORNERS, 2)), np.empty((_MAX_CORNERS, 2))
        count = _SIDES
        for c in range(count):
            corners[c, 0] = reach * math.cos(2 * math.pi * c / count)
            corners[c, 1] = reach * math.sin(2 * math.pi * c / count)
        u = v = 0.0
        for a in range(3):
            u += rims[p, a] * first[p, a]
            v += rims[p, a] * second[p, a]
        if u != 0 or v != 0:
            count = _cut(corners, count, u, v, u * u + v * v, cut)
            corners, cut = cut, corners
        runs_near(grid, grid.points[p], work)
        for run in range(RUNS):
            for i in range(work[run, 0], work[run, 1]):
                if i == p:
                    continue
                if _cosine(normals, p, i) < _MIN_COSINE:
                    continue
                u = v = height = 0.0
                for a in range(3):
                    offset = grid.points[i, a] - grid.points[p, a]
                    u += offset * first[p, a]
                    v += offset * second[p, a]
                    height += offset * normals[p, a]
                beside = u * u + v * v
                square = beside + height * height
                if height * height > beside or square >= 4 * reach * reach or beside == 0:
                    continue
                stretch = math.sqrt(square / beside)
                count = _cut(corners, count, u * stretch, v * stretch, square / 2, cut)
                corners, cut = cut, corners
        areas[p] = _area(corners, count)


@kernel
def _cut(corners, count, u, v, limit, cut):
    """Cut a convex polygon along a line; return how many corners the rest has."""
    kept = 0
    for c in range(count):
        d = c + 1 if c + 1 < count else 0
        here = corners[c, 0] * u + corners[c, 1] * v - limit
        there = corners[d, 0] * u + corners[d, 1] * v - limit
        if here <= 0 and kept < _MAX_CORNERS:
            cut[kept] = corners[c]
            kept += 1
        if here * there < 0 and kept < _MAX_CORNERS:
            share = here / (here - there)
            cut[kept, 0] = corners[c, 0] + share * (corners[d, 0] - corners[c, 0])
            cut[kept, 1] = corners[c, 1] + share * (corners[d, 1] - corners[c, 1])
            kept += 1
    return kept


@kernel
def _area(corners, count):
    twice = 0.0
    for c in range(count):
        d = c + 1 if c + 1 < count else 0
        twice += corners[c, 0] * corners[d, 1] - corners[d, 0] * corners[c, 1]
    return twice / 2
