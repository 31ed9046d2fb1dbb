# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far a cloud's points scatter about the surface.

Around points drawn at random, a paraboloid is fitted to all points within some radius, and what is
left is their scatter, if the radius is right: in a smaller ball than the scatter is thick, points
fill the volume, and what is left grows with the radius; so it does, faster, where a paraboloid no
longer fits the shape. In between it hardly depends on the radius, and there it is read off. The two
sides of something thin look like scatter too, but have no points in the middle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.cloud_shape import NEIGHBOURS
from focus_planner.core.surface.point_grid import point_grid
from focus_planner.core.surface.tree import tree_of

_SEED = 0
# The scatter does not depend on how many points there are.
_MAX_POINTS = 200_000
_PLACES = 1_000
_CANDIDATES = 4 * _PLACES
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
# Of the points, within half the residual of the surface: 0.38 if they scatter normally, 0.29 if
# evenly, none if they are two sheets.
_MIDDLE = 0.25
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
    places, spacing = _places(some, random)
    scales = _residuals_by_radius(some, places, spacing)
    flattest, found = _CONSTANT, None
    for before, scale in pairwise(scales):
        growth = scale.residual / before.residual if before.residual > 0 else math.inf
        if growth > _SHAPE:
            break
        scattered = scale.residual < _MAX_RELATIVE * scale.radius and scale.middle > _MIDDLE
        if growth < flattest and scattered:
            flattest, found = growth, scale
    denser = math.sqrt(len(some) / len(points))
    if found is None:
        return Scatter(0.0, spacing * denser)
    return Scatter(found.residual, found.radius * math.sqrt(math.pi / found.count) * denser)


@dataclass(frozen=True)
class _Scale:
    """What is left within a radius: medians over all places, and the mean share in the middle."""

    radius: float
    residual: float
    count: float
    middle: float


def _places(points: FloatArray, random: np.random.Generator) -> tuple[FloatArray, float]:
    """Return points drawn in proportion to the area they stand for, and their median spacing.

    Else a part scanned more densely, or a mesh's small triangles, would stand for all.
    """
    some = points[random.choice(len(points), min(_CANDIDATES, len(points)), replace=False)]
    count = min(NEIGHBOURS, len(points) - 1)
    reach = np.asarray(tree_of(points).query(some, k=[count + 1], workers=-1)[0])[:, 0]
    # Strays stand for none.
    areas = np.minimum(reach, 4 * np.median(reach)) ** 2
    if not areas.any():
        return some[:0], 0.0
    drawn = np.searchsorted(np.cumsum(areas), random.random(_PLACES) * areas.sum(), side="right")
    drawn = np.minimum(drawn, len(some) - 1)
    return some[drawn], float(np.median(reach[drawn])) * math.sqrt(math.pi / count)


def _residuals_by_radius(points: FloatArray, places: FloatArray, spacing: float) -> list[_Scale]:
    """Return what is left within growing radii, until it grows with the surface's shape."""
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
        residual, inside, _ = np.median(found, axis=0).tolist()
        scales.append(_Scale(radius, residual, inside, float(np.nanmean(found[:, 2]))))
        if len(scales) > 1 and scales[-1].residual > _SHAPE * scales[-2].residual:
            break
        radius *= _GROWTH
    return scales
