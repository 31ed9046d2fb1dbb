# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Samples in another order, with all that their pairs have."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel, parallel_kernel

# Parts of the samples that are gone through at once, whatever the number of threads.
_PARTS = 4


class Pairs(NamedTuple):
    """What a problem and its cells tell of the P pairs, sample by sample.

    Attributes
    ----------
    sample, camera : (P,) arrays of int32
    depth, base_cost, near, far : (P,) arrays
        As :class:`~focus_planner.core.problem.problem.Problem` has them.
    base : (P,) array of int64
    first, last : (P,) arrays of int32
        As :class:`~focus_planner.core.problem.cells.Cells` has them.
    """

    sample: IntArray
    camera: IntArray
    depth: FloatArray
    base_cost: FloatArray
    near: FloatArray
    far: FloatArray
    base: Offsets
    first: IntArray
    last: IntArray


@parallel_kernel
def move_pairs(order, came_from, offsets, pairs, moved):
    """Fill the pairs ``moved``, those of sample p being those of sample ``order[p]``.

    Parameters
    ----------
    order : (N,) array of int64
    came_from, offsets : (N + 1,) arrays of int64
        Where the pairs of each sample begin: before, and then.
    pairs, moved : Pairs
    """
    # Of tuples, assignments within the loop would be lost.
    _, camera, depth, base_cost, near, far, base, first, last = pairs
    (
        to_sample,
        to_camera,
        to_depth,
        to_base_cost,
        to_near,
        to_far,
        to_base,
        to_first,
        to_last,
    ) = moved
    for p in prange(len(order)):
        q = came_from[order[p]]
        for at in range(offsets[p], offsets[p + 1]):
            to_sample[at] = p
            to_camera[at], to_depth[at], to_base_cost[at] = camera[q], depth[q], base_cost[q]
            to_near[at], to_far[at], to_base[at] = near[q], far[q], base[q]
            to_first[at], to_last[at] = first[q], last[q]
            q += 1


@kernel
def _count_by_camera(camera, counts):
    """Count the pairs of each camera."""
    for c in camera:
        counts[c] += 1


@parallel_kernel
def list_by_camera(pairs, which, by_camera):
    """Fill ``which`` (P,), the indices of the pairs camera by camera, and what these pairs have.

    ``by_camera`` is a :class:`PairsByCamera` with its offsets; samples become ascending.
    """
    sample, camera, _, _, _, _, base, first, last = pairs
    camera_offsets, seen, seen_base, seen_first, seen_last = by_camera
    count, cameras = len(camera), len(camera_offsets) - 1
    size = (count + _PARTS - 1) // _PARTS
    counts = np.zeros((_PARTS, cameras), dtype=np.int64)
    for part in prange(_PARTS):
        _count_by_camera(camera[part * size : (part + 1) * size], counts[part])
    at = np.empty((_PARTS, cameras), dtype=np.int64)
    for c in range(cameras):
        begin = camera_offsets[c]
        for part in range(_PARTS):
            at[part, c] = begin
            begin += counts[part, c]
    for part in prange(_PARTS):
        for q in range(part * size, min((part + 1) * size, count)):
            j = at[part, camera[q]]
            at[part, camera[q]] += 1
            which[j], seen[j], seen_base[j] = q, sample[q], base[q]
            seen_first[j], seen_last[j] = first[q], last[q]
