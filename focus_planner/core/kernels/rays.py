# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Rays, many at a time, by functions of Embree for one.

Such a function is an argument, called with the scene and the address of a ray in Embree's layout.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel

# Of Embree's layouts of a ray, and of one with what it hits: in words of four bytes, the places of
# the end, of the mask, of the normal and of the triangle, and their lengths. They begin where 16
# divides the address.
_END, _MASK, _RAY = 8, 9, 12
_NORMAL, _TRIANGLE, _GEOMETRY, _RAY_AND_HIT = 12, 17, 18, 24
_ALIGNED = 16
_NOTHING = np.uint32(0xFFFFFFFF)
# Rays that a thread casts before it takes others.
_AT_ONCE = 512


@kernel
def _room_for(words):
    """Return room for a ray, float32, the same as bits, and its address."""
    room = np.zeros(words + _ALIGNED, dtype=np.float32)
    skipped = (-room.ctypes.data % _ALIGNED) // 4
    ray = room[skipped : skipped + words]
    return ray, ray.view(np.uint32), np.intp(ray.ctypes.data)


@kernel
def _aim(ray, bits, origin_and_way, end):
    """Aim a ray, which ends at so many times the length of its vector."""
    for axis in range(3):
        ray[axis] = origin_and_way[axis]
        ray[4 + axis] = origin_and_way[3 + axis]
    ray[_END] = end
    bits[_MASK] = _NOTHING


@parallel_kernel
def occluded(cast, scene, rays, hidden):
    """Fill ``hidden`` (n,) with whether something blocks each ray between its origin and its end.

    ``rays`` (n, 6) are origins and vectors from there to the ends, float32.
    """
    count = len(rays)
    for block in prange((count + _AT_ONCE - 1) // _AT_ONCE):
        ray, bits, address = _room_for(_RAY)
        for i in range(block * _AT_ONCE, min((block + 1) * _AT_ONCE, count)):
            _aim(ray, bits, rays[i], 1.0)
            cast(scene, address, 0)
            hidden[i] = ray[_END] < 0.0


@parallel_kernel
def first_hits(cast, scene, rays, distance, triangle, normal):
    """Fill (n,) distance, (n,) triangle and (n, 3) normal with what each ray hits first.

    Distances are in lengths of the ray's vector, inf where it hits nothing; normals are of any
    length, on the side from which the triangle's corners go round anticlockwise.
    """
    count = len(rays)
    for block in prange((count + _AT_ONCE - 1) // _AT_ONCE):
        ray, bits, address = _room_for(_RAY_AND_HIT)
        for i in range(block * _AT_ONCE, min((block + 1) * _AT_ONCE, count)):
            ray[_NORMAL : _NORMAL + 3] = 0.0
            bits[_TRIANGLE] = bits[_GEOMETRY] = _NOTHING
            _aim(ray, bits, rays[i], np.inf)
            cast(scene, address, 0)
            distance[i] = ray[_END]
            triangle[i] = np.int32(bits[_TRIANGLE])
            normal[i] = ray[_NORMAL : _NORMAL + 3]
