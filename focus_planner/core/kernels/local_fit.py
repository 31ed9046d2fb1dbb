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

#: What a fit returns: a place (3), a normal (3), the number of points, residual and importance.
COUNT, RESIDUAL, IMPORTANCE = 6, 7, 8
FITTED = 9


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
    oriented = facing[0] != 0 or facing[1] != 0 or facing[2] != 0
    square = radius * radius
    total = squares = count = important = 0.0
    mean, moments, common = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    offset = np.empty(3)
    for run in range(len(work)):
        for i in range(work[run, 0], work[run, 1]):
            weight = _weight(points, i, at, square, tapered, offset)
            if weight <= 0 or (oriented and _against(normals, i, facing)):
                continue
            count += averages.counts[i]
            weight *= averages.counts[i]
            total += weight
            squares += weight * weight / averages.counts[i]
            important += weight * averages.importance[i]
            for a in range(3):
                mean[a] += weight * offset[a]
                common[a] += weight * normals[i, a]
                for b in range(a + 1):
                    moments[a, b] += weight * offset[a] * offset[b]
    fitted[COUNT] = count
    if count < few or total <= 0:
        return
    mean /= total
    for a in range(3):
        for b in range(a + 1):
            moments[a, b] = moments[a, b] / total - mean[a] * mean[b]
            moments[b, a] = moments[a, b]
    spread, axes = np.linalg.eigh(moments)
    normal, first, second = axes[:, 0].copy(), axes[:, 2].copy(), axes[:, 1].copy()
    if _dot(normal, common) < 0:
        normal = -normal
    u, v = -_dot(mean, first), -_dot(mean, second)
    for a in range(3):
        fitted[a] = at[a] + mean[a] + u * first[a] + v * second[a]
        fitted[3 + a] = normal[a]
    freedom = total - 3 * squares / total
    fitted[RESIDUAL] = math.sqrt(max(spread[0], 0.0) * total / freedom) if freedom > 0 else 0.0
    fitted[IMPORTANCE] = important / total
    if not curved or count < _MIN_FOR_CURVATURE:
        return
    system, right, terms, heights = np.zeros((_TERMS, _TERMS)), np.zeros(_TERMS), np.ones(_TERMS), 0.0
    for run in range(len(work)):
        for i in range(work[run, 0], work[run, 1]):
            weight = _weight(points, i, at, square, tapered, offset)
            if weight <= 0 or (oriented and _against(normals, i, facing)):
                continue
            weight *= averages.counts[i]
            offset -= mean
            height = _dot(offset, normal) / radius
            _set_terms(terms, _dot(offset, first) / radius, _dot(offset, second) / radius)
            heights += weight * height * height
            for a in range(_TERMS):
                right[a] += weight * terms[a] * height
                for b in range(a + 1):
                    system[a, b] += weight * terms[a] * terms[b]
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
def _weight(points, i, at, square, tapered, offset):
    """Set a point's offset from a place; return its weight, 0 if it is too far away."""
    distance = 0.0
    for a in range(3):
        offset[a] = points[i, a] - at[a]
        distance += offset[a] * offset[a]
    if distance >= square:
        return 0.0
    if not tapered:
        return 1.0
    share = 1 - distance / square
    return share * share


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
