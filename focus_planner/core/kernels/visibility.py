"""Field of view, for every camera and sample."""

from __future__ import annotations

import numpy as np
from numba import njit, prange


@njit(cache=True, nogil=True)
def _sees(point, normal, position, rotation, frustum, facing):
    dx, dy, dz = point[0] - position[0], point[1] - position[1], point[2] - position[2]
    if facing and normal[0] * dx + normal[1] * dy + normal[2] * dz >= 0:
        return False
    z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    fx, fy, cx, cy, width, height, nearest = frustum
    if z <= nearest:
        return False
    x = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
    u = fx * x / z + cx
    if u < -0.5 or u >= width - 0.5:
        return False
    y = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
    v = fy * y / z + cy
    return -0.5 <= v < height - 0.5


@njit(cache=True, nogil=True, parallel=True)
def count_in_view(points, normals, positions, rotations, frustums, facing):
    """Return (C,) numbers of samples in each camera's image, and facing it if ``facing``."""
    counts = np.zeros(len(positions), dtype=np.int64)
    for c in prange(len(positions)):
        count = 0
        frustum = (
            frustums[c, 0],
            frustums[c, 1],
            frustums[c, 2],
            frustums[c, 3],
            frustums[c, 4],
            frustums[c, 5],
            frustums[c, 6],
        )
        for p in range(len(points)):
            if _sees(points[p], normals[p], positions[c], rotations[c], frustum, facing):
                count += 1
        counts[c] = count
    return counts


@njit(cache=True, nogil=True, parallel=True)
def list_in_view(points, normals, positions, rotations, frustums, facing, offsets, sample_index):
    """Fill ``sample_index`` with what :func:`count_in_view` counted, samples ascending."""
    for c in prange(len(positions)):
        at = offsets[c]
        frustum = (
            frustums[c, 0],
            frustums[c, 1],
            frustums[c, 2],
            frustums[c, 3],
            frustums[c, 4],
            frustums[c, 5],
            frustums[c, 6],
        )
        for p in range(len(points)):
            if _sees(points[p], normals[p], positions[c], rotations[c], frustum, facing):
                sample_index[at] = p
                at += 1


@njit(cache=True, nogil=True)
def by_sample(camera_offsets, sample_index, sample_offsets):
    """Return the camera-by-camera pairs in the order of their samples, cameras ascending.

    Fills ``sample_offsets`` (N + 1). The sort counts, so equal samples keep the cameras' order.
    """
    for p in sample_index:
        sample_offsets[p + 1] += 1
    for p in range(len(sample_offsets) - 1):
        sample_offsets[p + 1] += sample_offsets[p]
    at = sample_offsets[:-1].copy()
    sample = np.empty(len(sample_index), dtype=np.int32)
    camera = np.empty(len(sample_index), dtype=np.int32)
    for c in range(len(camera_offsets) - 1):
        for j in range(camera_offsets[c], camera_offsets[c + 1]):
            p = sample_index[j]
            sample[at[p]] = p
            camera[at[p]] = c
            at[p] += 1
    return sample, camera
