# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What may be claimed of a lens: states that fit the plan in force.

Anyone may publish a ``LensState``. Whether a lens is where it says, only its sender knows; one that
contradicts the plan, or itself, is not noted.
"""

from __future__ import annotations

import math
from typing import Any

from focus_planner.core.rig.lens_table import DIOPTRES, METRES, LensTable
from focus_planner.core.text import printable
from focus_planner.core.validation import InputError, check_number
from focus_planner.lenses.driver import LensStatus
from focus_planner.lenses.orders import NO_TIME, Time

#: Of a message in bytes; its texts are cut below.
MAX_STATE_BYTES = 1 << 14
#: Longest texts, in characters.
MAX_MESSAGE, MAX_UNIT = 400, 64

_NANOSECONDS = 1_000_000_000
# By which a value sent may differ from the planner's: in proportion, and where it is rounded.
_RELATIVE, _ROUNDING, _HALF = 1e-3, 1e-6, 0.5
# The same for a value read back, where there is no table to tell how far that is.
_NEAR = 0.05
_SENT = (LensStatus.SENT, LensStatus.VERIFIED, LensStatus.ACCEPTED)
_THERE = (LensStatus.VERIFIED, LensStatus.ACCEPTED)


def check_claim(state: Any, focus: Any, tolerance: float, table: LensTable | None = None) -> None:
    """Raise unless a state fits the camera's part of the plan that it is about.

    Parameters
    ----------
    state
        A ``LensState`` message.
    focus
        The ``CameraFocus`` message of the same camera and plan.
    tolerance : float
        By how much the distance read back of a lens that is said to be there may differ from the
        planned one, dioptres.
    table : LensTable, optional
        The camera's in the planner's file; one in the rig precedes it.

    Raises
    ------
    InputError
        If there is no plan that it fits.
    """
    if state.status not in set(LensStatus) - {LensStatus.UNREPORTED}:
        expected = f"{LensStatus.SENT} to {max(LensStatus)}, as LensState names them"
        raise InputError("status", expected, str(state.status))
    if state.planned_distance != focus.focus_distance:
        raise InputError(
            "planned_distance",
            f"{focus.focus_distance!r} m, as in the plan",
            f"{state.planned_distance!r}",
            "repeat the focus_distance of the order",
        )
    stamp, sent_at, read_at = (
        _time(name, stamp)
        for name, stamp in (
            ("header.stamp", state.header.stamp),
            ("sent_at", state.sent_at),
            ("read_at", state.read_at),
        )
    )
    if state.status in _SENT:
        check_number("sent_value", state.sent_value)
    if state.status in _THERE:
        if NO_TIME in (stamp, read_at) or read_at < sent_at:
            raise InputError("read_at", "a time since sent_at", f"{read_at[0]}.{read_at[1]:09} s")
        _check_read(state, focus, tolerance, table)


def without_long_texts(state: Any) -> tuple[str, str]:
    """Return a state's unit and message, each a printable line that is cut if it is long."""
    return printable(state.unit, MAX_UNIT), printable(state.message, MAX_MESSAGE)


def _time(name: str, stamp: Any) -> Time:
    if stamp.sec < 0 or not 0 <= stamp.nanosec < _NANOSECONDS:
        raise InputError(name, "a time", f"{stamp.sec} s and {stamp.nanosec} ns")
    return stamp.sec, stamp.nanosec


def _check_read(state: Any, focus: Any, tolerance: float, table: LensTable | None) -> None:
    """Raise unless what was read back is the planned distance."""
    value = check_number("read_value", state.read_value)
    by_table = focus.device_unit != "" and state.unit == focus.device_unit
    if by_table:
        _check_value("sent_value", state.sent_value, focus, _RELATIVE)
        if table is not None and _gives(table, focus):
            _check_distance("read_value", table.distance_at(value), focus, tolerance)
        else:
            _check_value("read_value", value, focus, _NEAR)
    elif METRES != state.unit != DIOPTRES != focus.device_unit not in ("", METRES):
        expected = f"{focus.device_unit!r}, m or dioptres"
        raise InputError("unit", expected, repr(printable(state.unit, MAX_UNIT)))
    # Its sender may have no table, where the value says it all.
    if not (by_table and math.isnan(state.read_distance)):
        _check_distance("read_distance", state.read_distance, focus, tolerance)


def _gives(table: LensTable, focus: Any) -> bool:
    """Return whether a plan's device value is from a table, and not from one in the rig."""
    if table.unit != focus.device_unit:
        return False
    try:
        value = table.value_at(focus.focus_distance)
    except InputError:  # outside the table
        return False
    return math.isclose(value, focus.device_value, rel_tol=_ROUNDING, abs_tol=_ROUNDING)


def _check_value(name: str, value: float, focus: Any, relative: float) -> None:
    wanted = focus.device_value
    rounding = _HALF if value % 1.0 == 0.0 != wanted % 1.0 else _ROUNDING
    if not abs(value - wanted) <= rounding + relative * abs(wanted):
        raise InputError(name, f"{wanted:g} {focus.device_unit}, as in the plan", f"{value:g}")


def _check_distance(name: str, distance: float, focus: Any, tolerance: float) -> None:
    given = check_number(name, distance, above=0.0)
    if not abs(1.0 / given - 1.0 / focus.focus_distance) <= tolerance:
        raise InputError(
            name,
            f"what is within {tolerance:g} dioptres (parameter lens_tolerance) of the planned"
            f" {focus.focus_distance:g} m",
            f"{given:g} m",
        )
