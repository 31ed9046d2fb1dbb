# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Odd cycles that a fractional solution violates, by shortest paths (docs/algorithm.md).

The nodes of a graph are pairs (sample, camera) that are taken in part. An edge joins two that
cannot both be taken whole, or only if the camera stands in some range of cells:

- of one sample: x_i + x_j ≤ 1;
- of one camera, in ranges with the common cells U: x_i + x_j ≤ 1 + 2 Y(U), without Y if there are
  none;
- of one camera: x_i + x_j ≤ 2 Y(U), where U holds both their ranges.

Half the sum of these over a cycle, with an odd number of edges of the first two kinds, has whole
numbers on its left and a half on its right, which can be rounded off. What an edge lacks is its
length: a cycle shorter than 1 is violated. It is a shortest path from a node to itself that changes
sides an odd number of times.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.local_cuts import CutPool

#: Kinds of edges.
_SAMPLE, _APART, _RANGE = 0, 1, 2
_SHORT = 0.6  # longer edges are in no cycle worth finding
_LENGTHENED = 1e-4  # of equal cycles, the one with fewer edges
_EMPTY = 1e-3  # a cell with less of its camera widens a range for nothing
_FAR = 1e9
_MOST_EDGES = 60


class TornPairs(NamedTuple):
    """A fractional solution, and the n pairs that it takes in part.

    ``pair`` (n,) are their places among all, ascending, and ``held`` (n,) how much of them is
    taken; ``sample``, ``camera``, ``first`` and ``last`` (n,) are theirs. ``up_to`` (M + 1,) is how
    much of the cells before each is taken.
    """

    pair: Offsets
    held: FloatArray
    sample: IntArray
    camera: IntArray
    first: IntArray
    last: IntArray
    up_to: FloatArray


class Graph(NamedTuple):
    """Edges from node i: ``offsets[i]`` to ``offsets[i + 1]``."""

    offsets: Offsets
    to: IntArray
    length: FloatArray
    kind: IntArray


@kernel
def _part(up_to, start, first, last):
    """Return how much of a range's cells is taken; 0 for none."""
    return up_to[start + last + 1] - up_to[start + first] if first <= last else 0.0


@kernel
def _edge(i, j, cell_offsets, fraction):
    """Return the lengths of the edges between two pairs of one camera, apart and in a range."""
    start = cell_offsets[fraction.camera[i]]
    a, b = fraction.first[i], fraction.last[i]
    c, d = fraction.first[j], fraction.last[j]
    both = fraction.held[i] + fraction.held[j]
    common = _part(fraction.up_to, start, max(a, c), min(b, d))
    union = _part(fraction.up_to, start, a, b) + _part(fraction.up_to, start, c, d) - common
    return 1.0 + 2.0 * common - both, 2.0 * union - both


@kernel
def _add(i, j, length, kind, edges, lengths, count):
    """Append an edge if it is short; return the number of edges."""
    if length >= _SHORT or count == len(edges):
        return count
    edges[count, 0], edges[count, 1], edges[count, 2] = i, j, kind
    lengths[count] = max(length, 0.0) + _LENGTHENED
    return count + 1


@kernel
def list_edges(cell_offsets, fraction, order, edges, lengths):
    """List the short edges, those of samples first; return how many there are.

    Parameters
    ----------
    cell_offsets : (C + 1,) array of int64
    fraction : TornPairs
    order : (n,) array of int64
        The nodes by sample.
    edges : (E, 3) array of int32
        Room for two nodes and a kind each; what finds none is left out.
    lengths : (E,) array
    """
    held, sample, camera = fraction.held, fraction.sample, fraction.camera
    count, nodes = 0, len(order)
    for a in range(nodes):
        i, b = order[a], a + 1
        while b < nodes and sample[order[b]] == sample[i]:
            j = order[b]
            count = _add(i, j, 1.0 - held[i] - held[j], _SAMPLE, edges, lengths, count)
            b += 1
    for i in range(nodes):
        j = i + 1
        while j < nodes and camera[j] == camera[i]:
            apart, ranged = _edge(i, j, cell_offsets, fraction)
            count = _add(i, j, apart, _APART, edges, lengths, count)
            count = _add(i, j, ranged, _RANGE, edges, lengths, count)
            j += 1
    return count


@kernel
def graph_of(nodes, edges, lengths):
    """Return the graph with these edges in both directions."""
    offsets = np.zeros(nodes + 1, dtype=np.int64)
    for e in range(len(edges)):
        offsets[edges[e, 0] + 1] += 1
        offsets[edges[e, 1] + 1] += 1
    for i in range(nodes):
        offsets[i + 1] += offsets[i]
    at = offsets[:-1].copy()
    to, kind = np.empty((2, offsets[nodes]), dtype=np.int32)
    length = np.empty(offsets[nodes])
    for e in range(len(edges)):
        for side in range(2):
            i, j = edges[e, side], edges[e, 1 - side]
            to[at[i]], kind[at[i]], length[at[i]] = j, edges[e, 2], lengths[e]
            at[i] += 1
    return Graph(offsets, to, length, kind)


class _Search(NamedTuple):
    """Scratch of the search: of 2n nodes, those of the other side after the first n."""

    distance: FloatArray
    before: IntArray
    kind: IntArray
    done: IntArray
    touched: IntArray


@kernel
def _mirrored(node, count):
    """Return the same node on the other side."""
    return node - count if node >= count else node + count


@kernel
def _meet(source, limit, graph, search):
    """Search from a node for a short odd cycle; return where two ways meet, -1 if there is none.

    Also returns the cycle's length, and how many nodes were touched.
    """
    distance, before, kind, done, touched = search
    offsets, to, lengths, kinds = graph
    count = len(offsets) - 1
    heap = [(0.0, source)]
    distance[source], touched[0], found = 0.0, source, 1
    best, where = limit, -1
    while len(heap) > 0:
        so_far, a = heapq.heappop(heap)
        if done[a]:
            continue
        if 2.0 * so_far >= best:
            break
        done[a] = 1
        here = a - count if a >= count else a
        for e in range(offsets[here], offsets[here + 1]):
            b = to[e]
            if (a >= count) == (kinds[e] == _RANGE):
                b += count
            length = so_far + lengths[e]
            if length < distance[b] and length < limit:
                if distance[b] == _FAR:
                    touched[found] = b
                    found += 1
                distance[b], before[b], kind[b] = length, a, kinds[e]
                other = distance[_mirrored(b, count)]
                if other + length < best:
                    best, where = other + length, b
                heapq.heappush(heap, (length, b))
    return where, best, found


@kernel
def _trace(where, count, search, path):
    """Fill a cycle's edges, two nodes and a kind each; return how many, 0 if they are too many."""
    edges = 0
    for side in range(2):
        a = where if side == 0 else _mirrored(where, count)
        while search.before[a] >= 0:
            if edges == len(path):
                return 0
            b = search.before[a]
            path[edges, 0], path[edges, 1] = a % count, b % count
            path[edges, 2] = search.kind[a]
            edges += 1
            a = b
    return edges


@kernel
def odd_cycles(graph, sources, limit, lengths, counts, paths):
    """Find a short odd cycle through each of some nodes.

    Parameters
    ----------
    graph : Graph
    sources : (S,) array of int64
    limit : float
        Longer ones are not looked for.
    lengths : (S,) array
    counts : (S,) array of int64
        Becomes the number of edges of each cycle, 0 where there is none.
    paths : (S, E, 3) array of int32
        Becomes the edges, two nodes and a kind each.
    """
    count = len(graph.offsets) - 1
    search = _Search(
        np.full(2 * count, _FAR),
        np.full(2 * count, -1, dtype=np.int32),
        np.empty(2 * count, dtype=np.int32),
        np.zeros(2 * count, dtype=np.int32),
        np.empty(2 * count, dtype=np.int32),
    )
    for s in range(len(sources)):
        where, lengths[s], found = _meet(sources[s], limit, graph, search)
        counts[s] = _trace(where, count, search, paths[s]) if where >= 0 else 0
        for i in range(found):
            a = search.touched[i]
            search.distance[a], search.before[a], search.done[a] = _FAR, -1, 0


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
            seen[path[e, side]] += 1 if path[e, 2] == _SAMPLE else 4
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
        if path[e, 2] == _SAMPLE:
            edges[samples, 0], edges[samples, 1] = i, j
            samples += 1
            continue
        for node in (i, j):
            first[node], last[node] = fraction.first[node], fraction.last[node]
        c, low, high = fraction.camera[i], min(first[i], first[j]), max(last[i], last[j])
        common, until = max(first[i], first[j]), min(last[i], last[j])
        if path[e, 2] == _APART:
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
        odd += path[e, 2] != _RANGE
    limit = odd // 2
    right = float(limit)
    for r in range(len(cycle.ranges)):
        start = cell_offsets[cycle.ranges[r, 0]]
        right += _part(fraction.up_to, start, cycle.ranges[r, 1], cycle.ranges[r, 2])
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
