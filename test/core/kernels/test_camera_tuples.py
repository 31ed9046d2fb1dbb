# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focus_planner.core import kernels
from testing import reference
from testing.problems import random_problem


def offsets_of(parts):
    return np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)


def conflict(a, b, neighbours):
    return any(c == d or d in neighbours[c] for c in a for d in b)


@settings(max_examples=200)
@given(st.integers(0, 2**32), st.integers(2, 12), st.integers(2, 3), st.floats(0, 1))
def test_tuples_of_one_colour_do_not_reach_each_other(seed, cameras, k, density):
    random = np.random.default_rng(seed)
    upper = np.triu(random.random((cameras, cameras)) < density, 1)
    neighbours = [np.flatnonzero(row) for row in upper | upper.T]
    all_tuples = list(itertools.combinations(range(cameras), k))
    tuples = np.array([t for t in all_tuples if random.random() < 0.5], dtype=np.int64)
    reach = np.concatenate([*neighbours, []]).astype(np.int32)
    colours = kernels.colour(tuples.reshape(-1, k), offsets_of(neighbours), reach)
    sets = [set(n.tolist()) for n in neighbours]
    for i, j in itertools.combinations(range(len(tuples)), 2):
        if colours[i] == colours[j]:
            assert not conflict(tuples[i], tuples[j], sets)
    # Greedy: a tuple has the first colour that none before it that it reaches has.
    for j in range(len(tuples)):
        taken = {colours[i] for i in range(j) if conflict(tuples[i], tuples[j], sets)}
        assert colours[j] == min(set(range(len(taken) + 1)) - taken)


def test_more_colours_than_one_word_or_four():
    # All 20 · 19 / 2 pairs reach each other: as many colours.
    tuples = np.array(list(itertools.combinations(range(26), 2)), dtype=np.int64)
    everyone = [np.array([d for d in range(26) if d != c]) for c in range(26)]
    colours = kernels.colour(
        tuples, offsets_of(everyone), np.concatenate(everyone).astype(np.int32)
    )
    np.testing.assert_array_equal(colours, np.arange(325))


@pytest.mark.parametrize(("cameras", "share"), [(1, 0.5), (3, 0.02), (6, 0.3), (40, 0.9)])
def test_common_samples_are_counted(cameras, share):
    problem = random_problem(3, 30, cameras, share=share)
    counts = np.full((cameras, cameras), -1, dtype=np.int32)
    middle = cameras // 2  # rows come in blocks
    expected = np.zeros((cameras, cameras))
    for seen in reference.table(problem).seen:
        for c, d in itertools.combinations(sorted(seen), 2):
            expected[c, d] += 1
    for rows, low in ((counts[:middle], 0), (counts[middle:], middle)):
        sharing = kernels.count_common(
            problem.pairs_by_camera, problem.camera_pairs, problem.pairs_by_sample, low, rows
        )
        np.testing.assert_array_equal(sharing, np.count_nonzero(rows, axis=1))
        offsets = np.concatenate([[0], np.cumsum(sharing)])
        later, common = np.empty(offsets[-1], np.int32), np.empty(offsets[-1], np.int64)
        kernels.list_common(low, rows, offsets, later, common)
        row, column = np.nonzero(rows)
        np.testing.assert_array_equal(later, column)
        np.testing.assert_array_equal(common, rows[row, column])
    np.testing.assert_array_equal(counts, expected)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.7])
def test_edges_are_listed_both_ways_in_order(share):
    random = np.random.default_rng(5)
    upper = np.triu(random.integers(1, 9, (9, 9)) * (random.random((9, 9)) < share), 1)
    both = upper + upper.T
    row, later = np.nonzero(upper)
    later_offsets = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=9))])
    offsets = np.concatenate([[0], np.cumsum(np.count_nonzero(both, axis=1))])
    neighbours, common = np.empty(offsets[-1], np.int32), np.empty(offsets[-1], np.int64)
    kernels.list_both_ways(
        later_offsets, later.astype(np.int32), upper[row, later], offsets, neighbours, common
    )
    row, column = np.nonzero(both)
    np.testing.assert_array_equal(neighbours, column)
    np.testing.assert_array_equal(common, both[row, column])


@pytest.mark.parametrize("k", [2, 3])
def test_shared_samples_are_those_that_two_cameras_see(k):
    problem = random_problem(4, 40, 5, share=0.4)
    cells, table = problem.cells, reference.table(problem)
    tuples = np.array(list(itertools.permutations(range(5), k)), dtype=np.int32)
    counts = kernels.count_shared(tuples, problem.camera_offsets, cells.seen)
    expected = [
        [p for p, seen in enumerate(table.seen) if sum(c in seen for c in members) > 1]
        for members in tuples.tolist()
    ]
    assert counts.tolist() == [len(samples) for samples in expected]
    offsets = offsets_of(expected)
    samples = np.empty(offsets[-1], dtype=np.int32)
    bases = np.empty((offsets[-1], k), dtype=np.int64)
    firsts, lasts = np.empty((2, offsets[-1], k), dtype=np.int32)
    batches = np.array([0, len(tuples)])
    listed = kernels.CameraTuples(tuples, batches, offsets, samples, bases, firsts, lasts)
    middle = len(tuples) // 3  # tuples come in parts
    for low, high in ((0, middle), (middle, len(tuples))):
        kernels.list_shared(listed, low, high, problem.pairs_by_camera)
    assert samples.tolist() == list(itertools.chain(*expected))
    pair = {
        (p, c): q
        for q, (p, c) in enumerate(zip(problem.sample_index, problem.camera_index, strict=True))
    }
    for t, members in enumerate(tuples.tolist()):
        for e in range(offsets[t], offsets[t + 1]):
            for m, c in enumerate(members):
                q = pair.get((samples[e], c))
                if q is None:
                    assert bases[e, m] == kernels.NEVER
                    assert firsts[e, m] > lasts[e, m]
                else:
                    assert (bases[e, m], firsts[e, m], lasts[e, m]) == (
                        cells.base[q],
                        cells.first[q],
                        cells.last[q],
                    )


def test_common_samples_of_pairs_are_looked_up():
    offsets = np.array([0, 2, 3, 4, 4])
    neighbours, common = np.array([1, 2, 0, 0], dtype=np.int32), np.array([5, 7, 5, 7])
    pairs = np.array([[0, 1], [1, 0], [0, 2], [1, 2], [3, 0], [0, 3]], dtype=np.int32)
    counts = kernels.count_of_pairs(pairs, offsets, neighbours, common)
    assert counts.tolist() == [5, 5, 7, 0, 0, 0]
