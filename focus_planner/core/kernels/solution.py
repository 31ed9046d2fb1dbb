# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which camera each sample is assigned to, and how far each camera can move for its samples."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.problem import UNSEEN


@kernel
def _cheapest(p, by_sample, focus, cell):
    """Return sample p's cheapest camera and its cost in units; ``UNSEEN`` where none sees it.

    A function of its own: inside the prange body of ``assign``, Numba 0.68 rejects the loop on
    Python 3.12 and later ("unexpected cycle in lookup()").
    """
    offsets, camera, base, first, last = by_sample
    least, which = np.int64(2**62), UNSEEN
    for q in range(offsets[p], offsets[p + 1]):
        c = camera[q]
        cost = base[q]
        if cell[c] < first[q] or cell[c] > last[q]:
            cost += focus[p]
        if cost < least:
            least, which = cost, c
    return which, least


@parallel_kernel
def assign(by_sample, focus, cell, best):
    """Fill ``best`` (N,) with each sample's cheapest camera (Eq. 5); return the cost in units.

    Samples that no camera sees get ``UNSEEN`` and add nothing to the cost.
    """
    total = np.int64(0)
    for p in prange(len(best)):
        which, least = _cheapest(p, by_sample, focus, cell)
        best[p] = which
        if which != UNSEEN:
            total += least
    return total


@kernel
def focus_room(
    sample_offsets, camera_index, focus_near, focus_far, focus, best, room_near, room_far
):
    """Narrow ``room_near``, ``room_far`` (C,) to where each camera keeps its own samples in focus.

    A camera's own samples are those with ``best`` equal to it that are in focus now. A camera
    without any keeps its range.
    """
    for p in range(len(best)):
        for q in range(sample_offsets[p], sample_offsets[p + 1]):
            c = camera_index[q]
            if c == best[p] and focus_near[q] <= focus[c] <= focus_far[q]:
                if not room_near[c] >= focus_near[q]:
                    room_near[c] = focus_near[q]
                if not room_far[c] <= focus_far[q]:
                    room_far[c] = focus_far[q]
