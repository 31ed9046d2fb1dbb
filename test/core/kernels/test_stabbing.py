# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Brackets against all choices of cells there are."""

import itertools

import numpy as np

from focus_planner.core.kernels.stabbing import (
    Intervals,
    best_cells,
    best_cells_of_each,
    best_with_each,
)


def random_intervals(random, cells, count):
    """Intervals of which some come twice, the second time with a weight below 0 but not lower."""
    ends = np.sort(random.integers(0, cells, (count, 2)), axis=1)
    weight = random.integers(0, 6, count)
    twice = random.random(count) < 0.4
    ends = np.concatenate([ends, ends[twice]])
    taken = (weight[twice] * random.random(int(twice.sum()))).astype(np.int64)
    order = random.permutation(len(ends))
    first, last = ends[order].T.astype(np.int32)
    weights = np.concatenate([weight, -taken])[order]
    return Intervals(first.copy(), last.copy(), weights)


def random_ranges(random, cells, shots):
    """Ascending first and last cells of each shot; at times all cells."""
    while True:
        low, high = np.sort(random.integers(0, cells, (2, shots)), axis=1).astype(np.int32)
        if random.random() < 0.4:
            low[:], high[:] = 0, cells - 1
        if (low <= high).all():
            return low, high


def held(intervals, cells):
    """The sum of the weights of the intervals that hold any of the cells."""
    return sum(
        int(weight)
        for first, last, weight in zip(*intervals, strict=True)
        if any(first <= cell <= last for cell in cells)
    )


def test_of_all_ascending_cells_the_best_are_found():
    random, several = np.random.default_rng(0), 0
    for _ in range(1500):
        cells, shots = int(random.integers(1, 8)), int(random.integers(1, 5))
        intervals = random_intervals(random, cells, int(random.integers(0, 15)))
        low, high = random_ranges(random, cells, shots)
        chosen, each = np.empty(shots, dtype=np.int32), np.empty((shots, cells), dtype=np.int64)
        value = best_cells(intervals, low, high, cells, chosen)
        best_with_each(intervals, low, high, each)
        assert (np.diff(chosen) >= 0).all()
        assert (low <= chosen).all()
        assert (chosen <= high).all()
        expected = np.full((shots, cells), -1)
        ranges = (range(a, b + 1) for a, b in zip(low, high, strict=True))
        for some in itertools.product(*ranges):
            if list(some) == sorted(some):
                places = np.arange(shots), np.array(some)
                expected[places] = np.maximum(expected[places], held(intervals, some))
        np.testing.assert_array_equal(each, expected)
        assert value == held(intervals, chosen) == expected.max()
        several += len(set(chosen.tolist())) > 1
    assert several > 300


def test_of_any_number_of_cells_the_best_are_found_and_each_adds_less():
    random, falling = np.random.default_rng(2), 0
    for _ in range(800):
        cells, shots = int(random.integers(1, 8)), int(random.integers(1, 5))
        intervals = random_intervals(random, cells, int(random.integers(0, 15)))
        values, chosen = np.empty(shots, dtype=np.int64), np.empty((shots, shots), dtype=np.int32)
        best_cells_of_each(intervals, cells, values, chosen)
        for k in range(1, shots + 1):
            sets = itertools.combinations_with_replacement(range(cells), k)
            assert values[k - 1] == max(held(intervals, some) for some in sets)
            assert held(intervals, chosen[k - 1, :k]) == values[k - 1]
            assert (np.diff(chosen[k - 1, :k]) >= 0).all()
        added = np.diff([0, *values])
        assert (np.diff(added) <= 0).all()
        falling += shots > 2 and added[0] > added[1] > added[2] > 0
    assert falling > 50


def test_among_many_cells_the_best_are_found():
    random = np.random.default_rng(1)
    for shots in (2, 3, 4):
        intervals = random_intervals(random, 200, 600)
        # f_k(j) = max over i ≤ j of f_{k-1}(i) + W(i, j), as it is written.
        first, last, weight = intervals
        holds = (first[:, None] <= np.arange(200)) & (np.arange(200) <= last[:, None])
        best = weight @ holds
        added = (weight[:, None] * holds).T @ ~holds  # (j, i)
        for _ in range(shots - 1):
            best = np.where(np.tri(200, dtype=bool), best + added, -1).max(axis=1)
        chosen = np.empty(shots, dtype=np.int32)
        low = np.zeros(shots, dtype=np.int32)
        value = best_cells(intervals, low, low + np.int32(199), 200, chosen)
        assert value == best.max() == held(intervals, chosen)
