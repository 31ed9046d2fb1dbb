# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Averaging a cloud whose points scatter: fewer points, on the surface that they scatter about.

Points are averaged within small cubes; each average is moved onto the paraboloid fitted to all
points around it (moving least squares), and of those that end up close together one is kept. The
area of a point is that of its Voronoi cell in its tangent plane.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.appearance import Colours, decode, encode
from focus_planner.core.surface.cloud_shape import (
    CloudShape,
    nearest_neighbours,
    relative_importance,
    tangents,
)
from focus_planner.core.surface.noise import Scatter
from focus_planner.core.surface.orientation import find_patches
from focus_planner.core.surface.point_grid import cubes, point_grid, runs
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.surface.tree import tree_of
from focus_planner.core.validation import InputError

#: More points than this tell a plan nothing more.
ENOUGH_POINTS = 200_000
# Points that are averaged lie within a cube of at least half the noise, and of so many spacings.
_CUBE_OF_NOISE = 0.5
_CUBE_OF_SPACING = 0.6
# The radius of the fits. Across the surface it has to contain the scatter. Along the surface, the
# slope of a fit is off by about noise · spacing / radius², and slopes add area.
_RADIUS_OF_NOISE = 4.0
_RADIUS_OF_SLOPE = 6.0
_RADIUS_OF_CUBE = 3.0
_RADIUS_OF_SPACING = 4.0
# Fewer points within the radius are strays.
_FEW = 6
# Of a cube: points on one sheet that are closer than this are one.
_FIRST_DISTANCE = 0.9
_LAST_DISTANCE = 0.7
# A cell reaches no farther, so that the rim of a hole keeps its place.
_REACH_OF_CUBE = 1.5
_REACH_OF_SPACING = 1.7
# Near a rim, the mean of the points around a place is away from it: relative to the radius, by what
# the weights within a half-plane tell for a rim so far off. Beyond the rim it is farther away.
_RIM = np.linspace(0, 1, 65)
_WEIGHT = _RIM * np.sqrt(1 - _RIM**2) * (33 - 26 * _RIM**2 + 8 * _RIM**4) / 48 + 5 / 16 * (
    np.arcsin(_RIM) + np.pi / 2
)
_ASIDE = (1 - _RIM**2) ** 3.5 / 7 / _WEIGHT
# Across the surface, averages lie in several layers: so many of them, at random, cover it.
_MAX_PLACES = 300_000
_SEED = 0
_PARTS = 16


@dataclass(frozen=True, eq=False)
class SmoothCloud:
    """A cloud of fewer points, on the surface.

    Attributes
    ----------
    cloud : PointCloud
        Its normals are those of the surface fitted, outward, if normals were given; its colours are
        means in linear light.
    shape : CloudShape
    strays : int
        How many of the points given lie apart from any surface, and were left out.
    """

    cloud: PointCloud
    shape: CloudShape
    strays: int


@dataclass(frozen=True, eq=False)
class _Averaged:
    """The averages of points within cubes, by their grid; colours in linear light, if any."""

    grid: kernels.PointGrid
    averages: kernels.Averages
    colours: FloatArray | None

    def moved(
        self,
        places: FloatArray,
        facing: FloatArray,
        radius: float,
        tell: Callable[[float], object],
        *,
        curved: bool,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return places on the surface, their normals, and what was found around them, (n, 5)."""
        moved, turned = np.empty_like(places), np.empty_like(places)
        kept = np.zeros((len(places), 5))
        for part in _parts(len(places)):
            kernels.project(
                self.grid, self.averages, places[part], facing[part], radius, curved, _FEW,
                moved[part], turned[part], kept[part],
            )  # fmt: skip
            tell(part.stop / len(places))
        few = kept[:, 0] < _FEW
        moved[few] = places[few]
        return moved, turned, kept


def smooth(
    cloud: PointCloud, scatter: Scatter, on_progress: Callable[[float], object] = lambda _: None
) -> SmoothCloud:
    """Average a cloud's points.

    Parameters
    ----------
    cloud : PointCloud
    scatter : Scatter
        The cloud's own.
    on_progress : callable, optional
        Called with the share that is done.

    Raises
    ------
    InputError
        If all points are strays, or no point with any importance is left.
    """
    noise, spacing = scatter.noise, scatter.spacing
    cube = max(
        _CUBE_OF_NOISE * noise,
        _CUBE_OF_SPACING * spacing,
        spacing * math.sqrt(len(cloud.points) / ENOUGH_POINTS),
    )
    radius = max(
        _RADIUS_OF_NOISE * noise,
        _RADIUS_OF_SLOPE * math.sqrt(noise * spacing),
        _RADIUS_OF_CUBE * cube,
        _RADIUS_OF_SPACING * spacing,
    )
    averaged = _averaged(cloud, cube, radius)
    on_progress(0.15)
    if cloud.normals is None:
        averaged = _with_signs(averaged, cube, radius, _stage(on_progress, 0.15, 0.4))
    averages = averaged.averages
    some = _some(len(averages.counts))
    places, normals = averaged.grid.points[some], averages.normals[some]
    # What is far off the surface comes near it first.
    for stage in ((0.4, 0.5), (0.5, 0.6)):
        tell = _stage(on_progress, *stage)
        places, normals, found = averaged.moved(places, normals, radius, tell, curved=False)
    on_surface = found[:, 0] >= _FEW
    strays = round(averages.counts[some][~on_surface].sum() * len(averages.counts) / len(some))
    if not on_surface.any():
        raise _no_surface()
    places, normals, _ = _thinned(
        places[on_surface], normals[on_surface], found[on_surface], _FIRST_DISTANCE * cube
    )
    tell = _stage(on_progress, 0.65, 0.9)
    places, normals, found = averaged.moved(places, normals, radius, tell, curved=True)
    on_surface = (found[:, 0] >= _FEW) & (_aside(found) < _ASIDE[0] * radius)
    if on_surface.sum() < PointCloud.MIN_POINTS:
        raise _no_surface()
    places, normals, found = _thinned(
        places[on_surface], normals[on_surface], found[on_surface], _LAST_DISTANCE * cube
    )
    reach = max(_REACH_OF_CUBE * cube, _REACH_OF_SPACING * spacing)
    places, normals, found, areas = _with_areas(places, normals, found, radius, reach)
    on_progress(1.0)
    smoothed = PointCloud(
        places,
        None if cloud.normals is None else normals,
        None if cloud.importance is None else found[:, 1],
        colours=_colours_at(places, normals, averaged, radius),
    )
    relative = relative_importance(smoothed, areas)
    patches = None
    if cloud.normals is None:
        joined = find_patches(places, normals, nearest_neighbours(places).index)
        normals, patches = joined.normals, joined.labels
    shape = CloudShape(normals, patches, areas, relative, float(np.sqrt(np.median(areas))))
    return SmoothCloud(smoothed, shape, strays)


def _no_surface() -> InputError:
    return InputError("cloud", "points on a surface", "points apart from one another")


def _averaged(cloud: PointCloud, cube: float, radius: float) -> _Averaged:
    """Average points within cubes; those that face away from one another apart."""
    keys, *_ = cubes(cloud.points, cube)
    if cloud.normals is not None:
        keys = keys * 8 + ((cloud.normals > 0) @ np.array([1, 2, 4]))
    order, starts = runs(keys)
    counts = np.diff(np.concatenate([starts, [len(order)]])).astype(np.float64)

    def mean(values: FloatArray) -> FloatArray:
        sums: FloatArray = np.add.reduceat(values[order], starts)
        return sums / (counts if values.ndim == 1 else counts[:, None])

    grid, place = point_grid(mean(cloud.points), radius)
    normals, importance = np.zeros((len(counts), 3)), np.ones(len(counts))
    if cloud.normals is not None:
        # Normals within one octant do not cancel.
        normals = mean(cloud.normals)
        normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    if cloud.importance is not None:
        importance = mean(cloud.importance)
    averages = kernels.Averages(counts[place], normals[place], importance[place])
    if cloud.colours is None:
        return _Averaged(grid, averages, None)
    light = decode(np.arange(256, dtype=np.uint8)).astype(np.float64)
    colours = np.stack([mean(light[cloud.colours[:, i]]) for i in range(3)], axis=1)
    return _Averaged(grid, averages, colours[place])


def _with_signs(
    averaged: _Averaged, cube: float, radius: float, on_progress: Callable[[float], object]
) -> _Averaged:
    """Give averages the normals of the surface near them, so that close sheets stay apart."""
    some = _some(len(averaged.averages.counts))
    places, any_way = averaged.grid.points[some], np.zeros((len(some), 3))
    for stage in ((0.0, 0.4), (0.4, 0.8)):
        tell = _stage(on_progress, *stage)
        places, normals, found = averaged.moved(places, any_way, radius, tell, curved=False)
    on_surface = found[:, 0] >= _FEW
    if on_surface.sum() < PointCloud.MIN_POINTS:
        raise _no_surface()
    places, normals, _ = _thinned(
        places[on_surface],
        normals[on_surface],
        found[on_surface],
        _FIRST_DISTANCE * cube,
        signed=False,
    )
    normals = find_patches(places, normals, nearest_neighbours(places).index).normals
    _, nearest = tree_of(places).query(averaged.grid.points, workers=-1)
    averages = averaged.averages._replace(normals=normals[nearest])
    return replace(averaged, averages=averages)


def _colours_at(
    places: FloatArray, normals: FloatArray, averaged: _Averaged, radius: float
) -> Colours | None:
    """Return (n, 3) the mean colour of what is nearest to each place and faces its way."""
    if averaged.colours is None:
        return None
    averages, points = averaged.averages, averaged.grid.points
    away, nearest = tree_of(places).query(points, workers=-1)
    facing = (averages.normals * normals[nearest]).sum(axis=1) > 0
    counts = np.where(facing & (away < radius), averages.counts, 0.0)
    total = np.bincount(nearest, counts, len(places))
    light = (
        np.stack(
            [np.bincount(nearest, counts * averaged.colours[:, i], len(places)) for i in range(3)],
            axis=1,
        )
        / np.where(total, total, 1.0)[:, None]
    )
    bare = total == 0
    if bare.any():
        light[bare] = averaged.colours[tree_of(points).query(places[bare], workers=-1)[1]]
    return encode(light)


def _stage(
    on_progress: Callable[[float], object], low: float, high: float
) -> Callable[[float], object]:
    """Return a callback for a part of the work."""
    return lambda share: on_progress(low + (high - low) * share)


def _some(count: int) -> NDArray[np.int64]:
    """Return which averages to move onto the surface, ascending."""
    if count <= _MAX_PLACES:
        return np.arange(count)
    random = np.random.default_rng(_SEED)
    return np.sort(random.choice(count, _MAX_PLACES, replace=False))


def _thinned(
    places: FloatArray,
    normals: FloatArray,
    found: FloatArray,
    distance: float,
    *,
    signed: bool = True,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the places, with what belongs to them, that remain at a distance of one another."""
    grid, order = point_grid(places, distance)
    normals = normals[order]
    kept = kernels.thin(grid, normals, distance, signed)
    return grid.points[kept], normals[kept], found[order[kept]]


def _with_areas(
    places: FloatArray,
    normals: FloatArray,
    found: FloatArray,
    radius: float,
    reach: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the places, with what belongs to them, in another order, and their areas."""
    grid, order = point_grid(places, 2 * reach)
    normals = normals[order]
    first, second = tangents(normals)
    areas, found = np.empty(len(order)), found[order]
    kernels.cell_areas(grid, normals, first, second, _rims(found, radius), reach, areas)
    return grid.points, normals, found, areas


def _aside(found: FloatArray) -> FloatArray:
    """Return (n,) how far along the surface the mean of the points around a place is from it."""
    aside: FloatArray = np.sqrt((found[:, 2:] ** 2).sum(axis=1))
    return aside


def _rims(found: FloatArray, radius: float) -> FloatArray:
    """Return (n, 3) the way to the rim from each place, zeros if it is out of the radius."""
    aside = _aside(found)
    away = np.interp(aside / radius, _ASIDE[::-1], _RIM[::-1])
    near = (away > 0) & (away < 1) & (aside > 0)
    return np.where(near, -radius * away / np.where(near, aside, 1.0), 0.0)[:, None] * found[:, 2:]


def _parts(count: int) -> list[slice]:
    """Return slices that cover so many items, for progress between them."""
    bounds = np.linspace(0, count, _PARTS + 1).astype(int).tolist()
    return [slice(a, b) for a, b in pairwise(bounds) if b > a]
