# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Kernels index as Python does, except that no computed index counts from the end."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numba import prange

from focus_planner.core.kernels import kept
from focus_planner.core.kernels.compiling import Kernel


def compiled(function, *, parallel=False, checked=False):
    options = {"nopython": True, "parallel": parallel, "boundscheck": checked}
    return Kernel(function, targetoptions=options)


def gather(values, table, places):
    last = -1
    total = values[-1] + values[last] + values[-3:].sum() + table[-1, -2]
    for k in range(len(places)):
        p = places[k]
        total += values[p] + table[p, -1] + table[-2, p] + table[p, 0] + table[p, p]
        total += table[p, 1:].sum() + table[:-1, p].sum() + table[p].max() + values[p - 1]
    return total


def scatter(values, table, places):
    for k in prange(3):
        values[places[k]] += table[k, -1]
        table[k, -1] = table[k, places[0]] - 1
    for k in range(len(places)):
        p = places[k]
        values[p] -= 0.5 * values[p - 1]
        table[p, -2] = values[p]
        table[-1, p], table[p, p] = table[p, p], table[-1, p]
        table[p, 2:] = values[p : p + 2]
    values[-1] += 1
    table[-1] *= 2
    return table[-1, -1]


@pytest.mark.parametrize("function", [gather, scatter])
@pytest.mark.parametrize("parallel", [False, True], ids=["on one core", "on all"])
@pytest.mark.parametrize("kind", [np.int32, np.int64, np.uint8, np.uint64])
def test_indexes_mean_what_they_do_in_python(function, parallel, kind):
    random = np.random.default_rng(0)
    values, table = random.random(8), random.random((4, 4))
    places = np.array([2, 1, 3], dtype=kind)
    if kind == np.uint64 and function is scatter:
        places = places.astype(np.int64)  # Python's p + 2 is then a float
    expected = values.copy(), table.copy()
    result = function(*expected, places)
    assert compiled(function, parallel=parallel)(values, table, places) == pytest.approx(
        result, rel=1e-14
    )
    np.testing.assert_allclose(values, expected[0], rtol=1e-14)
    np.testing.assert_allclose(table, expected[1], rtol=1e-14)


def one_of(values, place):
    return values[place]


def set_one(values, place):
    values[place] = 1.0


def test_no_index_is_tested_for_being_negative():
    def comparisons(dispatcher):
        dispatcher(np.arange(3), np.int64(1))
        (code,) = dispatcher.inspect_llvm().values()
        return code.count("icmp slt")

    of_numba = numba.njit(one_of, boundscheck=False)
    assert comparisons(compiled(one_of)) < comparisons(of_numba)


def test_others_who_use_numba_count_from_the_end():
    values = np.arange(5)
    assert compiled(one_of)(values, 3) == 3
    assert numba.njit(one_of)(values, np.int64(-2)) == 3


@pytest.mark.parametrize("function", [one_of, set_one])
@pytest.mark.parametrize("place", [-1, 5, (-1, 0), (1, -2), (1, 5)])
def test_an_index_that_should_not_be_is_told_where_bounds_are_checked(function, place):
    values = np.zeros((5, 5)) if isinstance(place, tuple) else np.zeros(5)
    with pytest.raises(IndexError, match="out of bounds"):
        compiled(function, checked=True)(values, place)


def test_checked_code_is_kept_apart(monkeypatch):
    def version(checked):
        monkeypatch.setattr(kept.config, "BOUNDSCHECK", checked)
        kept._version.cache_clear()
        return kept._version()

    try:
        assert version(None) != version(1)
    finally:
        monkeypatch.undo()
        kept._version.cache_clear()
