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

#: Kinds of edges.
SAMPLE, APART, RANGE = 0, 1, 2
_SHORT = 0.6  # longer edges are in no cycle worth finding
_LENGTHENED = 1e-4  # of equal cycles, the one with fewer edges
_FAR = 1e9


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
def part_taken(up_to, start, first, last):
    """Return how much of a range's cells is taken; 0 for none."""
    return up_to[start + last + 1] - up_to[start + first] if first <= last else 0.0


@kernel
def _edge(i, j, cell_offsets, fraction):
    """Return the lengths of the edges between two pairs of one camera, apart and in a range."""
    start = cell_offsets[fraction.camera[i]]
    a, b = fraction.first[i], fraction.last[i]
    c, d = fraction.first[j], fraction.last[j]
    both = fraction.held[i] + fraction.held[j]
    common = part_taken(fraction.up_to, start, max(a, c), min(b, d))
    union = (
        part_taken(fraction.up_to, start, a, b) + part_taken(fraction.up_to, start, c, d) - common
    )
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
            count = _add(i, j, 1.0 - held[i] - held[j], SAMPLE, edges, lengths, count)
            b += 1
    for i in range(nodes):
        j = i + 1
        while j < nodes and camera[j] == camera[i]:
            apart, ranged = _edge(i, j, cell_offsets, fraction)
            count = _add(i, j, apart, APART, edges, lengths, count)
            count = _add(i, j, ranged, RANGE, edges, lengths, count)
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
            if (a >= count) == (kinds[e] == RANGE):
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
