"""How far a cloud's points scatter about the surface.

Around points drawn at random, a paraboloid is fitted to all points within some radius, and what is
left is their scatter, if the radius is right: in a smaller ball than the scatter is thick, points
fill the volume, and what is left grows with the radius; so it does, faster, where a paraboloid no
longer fits the shape. In between it hardly depends on the radius, and there it is read off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.cloud_shape import NEIGHBOURS
from focus_planner.core.surface.point_grid import point_grid

_SEED = 0
# The scatter does not depend on how many points there are.
_MAX_POINTS = 200_000
_PLACES = 1_000
_FEW = 12
_FIRST_RADIUS = 2.5  # spacings: about twenty points
_GROWTH = math.sqrt(2)
# Of the surface's diagonal: a larger ball contains more than a patch of the surface.
_LARGEST_RADIUS = 1 / 16
# What is left relative to the radius: more than this fills the ball.
_MAX_RELATIVE = 0.25
# From one radius to the next: what is left in a ball that is full grows with the radius, shape
# grows faster; in between it is as good as constant.
_SHAPE = _GROWTH**1.2
_CONSTANT = _GROWTH**0.4


@dataclass(frozen=True)
class Scatter:
    """How far points lie from the surface, and from one another.

    Attributes
    ----------
    noise : float
        The standard deviation across the surface, metres; 0 if no smooth surface shows, or it is
        too small to be told from the surface's shape.
    spacing : float
        The spacing of a square grid on the surface with as many points per area, metres.
    """

    noise: float
    spacing: float


def estimate_scatter(points: FloatArray) -> Scatter:
    """Estimate a cloud's noise and spacing from some of its points.

    Parameters
    ----------
    points : (M, 3) array
        Metres.
    """
    random = np.random.default_rng(_SEED)
    some = points
    if len(points) > _MAX_POINTS:
        some = points[random.choice(len(points), _MAX_POINTS, replace=False)]
    denser = math.sqrt(len(some) / len(points))
    places = some[random.choice(len(some), min(_PLACES, len(some)), replace=False)]
    spacing = _typical_spacing(some, places)
    scales = _residuals_by_radius(some, places, spacing)
    flattest, found = _CONSTANT, None
    for (_, smaller, _), (radius, residual, count) in zip(scales, scales[1:], strict=False):
        growth = residual / smaller if smaller > 0 else math.inf
        if growth > _SHAPE:
            break
        if growth < flattest and residual < _MAX_RELATIVE * radius:
            flattest, found = growth, (radius, residual, count)
    if found is None:
        return Scatter(0.0, spacing * denser)
    radius, residual, count = found
    return Scatter(residual, radius * math.sqrt(math.pi / count) * denser)


def _typical_spacing(points: FloatArray, places: FloatArray) -> float:
    """Return the spacing that the distance of the last of the nearest neighbours tells."""
    count = min(NEIGHBOURS, len(points) - 1)
    reach = cKDTree(points).query(places, k=[count + 1], workers=-1)[0]
    return float(np.median(reach)) * math.sqrt(math.pi / count)


def _residuals_by_radius(
    points: FloatArray, places: FloatArray, spacing: float
) -> list[tuple[float, float, float]]:
    """Return radii with the median residual, and the median number of points, within each."""
    largest = _LARGEST_RADIUS * float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    radius, scales = _FIRST_RADIUS * spacing, []
    while 0 < radius <= largest:
        grid, order = point_grid(points, radius)
        count = len(order)
        averages = kernels.Averages(np.ones(count), np.zeros((count, 3)), np.ones(count))
        with kernels.threads_for(count):
            found = kernels.residuals(grid, averages, places, radius, _FEW)
        found = found[~np.isnan(found[:, 0])]
        if len(found) < len(places) / 2:
            break
        residual, inside = np.median(found, axis=0)
        scales.append((radius, float(residual), float(inside)))
        if len(scales) > 1 and scales[-1][1] > _SHAPE * scales[-2][1]:
            break
        radius *= _GROWTH
    return scales
