# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tuples of cameras to optimise jointly, and batches of tuples that may move at the same time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Grid

# Without a grid, each camera is paired with as many others as it would have neighbours on one. On
# bodies, more took longer and came no closer to the optimum.
_NEIGHBOURS_PER_CAMERA = 4
# Counting for all pairs of cameras at once would need gigabytes for ten thousand cameras.
_ROWS_AT_ONCE = 1024
# Work between two calls of ``keep_going``: about 20 ms.
_PAIRS_BETWEEN_CHECKS = 1_000_000
_LISTED_BETWEEN_CHECKS = 400_000


class Abandoned(Exception):  # noqa: N818 - nothing went wrong
    """The search for tuples was stopped by ``keep_going``."""


@dataclass(frozen=True, eq=False)
class _Graph:
    """Camera c's neighbours are ``neighbours[offsets[c]:offsets[c + 1]]``."""

    offsets: Offsets
    neighbours: IntArray

    def edges(self) -> NDArray[np.int64]:
        """Return (E, 2) each pair of neighbours once, the lower camera first, ascending."""
        a = np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))
        both = np.stack([a, self.neighbours], axis=1)
        return both[both[:, 0] < both[:, 1]]


@dataclass(frozen=True, eq=False)
class _Overlap(_Graph):
    """The graph of cameras that see a common sample; ``common`` tells of each edge how many."""

    common: Offsets


def camera_tuples(
    problem: Problem,
    k: int,
    scope: str,
    grid: Grid | None,
    keep_going: Callable[[], bool] = lambda: True,
    rings: int = 1,
) -> kernels.CameraTuples:
    """Return the k-tuples of cameras to optimise jointly: connected sets of k neighbours.

    Neighbours are those on the grid, at most ``rings`` of its edges apart. Without a grid, each
    camera's neighbours are those with which it shares most samples. Cameras that cannot hold any
    sample in focus are left out. With several shots per camera, the shots of one camera are
    neighbours, and so are the i-th shots of neighbouring cameras.

    Parameters
    ----------
    problem : Problem
    k : int
        2 or 3.
    scope : {"all", "assigned"}
        Which tuples influence each other, and so go into different batches: with "assigned" those
        that share a camera (the paper's independent sets), with "all" those that see a common
        sample.
    grid : Grid, optional
    keep_going : callable
        Called about every 20 ms, by the work done; return False to stop.
    rings : int
        At least 1; used only with a grid.

    Raises
    ------
    Abandoned
        If ``keep_going`` returned False.
    """
    overlap = _overlaps(problem, keep_going)
    shots = problem.shots
    edges = _overlap_edges(overlap, shots) if grid is None else _grid_pairs(grid, rings)
    graph = _graph(problem.camera_count, _shot_edges(edges, problem.camera_count, shots))
    cameras = graph.edges() if k == 2 else _triples(graph)
    cell_counts = np.diff(problem.cells.offsets)
    cameras = cameras[(cell_counts[cameras] > 0).all(axis=1)]
    if k == 3:
        fewest_last = np.argsort(-cell_counts[cameras], axis=1, kind="stable")
        cameras = np.take_along_axis(cameras, fewest_last, axis=1)
    reach = overlap.offsets if scope == "all" else np.zeros_like(overlap.offsets)
    colours = kernels.colour(cameras, reach, overlap.neighbours)
    batched = cameras[np.argsort(colours, kind="stable")].astype(np.int32)
    batch_offsets = np.concatenate([[0], np.cumsum(np.bincount(colours))])
    return _with_shared_samples(problem, overlap, batched, batch_offsets, keep_going)


def tuples_one_by_one(problem: Problem, cameras: IntArray) -> kernels.CameraTuples:
    """Return these tuples, (T, k) cameras with cells, each a batch of its own."""
    overlap, batch_offsets = _overlaps(problem, lambda: True), np.arange(len(cameras) + 1)
    alone = cameras.astype(np.int32)
    return _with_shared_samples(problem, overlap, alone, batch_offsets, lambda: True)


def _overlaps(problem: Problem, keep_going: Callable[[], bool]) -> _Overlap:
    """Return which cameras see common samples, and how many."""
    cameras, offsets = problem.camera_count, problem.camera_offsets
    seeing = len(problem.camera_index) / problem.sample_count
    work = np.diff(offsets) * (seeing / 2)
    rows, later, common = [], [], []
    for low, high in _chunks(work, _PAIRS_BETWEEN_CHECKS, keep_going, _ROWS_AT_ONCE):
        counts = np.empty((high - low, cameras), dtype=np.int32)
        sharing = kernels.count_common(
            problem.pairs_by_camera, problem.camera_pairs, problem.pairs_by_sample, low, counts
        )
        rows.append(sharing)
        row_offsets = _offsets(sharing)
        later.append(np.empty(row_offsets[-1], dtype=np.int32))
        common.append(np.empty(row_offsets[-1], dtype=np.int64))
        kernels.list_common(low, counts, row_offsets, later[-1], common[-1])
    return _both_ways(_offsets(np.concatenate(rows)), np.concatenate(later), np.concatenate(common))


def _both_ways(later_offsets: Offsets, later: IntArray, of_later: Offsets) -> _Overlap:
    """Return the graph given the neighbours that come later than each camera, and their counts."""
    degrees = np.diff(later_offsets) + np.bincount(later, minlength=len(later_offsets) - 1)
    offsets = _offsets(degrees)
    neighbours, common = np.empty(offsets[-1], dtype=np.int32), np.empty(offsets[-1], np.int64)
    kernels.list_both_ways(later_offsets, later, of_later, offsets, neighbours, common)
    return _Overlap(offsets, neighbours, common)


def _offsets(counts: Offsets) -> Offsets:
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])


def _overlap_edges(overlap: _Overlap, shots: int) -> NDArray[np.int64]:
    """Return (E, 2) each of the rig's cameras with those that it shares most samples with."""
    if shots > 1:
        overlap = _of_first_shots(overlap, shots)
    found = kernels.strongest(
        overlap.offsets, overlap.neighbours, overlap.common, _NEIGHBOURS_PER_CAMERA
    )
    camera, place = np.nonzero(found >= 0)
    return np.stack([camera, found[camera, place]], axis=1)


def _of_first_shots(overlap: _Overlap, shots: int) -> _Overlap:
    """Return the same of the rig's cameras: of the first shot of each."""
    cameras = len(overlap.offsets) - 1
    a = np.repeat(np.arange(cameras), np.diff(overlap.offsets))
    first = (a % shots == 0) & (overlap.neighbours % shots == 0)
    offsets = _offsets(np.bincount(a[first] // shots, minlength=cameras // shots))
    neighbours = overlap.neighbours[first] // np.int32(shots)
    return _Overlap(offsets, neighbours, overlap.common[first])


def _shot_edges(edges: NDArray[np.int64], cameras: int, shots: int) -> NDArray[np.int64]:
    """Return (E, 2) the edges between shots that follow from edges between cameras.

    Joining each shot with every shot of the neighbours took longer and gained a few hundredths of
    a percent at most.
    """
    alike = edges[:, None] * shots + np.arange(shots)[None, :, None]
    own = np.array(list(combinations(range(shots), 2)), dtype=np.int64).reshape(-1, 2)
    of_each = np.arange(0, cameras, shots)[:, None, None] + own
    return np.concatenate([alike.reshape(-1, 2), of_each.reshape(-1, 2)])


def _grid_pairs(grid: Grid, rings: int) -> NDArray[np.int64]:
    """Return (E, 2) the pairs of cameras that are at most ``rings`` edges of the grid apart."""
    index = np.arange(grid.rows * grid.columns).reshape(grid.rows, grid.columns)
    found = []
    for up in range(min(rings, grid.rows - 1) + 1):
        lower, upper = index[: grid.rows - up], index[up:]
        for around in range(up - rings, rings - up + 1):
            turned = np.roll(upper, -around, axis=1)
            found.append(np.stack([lower.ravel(), turned.ravel()], axis=1))
    return np.concatenate(found)


def _graph(cameras: int, edges: NDArray[np.int64]) -> _Graph:
    """Return the graph of these edges in both directions, without duplicates and loops."""
    edges = edges[edges[:, 0] != edges[:, 1]]
    a, b = edges.T
    camera, neighbour = np.divmod(
        np.unique(np.concatenate([a, b]) * cameras + np.concatenate([b, a])), cameras
    )
    return _Graph(_offsets(np.bincount(camera, minlength=cameras)), neighbour.astype(np.int32))


def _triples(graph: _Graph) -> NDArray[np.int64]:
    """Return (T, 3) each set of a camera and two of its neighbours once, sorted."""
    found = [
        (camera, *pair)
        for camera, (low, high) in enumerate(pairwise(graph.offsets))
        for pair in combinations(graph.neighbours[low:high].tolist(), 2)
    ]
    return np.unique(np.sort(np.array(found, dtype=np.int64).reshape(-1, 3), axis=1), axis=0)


def _chunks(
    work: NDArray[np.float64],
    most_work: float,
    keep_going: Callable[[], bool],
    most: int | None = None,
) -> Iterator[tuple[int, int]]:
    """Yield ranges of items with at most ``most_work`` in all; call ``keep_going`` in between."""
    until = np.cumsum(work)
    low = 0
    while low < len(work):
        before = until[low - 1] if low else 0.0
        high = max(low + 1, int(np.searchsorted(until, before + most_work, side="right")))
        high = min(high, low + most) if most else high
        yield low, high
        low = high
        if low < len(work) and not keep_going():
            raise Abandoned


def _with_shared_samples(
    problem: Problem,
    overlap: _Overlap,
    cameras: IntArray,
    batch_offsets: Offsets,
    keep_going: Callable[[], bool],
) -> kernels.CameraTuples:
    pairs = problem.pairs_by_camera
    offsets = np.zeros(len(cameras) + 1, dtype=np.int64)
    work = np.diff(pairs.offsets)[cameras].sum(axis=1).astype(np.float64)
    parts = partial(_chunks, work, _LISTED_BETWEEN_CHECKS, keep_going)
    for low, high in parts():
        offsets[low + 1 : high + 1] = _shared_counts(problem, overlap, cameras[low:high])
    offsets = np.cumsum(offsets)
    shape = (int(offsets[-1]), cameras.shape[1])
    tuples = kernels.CameraTuples(
        cameras=cameras,
        batch_offsets=batch_offsets,
        shared_offsets=offsets,
        samples=np.empty(shape[0], dtype=np.int32),
        bases=np.empty(shape, dtype=np.int64),
        firsts=np.empty(shape, dtype=np.int32),
        lasts=np.empty(shape, dtype=np.int32),
    )
    for low, high in parts():
        kernels.list_shared(tuples, low, high, pairs)
    return tuples


def _shared_counts(problem: Problem, overlap: _Overlap, cameras: IntArray) -> Offsets:
    """Return (T,) how many samples at least two cameras of each tuple see."""
    counts: Offsets
    if cameras.shape[1] == 2:
        counts = kernels.count_of_pairs(
            cameras, overlap.offsets, overlap.neighbours, overlap.common
        )
    else:
        pairs = problem.pairs_by_camera
        counts = kernels.count_shared(cameras, pairs.offsets, pairs.sample)
    return counts
