# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The surface around a cloud's points: normals, areas, and what hides what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.surface.open3d import estimated_normals
from focus_planner.core.surface.orientation import find_patches, refine_normals
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.surface.tree import tree_of
from focus_planner.core.validation import InputError

# Neighbours from which a point's normal and area are estimated: enough to average out noise, few
# enough to stay on one fold of the surface.
NEIGHBOURS = 16
_MAX_RELATIVE_AREA = 50.0  # of the median


@dataclass(frozen=True, eq=False)
class CloudShape:
    """The surface around a cloud's points, as estimated from them.

    Attributes
    ----------
    normals : (M, 3) array
        The cloud's own, outward; or estimated.
    patches : (M,) array of int32, or None
        The patch that each point belongs to, from 0, if normals are estimated: they point outward
        all over a patch, or inward all over it. None if all point outward.
    areas : (M,) array
        The surface area that each point represents, square metres.
    importance : (M,) array
        Relative to the greatest.
    spacing : float
        The spacing of a square grid with the median area per point, metres.
    """

    normals: FloatArray
    patches: IntArray | None
    areas: FloatArray
    importance: FloatArray
    spacing: float

    @property
    def oriented(self) -> bool:
        """Whether the normals are known to point outward."""
        return self.patches is None


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Each point's nearest neighbours.

    Attributes
    ----------
    count : int
        Neighbours of each point, itself not included.
    reach : (M,) array
        The distance of the last of them, metres.
    index : (M, count + 1) array of int64
        The nearest points, in general the point itself first.
    """

    count: int
    reach: FloatArray
    index: NDArray[np.int64]

    @property
    def areas(self) -> FloatArray:
        """(M,) the area per point: the disc that the neighbours lie in, divided by their number.

        A disc around a point that reaches its k-th neighbour contains k other points on average,
        so this is without bias for random points.
        """
        areas: FloatArray = np.pi * self.reach**2 / self.count
        return areas


def nearest_neighbours(points: FloatArray) -> Neighbours:
    """Find the neighbours of all points."""
    count = min(NEIGHBOURS, len(points) - 1)
    distances, index = tree_of(points).query(points, k=count + 1, workers=-1)
    return Neighbours(count, np.asarray(distances)[:, -1], np.asarray(index))


def cloud_shape(cloud: PointCloud, neighbours: Neighbours | None = None) -> CloudShape:
    """Estimate a cloud's normals, areas and spacing from each point's nearest neighbours.

    Parameters
    ----------
    cloud : PointCloud
    neighbours : Neighbours, optional
        Of the cloud's points, if they are known already.

    Raises
    ------
    InputError
        If most points coincide, or all points with any importance do.
    """
    neighbours = neighbours or nearest_neighbours(cloud.points)
    areas = neighbours.areas
    areas = np.minimum(areas, _MAX_RELATIVE_AREA * np.median(areas))
    spacing = float(np.sqrt(np.median(areas)))
    if not spacing > 0:
        repeated = f"mostly points repeated over {neighbours.count} times"
        raise InputError("cloud", "distinct points", repeated)
    importance = relative_importance(cloud, areas)
    if cloud.normals is not None:
        return CloudShape(cloud.normals, None, areas, importance, spacing)
    estimated = estimated_normals(cloud.points, neighbours.count + 1)
    patches = find_patches(cloud.points, estimated, neighbours.index)
    normals, on_sheet = refine_normals(cloud.points, patches.normals, neighbours.index)
    areas = areas * (neighbours.count / on_sheet)
    return CloudShape(normals, patches.labels, areas, importance, spacing)


def relative_importance(cloud: PointCloud, areas: FloatArray) -> FloatArray:
    """Return (M,) the importance of a cloud's points relative to the greatest.

    Raises
    ------
    InputError
        If no point with an area has any.
    """
    importance = np.ones(len(areas)) if cloud.importance is None else normalised(cloud.importance)
    if not (areas * importance).any():
        raise InputError(
            "cloud importance", "some above 0 where points are distinct", "0 all over the surface"
        )
    return importance


def normalised(importance: FloatArray) -> FloatArray:
    """Return the importance relative to the greatest."""
    relative: FloatArray = importance / importance.max()
    return relative


def tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two (n, 3) arrays of unit vectors orthogonal to each normal and to each other."""
    # Any direction that is not the normal's; the rotation about the normal does not matter.
    other = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, other)
    first /= np.sqrt((first**2).sum(axis=1))[:, None]
    return first, np.cross(normals, first)


def surfels(
    cloud: PointCloud, shape: CloudShape, radius_in_spacings: float
) -> tuple[FloatArray, IntArray]:
    """Return one square per point, tangent to the surface, which together make the cloud opaque.

    Parameters
    ----------
    cloud : PointCloud
    shape : CloudShape
    radius_in_spacings : float
        Half of a square's diagonal, relative to the square root of its point's area.

    Returns
    -------
    vertices : (4M, 3) array
        Metres.
    triangles : (2M, 3) array of int32
    """
    first, second = tangents(shape.normals)
    radius = (radius_in_spacings * np.sqrt(shape.areas))[:, None]
    corners = np.stack(
        [
            cloud.points + radius * first,
            cloud.points + radius * second,
            cloud.points - radius * first,
            cloud.points - radius * second,
        ],
        axis=1,
    )
    base = 4 * np.arange(len(first), dtype=np.int32)[:, None]
    corner = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return corners.reshape(-1, 3), np.concatenate([base + corner[0], base + corner[1]])
