# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner import (
    InputError,
    Lens,
    LensTable,
)
from testing import reference

COUNTED = LensTable("focus_absolute", True, (0.3, 0.5, 3.0), (30, 20, 6))
RANGE = LensTable("steps", False, (0.4, 2.0), (0, 1000))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"focal_length": 0}, "lens.focal_length: expected a number above 0, got 0"),
        ({"focal_length": math.nan}, "lens.focal_length: expected a number above 0, got nan"),
        (
            {"hyperfocal_distance": 0.05},
            r"hyperfocal_distance: expected a number above focal_length \(0.05 m\), got 0.05",
        ),
        ({"hyperfocal_distance": math.inf}, "lens.hyperfocal_distance: .* got inf"),
        ({"min_focus": -0.1}, "lens.min_focus: expected a number of at least 0, got -0.1"),
        (
            {"hiatus": 12.0},
            r"lens.hiatus: expected above -4 focal lengths \(-0.2 m\) and at most 1 m, got 12 m; ",
        ),
        ({"hiatus": -0.2}, "lens.hiatus: .* got -0.2 m"),
        ({"hiatus": math.inf}, "lens.hiatus: expected a number, got inf"),
        ({"hiatus": math.nan}, "lens.hiatus: expected a number, got nan"),
        ({"hiatus": "thin"}, "lens.hiatus: .* got 'thin'"),
        ({"min_focus": math.inf}, "lens.min_focus: .* got inf"),
        ({"min_focus": 1e13}, r"lens.min_focus: expected metres, .* at most 100, got 1e\+13$"),
        ({"max_focus": 1e13}, r"lens.max_focus: expected at most 1e\+12 m, got 1e\+13"),
        ({"hyperfocal_distance": 1e308}, "hyperfocal_distance: expected metres, at most 7.14e"),
        ({"focus_distances": [1.0, 1e13]}, "lens.focus_distances: expected at most 1e"),
        ({"max_focus": 0.05}, r"max_focus: expected a number above focal_length \(0.05 m\), got"),
        (
            {"min_focus": 2.0, "max_focus": 1.5},
            r"lens.min_focus: expected at most max_focus \(1.5 m\), got 2 m",
        ),
        ({"focus_distances": 3.0}, "lens.focus_distances: expected a list of distances .* got 3.0"),
        ({"focus_distances": "0.5"}, "lens.focus_distances: expected a list of distances"),
        ({"focus_distances": []}, "lens.focus_distances: expected 1 to 65536 distances, got 0; le"),
        (
            {"focus_distances": [1.0, 0.05]},
            r"lens.focus_distances\[1\]: expected a number above 0.05, got 0.05",
        ),
        ({"focus_distances": [math.inf]}, r"lens.focus_distances\[0\]: .* got inf"),
        ({"focus_distances": [1.0, math.nan]}, r"lens.focus_distances\[1\]: .* got nan"),
        ({"focus_distances": ["a"]}, r"lens.focus_distances\[0\]: .* got 'a'"),
        (
            {"focus_distances": [0.5, 0.4], "min_focus": 0.45},
            r"lens.focus_distances: expected distances from min_focus \(0.45 m\) .* 0.4 to 0.5 m",
        ),
        ({"focus_distances": [2.0], "max_focus": 1.5}, "lens.focus_distances: .* got 2 to 2 m"),
        (
            {"focus_steps": 1, "min_focus": 0.4},
            "lens.focus_steps: expected a whole number of at least 2, got 1",
        ),
        ({"focus_steps": 2.5, "min_focus": 0.4}, "lens.focus_steps: .* got 2.5"),
        ({"focus_steps": 10**6, "min_focus": 0.4}, "lens.focus_steps: expected at most 65536"),
        (
            {"focus_steps": 9},
            r"lens.min_focus: expected a number above focal_length \(0.05 m\), with focus_steps",
        ),
        (
            {"focus_steps": 9, "focus_distances": [1.0], "min_focus": 0.4},
            "lens.focus_steps: expected either focus_distances or focus_steps, got both",
        ),
        ({"table": "dioptres"}, "lens.table: expected a LensTable, got 'dioptres'"),
        (
            {"table": COUNTED, "min_focus": 3.5},
            r"lens.table: expected distances from min_focus \(3.5 m\) to .* got 0.3 to 3 m",
        ),
        ({"table": COUNTED, "max_focus": 0.2}, r"max_focus \(0.2 m\), above .* got 0.3 to 3 m"),
        (
            {"table": RANGE, "focal_length": 2.0},
            r"above focal_length \(2 m\), got 0.4 to 2 m",
        ),
        (
            {"table": COUNTED, "min_focus": 2.9, "max_focus": 2.95},
            "lens.table: .* got none of its 25 values there",
        ),
        (
            {"table": COUNTED, "focus_distances": [1.0]},
            "lens.table: expected either a table .*, focus_distances or focus_steps, got two",
        ),
        ({"table": COUNTED, "focus_steps": 9, "min_focus": 0.4}, "lens.table: .* got two of them"),
        (
            {"table": RANGE, "focus_distances": [1.0, 3.0]},
            r"from min_focus \(0.4 m\) to max_focus \(2 m\), as limited by the lens's table",
        ),
        (
            {"table": LensTable("m"), "focus_steps": 9},
            "lens.min_focus: expected a number above focal_length .*, with focus_steps, got 0",
        ),
    ],
)
def test_lenses_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        Lens(**values)


def test_a_lens_may_take_a_list_of_distances():
    lens = Lens(focus_distances=[2.0, 0.5, 2.0, 1])
    assert lens.focus_distances == (0.5, 1.0, 2.0)
    assert lens.settable_distances.tolist() == [0.5, 1.0, 2.0]
    assert lens == Lens(focus_distances=np.array([0.5, 1.0, 2.0]))
    assert hash(lens) == hash(Lens(focus_distances=(0.5, 1.0, 2.0)))
    assert lens != Lens()
    assert Lens().settable_distances is None
    with pytest.raises(ValueError, match="read-only"):
        lens.settable_distances[0] = 1


def test_a_lens_may_have_steps_equal_in_dioptres():
    lens = Lens(min_focus=0.3, max_focus=3.0, focus_steps=10)
    settable = lens.settable_distances
    assert (settable[0], settable[-1], len(settable)) == (0.3, 3.0, 10)
    assert (np.diff(settable) > 0).all()
    np.testing.assert_allclose(np.diff(1 / settable), (1 / 3.0 - 1 / 0.3) / 9)
    np.testing.assert_allclose(settable, reference.settable(lens))
    assert Lens(min_focus=0.7, max_focus=0.7, focus_steps=2).settable_distances.tolist() == [0.7]


@given(st.floats(0.1, 1.0), st.floats(1.0, 20.0), st.integers(2, 200))
def test_the_limits_are_steps_exactly(low, ratio, steps):
    settable = Lens(min_focus=low, max_focus=low * ratio, focus_steps=steps).settable_distances
    assert (settable[0], settable[-1]) == (low, low * ratio)
    assert len(settable) <= steps


def test_a_step_at_infinity_counts_but_is_not_taken():
    settable = Lens(min_focus=0.5, focus_steps=5).settable_distances
    assert settable.tolist() == [0.5, 1 / 1.5, 1.0, 2.0]
    assert Lens(min_focus=0.5, focus_steps=2).settable_distances.tolist() == [0.5]


def test_a_table_limits_its_lens():
    assert Lens().focus_limits == (0.0, math.inf)
    assert Lens(table=LensTable("dioptres")).focus_limits == (0.0, math.inf)
    assert Lens(table=RANGE).focus_limits == (0.4, 2.0)
    narrow = Lens(min_focus=0.2, max_focus=1.5, table=RANGE)
    assert narrow.focus_limits == (0.4, 1.5)
    assert narrow.settable_distances is None
    # What was given stays, for another table.
    assert dataclasses.replace(narrow, table=None) == Lens(min_focus=0.2, max_focus=1.5)


def test_a_table_of_whole_values_is_a_list_of_distances():
    lens = Lens(table=COUNTED)
    assert lens.settable_distances.tolist() == COUNTED.settable_distances.tolist()
    assert len(lens.settable_distances) == 25
    some = Lens(min_focus=0.31, max_focus=1.0, table=COUNTED).settable_distances
    expected = reference.settable(Lens(0.05, 10.0, 0.31, 1.0, table=COUNTED))
    np.testing.assert_allclose(some, expected, rtol=1e-15)
    assert 0 < len(some) < 25
    # Nothing nearer than its focal length comes into focus.
    long = Lens(focal_length=0.4, table=COUNTED)
    assert long.settable_distances.min() > 0.4
    with pytest.raises(ValueError, match="read-only"):
        lens.settable_distances[0] = 1


def test_lists_and_steps_go_with_a_table_of_a_range():
    assert Lens(focus_distances=(0.5, 1.0), table=RANGE).settable_distances.tolist() == [0.5, 1.0]
    stepped = Lens(max_focus=9.0, focus_steps=3, table=RANGE)
    assert stepped.settable_distances.tolist() == [0.4, 1 / 1.5, 2.0]
