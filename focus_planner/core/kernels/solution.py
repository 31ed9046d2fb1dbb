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
def is_assigned(p, c, best):
    """Return whether camera c is one of those that sample p is assigned to."""
    assigned = best[p, 0] == c
    for i in range(1, best.shape[1]):
        assigned |= best[p, i] == c
    return assigned


@kernel
def _cheapest_one(p, by_sample, focus, cell, best):
    """Fill sample p's cheapest camera of all; return its cost in units, 0 if there is none."""
    offsets, camera, base, first, last = by_sample
    least, which = np.int64(2**62), UNSEEN
    for q in range(offsets[p], offsets[p + 1]):
        at = cell[camera[q]]
        cost = base[q] + (0 if first[q] <= at <= last[q] else focus[p])
        if cost < least:
            least, which = cost, camera[q]
    best[0] = which
    return np.int64(0) if which == UNSEEN else least


@kernel
def _cheapest(p, by_sample, focus, views, cell, best, least):
    """Fill sample p's cheapest cameras, each of another view; return their cost in units.

    A function of its own: inside the prange body of ``assign``, Numba 0.68 rejects the loop on
    Python 3.12 and later ("unexpected cycle in lookup()").
    """
    offsets, camera, base, first, last = by_sample
    best[:] = UNSEEN
    least[:] = views.missing[p] + 1
    q, high = offsets[p], offsets[p + 1]
    while q < high:
        view, cheapest, which = views.number[camera[q]], np.int64(2**62), UNSEEN
        while q < high and views.number[camera[q]] == view:
            c = camera[q]
            cost = base[q]
            if cell[c] < first[q] or cell[c] > last[q]:
                cost += focus[p]
            if cost < cheapest:
                cheapest, which = cost, c
            q += 1
        at = len(least)
        while at > 0 and cheapest < least[at - 1]:
            at -= 1
            if at + 1 < len(least):
                least[at + 1], best[at + 1] = least[at], best[at]
        if at < len(least):
            least[at], best[at] = cheapest, which
    total = np.int64(0)
    for i in range(len(least)):
        total += 0 if best[i] == UNSEEN else least[i]
    return total


@parallel_kernel
def assign(by_sample, focus, views, cell, best):
    """Fill ``best`` (N, needed) with each sample's cheapest cameras (Eq. 5); return their cost.

    Each is of another view. Views that are missing get ``UNSEEN`` and add nothing to the cost, in
    units.
    """
    total = np.int64(0)
    if views.needed == 1:
        for p in prange(len(best)):
            total += _cheapest_one(p, by_sample, focus, cell, best[p])
        return total
    for p in prange(len(best)):
        least = np.empty(best.shape[1], dtype=np.int64)
        total += _cheapest(p, by_sample, focus, views, cell, best[p], least)
    return total


@kernel
def focus_room(
    sample_offsets, camera_index, focus_near, focus_far, focus, best, room_near, room_far
):
    """Narrow ``room_near``, ``room_far`` (C,) to where each camera keeps its own samples in focus.

    A camera's own samples are those assigned to it, in ``best`` (N, needed), that are in focus now.
    A camera without any keeps its range.
    """
    for p in range(len(best)):
        for q in range(sample_offsets[p], sample_offsets[p + 1]):
            c = camera_index[q]
            if is_assigned(p, c, best) and focus_near[q] <= focus[c] <= focus_far[q]:
                if not room_near[c] >= focus_near[q]:
                    room_near[c] = focus_near[q]
                if not room_far[c] <= focus_far[q]:
                    room_far[c] = focus_far[q]
