# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Cells: ranges of focus distance over which the set of samples in focus does not change.

Of all the cells between a camera's sorted interval ends (paper, Sec. 3.4.1) only those that
start where an interval starts and end where one ends matter: every other cell's samples are a
subset of one of theirs. In practice they are a quarter of all at most, and turn each interval into
a range of whole numbers, so that no solver sorts again.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.ranks import ranks_among


@parallel_kernel
def maximal_cells(offsets, starts, ends, cell_counts, cell_near, cell_far):
    """Fill each camera's cells from its sorted interval starts and ends.

    ``offsets`` (C + 1,) bounds camera c's part of ``starts`` and ``ends``, and of the outputs,
    which have room for as many cells as there are intervals. Empty intervals (start inf, end -inf)
    are skipped.
    """
    for c in prange(len(offsets) - 1):
        own = slice(offsets[c], offsets[c + 1])
        cell_counts[c] = _maximal_cells(starts[own], ends[own], cell_near[own], cell_far[own])


@kernel
def _maximal_cells(starts, ends, cell_near, cell_far):
    """Fill one camera's cells; return how many there are."""
    i, j, count = 0, 0, 0
    while j < len(ends) and ends[j] == -np.inf:
        j += 1
    while i < len(starts) and starts[i] < np.inf:
        # A start followed by an end closes a cell; starts go first where they are equal.
        while i + 1 < len(starts) and starts[i + 1] <= ends[j] and starts[i + 1] < np.inf:
            i += 1
        cell_near[count], cell_far[count] = starts[i], ends[j]
        count += 1
        i += 1
        while i < len(starts) and j < len(ends) and ends[j] < starts[i]:
            j += 1
    return count


@parallel_kernel
def cell_ranges(offsets, starts, ends, cell_offsets, cell_near, cell_far, first, last):
    """Fill ``first`` and ``last`` (P,), camera by camera: the cells that hold a pair in focus.

    An empty interval gets first > last.
    """
    for c in prange(len(offsets) - 1):
        own, cells = slice(offsets[c], offsets[c + 1]), slice(cell_offsets[c], cell_offsets[c + 1])
        ranks_among(cell_near[cells], starts[own], False, first[own])
        ranks_among(cell_far[cells], ends[own], True, last[own])
        last[own] -= 1


@parallel_kernel
def take(pairs, near, far, base, sample, starts, ends, seen_base, seen):
    """Fill what pairs (P,) have camera by camera, given what they have sample by sample."""
    for j in prange(len(pairs)):
        q = pairs[j]
        starts[j], ends[j], seen_base[j], seen[j] = near[q], far[q], base[q], sample[q]


@parallel_kernel
def put(pairs, seen_first, seen_last, first, last):
    """Fill what pairs (P,) have sample by sample, given what they have camera by camera."""
    for j in prange(len(pairs)):
        first[pairs[j]], last[pairs[j]] = seen_first[j], seen_last[j]


@parallel_kernel
def costs_in_units(sample_offsets, weights, base_cost, base):
    """Fill ``base`` (P,) with the costs of pairs, given by sample, in whole units.

    ``weights`` (N,) are those of the samples, in units.
    """
    for p in prange(len(weights)):
        for q in range(sample_offsets[p], sample_offsets[p + 1]):
            base[q] = np.int64(np.rint(weights[p] * base_cost[q]))
