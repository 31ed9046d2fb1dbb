"""The pointwise cost of given focus distances."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel

UNSEEN = -1


@parallel_kernel
def best_cameras(
    sample_offsets, camera_index, base_cost, focus_near, focus_far, focus_weight, focus, costs, best
):
    """Fill ``costs`` (N,) and ``best`` (N,), the camera with the least cost (Eq. 2 and 5).

    A sample that no camera sees costs 1; its ``best`` is ``UNSEEN``. Of equal cameras the first
    is taken.
    """
    for p in prange(len(sample_offsets) - 1):
        least, which = np.inf, UNSEEN
        for q in range(sample_offsets[p], sample_offsets[p + 1]):
            s = focus[camera_index[q]]
            cost = base_cost[q]
            if not focus_near[q] <= s <= focus_far[q]:  # nor is NaN, a camera without a distance
                cost += focus_weight
            if cost < least:
                least, which = cost, camera_index[q]
        costs[p] = least if which != UNSEEN else 1.0
        best[p] = which


@parallel_kernel
def base_costs(
    points,
    normals,
    positions,
    rotations,
    sample_index,
    camera_index,
    area_weight,
    deviation_weight,
    area_scale,
    deviation_limit,
    depth,
    base_cost,
):
    """Fill ``depth`` and ``base_cost`` (P,) of pairs of a sample and a camera (Eq. 1)."""
    for q in prange(len(sample_index)):
        p, c = sample_index[q], camera_index[q]
        dx = points[p, 0] - positions[c, 0]
        dy = points[p, 1] - positions[c, 1]
        dz = points[p, 2] - positions[c, 2]
        r = rotations[c]
        x = r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz
        y = r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz
        z = r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz
        # The paper's normals point inward, these outward: hence the sign.
        cosine = -(r[0, 2] * normals[p, 0] + r[1, 2] * normals[p, 1] + r[2, 2] * normals[p, 2])
        area = 1.0
        if cosine > 0:
            area = min(area_scale * z * z / cosine, 1.0)
        deviation = min(np.sqrt(x * x + y * y) / deviation_limit, 1.0)
        depth[q] = z
        base_cost[q] = area_weight * area + deviation_weight * deviation


@kernel
def focus_room(
    sample_offsets, camera_index, focus_near, focus_far, focus, best, room_near, room_far
):
    """Fill (C,) the range that keeps each camera's own samples in focus that are so now.

    A camera's own are those with ``best`` equal to it. Cameras without any keep what is there.
    """
    for p in range(len(best)):
        for q in range(sample_offsets[p], sample_offsets[p + 1]):
            c = camera_index[q]
            if c == best[p] and focus_near[q] <= focus[c] <= focus_far[q]:
                if not room_near[c] >= focus_near[q]:
                    room_near[c] = focus_near[q]
                if not room_far[c] <= focus_far[q]:
                    room_far[c] = focus_far[q]
