# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Cuts of odd cycles: which samples and ranges take part (docs/algorithm.md).

A cycle is of pairs that are taken in part. Other samples that the same cameras see, in the same
ranges, give cuts of the same form, often as violated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.local_cuts import CutPool
from focus_planner.core.kernels.odd_cycles import APART, RANGE, SAMPLE, part_taken

_EMPTY = 1e-3  # a cell with less of its camera widens a range for nothing


class Room(NamedTuple):
    """Room for the cuts of a pool; ``counts`` (3,) is how many cuts, pairs and ranges there are.

    ``used`` (G,) counts the cuts of each pair.
    """

    pool: CutPool
    counts: Offsets
    used: IntArray


class _Cycle(NamedTuple):
    """A cycle's sample edges (s, 2), its ranges (r, 3) of a camera, and each node's range."""

    edges: IntArray
    ranges: IntArray
    first: IntArray
    last: IntArray


@kernel
def _widen(c, first, last, cell_offsets, up_to):
    """Return the range with the cells beside it that are hardly taken."""
    start, end = cell_offsets[c], cell_offsets[c + 1]
    while first > 0 and up_to[start + first] - up_to[start + first - 1] < _EMPTY:
        first -= 1
    while start + last + 1 < end and up_to[start + last + 2] - up_to[start + last + 1] < _EMPTY:
        last += 1
    return first, last


@kernel
def _is_simple(path, seen):
    """Return whether every node is in two of a cycle's edges: in one of its sample, one else."""
    for e in range(len(path)):
        for side in range(2):
            seen[path[e, side]] += 1 if path[e, 2] == SAMPLE else 4
    simple = True
    for e in range(len(path)):
        simple &= seen[path[e, 0]] == 5 and seen[path[e, 1]] == 5
    for e in range(len(path)):
        seen[path[e, 0]] = seen[path[e, 1]] = 0
    return simple


@kernel
def _cycle_of(path, cell_offsets, fraction, first, last):
    """Return the cycle of a path; ``first`` and ``last`` (n,) become the ranges of its nodes."""
    edges, ranges = np.empty((len(path), 2), dtype=np.int32), np.empty((2 * len(path), 3), np.int32)
    samples, count = 0, 0
    for e in range(len(path)):
        i, j = path[e, 0], path[e, 1]
        if path[e, 2] == SAMPLE:
            edges[samples, 0], edges[samples, 1] = i, j
            samples += 1
            continue
        for node in (i, j):
            first[node], last[node] = fraction.first[node], fraction.last[node]
        c, low, high = fraction.camera[i], min(first[i], first[j]), max(last[i], last[j])
        common, until = max(first[i], first[j]), min(last[i], last[j])
        if path[e, 2] == APART:
            if common <= until:
                ranges[count, 0], ranges[count, 1], ranges[count, 2] = c, common, until
                count += 1
        elif common <= until:
            low, high = _widen(c, low, high, cell_offsets, fraction.up_to)
            first[i] = first[j] = low
            last[i] = last[j] = high
            ranges[count, 0], ranges[count, 1], ranges[count, 2] = c, low, high
            count += 1
        else:
            for node in (i, j):
                ranges[count, 0], ranges[count, 1] = c, first[node]
                ranges[count, 2] = last[node]
                count += 1
    return _Cycle(edges[:samples], ranges[:count], first, last)


@kernel
def _candidates(i, j, most, cycle, gains, averages, fraction, room, found):
    """Fill the pairs of samples that can take the place of an edge's, the most taken first.

    They are seen by the same cameras, within the cycle's ranges. Returns how many there are.
    """
    offsets, sample, _, first, last = gains
    a, end_a = offsets[fraction.camera[i]], offsets[fraction.camera[i] + 1]
    b, end_b = offsets[fraction.camera[j]], offsets[fraction.camera[j] + 1]
    held, used = averages.held, room.used
    low_a, high_a, low_b, high_b = cycle.first[i], cycle.last[i], cycle.first[j], cycle.last[j]
    worth = np.empty(min(end_a - a, end_b - b))
    both, count = np.empty((len(worth), 2), dtype=np.int64), 0
    while a < end_a and b < end_b:
        if sample[a] < sample[b]:
            a += 1
        elif sample[a] > sample[b]:
            b += 1
        else:
            inside = low_a <= first[a] and last[a] <= high_a
            inside &= low_b <= first[b] and last[b] <= high_b
            if inside and used[a] < most:
                worth[count] = 0.3 * used[a] - held[a] - held[b]
                both[count, 0], both[count, 1] = a, b
                count += 1
            a += 1
            b += 1
    order = np.argsort(worth[:count], kind="mergesort")
    count = min(count, len(found))
    for n in range(count):
        found[n, 0], found[n, 1] = both[order[n], 0], both[order[n], 1]
    return count


@kernel
def _append(pairs, cycle, limit, room):
    """Append a cut; return whether there was room."""
    cuts, at, ranged = room.counts
    pool = room.pool
    fits = cuts < len(pool.limit) and at + len(pairs) <= len(pool.pair)
    if not fits or ranged + len(cycle.ranges) > len(pool.camera):
        return False
    pool.limit[cuts] = limit
    for j in pairs:
        pool.pair[at] = j
        room.used[j] += 1
        at += 1
    for r in range(len(cycle.ranges)):
        pool.camera[ranged], pool.first[ranged] = cycle.ranges[r, 0], cycle.ranges[r, 1]
        pool.last[ranged] = cycle.ranges[r, 2]
        ranged += 1
    pool.pair_offsets[cuts + 1], pool.range_offsets[cuts + 1] = at, ranged
    room.counts[0], room.counts[1], room.counts[2] = cuts + 1, at, ranged
    return True


@kernel
def _cuts_of_cycle(path, most, least, parallel, gains, cell_offsets, averages, fraction, room):
    """Append cuts of one cycle, each with other samples of the same cameras in the same ranges."""
    nodes = len(fraction.pair)
    if not _is_simple(path, np.zeros(nodes, dtype=np.int8)):
        return
    first, last = np.empty((2, nodes), dtype=np.int32)
    cycle = _cycle_of(path, cell_offsets, fraction, first, last)
    odd = 0
    for e in range(len(path)):
        odd += path[e, 2] != RANGE
    limit = odd // 2
    right = float(limit)
    for r in range(len(cycle.ranges)):
        start = cell_offsets[cycle.ranges[r, 0]]
        right += part_taken(fraction.up_to, start, cycle.ranges[r, 1], cycle.ranges[r, 2])
    edges = len(cycle.edges)
    found, counts = np.empty((edges, parallel, 2), dtype=np.int64), np.empty(edges, dtype=np.int64)
    for e in range(edges):
        i, j = cycle.edges[e]
        counts[e] = _candidates(i, j, most, cycle, gains, averages, fraction, room, found[e])
        if counts[e] == 0:
            return
    pairs = np.empty(2 * edges, dtype=np.int64)
    for n in range(counts.max()):
        left = 0.0
        for e in range(edges):
            for side in range(2):
                pairs[2 * e + side] = found[e, n % counts[e], side]
                left += averages.held[pairs[2 * e + side]]
        if left <= right + least or not _append(pairs, cycle, limit, room):
            return


@kernel
def cuts_of_cycles(
    order, counts, paths, most, least, parallel, gains, cell_offsets, averages, fraction, room
):
    """Append cuts of cycles, several of each with samples of the same cameras in the same ranges.

    Parameters
    ----------
    order : (S,) array of int64
        Which cycle comes first.
    counts : (S,) array of int64
    paths : (S, E, 3) array of int32
        As :func:`odd_cycles` fills them.
    most : int
        So many of the new cuts may share a pair.
    least : float
        By how much a cut has to be violated.
    parallel : int
        The most cuts of one cycle.
    gains : GainsByCamera
    cell_offsets : (C + 1,) array of int64
    averages : FractionalPlan
    fraction : TornPairs
    room : Room
    """
    for s in order:
        if counts[s] > 0:
            _cuts_of_cycle(
                paths[s, : counts[s]],
                most,
                least,
                parallel,
                gains,
                cell_offsets,
                averages,
                fraction,
                room,
            )
