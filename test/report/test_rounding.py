# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Numbers as they are told: what is said of them stays true."""

from __future__ import annotations

import pytest

from focus_planner.report.rounding import ceiling, change, floored, millimetres, percent


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"),
        (1e-5, "0.001 %"),
        (0.0049, "0.5 %"),
        (0.0097, "1 %"),
        (0.5049, "50 %"),
        (0.988, "99 %"),
        (0.9949, "99.4 %"),
        (0.99999, "99.9 %"),
        (1.0, "100 %"),
    ],
)
def test_only_all_is_100_percent_and_only_nothing_0(share: float, text: str) -> None:
    assert percent(share) == text


@pytest.mark.parametrize(
    ("share", "text"),
    [(1e-6, "0.01 %"), (0.00211, "0.22 %"), (0.12, "12 %"), (0.1201, "13 %")],
)
def test_what_can_be_saved_at_most_is_rounded_up(share: float, text: str) -> None:
    assert ceiling(share) == text


def test_a_lower_bound_is_rounded_down() -> None:
    assert [floored(226.595), floored(226.6), floored(0.04)] == ["226.5", "226.6", "0.0"]


def test_no_change_has_no_sign() -> None:
    assert [change(-0.1234), change(0.0567)] == ["−12.3 %", "+5.7 %"]
    assert {change(0.0), change(-0.0004), change(0.0004)} == {"0.0 %"}


def test_lengths_have_two_digits_or_all_before_the_point() -> None:
    assert [millimetres(0.0031), millimetres(0.0124), millimetres(0.1236)] == [
        "3.1 mm",
        "12 mm",
        "124 mm",
    ]
