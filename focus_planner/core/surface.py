"""Surfaces as samples: points with a normal and the area that each stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

from focus_planner.core.checks import InputError
from focus_planner.core.types import (
    FloatArray,
    IntArray,
    Mesh,
    PointCloud,
    Samples,
)

# A point's neighbours tell its normal and its share of the area; enough to average noise out,
# few enough to stay on one fold of the surface.
_NEIGHBOURS = 16
_STRAY = 50.0


@dataclass(frozen=True, eq=False)
class CloudShape:
    """What a cloud's points tell about the surface between them.

    Attributes
    ----------
    normals : (M, 3) array
        The cloud's own, outward; or estimated, and then of either sign.
    oriented : bool
        Whether the normals point outward.
    areas : (M,) array
        The surface area that each point stands for, square metres.
    spacing : float
        Median distance between a point and what would be its neighbour on a square grid, metres.
    """

    normals: FloatArray
    oriented: bool
    areas: FloatArray
    spacing: float


def cloud_shape(cloud: PointCloud) -> CloudShape:
    """Return normals, areas and spacing of a cloud from each point's nearest neighbours.

    The disc that reaches a point's k-th neighbour holds k points on average, so its area over k
    is the area per point, without bias for points strewn at random.

    Raises
    ------
    InputError
        If the points coincide.
    """
    count = min(_NEIGHBOURS, len(cloud.points) - 1)
    distances = np.asarray(cKDTree(cloud.points).query(cloud.points, k=count + 1, workers=-1)[0])
    areas = np.pi * distances[:, -1] ** 2 / count
    # A stray point stands for no surface, and hides none.
    areas = np.minimum(areas, _STRAY * np.median(areas))
    spacing = float(np.sqrt(np.median(areas)))
    if not spacing > 0:
        raise InputError("cloud", "distinct points", f"mostly points repeated over {count} times")
    if cloud.normals is not None:
        return CloudShape(cloud.normals, True, areas, spacing)
    shape = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points.copy()))
    shape.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(count + 1))
    return CloudShape(np.asarray(shape.normals).copy(), False, areas, spacing)


def sample_mesh(mesh: Mesh, count: int, seed: int) -> Samples:
    """Return ``count`` samples, uniform over the area.

    Normals are interpolated from the vertices where the mesh has vertex normals, else those of
    the triangles.

    Parameters
    ----------
    mesh : Mesh
    count : int
    seed : int
        For NumPy's PCG64: the same seed gives the same samples.
    """
    random = np.random.default_rng(seed)
    crosses = mesh.cross_products
    cumulative = np.cumsum(np.sqrt((crosses**2).sum(axis=1)) / 2)
    area = cumulative[-1]
    chosen = np.searchsorted(cumulative, random.random(count) * area, side="right")
    chosen = np.minimum(chosen, len(crosses) - 1)
    root, v = np.sqrt(random.random(count)), random.random(count)
    barycentric = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    corners = mesh.triangles[chosen]
    points = (barycentric[:, :, None] * mesh.vertices[corners]).sum(axis=1)
    normals = crosses[chosen]
    if mesh.vertex_normals is not None:
        smooth = (barycentric[:, :, None] * mesh.vertex_normals[corners]).sum(axis=1)
        # Opposite vertex normals may cancel; the triangle's own is right there.
        cancelled = (smooth**2).sum(axis=1) < 1e-12
        normals = np.where(cancelled[:, None], normals, smooth)
    normals = normals / np.sqrt((normals**2).sum(axis=1))[:, None]
    return Samples(points, normals, np.full(count, area / count))


def sample_cloud(cloud: PointCloud, shape: CloudShape, count: int, seed: int) -> Samples:
    """Return ``count`` of the cloud's points, drawn by area with replacement; 0 returns them all.

    Drawing by area undoes a density that differs from place to place, as in merged scans.
    """
    if count == 0:
        # Copies: kernels are compiled anew for arrays that cannot be written to.
        return Samples(cloud.points.copy(), shape.normals.copy(), shape.areas.copy())
    cumulative = np.cumsum(shape.areas)
    random = np.random.default_rng(seed)
    chosen = np.searchsorted(cumulative, random.random(count) * cumulative[-1], side="right")
    chosen = np.minimum(chosen, len(cloud.points) - 1)
    weights = np.full(count, cumulative[-1] / count)
    return Samples(cloud.points[chosen], shape.normals[chosen], weights)


def surfels(
    cloud: PointCloud, shape: CloudShape, radius_in_spacings: float
) -> tuple[FloatArray, IntArray]:
    """Return one square per point, tangent to the surface: the cloud made opaque.

    Parameters
    ----------
    cloud : PointCloud
    shape : CloudShape
    radius_in_spacings : float
        Half the square's diagonal, in units of the point's own spacing.

    Returns
    -------
    vertices : (4M, 3) array
        Metres.
    triangles : (2M, 3) array of int32
    """
    normals = shape.normals
    # Any direction that is not the normal's; the square's turn about it does not matter.
    other = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, other)
    first /= np.sqrt((first**2).sum(axis=1))[:, None]
    second = np.cross(normals, first)
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
    base = 4 * np.arange(len(normals), dtype=np.int32)[:, None]
    corner = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return corners.reshape(-1, 3), np.concatenate([base + corner[0], base + corner[1]])
