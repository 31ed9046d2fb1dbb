"""One camera's best cell for the samples assigned to it: weighted interval stabbing."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.cost import UNSEEN


@kernel
def _cheapest(p, sample_offsets, camera_index, base, focus, first, last, cell):
    """Return sample p's cheapest camera and its cost in units; ``UNSEEN`` where none sees it.

    A function of its own: inside the prange body of ``assign``, Numba 0.68 rejects the loop on
    Python 3.12 and later ("unexpected cycle in lookup()").
    """
    least, which = np.int64(2**62), UNSEEN
    for q in range(sample_offsets[p], sample_offsets[p + 1]):
        c = camera_index[q]
        cost = base[q]
        if cell[c] < first[q] or cell[c] > last[q]:
            cost += focus[p]
        if cost < least:
            least, which = cost, c
    return which, least


@parallel_kernel
def assign(sample_offsets, camera_index, base, focus, first, last, cell, best):
    """Fill ``best`` (N,) with each sample's cheapest camera (Eq. 5); return the cost in units.

    Samples that no camera sees get ``UNSEEN`` and count nothing.
    """
    total = np.int64(0)
    for p in prange(len(sample_offsets) - 1):
        which, least = _cheapest(p, sample_offsets, camera_index, base, focus, first, last, cell)
        best[p] = which
        if which != UNSEEN:
            total += least
    return total


@parallel_kernel
def stab(camera_offsets, seen, seen_first, seen_last, focus, cell_offsets, best, cell):
    """Move each camera to the cell that holds most of its samples' weight in focus (Eq. 8).

    Camera c's samples are those with ``best[p] == c``. Of equal cells it takes the one that
    holds most of all that the camera sees, which the next assignment may profit from; a camera
    stays where nothing is better. Two prefix sums per camera. Returns how many cameras moved.
    """
    moved = 0
    for c in prange(len(camera_offsets) - 1):
        count = cell_offsets[c + 1] - cell_offsets[c]
        if count > 0:
            own, all_seen = np.zeros((2, count + 1), dtype=np.int64)
            for j in range(camera_offsets[c], camera_offsets[c + 1]):
                if seen_first[j] <= seen_last[j]:
                    p = seen[j]
                    all_seen[seen_first[j]] += focus[p]
                    all_seen[seen_last[j] + 1] -= focus[p]
                    if best[p] == c:
                        own[seen_first[j]] += focus[p]
                        own[seen_last[j] + 1] -= focus[p]
            own, all_seen = np.cumsum(own[:-1]), np.cumsum(all_seen[:-1])
            where = cell[c]
            for i in range(count):
                if own[i] > own[where] or (own[i] == own[where] and all_seen[i] > all_seen[where]):
                    where = i
            if where != cell[c]:
                cell[c] = where
                moved += 1
    return moved
