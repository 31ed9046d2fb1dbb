# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A simulated lens: finite speed, latency, limits, backlash."""

from __future__ import annotations

import math
from dataclasses import dataclass

from focus_planner.core.validation import InputError, check_number


@dataclass(frozen=True)
class LensMechanics:
    """How a lens moves, in the unit of its driver.

    Attributes
    ----------
    low, high : float
        The ends of its travel.
    speed : float
        Units per second; inf for a lens that jumps.
    latency : float
        Seconds from a command to the first movement.
    backlash : float
        How far the lens lags behind the motor after moving down; after moving up it does not.
    step : float
        Between the motor's positions, counted from ``low``; 0 if it is continuous.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    low: float
    high: float
    speed: float = math.inf
    latency: float = 0.0
    backlash: float = 0.0
    step: float = 0.0

    def __post_init__(self) -> None:
        check_number("high", self.high, above=check_number("low", self.low))
        check_number("speed", self.speed, above=0.0, infinite=True)
        for name in ("latency", "backlash", "step"):
            check_number(name, getattr(self, name), at_least=0.0)
        if self.step > self.high - self.low:
            raise InputError("step", "less than the lens's travel", f"{self.step:g}")

    def clamp(self, value: float) -> float:
        """Return the nearest value within the travel."""
        return min(max(value, self.low), self.high)

    def quantise(self, value: float) -> float:
        """Return the motor's position for a value within the travel."""
        if not self.step:
            return value
        return self.clamp(self.low + self.step * round((value - self.low) / self.step))


class MovingLens:
    """A motor of constant speed, and a lens that it drives with backlash.

    The motor pushes the lens up, and drags it down once it has taken up the backlash: after moving
    up the lens is where the motor is, after moving down up to the backlash above it. A command
    during a movement stops the motor where it is, for the latency.

    Parameters
    ----------
    mechanics : LensMechanics
    position : float
        Initial position of the lens and its motor.
    stuck : bool
        Whether it never moves.
    """

    def __init__(self, mechanics: LensMechanics, position: float, stuck: bool = False) -> None:
        self._mechanics = mechanics
        self._stuck = stuck
        self._lens = self._motor = self._target = position
        self._since = -math.inf

    def command(self, value: float, now: float) -> None:
        """Move to a value within the travel.

        Parameters
        ----------
        value : float
        now : float
            Seconds, by any monotonic clock.
        """
        motor = self._motor_at(now)
        self._lens = self._lens_behind(motor)
        self._motor = motor
        self._target = self._motor if self._stuck else self._mechanics.quantise(value)
        self._since = now + self._mechanics.latency

    def position(self, now: float) -> float:
        """Return the position of the lens."""
        return self._mechanics.clamp(self._lens_behind(self._motor_at(now)))

    def arrives(self) -> float:
        """Return when the motor stops, by the clock of :meth:`command`."""
        return self._since + abs(self._target - self._motor) / self._mechanics.speed

    def _motor_at(self, now: float) -> float:
        if now >= self.arrives():
            return self._target
        if now <= self._since:
            return self._motor
        travelled = self._mechanics.speed * (now - self._since)
        return self._motor + math.copysign(travelled, self._target - self._motor)

    def _lens_behind(self, motor: float) -> float:
        """Return where the lens is after the motor has moved to a position in one direction."""
        return min(max(self._lens, motor), motor + self._mechanics.backlash)
