# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Focus distances in a driver's terms: what to send, what was read back, and how it is reported."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum

from focus_planner.core.rig.lens_table import DIOPTRES, METRES, LensTable
from focus_planner.core.text import MAX_REASON, printable
from focus_planner.core.validation import InputError
from focus_planner.lenses.orders import NO_TIME, FocusOrder, Time
from focus_planner.lenses.profiles import DEVICE, DriverProfile
from focus_planner.messages.writing import Fields, time_to_fields

_NAN = math.nan
# A value that differs by more from 1 / distance, which messages hold in 64 bits, is from a table.
_ROUNDING = 1e-9
_HALF = 0.5


class LensStatus(IntEnum):
    """How far a lens has applied a plan; equal to the constants of ``LensState.msg``."""

    UNREPORTED = 0
    SENT = 1
    VERIFIED = 2
    DIFFERS = 3
    FAILED = 4
    ACCEPTED = 5


@dataclass(frozen=True)
class LensCommand:
    """The value to send to a driver.

    Attributes
    ----------
    value : int or float
    unit : str
    calibrated : bool
        Whether a value in metres or dioptres comes from a table, and differs from the distance's.
    """

    value: int | float
    unit: str
    calibrated: bool = False


@dataclass(frozen=True)
class Tolerance:
    """By how much a value read back may differ from the value sent.

    Attributes
    ----------
    absolute : float
        In the driver's unit.
    relative : float
        In proportion to the value sent.
    """

    absolute: float = 0.0
    relative: float = 1e-4

    def accepts(self, sent: float, read: float, rounding: float = 0.0) -> bool:
        """Return whether ``read``, rounded to multiples, is ``sent``; NaN never is."""
        return abs(read - sent) <= self.absolute + self.relative * abs(sent) + rounding


@dataclass(frozen=True)
class LensReport:
    """How far a lens has applied a plan: the fields of ``LensState`` without name and stamp.

    Times are seconds and nanoseconds. With ``refused`` the order was none, and nothing was done:
    the one before, if there was one, is still in force.
    """

    plan_id: str
    status: LensStatus
    planned_distance: float
    unit: str = ""
    sent_value: float = field(default=_NAN)
    sent_at: Time = NO_TIME
    read_value: float = field(default=_NAN)
    read_at: Time = NO_TIME
    read_distance: float = field(default=_NAN)
    message: str = ""
    refused: bool = False


def report_to_fields(report: LensReport, name: str, stamp: Time) -> Fields:
    """Return the fields of a ``LensState`` message: texts, such as a driver's reason, are cut."""
    return {
        "header": {"stamp": time_to_fields(stamp)},
        "name": name,
        "plan_id": report.plan_id,
        "status": int(report.status),
        "planned_distance": report.planned_distance,
        "unit": report.unit,
        "sent_value": report.sent_value,
        "sent_at": time_to_fields(report.sent_at),
        "read_value": report.read_value,
        "read_at": time_to_fields(report.read_at),
        "read_distance": report.read_distance,
        "message": printable(report.message, MAX_REASON),
    }


def command_for(
    order: FocusOrder, profile: DriverProfile, table: LensTable | None = None
) -> LensCommand:
    """Return the value to send to a driver.

    It is the planner's device value if that is in the driver's unit, else the given table's; a
    driver in metres or dioptres needs neither.

    Parameters
    ----------
    order : FocusOrder
    profile : DriverProfile
    table : LensTable, optional
        The adapter's table for this lens.

    Raises
    ------
    InputError
        If the message is not from a plan, or no table has the driver's unit.
    """
    _check_planned(order)
    value, unit = _device_value(order, profile, table)
    plain = _plain_value(order.focus_distance, unit)
    calibrated = plain is not None and not math.isclose(value, plain, rel_tol=_ROUNDING)
    return LensCommand(round(value) if profile.whole else float(value), unit, calibrated)


def distance_of(command: LensCommand, value: float, table: LensTable | None = None) -> float:
    """Return the focus distance [m] of a value read back, NaN if it is unknown."""
    if table is not None and table.unit == command.unit:
        try:
            return table.distance_at(value)
        except InputError:  # outside the table
            return math.nan
    if command.calibrated or value < 0:
        return math.nan
    if command.unit == DIOPTRES:
        return 1.0 / value if value else math.inf
    return value if command.unit == METRES else math.nan


def _check_planned(order: FocusOrder) -> None:
    if not order.planned:
        raise InputError("status", "a planned status", "STATUS_UNKNOWN", "this is not from a plan")
    if not 0.0 < order.focus_distance < math.inf:
        raise InputError(
            "focus_distance",
            "a distance above 0 m",
            f"{order.focus_distance:g}",
            "this is not from a plan",
        )


def _device_value(
    order: FocusOrder, profile: DriverProfile, table: LensTable | None
) -> tuple[float, str]:
    if table is not None and order.device_unit not in ("", table.unit):
        raise InputError(
            "device_unit",
            f"{table.unit!r}, as in the adapter's lens tables",
            repr(order.device_unit),
            "give the planner and the adapter the same lens tables",
        )
    if order.device_value is not None and _takes(profile, order.device_unit):
        _check_by_table(order, order.device_value, profile, table)
        return order.device_value, order.device_unit
    if table is not None and _takes(profile, table.unit):
        return table.value_at(order.focus_distance), table.unit
    plain = _plain_value(order.focus_distance, profile.unit)
    if plain is None:
        raise InputError(
            "device_value",
            f"a value for {profile.parameter} in the driver's own unit",
            f"one in {order.device_unit}" if order.device_unit else "none",
            "give the planner or this adapter lens tables",
        )
    return plain, profile.unit


def _check_by_table(
    order: FocusOrder, value: float, profile: DriverProfile, table: LensTable | None
) -> None:
    """Raise unless a planner's value is the adapter's own for the same distance."""
    if table is None:
        return
    own = table.value_at(order.focus_distance)
    # Only where the driver takes whole values is the planner's rounded, and the table's may not be.
    rounding = _HALF if profile.whole else 0.0
    if abs(value - own) > rounding + _ROUNDING * max(abs(own), 1.0):
        raise InputError(
            "device_value",
            f"{own:g} {table.unit} for {order.focus_distance:g} m, as in the adapter's lens tables",
            f"{value:g}",
            "give the planner and the adapter the same lens tables",
        )


def _takes(profile: DriverProfile, unit: str) -> bool:
    """Return whether a table's unit is the driver's unit."""
    return unit not in (METRES, DIOPTRES) if profile.unit == DEVICE else unit == profile.unit


def _plain_value(distance: float, unit: str) -> float | None:
    if unit == METRES:
        return distance
    return 1.0 / distance if unit == DIOPTRES else None
