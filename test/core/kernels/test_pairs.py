# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from focus_planner.core import kernels
from testing import reference


def solve(gain_a, gain_b, rectangles, weights, start_a, start_b, floor):
    return kernels.best_pair(
        np.array(gain_a, dtype=np.int64),
        np.array(gain_b, dtype=np.int64),
        np.array(rectangles, dtype=np.int32).reshape(-1, 4),
        np.array(weights, dtype=np.int64),
        len(weights),
        np.int64(start_a),
        np.int64(start_b),
        np.int64(floor),
    )


def value(gain_a, gain_b, rectangles, weights, i, j):
    held = [
        int(w)
        for (i_0, i_1, j_0, j_1), w in zip(rectangles, weights, strict=True)
        if i_0 <= i <= i_1 and j_0 <= j <= j_1
    ]
    return int(gain_a[i]) + int(gain_b[j]) - sum(held)


def check(gain_a, gain_b, rectangles, weights, start_a, start_b, floor):
    most = reference.best_pair(gain_a, gain_b, rectangles, weights)
    gain, i, j = solve(gain_a, gain_b, rectangles, weights, start_a, start_b, floor)
    if most > floor:
        assert gain == most
        assert value(gain_a, gain_b, rectangles, weights, i, j) == most
    else:
        assert (gain, i, j) == (floor, -1, -1)


@st.composite
def ranges(draw, size):
    first = draw(st.integers(0, size - 1))
    return first, draw(st.integers(first, size - 1))


@st.composite
def questions(draw):
    n, m = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    small = st.integers(0, 6)
    gain_a = draw(st.lists(small, min_size=n, max_size=n))
    gain_b = draw(st.lists(small, min_size=m, max_size=m))
    rectangles, weights = [], []
    for _ in range(draw(st.integers(0, 8))):
        rectangles.append((*draw(ranges(n)), *draw(ranges(m))))
        weights.append(draw(st.integers(0, 5)))
    return (
        gain_a,
        gain_b,
        rectangles,
        weights,
        draw(st.integers(0, n - 1)),
        draw(st.integers(0, m - 1)),
        draw(st.integers(-10, 14)),
    )


@settings(max_examples=1000)
@given(questions())
def test_the_best_pair_is_found_or_nothing_exceeds_the_floor(question):
    check(*question)


def test_larger_random_questions():
    random = np.random.default_rng(0)
    for _ in range(1000):
        n, m, count = (int(x) for x in random.integers(1, [40, 40, 40]))
        gain_a, gain_b = random.integers(0, 50, n), random.integers(0, 50, m)
        spans = [np.sort(random.integers(0, size, (count, 2)), axis=1) for size in (n, m)]
        rectangles, weights = np.concatenate(spans, axis=1), random.integers(0, 30, count)
        start = int(random.integers(0, n)), int(random.integers(0, m))
        table = gain_a[:, None] + gain_b[None, :]
        for (i_0, i_1, j_0, j_1), weight in zip(rectangles, weights, strict=True):
            table[i_0 : i_1 + 1, j_0 : j_1 + 1] -= weight
        floor = int(random.choice([-(10**6), table.max() - 1, table.max(), table.max() - 10]))
        gain, i, j = solve(gain_a, gain_b, rectangles, weights, *start, floor)
        if table.max() > floor:
            assert gain == table.max() == table[i, j]
        else:
            assert (gain, i, j) == (floor, -1, -1)


def test_a_search_by_turns_may_stick_where_the_sweep_goes_on():
    # From (0, 0) neither camera alone gains; both together do.
    gain_a, gain_b = [5, 6], [5, 6]
    rectangles, weights = [(1, 1, 0, 0), (0, 0, 1, 1)], [4, 4]
    assert solve(gain_a, gain_b, rectangles, weights, 0, 0, 10) == (12, 1, 1)


def test_only_the_rectangles_that_count_are_looked_at():
    gain, i, j = kernels.best_pair(
        np.array([3, 1], dtype=np.int64),
        np.array([2], dtype=np.int64),
        np.array([[0, 0, 0, 0], [0, 1, 0, 0]], dtype=np.int32),
        np.array([1, 100], dtype=np.int64),
        1,
        np.int64(1),
        np.int64(0),
        np.int64(0),
    )
    assert (gain, i, j) == (4, 0, 0)


def test_sums_as_large_as_all_cost_in_units():
    unit = 2**43
    rectangles = [(0, 1, 0, 1)] * 3
    assert solve([unit, 0], [unit, 7], rectangles, [unit // 4] * 3, 1, 1, 0) == (
        2 * unit - 3 * (unit // 4),
        0,
        0,
    )
