# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which cameras are worth moving together, and which tuples can move at the same time."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel

#: More than any sample's cost, in units: the cost with a camera that does not see it.
NEVER = np.int64(2**44)


@parallel_kernel
def count_common(by_camera, camera_pairs, by_sample, low, counts):
    """Fill ``counts`` (B, C): how many samples camera ``low + row`` and each later one both see.

    ``camera_pairs`` (P,) are the indices of each camera's pairs among those by sample. Returns (B,)
    with how many later cameras each shares a sample.
    """
    sharing = np.empty(len(counts), dtype=np.int64)
    for row in prange(len(counts)):
        _count_common(low + row, by_camera, camera_pairs, by_sample, counts[row])
        sharing[row] = np.count_nonzero(counts[row])
    return sharing


@kernel
def _count_common(c, by_camera, camera_pairs, by_sample, counts):
    """Count the samples that camera c and each later one both see."""
    seen, camera, sample_offsets = by_camera.sample, by_sample.camera, by_sample.offsets
    counts[:] = 0
    for j in range(by_camera.offsets[c], by_camera.offsets[c + 1]):
        for q in range(camera_pairs[j] + 1, sample_offsets[seen[j] + 1]):
            counts[camera[q]] += 1


@parallel_kernel
def list_common(low, counts, offsets, cameras, common):
    """List the later cameras that share samples with camera ``low + row``, and how many.

    ``counts`` are as :func:`count_common` fills them; row r's are written from ``offsets[r]`` on.
    """
    for row in prange(len(counts)):
        _list_common(low + row + 1, counts[row], cameras[offsets[row] :], common[offsets[row] :])


@kernel
def _list_common(low, counts, cameras, common):
    """List the cameras, from number ``low`` on, that are counted, and how often."""
    at = 0
    # Neighbours have neighbouring numbers, so these branches are guessed well.
    for camera in range(low, len(counts)):
        if counts[camera] > 0:
            cameras[at], common[at] = camera, counts[camera]
            at += 1


@kernel
def list_both_ways(later_offsets, later, of_later, offsets, neighbours, common):
    """List the neighbours of each camera, ascending, given those that come later than it.

    ``of_later`` is what is to be told of each edge; it goes to ``common``.
    """
    at = offsets[:-1].copy()
    for c in range(len(later_offsets) - 1):
        for j in range(later_offsets[c], later_offsets[c + 1]):
            d = later[j]
            neighbours[at[c]], common[at[c]] = d, of_later[j]
            neighbours[at[d]], common[at[d]] = c, of_later[j]
            at[c] += 1
            at[d] += 1


@parallel_kernel
def strongest(offsets, neighbours, shared, most):
    """Return (C, most) the neighbours that share most samples with each camera, -1 beyond the last.

    Ties go to the first.
    """
    cameras = len(offsets) - 1
    found = np.full((cameras, most), -1, dtype=np.int32)
    for c in prange(cameras):
        weights = np.zeros(most, dtype=np.int64)
        for j in range(offsets[c], offsets[c + 1]):
            at = most
            while at > 0 and shared[j] > weights[at - 1]:
                at -= 1
                if at + 1 < most:
                    weights[at + 1], found[c, at + 1] = weights[at], found[c, at]
            if at < most:
                weights[at], found[c, at] = shared[j], neighbours[j]
    return found


@kernel
def colour(tuples, reach_offsets, reach):
    """Return a colour per tuple such that tuples of one colour do not reach each other.

    A tuple reaches its cameras and, for each of them, ``reach[reach_offsets[c] : ...]``, which
    reach it too. Greedy, in the tuples' order: each takes the first free colour.
    """
    words = 4
    # The colours, a bit each, that tuples with a given camera cannot have any more.
    barred = np.zeros((words, len(reach_offsets) - 1), dtype=np.uint64)
    colours = np.empty(len(tuples), dtype=np.int32)
    for t in range(len(tuples)):
        found = _first_free(tuples[t], barred)
        if found == 64 * words:
            barred = np.concatenate((barred, np.zeros_like(barred)))
            words *= 2
        barred_here, bit = barred[found >> 6], np.uint64(1) << np.uint64(found & 63)
        for c in tuples[t]:
            barred_here[c] |= bit
            for d in reach[reach_offsets[c] : reach_offsets[c + 1]]:
                barred_here[d] |= bit
        colours[t] = found
    return colours


@kernel
def _first_free(members, barred):
    """Return the first colour that is barred to none of some cameras."""
    for word in range(len(barred)):
        taken = np.uint64(0)
        for c in members:
            taken |= barred[word, c]
        if taken != ~np.uint64(0):
            found = 64 * word
            while taken & np.uint64(1):
                taken >>= np.uint64(1)
                found += 1
            return found
    return 64 * len(barred)


@parallel_kernel
def count_of_pairs(pairs, offsets, neighbours, common):
    """Return (T,) how many samples both cameras of each pair (T, 2) see.

    ``common`` has it for each of a camera's ``neighbours``, which are ascending.
    """
    counts = np.zeros(len(pairs), dtype=np.int64)
    for t in prange(len(pairs)):
        own = slice(offsets[pairs[t, 0]], offsets[pairs[t, 0] + 1])
        at = np.searchsorted(neighbours[own], pairs[t, 1])
        if at < len(neighbours[own]) and neighbours[own][at] == pairs[t, 1]:
            counts[t] = common[own][at]
    return counts


@kernel
def _next_sample(members, offsets, seen, heads):
    """Return the least sample at the heads of the members' lists, -1 at their ends."""
    least = -1
    for m in range(len(members)):
        if heads[m] < offsets[members[m] + 1]:
            p = seen[heads[m]]
            if least < 0 or p < least:
                least = p
    return least


@parallel_kernel
def count_shared(cameras, offsets, seen):
    """Return (T,) how many samples at least two cameras of each tuple see.

    ``cameras`` (T, k) are the tuples, ``offsets`` and ``seen`` the pairs' samples by camera.
    """
    counts = np.zeros(len(cameras), dtype=np.int64)
    for t in prange(len(cameras)):
        counts[t] = _count_shared(cameras[t], offsets, seen)
    return counts


@kernel
def _count_shared(members, offsets, seen):
    """Count what at least two of several cameras share."""
    heads, count = offsets[members], 0
    p = _next_sample(members, offsets, seen, heads)
    while p >= 0:
        seeing = 0
        for m in range(len(members)):
            if heads[m] < offsets[members[m] + 1] and seen[heads[m]] == p:
                heads[m] += 1
                seeing += 1
        if seeing > 1:
            count += 1
        p = _next_sample(members, offsets, seen, heads)
    return count


@kernel
def _list_of_pair(t, tuples, by_camera):
    """Fill the samples that the two cameras of tuple t share.

    Where they are is found first, without branches to guess: few of the steps find one.
    """
    offsets, seen, base, first, last = by_camera
    samples, bases = tuples.samples, tuples.bases
    firsts, lasts = tuples.firsts, tuples.lasts
    begin = tuples.shared_offsets[t]
    count = tuples.shared_offsets[t + 1] - begin
    of_a, of_b = np.empty((2, count), dtype=np.int64)
    i, j, found = offsets[tuples.cameras[t, 0]], offsets[tuples.cameras[t, 1]], 0
    while found < count:
        p, q = seen[i], seen[j]
        of_a[found], of_b[found] = i, j
        found += p == q
        i += p <= q
        j += q <= p
    for n in range(count):
        i, j, at = of_a[n], of_b[n], begin + n
        samples[at] = seen[i]
        bases[at, 0], bases[at, 1] = base[i], base[j]
        firsts[at, 0], firsts[at, 1] = first[i], first[j]
        lasts[at, 0], lasts[at, 1] = last[i], last[j]


@kernel
def _list_of_many(t, tuples, by_camera):
    """Fill the samples that at least two of the several cameras of tuple t share."""
    offsets, seen, base, first, last = by_camera
    bases, firsts, lasts = tuples.bases, tuples.firsts, tuples.lasts
    members, at = tuples.cameras[t], tuples.shared_offsets[t]
    heads = offsets[members]
    while at < tuples.shared_offsets[t + 1]:
        p = _next_sample(members, offsets, seen, heads)
        seeing = 0
        for m in range(len(members)):
            j = heads[m]
            if j < offsets[members[m] + 1] and seen[j] == p:
                bases[at, m], firsts[at, m], lasts[at, m] = base[j], first[j], last[j]
                heads[m] += 1
                seeing += 1
            else:
                bases[at, m], firsts[at, m], lasts[at, m] = NEVER, 1, 0
        if seeing > 1:
            tuples.samples[at] = p
            at += 1


@parallel_kernel
def list_shared(tuples, low, high, by_camera):
    """Fill the samples that tuples ``low`` to ``high`` share, and what they are to each camera.

    There are as many as :func:`count_shared` returned. A camera that does not see the sample gets
    the base cost ``NEVER`` and an empty range.
    """
    pairs = tuples.cameras.shape[1] == 2
    for t in prange(low, high):
        if pairs:
            _list_of_pair(t, tuples, by_camera)
        else:
            _list_of_many(t, tuples, by_camera)
