# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What simulated camera drivers do with the parameters that they are given.

Each kind mimics a driver where drivers differ: when a parameter takes effect, what is refused, and
what is lost without a word.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from focus_planner.lenses.profiles import Assignment, DriverProfile, Value
from focus_planner.lenses.simulation import LensMechanics, MovingLens


class SimulatedDevice:
    """A lens with autofocus, whose parameters take effect at once.

    During autofocus the lens stays, and positions are ignored.

    Parameters
    ----------
    profile : DriverProfile
        With the names of this lens's parameters.
    mechanics : LensMechanics
    autofocus : bool
        Whether it is on at the start.
    stuck : bool
        Whether the lens never moves.
    """

    def __init__(
        self, profile: DriverProfile, mechanics: LensMechanics, autofocus: bool, stuck: bool
    ) -> None:
        self.profile = profile
        self._mechanics = mechanics
        self._lens = MovingLens(mechanics, mechanics.low, stuck)
        self._manual = dict(self._parameters_of_autofocus(profile))
        self._switches = {
            name: _other(value) if autofocus else value for name, value in self._manual.items()
        }

    @staticmethod
    def _parameters_of_autofocus(profile: DriverProfile) -> tuple[Assignment, ...]:
        """Return what ends autofocus, as far as the device has it."""
        return profile.first

    @property
    def initial(self) -> tuple[Assignment, ...]:
        """The initial values of its parameters."""
        low = self._mechanics.low
        return (
            *self._switches.items(),
            (self.profile.parameter, round(low) if self.profile.whole else low),
        )

    @property
    def has_autofocus(self) -> bool:
        """Whether autofocus is on."""
        return self._switches != self._manual

    def position(self, now: float) -> float:
        """Return where the lens is."""
        return self._lens.position(now)

    def take(self, values: Sequence[Assignment], now: float) -> str | None:
        """Take the parameters of one call.

        Parameters
        ----------
        values : sequence of (str, value)
            In the order of the call; among them may be some of other lenses.
        now : float
            Seconds, by any monotonic clock.

        Returns
        -------
        str or None
            Why the call is refused; None if it is not.
        """
        for name, value in values:
            if name in self._switches:
                self._switches[name] = value
        self._move(dict(values).get(self.profile.parameter), now)
        return None

    def _move(self, value: Value | None, now: float) -> None:
        if isinstance(value, (int, float)) and not self.has_autofocus:
            self._lens.command(self._mechanics.clamp(value), now)


class PerFrameDevice(SimulatedDevice):
    """As ``camera_ros``: parameters take effect with the next frame.

    What was set by an earlier call, and no frame has taken up yet, is dropped. Of what takes effect
    with one frame, autofocus comes first.
    """

    _pending: tuple[Assignment, ...] = ()

    def take(self, values: Sequence[Assignment], now: float) -> str | None:  # noqa: ARG002
        """Keep the parameters for the next frame, and no others."""
        self._pending = tuple(values)
        return None

    def begin_frame(self, now: float) -> None:
        """Let what was set last take effect."""
        pending, self._pending = self._pending, ()
        super().take(pending, now)


class SequentialDevice(SimulatedDevice):
    """As ``v4l2_camera``: controls are set one by one, and a position is refused during autofocus.

    Those set before the one refused stay set, whatever the parameters say.
    """

    @staticmethod
    def _parameters_of_autofocus(profile: DriverProfile) -> tuple[Assignment, ...]:
        return profile.first[:1]  # a kernel has one name for it

    def take(self, values: Sequence[Assignment], now: float) -> str | None:
        """Set one control after the other; refuse without a reason."""
        refused = None
        for name, value in values:
            if name == self.profile.parameter and self.has_autofocus:
                refused = ""
            else:
                super().take([(name, value)], now)
        return refused


class StoredValuesDevice(SimulatedDevice):
    """As ``depthai``: a call is judged by the parameters as they were before.

    Ending autofocus moves the lens to the position stored, and a position is ignored unless
    autofocus was off before the call.
    """

    _stored: dict[str, Value] | None = None

    def take(self, values: Sequence[Assignment], now: float) -> str | None:
        """Move by the values before the call."""
        before = self._stored or dict(self.initial)
        for name, value in values:
            if name in self._switches:
                self._switches[name] = value
                self._move(before[self.profile.parameter], now)
            elif name == self.profile.parameter and self._manual.items() <= before.items():
                self._move(value, now)
        self._stored = before | dict(values)
        return None


#: By driver; others are as the first one.
DEVICES: Mapping[str, type[SimulatedDevice]] = {
    "camera_ros": PerFrameDevice,
    "v4l2_camera": SequentialDevice,
    "depthai": StoredValuesDevice,
}


def _other(value: Value) -> Value:
    """Return a value that is not the one which ends autofocus; 2 for libcamera's AfMode 0."""
    if isinstance(value, bool):
        return not value
    return f"not {value}" if isinstance(value, str) else value + 2
