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
    for p in prange(len(order)):
        _move_pairs(p, came_from[order[p]], offsets[p], offsets[p + 1], pairs, moved)


@kernel
def _move_pairs(p, q, begin, end, pairs, moved):
    """Fill the moved pairs ``begin`` to ``end``, those of sample p, with those from q on."""
    for at in range(begin, end):
        moved.sample[at], moved.camera[at] = p, pairs.camera[q]
        moved.depth[at], moved.base_cost[at] = pairs.depth[q], pairs.base_cost[q]
        moved.near[at], moved.far[at] = pairs.near[q], pairs.far[q]
        moved.base[at] = pairs.base[q]
        moved.first[at], moved.last[at] = pairs.first[q], pairs.last[q]
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
    camera, camera_offsets = pairs.camera, by_camera.offsets
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
        _list_part(part * size, min((part + 1) * size, count), pairs, at[part], which, by_camera)


@kernel
def _list_part(low, high, pairs, at, which, by_camera):
    """List pairs ``low`` to ``high``, each camera's from a place on that moves along."""
    for q in range(low, high):
        j = at[pairs.camera[q]]
        at[pairs.camera[q]] += 1
        which[j], by_camera.sample[j], by_camera.base[j] = q, pairs.sample[q], pairs.base[q]
        by_camera.first[j], by_camera.last[j] = pairs.first[q], pairs.last[q]
