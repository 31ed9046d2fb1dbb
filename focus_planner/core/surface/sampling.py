# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Sampling surfaces: points with normals, the areas that they represent, and their weights."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.surface.cloud_shape import CloudShape, normalised, tangents
from focus_planner.core.surface.surface import Mesh, PointCloud, Samples, squared_lengths

#: For NumPy's PCG64.
Seed = int | np.random.SeedSequence
#: What the density of samples is proportional to; the same thing without importance.
Density = Literal["importance", "area"]


def fresh_seed(seed: int) -> np.random.SeedSequence:
    """Return a seed whose random numbers are independent of those of every integer seed."""
    return np.random.SeedSequence(seed, spawn_key=(0,))


def sample_mesh(mesh: Mesh, count: int, seed: Seed, by: Density = "importance") -> Samples:
    """Return ``count`` random samples of the mesh.

    Normals are interpolated between vertex normals if the mesh has them, else the triangles'.

    Parameters
    ----------
    mesh : Mesh
    count : int
    seed : int or SeedSequence
        For NumPy's PCG64: the same seed gives the same samples.
    by : {"importance", "area"}
        What the samples' density is proportional to. By importance, all samples have the same
        weight, and there are none where the importance is 0. By area, all samples represent the
        same area, and some may have weight 0.
    """
    random = np.random.default_rng(seed)
    crosses = mesh.cross_products
    importance = _corner_importance(mesh)
    if importance is None or by == "area":
        chosen, barycentric, area = _draw_by_area(mesh.cumulative_areas, count, random)
        at = 1.0 if importance is None else (barycentric * importance[chosen]).sum(axis=1)
        sample_areas = np.full(count, area / count)
        weights = sample_areas * at
    else:
        chosen, barycentric, weight = _draw_by_importance(mesh.areas, importance, count, random)
        at = (barycentric * importance[chosen]).sum(axis=1)
        sample_areas = _areas_of_equal_weights(at, mesh.areas[importance.any(axis=1)].sum())
        weights = np.full(count, weight / count)
    corners = mesh.triangles[chosen]
    points = _interpolated(mesh.vertices, corners, barycentric)
    normals = crosses[chosen]
    if mesh.vertex_normals is not None:
        smooth = _interpolated(mesh.vertex_normals, corners, barycentric)
        # Opposite vertex normals may cancel; use the triangle's own there.
        cancelled = squared_lengths(smooth) < 1e-12
        normals = np.where(cancelled[:, None], normals, smooth)
    normals = normals / np.sqrt(squared_lengths(normals))[:, None]
    return Samples(points, normals, sample_areas, weights)


def _interpolated(
    values: FloatArray, corners: NDArray[np.integer[Any]], barycentric: FloatArray
) -> FloatArray:
    """Return (n, 3) what (V, 3) values are at these coordinates of triangles."""
    a, b, c = (np.take(values, corners[:, i], axis=0) * barycentric[:, i, None] for i in range(3))
    between: FloatArray = a + b + c
    return between


def sample_cloud(
    cloud: PointCloud, shape: CloudShape, count: int, seed: int, by: Density = "importance"
) -> Samples:
    """Return ``count`` of the cloud's points, drawn with replacement; all of them if it is 0.

    Drawing in proportion to area compensates for uneven density, as in merged scans.

    Parameters
    ----------
    cloud : PointCloud
    shape : CloudShape
    count, seed, by
        As for :func:`sample_mesh`. With a count of 0 each point represents its own area; by
        importance, points of importance 0 are left out.
    """
    points, normals, importance = cloud.points, shape.normals, shape.importance
    if count == 0:
        # Copies, because kernels would be compiled anew for read-only arrays.
        kept = np.flatnonzero(importance > 0) if by == "importance" else np.arange(len(points))
        areas = shape.areas[kept]
        patches = _patches(shape, kept)
        return Samples(points[kept], normals[kept], areas, areas * importance[kept], patches)
    random = np.random.default_rng(seed)
    chosen, areas, weights = _draw_points(cloud, shape, count, random, by)
    return Samples(points[chosen], normals[chosen], areas, weights, _patches(shape, chosen))


def sample_around_cloud(
    cloud: PointCloud, shape: CloudShape, count: int, seed: Seed, by: Density = "importance"
) -> Samples:
    """Return ``count`` samples of the surface around a cloud's points.

    Points are drawn as in :func:`sample_cloud`. Each sample is distributed uniformly over a square
    in its point's tangent plane with the point's area, and has the point's normal. So samples lie
    on the surface that the points represent, but not on the points, on which a plan may have been
    made.

    Parameters
    ----------
    cloud : PointCloud
    shape : CloudShape
    count, seed, by
        As for :func:`sample_mesh`.
    """
    random = np.random.default_rng(seed)
    chosen, areas, weights = _draw_points(cloud, shape, count, random, by)
    normals = shape.normals[chosen]
    side = np.sqrt(shape.areas[chosen])
    along = side[:, None] * (random.random((count, 2)) - 0.5)
    first, second = tangents(normals)
    points = cloud.points[chosen] + along[:, :1] * first + along[:, 1:] * second
    return Samples(points, normals, areas, weights, _patches(shape, chosen))


def _patches(shape: CloudShape, chosen: NDArray[np.int64]) -> IntArray | None:
    return None if shape.patches is None else shape.patches[chosen]


def _draw_points(
    cloud: PointCloud, shape: CloudShape, count: int, random: np.random.Generator, by: Density
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Return (count,) indices of points drawn with replacement, their areas and weights."""
    importance = shape.importance
    if cloud.importance is None or by == "area":
        chosen, area = _draw_indices(np.cumsum(shape.areas), count, random)
        areas = np.full(count, area / count)
        return chosen, areas, areas * importance[chosen]
    chosen, weight = _draw_indices(np.cumsum(shape.areas * importance), count, random)
    areas = _areas_of_equal_weights(importance[chosen], shape.areas[importance > 0].sum())
    return chosen, areas, np.full(count, weight / count)


def _corner_importance(mesh: Mesh) -> FloatArray | None:
    """Return (T, 3) the relative importance at triangles' corners; None if the mesh has none."""
    if mesh.vertex_importance is None:
        return None
    return normalised(mesh.vertex_importance[mesh.triangles])


def _draw_indices(
    cumulative: FloatArray, count: int, random: np.random.Generator
) -> tuple[NDArray[np.int64], float]:
    """Return (count,) indices drawn with replacement in proportion to shares, and their sum.

    ``cumulative`` are the sums of the shares up to each.
    """
    # Less than the last whatever the rounding, so that an index with no share is never drawn.
    drawn = random.random(count) * cumulative[-1]
    if count < len(cumulative):
        return np.searchsorted(cumulative, drawn, side="right"), float(cumulative[-1])
    # A table of all is made first, which pays where as many are looked for.
    chosen = np.empty(count, dtype=np.int64)
    kernels.ranks_among(cumulative, drawn, True, chosen)
    return chosen, float(cumulative[-1])


def _draw_by_area(
    cumulative: FloatArray, count: int, random: np.random.Generator
) -> tuple[NDArray[np.int64], FloatArray, float]:
    """Return triangles, barycentric coordinates in them, and the total area."""
    chosen, area = _draw_indices(cumulative, count, random)
    root, v = np.sqrt(random.random(count)), random.random(count)
    return chosen, np.stack([1 - root, root * (1 - v), root * v], axis=1), area


def _draw_by_importance(
    areas: FloatArray, importance: FloatArray, count: int, random: np.random.Generator
) -> tuple[NDArray[np.int64], FloatArray, float]:
    """Return triangles, barycentric coordinates in them, and the integral of the importance.

    A density that is linear on a triangle is a mixture of three, each proportional to one
    barycentric coordinate: a Dirichlet distribution with parameter 2 for that one and 1 for the
    others.
    """
    shares = (areas[:, None] / 3 * importance).ravel()
    chosen, weight = _draw_indices(np.cumsum(shares), count, random)
    triangles, corner = np.divmod(chosen, 3)
    # Three cuts of [0, 1] leave four parts, Dirichlet(1, 1, 1, 1); adding two gives (2, 1, 1).
    cuts = np.sort(random.random((count, 3)), axis=1)
    parts = np.stack([cuts[:, 1], cuts[:, 2] - cuts[:, 1], 1 - cuts[:, 2]], axis=1)
    place = (np.arange(3) - corner[:, None]) % 3
    return triangles, np.take_along_axis(parts, place, axis=1), weight


def _areas_of_equal_weights(importance: FloatArray, area: float) -> FloatArray:
    """Return the areas, which sum to ``area``, that samples of equal weight represent."""
    areas = 1 / importance
    scaled: FloatArray = areas * (area / areas.sum())
    return scaled
