# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Orders to a lens, and which messages are none."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from focus_planner.core.planning.plan import CameraStatus
from focus_planner.core.validation import InputError

Time = tuple[int, int]

NO_TIME: Time = (0, 0)
#: Of a message in bytes: brackets of some thousand shots.
MAX_ORDER_BYTES = 1 << 20
# Characters: these texts are published again in every state of the lens.
_MAX_PLAN_ID, _MAX_UNIT = 256, 64
# dioptres and focus_distance are the same number, both in 64 bits.
_ROUNDING = 1e-6
# Up to here all integers are exact in double precision.
_LARGEST_VALUE = 2.0**53
_OTHER_HANDS = "check who else publishes on this topic"


@dataclass(frozen=True)
class FocusOrder:
    """Where a lens is to focus.

    Attributes
    ----------
    plan_id : str
    focus_distance : float
        [m], along the optical axis from the centre of projection.
    planned : bool
        Whether the message has a planned distance at all.
    device_value : float or None
        The value for the distance in the planner's lens table; None without one.
    device_unit : str
        Its unit; "" without a table.
    planned_at : Time
        When the plan was made; zero if that is not known. The same order at another time is the
        same.
    """

    plan_id: str
    focus_distance: float
    planned: bool = True
    device_value: float | None = None
    device_unit: str = ""
    planned_at: Time = field(default=NO_TIME, compare=False)

    def check_newer(self, other: FocusOrder, now: Callable[[], Time]) -> None:
        """Raise if this is of an older plan than another order, as far as that can be told.

        Parameters
        ----------
        other : FocusOrder
            The one in force.
        now : callable
            Returns the time. If the other's plan is later, time was set back since, and tells
            nothing.

        Raises
        ------
        InputError
        """
        known = NO_TIME not in (self.planned_at, other.planned_at)
        if not known or self.plan_id == other.plan_id or self.planned_at >= other.planned_at:
            return
        if other.planned_at <= now():
            raise InputError(
                "header.stamp",
                f"a plan made after {other.plan_id!r}, which is in force here",
                f"one made {_seconds(other.planned_at) - _seconds(self.planned_at):.3f} s before",
                "plan again, or restart this adapter",
            )


def order_from_message(message: Any, camera: str | None = None) -> FocusOrder:
    """Return the order in a ``CameraFocus`` message.

    Parameters
    ----------
    message
    camera : str, optional
        The camera that it is for.

    Raises
    ------
    InputError
        If it is another camera's, if it has a status, a value or a text that the planner does not
        send, or if its values contradict each other.
    """
    if camera is not None and message.name != camera:
        raise InputError("name", repr(camera), repr(message.name), _OTHER_HANDS)
    _check_text("plan_id", message.plan_id, _MAX_PLAN_ID)
    _check_text("device_unit", message.device_unit, _MAX_UNIT)
    if message.status not in set(CameraStatus):
        expected = f"{min(CameraStatus)} to {max(CameraStatus)}, as CameraFocus names them"
        raise InputError("status", expected, str(message.status), _OTHER_HANDS)
    planned = message.status != CameraStatus.UNKNOWN
    if planned:
        _check_dioptres(message)
        _check_device_value(message)
    has_value = message.device_unit != ""
    stamp = message.header.stamp
    return FocusOrder(
        plan_id=message.plan_id,
        focus_distance=float(message.focus_distance),
        planned=planned,
        device_value=float(message.device_value) if has_value else None,
        device_unit=message.device_unit if has_value else "",
        planned_at=(stamp.sec, stamp.nanosec),
    )


def _check_text(name: str, text: str, longest: int) -> None:
    if len(text) > longest or not text.isprintable():
        expected = f"at most {longest} printable characters"
        raise InputError(name, expected, f"{text!r} ({len(text)})", _OTHER_HANDS)


def _check_dioptres(message: Any) -> None:
    distance, dioptres = message.focus_distance, message.dioptres
    # 0 in an order by hand, which need not repeat the distance.
    given = 0.0 < distance < math.inf and dioptres != 0.0
    if given and not math.isclose(dioptres * distance, 1.0, rel_tol=_ROUNDING):
        raise InputError(
            "dioptres", f"{1.0 / distance:g}, as focus_distance says", f"{dioptres:g}", _OTHER_HANDS
        )


def _check_device_value(message: Any) -> None:
    if message.device_unit and not abs(message.device_value) <= _LARGEST_VALUE:
        expected = f"a number up to {_LARGEST_VALUE:g} with a device_unit"
        raise InputError("device_value", expected, f"{message.device_value:g}", _OTHER_HANDS)


def _seconds(time: Time) -> float:
    seconds, nanoseconds = time
    return seconds + nanoseconds * 1e-9
