# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

from datetime import date

import pytest

from focus_planner.io.quoting import abbreviated, key_name, kind_of, word


@pytest.mark.parametrize(
    ("value", "quoted", "kind"),
    [
        (None, "nothing", "nothing"),
        (1.5, "1.5", "a number"),
        (-3, "-3", "a number"),
        (10**39, str(10**39), "a number"),
        (10**40, "a whole number of more than 40 digits", "a number"),
        pytest.param(10**6000, "a whole number of more than 40 digits", "a number", id="long"),
        (True, "True", "true or false"),
        ("wide", "'wide'", "text"),
        ("x" * 40, repr("x" * 40), "text"),
        ("x" * 41, "text of 41 characters", "text"),
        (["a secret"], "a list of 1", "a list of 1"),
        ([], "an empty list", "an empty list"),
        ({"a": "secret"}, "keys and values", "keys and values"),
        (date(2024, 1, 2), "datetime.date(2024, 1, 2)", "a date"),
    ],
)
def test_values_are_quoted_if_short_and_lists_never(value: object, quoted: str, kind: str) -> None:
    assert (abbreviated(value), kind_of(value)) == (quoted, kind)


@pytest.mark.parametrize("key", ["focal_length", "camera matrix", "K.2-b", True])
def test_what_looks_like_a_key_is_quoted(key: object) -> None:
    assert key_name(key) == str(key)


@pytest.mark.parametrize("key", ["a" * 41, "root:x", "a=b", "a\nb", "", 10**50, ("a",), "MII+/x"])
def test_what_does_not_is_not(key: object) -> None:
    assert key_name(key) == "(a key that is no name)"


@pytest.mark.parametrize(
    "text", ["1,5", "-30", "1.5m", "1e-5", "1.2.3", "-nan(ind)", "null", "12:30", "1_000"]
)
def test_words_that_were_meant_for_numbers_are_quoted(text: str) -> None:
    assert word(text) == repr(text)


@pytest.mark.parametrize("text", ["hunter2", "secret", "AAAAB3NzaC1yc2E", "1" * 40, "", "12ab34"])
def test_other_words_are_not(text: str) -> None:
    assert word(text) == "something else"
