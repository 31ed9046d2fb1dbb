# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A surface fitted to the points around a place: a plane, then a paraboloid over it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.point_grid import runs_near

# Fewer points tell no curvature.
_MIN_FOR_CURVATURE = 12.0
_TERMS = 6
# Relative to the total weight: for points on a line, whose curvature across it is unknown.
_RIDGE = 1e-6
# A paraboloid that leaves the plane by more than this, relative to the radius, or this steeply, is
# no description of the surface.
_MAX_RISE = 0.5
_MAX_SLOPE = 1.0

#: What a fit returns: a place (3), a normal (3), the number of points, residual, importance, and
#: the way along the plane from the place to the mean of the points (3).
COUNT, RESIDUAL, IMPORTANCE, ASIDE = 6, 7, 8, 9
FITTED = 12


class Averages(NamedTuple):
    """What points of a grid stand for.

    Attributes
    ----------
    counts : (M,) array
        Of scanned points.
    normals : (M, 3) array
        Given normals; zeros if there are none.
    importance : (M,) array
    """

    counts: FloatArray
    normals: FloatArray
    importance: FloatArray


@kernel
def fit(grid, averages, at, facing, radius, tapered, curved, few, work, fitted):
    """Fit a surface to the points within ``radius``, at most a cube's side, of a place.

    With a ``facing`` other than zero, only points whose normals are less than 90° from it count.
    ``tapered`` weights fall to zero at the radius. The place fitted is where the line through
    ``at`` along the plane's normal meets the surface. With fewer points than ``few`` only their
    count is set. ``work`` is a place for 9 runs of points.
    """
    runs_near(grid, at, work)
    points, normals = grid.points, averages.normals
    counts, importance = averages.counts, averages.importance
    oriented = facing[0] != 0 or facing[1] != 0 or facing[2] != 0
    per_square = 1 / (radius * radius)
    total = squares = count = important = 0.0
    # Written out: this loop and the next are where the time goes.
    x = y = z = xx = xy = xz = yy = yz = zz = 0.0
    nx = ny = nz = 0.0
    for run in range(len(work)):
        for i in range(work[run, 0], work[run, 1]):
            dx, dy, dz = points[i, 0] - at[0], points[i, 1] - at[1], points[i, 2] - at[2]
            near = 1 - (dx * dx + dy * dy + dz * dz) * per_square
            if near <= 0:
                continue
            if oriented:
                if _against(normals, i, facing):
                    continue
                nx, ny, nz = nx + normals[i, 0], ny + normals[i, 1], nz + normals[i, 2]
            share = near * near if tapered else 1.0
            weight = share * counts[i]
            count += counts[i]
            total += weight
            squares += weight * share
            important += weight * importance[i]
            x, y, z = x + weight * dx, y + weight * dy, z + weight * dz
            xx, xy, xz = xx + weight * dx * dx, xy + weight * dx * dy, xz + weight * dx * dz
            yy, yz, zz = yy + weight * dy * dy, yz + weight * dy * dz, zz + weight * dz * dz
    fitted[COUNT] = count
    if count < few or total <= 0:
        return
    x, y, z = x / total, y / total, z / total
    moments = np.array(
        [
            [xx / total - x * x, xy / total - x * y, xz / total - x * z],
            [xy / total - x * y, yy / total - y * y, yz / total - y * z],
            [xz / total - x * z, yz / total - y * z, zz / total - z * z],
        ]
    )
    mean, common = np.array([x, y, z]), np.array([nx, ny, nz])
    spread, axes = np.linalg.eigh(moments)
    normal, first, second = axes[:, 0].copy(), axes[:, 2].copy(), axes[:, 1].copy()
    if _dot(normal, common) < 0:
        normal = -normal
    u, v = -_dot(mean, first), -_dot(mean, second)
    for a in range(3):
        fitted[a] = at[a] + mean[a] + u * first[a] + v * second[a]
        fitted[3 + a] = normal[a]
        fitted[ASIDE + a] = -u * first[a] - v * second[a]
    freedom = total - 3 * squares / total
    fitted[RESIDUAL] = math.sqrt(max(spread[0], 0.0) * total / freedom) if freedom > 0 else 0.0
    fitted[IMPORTANCE] = important / total
    if not curved or count < _MIN_FOR_CURVATURE:
        return
    system, right, terms = np.zeros((_TERMS, _TERMS)), np.zeros(_TERMS), np.ones(_TERMS)
    heights, per_radius = 0.0, 1 / radius
    for run in range(len(work)):
        for i in range(work[run, 0], work[run, 1]):
            dx, dy, dz = points[i, 0] - at[0], points[i, 1] - at[1], points[i, 2] - at[2]
            near = 1 - (dx * dx + dy * dy + dz * dz) * per_square
            if near <= 0 or (oriented and _against(normals, i, facing)):
                continue
            weight = (near * near if tapered else 1.0) * counts[i]
            dx, dy, dz = (dx - x) * per_radius, (dy - y) * per_radius, (dz - z) * per_radius
            height = dx * normal[0] + dy * normal[1] + dz * normal[2]
            _set_terms(
                terms,
                dx * first[0] + dy * first[1] + dz * first[2],
                dx * second[0] + dy * second[1] + dz * second[2],
            )
            heights += weight * height * height
            for a in range(_TERMS):
                term = weight * terms[a]
                right[a] += term * height
                for b in range(a + 1):
                    system[a, b] += term * terms[b]
    for a in range(_TERMS):
        system[a, a] += _RIDGE * total
        for b in range(a):
            system[b, a] = system[a, b]
    k = np.linalg.solve(system, right)
    u, v = u / radius, v / radius
    _set_terms(terms, u, v)
    rise = _dot(k, terms)
    along, across = k[1] + 2 * k[3] * u + k[4] * v, k[2] + k[4] * u + 2 * k[5] * v
    slope = along * along + across * across
    if abs(rise) > _MAX_RISE or slope > _MAX_SLOPE * _MAX_SLOPE:
        return
    freedom = total - _TERMS * squares / total
    if freedom > 0:
        left = max(heights - _dot(k, right), 0.0)
        fitted[RESIDUAL] = radius * math.sqrt(left / freedom)
    length = math.sqrt(1 + slope)
    for a in range(3):
        fitted[a] += rise * radius * normal[a]
        fitted[3 + a] = (normal[a] - along * first[a] - across * second[a]) / length


@kernel
def _against(normals, i, facing):
    return normals[i, 0] * facing[0] + normals[i, 1] * facing[1] + normals[i, 2] * facing[2] <= 0


@kernel
def _dot(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@kernel
def _set_terms(terms, u, v):
    terms[1], terms[2] = u, v
    terms[3], terms[4], terms[5] = u * u, u * v, v * v
