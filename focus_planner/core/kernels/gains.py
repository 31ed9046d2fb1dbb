# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What focus gains, pair by pair."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel


@kernel
def _keep_least(cost, least):
    """Insert a cost into the least so far, ascending; the largest of them drops out."""
    at = len(least) - 1
    if cost < least[at]:
        while at > 0 and cost < least[at - 1]:
            least[at] = least[at - 1]
            at -= 1
        least[at] = cost


@kernel
def _cost_out(p, by_sample, focus, unseen, shots, least):
    """Return what the last of sample p's views costs with every camera out of focus.

    Fills the ``least`` costs of as many views, each in another camera of the rig.
    """
    offsets, camera, base, _, _ = by_sample
    low, high = offsets[p], offsets[p + 1]
    # Rounded, a view out of focus may cost a unit more than one that is missing. If one view is
    # all that a sample needs it still has that view.
    least[:] = unseen[p] if low == high or len(least) > 1 else np.int64(2**62)
    for q in range(low, high):
        if camera[q] % shots == 0:
            _keep_least(base[q] + focus[p], least)
    return least[-1]


@kernel
def _cost_sharp(p, by_sample, focus, shots, out, least):
    """Return what sample p costs in focus in its best cameras; ``out`` for each view missing.

    Fills the ``least`` costs.
    """
    offsets, camera, base, first, last = by_sample
    least[:] = out
    for q in range(offsets[p], offsets[p + 1]):
        if camera[q] % shots == 0:
            _keep_least(base[q] + (0 if first[q] <= last[q] else focus[p]), least)
    return least.sum()


@parallel_kernel
def most_gains(by_sample, focus, unseen, views, shots, limited, out, most, total):
    """Fill what each sample's views cost out of focus, and the most that they gain.

    Parameters
    ----------
    by_sample : PairsBySample
    focus, unseen : (N,) arrays of int64
        What a view costs more out of focus, and what it costs if it is missing, units.
    views, shots : int
        How many views a sample needs, and how many cameras, one after the other, are one view.
    limited : bool
        Whether pictures are limited: then a sample may have no view at all.
    out : (N,) array of int64
        Becomes the cost of the last of its views with every camera out of focus, or without any.
    most, total : (N,) arrays of int64
        Become the most that one view gains, and that all do.
    """
    for p in prange(len(out)):
        least = np.empty(views, dtype=np.int64)
        out[p] = _cost_out(p, by_sample, focus, unseen, shots, least)
        if limited:
            out[p] = unseen[p]
        total[p] = views * out[p] - _cost_sharp(p, by_sample, focus, shots, out[p], least)
        most[p] = out[p] - least[0]


@parallel_kernel
def count_gains(by_camera, out, counts):
    """Fill ``counts`` (C,): how many of each camera's pairs cost less in focus than ``out``."""
    for c in prange(len(counts)):
        counts[c] = _count_gains(c, by_camera, out)


@kernel
def _count_gains(c, by_camera, out):
    offsets, seen, base, first, last = by_camera
    count = 0
    for j in range(offsets[c], offsets[c + 1]):
        count += (first[j] <= last[j]) & (base[j] < out[seen[j]])
    return count


@parallel_kernel
def list_gains(by_camera, out, gains):
    """Fill by how much those that :func:`count_gains` counted do; their ``offsets`` are given."""
    for c in prange(len(gains.offsets) - 1):
        _list_gains(c, by_camera, out, gains)


@kernel
def _list_gains(c, by_camera, out, gains):
    offsets, seen, base, first, last = by_camera
    at = gains.offsets[c]
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= last[j] and base[j] < out[seen[j]]:
            gains.sample[at], gains.first[at], gains.last[at] = seen[j], first[j], last[j]
            gains.gain[at] = out[seen[j]] - base[j]
            at += 1
