"""Field of view, for every camera and sample."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel


@kernel
def _sees(point, normal, position, rotation, frustum, facing):
    """Return whether a point is in view: ``frustum`` is fx, fy, cx, cy, width, height, nearest."""
    dx, dy, dz = point[0] - position[0], point[1] - position[1], point[2] - position[2]
    if facing and normal[0] * dx + normal[1] * dy + normal[2] * dz >= 0:
        return False
    z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    if z <= frustum[6]:
        return False
    x = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
    u = frustum[0] * x / z + frustum[2]
    if u < -0.5 or u >= frustum[4] - 0.5:
        return False
    y = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
    v = frustum[1] * y / z + frustum[3]
    return -0.5 <= v < frustum[5] - 0.5


@parallel_kernel
def count_in_view(points, normals, positions, rotations, frustums, facing):
    """Return (C,) numbers of samples in each camera's image, and facing it if ``facing``."""
    counts = np.zeros(len(positions), dtype=np.int64)
    for c in prange(len(positions)):
        count = 0
        for p in range(len(points)):
            if _sees(points[p], normals[p], positions[c], rotations[c], frustums[c], facing):
                count += 1
        counts[c] = count
    return counts


@parallel_kernel
def list_in_view(points, normals, positions, rotations, frustums, facing, offsets, sample_index):
    """Fill ``sample_index`` with what :func:`count_in_view` counted, samples ascending."""
    for c in prange(len(positions)):
        at = offsets[c]
        for p in range(len(points)):
            if _sees(points[p], normals[p], positions[c], rotations[c], frustums[c], facing):
                sample_index[at] = p
                at += 1


@kernel
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
