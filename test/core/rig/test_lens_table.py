# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from focus_planner import InputError, LensTable
from focus_planner.core.rig.lens_table import MAX_FOCUS_STEPS
from testing import reference
from testing.messages import lens_tables

# A V4L2 lens that counts from near to far backwards.
FOCUS_ABSOLUTE = LensTable("focus_absolute", True, (0.3, 0.5, 1.0, 3.0), (250, 180, 90, 20))
INFINITE = LensTable("steps", False, (0.4, 1.0, math.inf), (-7.5, 100, 300))


def between(table):
    """Distances that the table has, and are no entries."""
    last = table.farthest if math.isfinite(table.farthest) else 1e3
    return st.floats(table.nearest or 1e-3, min(last, 1e4))


def test_metres_and_dioptres_need_no_table():
    metres, dioptres = LensTable("m"), LensTable("dioptres")
    assert metres.value_at(0.7) == metres.distance_at(0.7) == 0.7
    assert dioptres.value_at(0.25) == 4.0
    assert dioptres.distance_at(4.0) == 0.25
    assert dioptres.distance_at(0) == math.inf
    assert dioptres.value_at(math.inf) == 0.0
    for table in (metres, dioptres):
        assert (table.nearest, table.farthest) == (0.0, math.inf)
        assert table.settable_distances is None


def test_entries_are_met_exactly():
    for table in (FOCUS_ABSOLUTE, INFINITE):
        for distance, value in zip(table.distances, table.values, strict=True):
            assert table.value_at(distance) == value
            assert table.distance_at(value) == distance
    assert (FOCUS_ABSOLUTE.nearest, FOCUS_ABSOLUTE.farthest) == (0.3, 3.0)
    assert (INFINITE.nearest, INFINITE.farthest) == (0.4, math.inf)


def test_in_between_values_are_linear_in_dioptres():
    # Halfway from 2 to 1 dioptres are 1.5.
    assert FOCUS_ABSOLUTE.value_at(1 / 1.5) == 135
    assert FOCUS_ABSOLUTE.distance_at(135) == pytest.approx(1 / 1.5, rel=1e-15)
    assert INFINITE.value_at(2.0) == pytest.approx(200)
    assert INFINITE.distance_at(250) == pytest.approx(4.0)


def test_a_thin_lens_is_nearly_linear_in_dioptres():
    # What the interpolation rests on: the extension of a 50 mm lens, at five distances.
    extension = lambda d: 1e6 * 0.05**2 / (d - 0.05)  # noqa: E731
    distances = (0.5, 0.7, 1.0, 2.0, math.inf)
    table = LensTable("micrometres", False, distances, tuple(map(extension, distances)))
    for d in np.geomspace(0.5, 50.0, 200):
        told = table.distance_at(extension(d))
        assert abs(1 / told - 1 / d) < 0.005
        # Linear in metres it would be far from it.
        linear = np.interp(d, distances[:4], table.values[:4])
        if 1.3 < d < 1.7:
            assert abs(linear - extension(d)) > 10 * abs(table.value_at(d) - extension(d))


@given(lens_tables(), st.data())
def test_it_is_what_the_reference_says(table, data):
    distance = data.draw(between(table))
    assert table.value_at(distance) == pytest.approx(
        reference.device_value(table, distance),
        abs=(table.step or 1.0) if table.whole else 1e-7,
        rel=1e-9,
    )
    again = table.distance_at(table.value_at(distance))
    if not table.whole:
        assert 1 / again == pytest.approx(1 / distance, rel=1e-7, abs=1e-7)


@given(lens_tables(kinds=(True,)))
def test_whole_values_are_set_exactly(table):
    low, high = math.ceil(min(table.values)), math.floor(max(table.values))
    values = range(low, high + 1, int(table.step) or 1)
    distances = [table.distance_at(value) for value in values]
    assert [table.value_at(distance) for distance in distances] == list(values)
    finite = sorted(d for d in distances if d < math.inf)
    assert table.settable_distances.tolist() == finite
    assert len(set(finite)) == len(finite)
    assert table.nearest <= finite[0] <= finite[-1] <= table.farthest
    np.testing.assert_allclose(finite, reference.whole_distances(table), rtol=1e-12)


@given(lens_tables(kinds=(True,)), st.data())
def test_the_nearest_whole_value_is_told(table, data):
    distance = data.draw(between(table))
    value = table.value_at(distance)
    assert value == round(value)
    assert min(table.values) <= value <= max(table.values)
    exact = reference.device_value(table, distance)
    step = table.step or 1.0
    assume(not math.isclose(abs(exact - value), step / 2, rel_tol=1e-6))
    least = math.ceil(min(table.values))
    last = least + (math.floor(max(table.values)) - least) // step * step
    assert abs(exact - value) <= (step / 2 if least <= exact <= last else step)


def test_a_driver_that_takes_every_fifth_value_is_told_one_of_these():
    table = LensTable("focus_absolute", True, (0.3, 0.5, 1.0, 3.0), (250, 180, 90, 20), step=5)
    told = [table.value_at(distance) for distance in table.settable_distances]
    assert sorted(told) == list(range(20, 251, 5))
    assert [table.distance_at(value) for value in told] == table.settable_distances.tolist()
    exact = FOCUS_ABSOLUTE.distance_at(182)
    assert table.value_at(exact) == 180.0
    assert table.value_at(FOCUS_ABSOLUTE.distance_at(183)) == 185.0


@pytest.mark.parametrize(
    ("table", "values"),
    [
        # From the least value, which the driver takes, and up to what the table knows.
        (LensTable("s", True, (1, 2), (3, 22), step=5), [3, 8, 13, 18]),
        (LensTable("s", True, (1, 2), (22, 3), step=5), [3, 8, 13, 18]),
        (LensTable("s", True, (1, 2), (2.5, 22), step=5), [3, 8, 13, 18]),
        (LensTable("s", True, (1, 2), (-12, 0), step=4), [-12, -8, -4, 0]),
        (LensTable("s", True, (1, 2), (0, 3), step=1), [0, 1, 2, 3]),
        (LensTable("s", True, (1, 2), (7, 9), step=5), [7]),
        (LensTable("dioptres", False, (1, 2), (1, 0.5), step=0.125), [0.5, 0.625, 0.75, 0.875, 1]),
        (LensTable("s", False, (1, 2), (0.1, 0.7), step=0.1), np.linspace(0.1, 0.7, 7)),
    ],
)
def test_steps_count_from_the_least_value(table, values):
    told = sorted(table.value_at(distance) for distance in table.settable_distances)
    assert told == pytest.approx(list(values))
    assert [table.value_at(table.distance_at(value)) for value in told] == told
    assert min(table.values) <= told[0] <= told[-1] <= max(table.values)


@given(lens_tables(kinds=(True,)))
def test_a_step_of_one_is_what_whole_values_have_anyway(table):
    stepped, whole = replace(table, step=1), replace(table, step=0)
    assert stepped.settable_distances.tolist() == whole.settable_distances.tolist()


def test_what_is_whole_leaves_out_infinity_and_ends_that_are_not():
    table = LensTable("steps", True, (0.5, math.inf), (10.25, 0))
    assert len(table.settable_distances) == 10
    assert table.distance_at(0) == math.inf
    assert table.value_at(0.5) == 10
    assert table.nearest == 0.5 < table.settable_distances[0]
    with pytest.raises(ValueError, match="read-only"):
        table.settable_distances[0] = 1


def test_tables_are_values():
    table = LensTable("steps", np.bool_(True), [0.5, 1], np.array([3, 1]))
    assert table == LensTable("steps", True, (0.5, 1.0), (3.0, 1.0))
    assert hash(table) == hash(LensTable("steps", True, (0.5, 1.0), (3.0, 1.0)))
    assert type(table.whole) is bool
    assert all(type(x) is float for x in (*table.distances, *table.values))


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda: FOCUS_ABSOLUTE.value_at(0.29),
            "focus distance: expected 0.3 to 3 m, the range of the lens table, got 0.29",
        ),
        (lambda: FOCUS_ABSOLUTE.value_at(math.inf), "focus distance: .* got inf"),
        (lambda: FOCUS_ABSOLUTE.value_at(math.nan), "focus distance: .* got nan"),
        (lambda: LensTable("m").value_at(0.0), "focus distance: expected a number above 0, got 0"),
        (
            lambda: FOCUS_ABSOLUTE.distance_at(251),
            r"\(focus_absolute\): expected 20 to 250, the range of the lens table, got 251",
        ),
        (lambda: FOCUS_ABSOLUTE.distance_at("a"), r"device value \(focus_absolute\): .* got 'a'"),
        (lambda: LensTable("dioptres").distance_at(-1), r"device value \(dioptres\): .* got -1"),
        (lambda: LensTable("m").distance_at(0), r"device value \(m\): .* got 0"),
    ],
)
def test_what_a_table_does_not_have(ask, message):
    with pytest.raises(InputError, match=message):
        ask()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (("",), "table.unit: expected a name such as dioptres or steps, got ''"),
        ((None,), "table.unit: expected a name .* got None"),
        (("m", 1), "table.whole: expected true or false, got 1"),
        (("steps",), "table.distances: expected at least 2 with the unit steps, got none"),
        (("m", True), "table.distances: expected at least 2 with whole values, got none"),
        (("s", False, (1,), (1,)), "table.distances: expected at least 2, got 1"),
        (
            ("s", False, (1, 2), (1,)),
            r"table.values: expected as many as table.distances \(2\), got 1",
        ),
        (("s", False, ("a", 2), (1, 2)), r"table.distances: expected numbers of shape \(n\)"),
        (("s", False, (2, 1), (1, 2)), "table.distances: expected ascending metres, got 2, 1"),
        (("s", False, (1, 1), (1, 2)), "table.distances: expected ascending metres, got 1, 1"),
        (("s", False, range(40, 1, -1), range(39)), r"ascending metres, got 40, 39, .*\.\.\.$"),
        (("s", False, (0, 1), (1, 2)), r"table.distances: expected 1e-06 to 1e\+09 m; .* got 0"),
        (
            ("s", False, (math.inf, 1), (1, 2)),
            "table.distances: .* only the last may be inf, got inf",
        ),
        (("s", False, (math.nan, 1), (1, 2)), "table.distances: .* got nan"),
        (("s", False, (1, 2), (math.inf, 2)), "table.values: expected finite numbers"),
        (("s", False, (1, 2), (1, 1e17)), r"table.values: expected numbers up to .*, got 1e\+17"),
        (
            ("s", False, (1, 2, 3), (1, 3, 2)),
            "table.values: expected strictly rising or strictly falling numbers, got 1, 3, 2",
        ),
        (("s", False, (1, 2), (1, 1)), "table.values: expected strictly rising"),
        (
            ("s", True, (1, 2), (0.2, 0.4)),
            "table.values: expected 1 to 65536 whole numbers .*, got 0 from 0.2 to 0.4$",
        ),
        (
            ("s", True, (1, 2), (0, MAX_FOCUS_STEPS)),
            "expected 1 to 65536 whole numbers .*, got 65537 from 0 to 65536; leave whole out",
        ),
        (
            ("s", True, (1, 1 + 1e-14), (0, 1000)),
            "table.values: expected whole numbers with distinguishable distances, got 1001 of them",
        ),
        (("m", False, (), (), 0.1), "table.distances: expected at least 2 with a step, got none"),
        (("s", False, (1, 2), (1, 2), -1), "table.step: expected a number of at least 0, got -1"),
        (
            ("s", True, (1, 2), (1, 2), 0.5),
            "table.step: expected a whole number with whole values, got 0.5",
        ),
        (
            ("s", False, (1, 2), (0, 1), 1e-300),
            "expected 1 to 65536 values a step apart .*; leave step out and let the driver round",
        ),
        (
            ("s", False, (1, math.inf), (1, 0.5), 1),
            "table.values: expected a value at a finite distance, got none",
        ),
        (
            ("s", True, (1, math.inf), (0.5, 1)),
            "table.values: expected a whole number at a finite distance, got none",
        ),
    ],
)
def test_tables_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        LensTable(*values)


def test_as_many_steps_as_a_motor_may_have():
    table = LensTable("steps", True, (0.3, 2.0), (0, MAX_FOCUS_STEPS - 1))
    assert len(table.settable_distances) == MAX_FOCUS_STEPS
    assert (table.settable_distances[0], table.settable_distances[-1]) == (0.3, 2.0)


def test_a_table_that_ends_in_rounding_is_read_to_its_end():
    table = LensTable("steps", True, (0.3448275862068966, 1.0), (7.368578588116083e-149, -107.5))
    assert (np.diff(table.settable_distances) > 0).all()
    assert table.settable_distances[0] >= 0.3448275862068966
