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

import math
from types import SimpleNamespace

import pytest

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError
from focus_planner.lenses.claims import MAX_MESSAGE, MAX_UNIT, check_claim, without_long_texts
from focus_planner.lenses.driver import LensStatus

UNREPORTED, SENT, VERIFIED, DIFFERS, FAILED, ACCEPTED = LensStatus
NAN = math.nan
THERE = (VERIFIED, ACCEPTED)
FOCUS = SimpleNamespace(focus_distance=0.5, device_value=NAN, device_unit="")
BY_TABLE = SimpleNamespace(focus_distance=0.5, device_value=100.0, device_unit="steps")
TABLE = LensTable("steps", whole=True, distances=(0.25, 1.0), values=(200.0, 50.0))
OTHER_TABLE = LensTable("steps", whole=True, distances=(0.25, 1.0), values=(2000.0, 500.0))
TOLERANCE = 0.1


def at(sec, nanosec=0):
    return SimpleNamespace(sec=sec, nanosec=nanosec)


def state(status=VERIFIED, **values):
    """What an adapter says of a lens that is where it was sent."""
    return SimpleNamespace(
        **{
            "header": SimpleNamespace(stamp=at(7)),
            "status": int(status),
            "planned_distance": 0.5,
            "unit": "dioptres",
            "sent_value": 2.0,
            "sent_at": at(5, 10),
            "read_value": 2.0,
            "read_at": at(6),
            "read_distance": 0.5,
            "message": "",
        }
        | values
    )


def steps(status=VERIFIED, **values):
    """The same in the unit of the lens's table."""
    fields = {"unit": "steps", "sent_value": 100.0, "read_value": 100.0}
    return state(status, **fields | values)


def refusal(claim, focus=FOCUS, table=None):
    with pytest.raises(InputError) as raised:
        check_claim(claim, focus, TOLERANCE, table)
    return str(raised.value)


@pytest.mark.parametrize("status", [SENT, VERIFIED, DIFFERS, FAILED, ACCEPTED])
def test_what_an_adapter_says_of_a_lens_fits(status):
    check_claim(state(status), FOCUS, TOLERANCE)
    for table in (None, TABLE):
        check_claim(steps(status), BY_TABLE, TOLERANCE, table)


@pytest.mark.parametrize("status", [DIFFERS, FAILED])
def test_of_a_lens_that_is_not_there_nothing_need_be_known(status):
    nothing = {"unit": "", "sent_value": NAN, "read_value": NAN, "read_distance": NAN}
    check_claim(state(status, sent_at=at(0), read_at=at(0), **nothing), FOCUS, TOLERANCE)
    check_claim(state(status, read_distance=math.inf, read_value=0.0), FOCUS, TOLERANCE)


@pytest.mark.parametrize("status", [0, 6, 200])
def test_a_status_that_says_nothing(status):
    assert refusal(state(status)) == (
        f"status: expected 1 to 5, as LensState names them, got {status}"
    )


@pytest.mark.parametrize("status", [SENT, VERIFIED, DIFFERS, FAILED, ACCEPTED])
@pytest.mark.parametrize("distance", [0.0, 0.51, -0.5, 99.0, NAN, math.inf])
def test_another_planned_distance(status, distance):
    assert refusal(state(status, planned_distance=distance)) == (
        f"planned_distance: expected 0.5 m, as in the plan, got {distance!r}; repeat the"
        " focus_distance of the order"
    )


@pytest.mark.parametrize("status", THERE)
@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"read_distance": NAN}, "read_distance: expected a number above 0"),
        ({"read_distance": -500.0}, "read_distance: expected a number above 0"),
        ({"read_distance": 0.0}, "read_distance: expected a number above 0"),
        ({"read_distance": math.inf}, "read_distance: expected a number above 0"),
        ({"read_distance": 99.0}, "read_distance: expected what is within 0.1 dioptres"),
        ({"read_distance": 1 / 2.11}, "read_distance: expected what is within 0.1 dioptres"),
        ({"read_value": NAN}, "read_value: expected a number"),
        ({"sent_value": NAN}, "sent_value: expected a number"),
        ({"sent_value": math.inf}, "sent_value: expected a number"),
        ({"read_at": at(0)}, "read_at: expected a time since sent_at"),
        ({"read_at": at(5, 9)}, "read_at: expected a time since sent_at"),
        ({"read_at": at(-1)}, "read_at: expected a time, got -1 s"),
        ({"sent_at": at(1, 2_000_000_000)}, "sent_at: expected a time, got 1 s"),
        ({"header": SimpleNamespace(stamp=at(0))}, "read_at: expected a time since sent_at"),
    ],
)
def test_a_lens_that_is_said_to_be_there_and_is_not(status, values, error):
    assert refusal(state(status, **values)).startswith(error)


def test_a_lens_within_the_tolerance_is_there():
    for dioptres in (1.91, 2.09):
        check_claim(state(read_distance=1 / dioptres), FOCUS, TOLERANCE)


@pytest.mark.parametrize("status", THERE)
def test_values_fit_by_the_cameras_table(status):
    for table in (None, TABLE):
        assert refusal(steps(status, sent_value=150.0), BY_TABLE, table).startswith(
            "sent_value: expected 100 steps, as in the plan, got 150"
        )
    far = steps(status, read_value=150.0)
    assert refusal(far, BY_TABLE, TABLE).startswith("read_value: expected what is within 0.1")
    for table in (None, OTHER_TABLE):
        assert refusal(far, BY_TABLE, table).startswith("read_value: expected 100 steps")
    outside = steps(status, read_value=5000.0)
    assert refusal(outside, BY_TABLE, TABLE).startswith("device value (steps): expected 50 to 200")
    assert refusal(steps(status, unit="turns"), BY_TABLE).startswith(
        "unit: expected 'steps', m or dioptres, got 'turns'"
    )


def test_who_has_no_table_need_not_tell_the_distance():
    for table in (None, TABLE):
        check_claim(steps(read_distance=NAN), BY_TABLE, TOLERANCE, table)
    rounded = SimpleNamespace(focus_distance=0.5, device_value=99.5, device_unit="steps")
    check_claim(steps(read_distance=NAN), rounded, TOLERANCE)
    assert "read_distance" in refusal(steps(read_distance=NAN))
    assert "read_distance" in refusal(state(read_distance=NAN), BY_TABLE)


def test_a_lens_that_was_sent_nothing_was_not_sent():
    assert refusal(state(SENT, sent_value=NAN)).startswith("sent_value: expected a number")


def test_texts_are_cut_and_printable():
    unit, message = without_long_texts(state(unit="\x1b[2J" + 5000 * "u", message=5_000_000 * "x"))
    assert len(unit) <= MAX_UNIT + 10
    assert len(message) <= MAX_MESSAGE + 10
    assert (unit + message).isprintable()
    assert "…" in unit
    assert "…" in message
    assert without_long_texts(state(message="a\nb"))[1] == "a b"
