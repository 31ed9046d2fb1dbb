# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where points are imaged by cameras with lens distortion."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel

#: A projection's first number, its kind: pinhole, OpenCV's polynomial model, or its fisheye model.
PINHOLE, POLYNOMIAL, FISHEYE = 0, 1, 2
#: How many numbers of a projection precede the coefficients, and how many those are.
PROJECTION, COEFFICIENTS = 8, 12


@kernel
def distort(x, y, kind, k):
    """Return the image of (x, y, 1) relative to the principal point, in focal lengths.

    ``k`` is k₁, k₂, p₁, p₂, k₃, ..., k₆, s₁, ..., s₄ of the polynomial model, or k₁, ..., k₄ of the
    fisheye model.
    """
    square = x * x + y * y
    if kind == FISHEYE:
        tangent = np.sqrt(square)
        angle = np.arctan(tangent)
        t = angle * angle
        grown = angle * (1 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))))
        scale = grown / tangent if tangent > 0 else 1.0
        return scale * x, scale * y
    scale = 1 + square * (k[0] + square * (k[1] + square * k[4]))
    divisor = 1 + square * (k[5] + square * (k[6] + square * k[7]))
    # Within the valid angle a divisor is 0 or less only by rounding, next to a pole.
    scale = scale / divisor if divisor > 0 else np.inf
    twice = 2 * x * y
    u = scale * x + k[2] * twice + k[3] * (square + 2 * x * x) + square * (k[8] + square * k[9])
    v = scale * y + k[2] * (square + 2 * y * y) + k[3] * twice + square * (k[10] + square * k[11])
    return u, v


@kernel
def bound_view(distances, bend, tangents, directions, sides):
    """Return (2, 2) the least and greatest x, and y, at depth 1 of all points that may be imaged.

    Ring i of cells reaches from ``tangents[i]`` to ``tangents[i + 1]`` off the axis, and its radial
    part from ``distances[i]`` to the next; cell j from ``directions[j, axis, 0]`` to ``[..., 1]``,
    its least and greatest cosine and sine. ``sides`` (2, 2) are where pixels begin and end.
    """
    bounds = np.array([[np.inf, -np.inf], [np.inf, -np.inf]])
    for i in range(len(tangents) - 1):
        for j in range(len(directions)):
            touches = True
            for axis in range(2):
                low, high = directions[j, axis]
                touches &= min(distances[i] * low, distances[i + 1] * low) <= (
                    sides[axis, 1] + bend[i + 1]
                )
                touches &= max(distances[i] * high, distances[i + 1] * high) >= (
                    sides[axis, 0] - bend[i + 1]
                )
            if touches:
                for axis in range(2):
                    low, high = directions[j, axis]
                    least = min(tangents[i] * low, tangents[i + 1] * low)
                    most = max(tangents[i] * high, tangents[i + 1] * high)
                    bounds[axis, 0] = min(bounds[axis, 0], least)
                    bounds[axis, 1] = max(bounds[axis, 1], most)
    return bounds


@kernel
def _images(point, position, rotation, projection):
    """Return whether a point in front of the camera falls on a pixel that is read out.

    ``projection`` is kind, reach (tan θ), fx, fy, cx, cy, width, height, and the coefficients;
    pixels are counted from the first that is read out.
    """
    dx, dy, dz = point[0] - position[0], point[1] - position[1], point[2] - position[2]
    z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    x = (rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz) / z
    y = (rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz) / z
    if not np.sqrt(x * x + y * y) < projection[1]:
        return False
    u, v = distort(x, y, projection[0], projection[PROJECTION:])
    u = projection[2] * u + projection[4]
    v = projection[3] * v + projection[5]
    return -0.5 <= u < projection[6] - 0.5 and -0.5 <= v < projection[7] - 0.5


@parallel_kernel
def keep_imaged(points, positions, rotations, projections, room, listed, counts):
    """Filter each camera's list, in place, to the samples in its image; return (C,) their counts.

    Camera c lists ``counts[c]`` samples from ``room[c]`` on; a pinhole camera keeps all.
    """
    left = counts.copy()
    for c in prange(len(positions)):
        if projections[c, 0] != PINHOLE:
            at = room[c]
            for i in range(room[c], room[c] + counts[c]):
                p = listed[i]
                if _images(points[p], positions[c], rotations[c], projections[c]):
                    listed[at] = p
                    at += 1
            left[c] = at - room[c]
    return left
