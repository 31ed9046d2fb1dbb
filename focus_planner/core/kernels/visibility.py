# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which samples are in the field of view of which camera."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import FloatArray
from focus_planner.core.kernels.compiling import kernel, parallel_kernel

#: Samples per block. Smaller ones take more tests; larger ones are less often ruled out whole.
BLOCK = 64
#: The last of the cells that an axis is divided into for sorting.
PLACES = 2**20 - 1
# More than what rounding does to a test, relative to the distances in it; and what it does to the
# square root of a difference.
_SLACK = 1e-9
_SLACK_OF_ROOT = 1e-6
_SPREADING = (
    (np.uint64(32), np.uint64(0x001F00000000FFFF)),
    (np.uint64(16), np.uint64(0x001F0000FF0000FF)),
    (np.uint64(8), np.uint64(0x100F00F00F00F00F)),
    (np.uint64(4), np.uint64(0x10C30C30C30C30C3)),
    (np.uint64(2), np.uint64(0x1249249249249249)),
)


class Views(NamedTuple):
    """Where C cameras stand, and what their images hold.

    Attributes
    ----------
    positions : (C, 3) array
        Metres.
    rotations : (C, 3, 3) array
        From each camera's optical frame to the rig's.
    frustums : (C, 7) array
        fx, fy, cx, cy, width, height in pixels, and the least depth in metres.
    """

    positions: FloatArray
    rotations: FloatArray
    frustums: FloatArray


class Blocks(NamedTuple):
    """What bounds ``BLOCK`` samples each.

    Attributes
    ----------
    spheres : (B, 4) array
        Around the points: centre and radius, metres.
    cones : (B, 5) array
        Around the normals: axis, cosine and sine of the half-angle. The cosine of a half-angle of
        a right angle or more is -1.
    """

    spheres: FloatArray
    cones: FloatArray


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


@kernel
def _spread(value):
    """Return the lower 20 bits of a number, two zeros apart."""
    spread = np.uint64(value)
    for shift, mask in _SPREADING:
        spread = (spread | (spread << shift)) & mask
    return spread


@parallel_kernel
def block_keys(points, normals, low, scale, facing):
    """Return (N,) keys that sort samples into blocks: by normal if ``facing``, then by position.

    Above the position's Morton code, 20 bits per axis from ``low`` on, is the normal's octant.
    """
    keys = np.empty(len(points), dtype=np.uint64)
    for p in prange(len(points)):
        key = np.uint64(0)
        for axis in range(3):
            if facing and normals[p, axis] < 0:
                key |= np.uint64(1) << np.uint64(60 + axis)
            key |= _spread(np.int64((points[p, axis] - low[axis]) * scale)) << np.uint64(axis)
        keys[p] = key
    return keys


@parallel_kernel
def bound_blocks(points, normals):
    """Return the blocks of the samples in turn."""
    blocks = (len(points) + BLOCK - 1) // BLOCK
    spheres, cones = np.empty((blocks, 4)), np.empty((blocks, 5))
    for b in prange(blocks):
        low, high = b * BLOCK, min((b + 1) * BLOCK, len(points))
        for axis in range(3):
            part = points[low:high, axis]
            spheres[b, axis] = (part.min() + part.max()) / 2
            cones[b, axis] = normals[low:high, axis].sum()
        length = np.sqrt(cones[b, 0] ** 2 + cones[b, 1] ** 2 + cones[b, 2] ** 2)
        radius, cosine = 0.0, 1.0
        for p in range(low, high):
            away, along, norm = 0.0, 0.0, 0.0
            for axis in range(3):
                away += (points[p, axis] - spheres[b, axis]) ** 2
                along += normals[p, axis] * cones[b, axis]
                norm += normals[p, axis] ** 2
            radius = max(radius, np.sqrt(away))
            if norm > 0 and length > 0:
                cosine = min(cosine, along / (np.sqrt(norm) * length))
            else:
                cosine = -1.0
        spheres[b, 3] = radius
        for axis in range(3):
            cones[b, axis] /= max(length, 1e-300)
        cones[b, 3] = cosine - _SLACK if cosine > _SLACK else -1.0
        cones[b, 4] = np.sqrt(max(0.0, 1.0 - cones[b, 3] ** 2))
    return Blocks(spheres, cones)


@kernel
def _may_see(sphere, cone, position, rotation, frustum, facing):
    """Return False only if :func:`_sees` is False for every point of the block, rounding included.

    So it is where the whole sphere lies beyond one side of the frustum, or where all normals of the
    cone point away from the camera from anywhere in the sphere.
    """
    dx, dy, dz = sphere[0] - position[0], sphere[1] - position[1], sphere[2] - position[2]
    away = np.sqrt(dx * dx + dy * dy + dz * dz)
    reach = abs(position[0]) + abs(position[1]) + abs(position[2])
    room = sphere[3] + _SLACK * (away + sphere[3] + reach)
    if facing and cone[3] > 0:
        along = cone[0] * dx + cone[1] * dy + cone[2] * dz
        across = np.sqrt(max(0.0, away * away - along * along))
        if along * cone[3] - across * cone[4] > room + _SLACK_OF_ROOT * away:
            return False
    z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    if z + room <= frustum[6]:
        return False
    x = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
    y = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
    for axis in range(2):
        side, f = (x if axis == 0 else y), frustum[axis]
        first, end = frustum[2 + axis] + 0.5, frustum[2 + axis] + 0.5 - frustum[4 + axis]
        if f * side + first * z < -room * np.sqrt(f * f + first * first):
            return False
        if f * side + end * z > room * np.sqrt(f * f + end * end):
            return False
    return True


@parallel_kernel
def count_near_view(blocks, count, views, facing):
    """Return (C,) how many of the ``count`` samples lie in blocks that each camera may see."""
    spheres, cones = blocks
    positions, rotations, frustums = views
    counts = np.zeros(len(positions), dtype=np.int64)
    for c in prange(len(positions)):
        for b in range(len(spheres)):
            if _may_see(spheres[b], cones[b], positions[c], rotations[c], frustums[c], facing):
                counts[c] += min(BLOCK, count - b * BLOCK)
    return counts


@parallel_kernel
def list_in_view(points, normals, blocks, views, facing, room, listed):
    """List the samples in each camera's image, and facing it if ``facing``; return (C,) counts.

    Camera c's samples are written to ``listed`` from ``room[c]`` on, as many at most as
    :func:`count_near_view` counted.
    """
    spheres, cones = blocks
    positions, rotations, frustums = views
    counts = np.zeros(len(positions), dtype=np.int64)
    for c in prange(len(positions)):
        at = room[c]
        for b in range(len(spheres)):
            if _may_see(spheres[b], cones[b], positions[c], rotations[c], frustums[c], facing):
                for p in range(b * BLOCK, min((b + 1) * BLOCK, len(points))):
                    if _sees(
                        points[p], normals[p], positions[c], rotations[c], frustums[c], facing
                    ):
                        listed[at] = p
                        at += 1
        counts[c] = at - room[c]
    return counts


@parallel_kernel
def fill_rays(points, positions, room, listed, offsets, centre, stop_short, rays):
    """Fill (n, 6) the rays from each camera to the samples it lists, from ``offsets[c]`` on.

    They are relative to ``centre`` and stop ``stop_short``, in metres, short of the sample.
    """
    for c in prange(len(positions)):
        ox = positions[c, 0] - centre[0]
        oy = positions[c, 1] - centre[1]
        oz = positions[c, 2] - centre[2]
        for i in range(offsets[c + 1] - offsets[c]):
            p, ray = listed[room[c] + i], rays[offsets[c] + i]
            dx = points[p, 0] - centre[0] - ox
            dy = points[p, 1] - centre[1] - oy
            dz = points[p, 2] - centre[2] - oz
            length = np.sqrt(dx * dx + dy * dy + dz * dz)
            share = max(length - stop_short, 0.0) / max(length, 1e-300)
            ray[0], ray[1], ray[2] = ox, oy, oz
            ray[3], ray[4], ray[5] = dx * share, dy * share, dz * share


@parallel_kernel
def keep_seen(room, listed, offsets, hidden, order):
    """Filter each camera's list, in place, to the samples not hidden; return (C,) their counts.

    Sample p becomes ``order[p]``; the lists are sorted.
    """
    counts = np.zeros(len(offsets) - 1, dtype=np.int64)
    for c in prange(len(counts)):
        kept = room[c]
        for i in range(offsets[c + 1] - offsets[c]):
            if not hidden[offsets[c] + i]:
                listed[kept] = order[listed[room[c] + i]]
                kept += 1
        listed[room[c] : kept].sort()
        counts[c] = kept - room[c]
    return counts


@parallel_kernel
def gather(starts, counts, shifts, offsets, source, gathered):
    """Fill camera c's part of ``gathered``, from ``offsets[c]`` on, with its parts of ``source``.

    Part k is ``counts[k, c]`` numbers from ``starts[k, c]`` on; each is raised by ``shifts[k]``.
    """
    for c in prange(len(offsets) - 1):
        at = offsets[c]
        for k in range(len(counts)):
            for i in range(starts[k, c], starts[k, c] + counts[k, c]):
                gathered[at] = source[i] + shifts[k]
                at += 1
