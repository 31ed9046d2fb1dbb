# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Odd-hole cuts: what three cameras that overlap cannot do, though two can (docs/algorithm.md)."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.problem.gains import Gains

# Pairs that are taken less than this, or whole but for this, are in no cycle worth finding; nor is
# a cut that is violated by less.
_PART = 0.08
_VIOLATED = 0.05
# Samples are drawn until there are so many such pairs, and cycles are sought from so many of them:
# from fewer in a graph with so many edges that it would take far longer than price steps do.
_NODES, _SOURCES, _FEWEST_SOURCES = 1500, 400, 20
_EDGES_LOOKED_AT = 16_000_000
# Found cycles have at most so many edges, and so many of the new cuts may share a pair; each cycle
# gives cuts for so many other samples.
_EDGES = 60
_SHARED = 4
_PARALLEL = 30
_ROOM_FOR_EDGES = 400_000
_ROOM_FOR_CUTS = 1000


def no_cuts() -> kernels.CutPool:
    """Return an empty pool."""
    none, offsets = np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64)
    ranges = np.zeros((3, 0), dtype=np.int32)
    return kernels.CutPool(none, offsets, none, offsets, *ranges)


def joined(pool: kernels.CutPool, more: kernels.CutPool) -> kernels.CutPool:
    """Return the cuts of both pools, those of the first one first."""

    def on(offsets: Offsets, others: Offsets) -> Offsets:
        return np.concatenate([offsets, offsets[-1] + others[1:]])

    return kernels.CutPool(
        np.concatenate([pool.limit, more.limit]),
        on(pool.pair_offsets, more.pair_offsets),
        np.concatenate([pool.pair, more.pair]),
        on(pool.range_offsets, more.range_offsets),
        np.concatenate([pool.camera, more.camera]),
        np.concatenate([pool.first, more.first]),
        np.concatenate([pool.last, more.last]),
    )


def chosen(pool: kernels.CutPool, kept: Offsets) -> kernels.CutPool:
    """Return some cuts of a pool, given by ascending number."""

    def part(offsets: Offsets) -> tuple[Offsets, Offsets]:
        counts = np.diff(offsets)[kept]
        ends = np.concatenate([[0], np.cumsum(counts)])
        return ends, np.repeat(offsets[:-1][kept] - ends[:-1], counts) + np.arange(ends[-1])

    pair_offsets, pairs = part(pool.pair_offsets)
    range_offsets, ranges = part(pool.range_offsets)
    return kernels.CutPool(
        pool.limit[kept],
        pair_offsets,
        pool.pair[pairs],
        range_offsets,
        pool.camera[ranges],
        pool.first[ranges],
        pool.last[ranges],
    )


def separate(
    gains: Gains, camera: IntArray, averages: kernels.FractionalPlan, random: Generator
) -> kernels.CutPool:
    """Return cuts that a fractional solution violates: none if none were found.

    Parameters
    ----------
    gains : Gains
    camera : (G,) array of int32
        That of each pair.
    averages : FractionalPlan
        How much of each pair and of each cell is taken, 0 to 1.
    random : Generator
        Draws where to look.
    """
    taken = _torn(gains, averages.held, random)
    fraction = kernels.TornPairs(
        taken,
        averages.held[taken],
        gains.sample[taken],
        camera[taken],
        gains.first[taken],
        gains.last[taken],
        np.concatenate([[0.0], np.cumsum(averages.stands)]),
    )
    graph = _graph(gains, fraction)
    edges = max(len(graph.to), 1)
    most = max(min(_SOURCES, _EDGES_LOOKED_AT // edges), _FEWEST_SOURCES)
    sources = np.arange(len(taken))
    if len(taken) > most:
        sources = random.choice(len(taken), most, replace=False)
    lengths, counts = np.empty(len(sources)), np.zeros(len(sources), dtype=np.int64)
    paths = np.empty((len(sources), _EDGES, 3), dtype=np.int32)
    kernels.odd_cycles(graph, sources, 1.0 - 2.0 * _VIOLATED, lengths, counts, paths)
    room = _room(len(gains.gain))
    kernels.cuts_of_cycles(
        np.argsort(lengths, kind="stable"),
        counts,
        paths,
        _SHARED,
        _VIOLATED / 2,
        _PARALLEL,
        gains.by_camera,
        gains.cell_offsets,
        averages,
        fraction,
        room,
    )
    return _used(room)


def _torn(gains: Gains, held: FloatArray, random: Generator) -> Offsets:
    """Return the pairs that are taken in part: those of samples drawn, if they are many."""
    torn = np.flatnonzero((held > _PART) & (held < 1.0 - _PART))
    if len(torn) <= _NODES:
        return torn
    samples = np.unique(gains.sample[torn])
    drawn = np.zeros(len(gains.most), dtype=bool)
    drawn[random.choice(samples, len(samples) * _NODES // len(torn), replace=False)] = True
    return torn[drawn[gains.sample[torn]]]


def _graph(gains: Gains, fraction: kernels.TornPairs) -> kernels.Graph:
    """Return the short edges between pairs that are taken in part."""
    by_sample = np.argsort(fraction.sample, kind="stable")
    edges, lengths = np.empty((_ROOM_FOR_EDGES, 3), dtype=np.int32), np.empty(_ROOM_FOR_EDGES)
    count = kernels.list_edges(gains.cell_offsets, fraction, by_sample, edges, lengths)
    return kernels.Graph(*kernels.graph_of(len(by_sample), edges[:count], lengths[:count]))


def _room(pairs: int) -> kernels.Room:
    """Return room for new cuts."""
    most = _ROOM_FOR_CUTS
    limit, pair = np.empty(most, dtype=np.int64), np.empty(20 * most, dtype=np.int64)
    offsets = np.zeros((2, most + 1), dtype=np.int64)
    ranges = np.empty((3, 20 * most), dtype=np.int32)
    pool = kernels.CutPool(limit, offsets[0], pair, offsets[1], *ranges)
    return kernels.Room(pool, np.zeros(3, dtype=np.int64), np.zeros(pairs, dtype=np.int32))


def _used(room: kernels.Room) -> kernels.CutPool:
    """Return the cuts that were found."""
    cuts, pairs, ranges = room.counts
    pool = room.pool
    return kernels.CutPool(
        pool.limit[:cuts],
        pool.pair_offsets[: cuts + 1],
        pool.pair[:pairs],
        pool.range_offsets[: cuts + 1],
        *(column[:ranges] for column in (pool.camera, pool.first, pool.last)),
    )
