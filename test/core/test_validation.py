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

import numpy as np
import pytest

from focus_planner import InputError
from focus_planner.core.validation import (
    check_array,
    check_choice,
    check_finite,
    check_number,
    check_whole,
)


def test_an_error_says_what_where_and_what_to_do():
    error = InputError("rig", "two cameras", "one", "add another")
    assert str(error) == "rig: expected two cameras, got one; add another"
    assert (error.argument, error.expected, error.got) == ("rig", "two cameras", "one")
    assert error.remedy == "add another"
    assert str(InputError("rig", "two cameras", "one")) == "rig: expected two cameras, got one"
    assert isinstance(error, ValueError)


def test_of_what_came_in_many_words_the_beginning_and_the_end_are_told():
    error = InputError("frame_id", "'world'", f"a{'b' * 100_000}c")
    assert len(str(error)) < 500
    assert str(error).startswith("frame_id: expected 'world', got abbb")
    assert str(error).endswith("bbbc")
    long = InputError("a" * 10_000, "b" * 10_000, "c")
    assert len(str(long)) < 3000


def test_what_came_cannot_forge_a_line_of_a_log():
    error = InputError("fields", "x, y and z", "a\r\n  [ERROR] \x1b[31mforged\u202e, b\0", "é")
    told = r"fields: expected x, y and z, got a [ERROR] \x1b[31mforged\u202e, b\x00; é"
    assert str(error) == told


def test_an_array_is_copied_contiguous_and_read_only():
    given = np.arange(12, dtype=np.float32).reshape(3, 4).T
    array = check_array("points", given, (None, 3))
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    np.testing.assert_array_equal(array, given)
    given[0, 0] = 99
    assert array[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        array[0, 0] = 1


@pytest.mark.parametrize(
    ("value", "shape", "message"),
    [
        ([1.0, 2.0], (3,), r"p: expected shape \(3\), got shape \(2,\)"),
        ([1.0, 2.0], (None, 3), r"p: expected shape \(n, 3\), got shape \(2,\)"),
        (np.zeros((4, 2)), (None, 3), r"p: expected shape \(n, 3\), got shape \(4, 2\)"),
        ("abc", (3,), r"p: expected numbers of shape \(3\), got something else"),
        ([[1.0, 2.0, 3.0], [4.0]], (None, 3), r"p: expected numbers of shape \(n, 3\)"),
        ([None, {}, ()], (3,), r"p: expected numbers of shape \(3\)"),
    ],
)
def test_an_array_of_another_kind_is_refused(value, shape, message):
    with pytest.raises(InputError, match=message):
        check_array("p", value, shape)


def test_an_integer_too_large_is_refused():
    with pytest.raises(InputError, match=r"t: expected numbers of shape \(1\)"):
        check_array("t", [2**70], (1,), np.int64)


@pytest.mark.parametrize("value", [0.5, np.nan, -np.inf, np.uint64(2**63 + 1)])
def test_whole_numbers_are_not_made_of_others(value):
    with pytest.raises(
        InputError, match=r"t: expected (whole numbers, got others|numbers of shape)"
    ):
        check_array("t", [value, 1], (2,), np.int64)
    np.testing.assert_array_equal(check_array("t", [2.0, 1.0], (2,), np.int64), [2, 1])


def test_the_first_row_that_is_not_finite_is_named():
    array = np.zeros((5, 3))
    check_finite("points", array, "point")
    array[3, 1], array[4, 0] = np.nan, -np.inf
    with pytest.raises(
        InputError,
        match=r"points: expected finite numbers, got NaN or infinity in 2 of 5 "
        r"\(first: point 3\); drop them",
    ):
        check_finite("points", array, "point", "drop them")


def test_numbers_within_limits_come_back_as_floats():
    assert check_number("x", 3) == 3.0
    assert isinstance(check_number("x", np.float32(0.5)), float)
    assert isinstance(check_number("x", np.int64(2)), float)
    assert check_number("x", 0, at_least=0) == 0.0
    assert check_number("x", np.inf, infinite=True) == np.inf


@pytest.mark.parametrize(
    ("value", "limits", "message"),
    [
        (True, {}, "x: expected a number, got True"),
        ("1", {}, "x: expected a number, got '1'"),
        (None, {}, "x: expected a number, got None"),
        (np.nan, {}, "x: expected a number, got nan"),
        (np.inf, {}, "x: expected a number, got inf"),
        (np.nan, {"infinite": True}, "x: expected a number, got nan"),
        (-np.inf, {"infinite": True}, "x: expected a number, got -inf"),
        (0, {"above": 0}, "x: expected a number above 0, got 0"),
        (-0.5, {"at_least": 0}, "x: expected a number of at least 0, got -0.5"),
    ],
)
def test_other_numbers_are_refused(value, limits, message):
    with pytest.raises(InputError, match=message):
        check_number("x", value, **limits)


def test_whole_numbers():
    assert check_whole("n", 3, 3) == 3
    assert type(check_whole("n", np.int32(7), 0)) is int


@pytest.mark.parametrize("value", [2, 3.0, "3", True, None, np.float64(4)])
def test_what_is_no_whole_number_in_range_is_refused(value):
    with pytest.raises(InputError, match="n: expected a whole number of at least 3, got "):
        check_whole("n", value, 3)


def test_a_choice_is_one_of_the_choices():
    assert check_choice("method", "em", ("em", "k_view")) == "em"
    with pytest.raises(InputError, match="method: expected one of em, k_view, got 'best'"):
        check_choice("method", "best", ("em", "k_view"))


@pytest.mark.parametrize("value", [10**400, -(10**400), 2**5000, 10**6000], ids=range(4))
def test_numbers_beyond_all_doubles_are_refused_without_their_digits(value):
    with pytest.raises(
        InputError, match=r"x: expected a number.*, up to 1e308, got a whole number"
    ):
        check_number("x", value, above=0)
    if value > 0:
        telling = "x: expected a whole number of at least 0, at most 9, got a whole number of"
        with pytest.raises(InputError, match=telling):
            check_whole("x", value, 0, 9)


def test_numbers_have_upper_limits():
    assert check_number("x", 5, at_most=5) == 5.0
    assert check_whole("x", 5, 0, 5) == 5
    assert check_number("x", math.inf, at_most=5, infinite=True) == math.inf
    with pytest.raises(InputError, match=r"x: expected a number, at most 5, got 5\.1"):
        check_number("x", 5.1, at_most=5)
    with pytest.raises(InputError, match="x: expected a number, got inf"):
        check_number("x", math.inf, at_most=5)


def test_texts_in_arrays_are_not_quoted():
    with pytest.raises(InputError, match=r"got something else$"):
        check_array("x", ["a secret"], (None,))
