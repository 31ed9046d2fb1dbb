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

EMPTY = (np.inf, -np.inf)


@st.composite
def intervals(draw):
    """Intervals over few numbers, so that ends coincide; some empty, some without an end."""
    found = []
    for _ in range(draw(st.integers(0, 12))):
        start = draw(st.integers(1, 12))
        end = draw(st.one_of(st.integers(start, 14), st.just(np.inf)))
        found.append(draw(st.sampled_from([(start, end), (start, end), (start, end), EMPTY])))
    return found


def cells_of(cameras):
    offsets = np.concatenate([[0], np.cumsum([len(part) for part in cameras])]).astype(np.int64)
    flat = np.array(list(itertools.chain(*cameras)), dtype=np.float64).reshape(-1, 2)
    starts, ends = flat[:, 0].copy(), flat[:, 1].copy()
    counts = np.empty(len(cameras), dtype=np.int64)
    near, far = np.empty(len(flat)), np.empty(len(flat))
    by_camera = list(itertools.pairwise(offsets))
    kernels.maximal_cells(
        offsets,
        np.concatenate([np.sort(starts[a:b]) for a, b in by_camera] or [starts]),
        np.concatenate([np.sort(ends[a:b]) for a, b in by_camera] or [ends]),
        counts,
        near,
        far,
    )
    return [
        list(zip(near[a : a + n], far[a : a + n], strict=True))
        for (a, _), n in zip(by_camera, counts, strict=True)
    ]


def held(part, s):
    return frozenset(p for p, (near, far) in enumerate(part) if near <= s <= far)


@settings(max_examples=400)
@given(st.lists(intervals(), min_size=1, max_size=3))
def test_cells_are_the_maximal_sets_held_in_focus(cameras):
    for part, cells in zip(cameras, cells_of(cameras), strict=True):
        sets = {held(part, s) for s in reference.candidates(part)}
        maximal = {a for a in sets if not any(a < b for b in sets)}
        inside = [held(part, near if far == np.inf else (near + far) / 2) for near, far in cells]
        assert set(inside) == maximal
        assert len(inside) == len(maximal)
        for (near, far), (next_near, _) in itertools.pairwise(cells):
            assert near <= far < next_near
        for (near, far), content in zip(cells, inside, strict=True):
            # A cell reaches as far as its content stays in focus.
            assert near == max(part[p][0] for p in content)
            assert far == min(part[p][1] for p in content)


@settings(max_examples=400)
@given(intervals())
def test_ranges_are_the_cells_that_an_interval_contains(part):
    cells = np.array(cells_of([part])[0]).reshape(-1, 2)
    offsets = np.array([0, len(part)], dtype=np.int64)
    ends = np.array(part, dtype=np.float64).reshape(-1, 2)
    first, last = np.empty((2, len(part)), dtype=np.int32)
    kernels.cell_ranges(
        offsets,
        ends[:, 0].copy(),
        ends[:, 1].copy(),
        np.array([0, len(cells)], dtype=np.int64),
        cells[:, 0].copy(),
        cells[:, 1].copy(),
        first,
        last,
    )
    for p, (near, far) in enumerate(part):
        expected = [i for i, cell in enumerate(cells) if near <= cell[0] and cell[1] <= far]
        assert list(range(first[p], last[p] + 1)) == expected
        assert bool(expected) == (near <= far)


@pytest.mark.parametrize("spread", [0.0, 1.0, 12.0], ids=["alike", "even", "over magnitudes"])
def test_ranges_of_many_are_those_that_a_search_finds(spread):
    random = np.random.default_rng(6)
    near = np.unique(10 ** (spread * random.random(300)))
    far = np.concatenate([near[1:], [np.inf]])
    starts = np.concatenate([near, 10 ** (spread * random.random(500)), [0.0, np.inf]])
    ends = np.concatenate([far, 10 ** (spread * random.random(500)), [np.inf, -np.inf]])
    starts, ends = starts[-len(ends) :], ends[-len(starts) :]
    offsets, cells = np.array([0, len(starts)]), np.array([0, len(near)])
    first, last = np.empty((2, len(starts)), dtype=np.int32)
    kernels.cell_ranges(offsets, starts, ends, cells, near, far, first, last)
    np.testing.assert_array_equal(first, np.searchsorted(near, starts, side="left"))
    np.testing.assert_array_equal(last, np.searchsorted(far, ends, side="right") - 1)


def test_what_cannot_be_held_makes_no_cell_of_what_is_held_without_end():
    assert cells_of([[(1.0, np.inf), EMPTY]]) == [[(1.0, np.inf)]]


@pytest.mark.parametrize("part", [[], [EMPTY], [EMPTY, EMPTY]])
def test_nothing_to_hold_makes_no_cell(part):
    assert cells_of([part]) == [[]]
