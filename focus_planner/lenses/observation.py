# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""One lens of a driver: what it is told, and what can be seen of it.

A parameter that reads back as it was set says that the driver took it, not where the lens is. That
only the driver's own word of the lens says: the metadata of its frames, or a parameter that it
measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from focus_planner.core.validation import InputError
from focus_planner.lenses.calls import DriverCalls, RefusedError
from focus_planner.lenses.driver import LensStatus, Tolerance
from focus_planner.lenses.frames import AGREEING, RESOLUTION, Frame, FrameSource
from focus_planner.lenses.orders import Time
from focus_planner.lenses.profiles import Assignment, DriverProfile


class Frames(Protocol):
    """The newest frames of drivers."""

    def expect(self, driver: str, source: FrameSource | None) -> None:
        """Note what a driver node's frames are called."""

    def frames_of(self, driver: str, after: Time) -> Sequence[Frame]:
        """Return a driver's newest frames, at most :data:`AGREEING`, of those not before a time.

        Raises
        ------
        InputError
            If it is not certain which frames are this driver's.
        """


@dataclass(frozen=True)
class Observation:
    """What was seen of a lens.

    Attributes
    ----------
    status : LensStatus
        VERIFIED, ACCEPTED or DIFFERS.
    value : float
        The lens's where it was seen, else the parameter's; NaN if neither is a number.
    at : Time or None
        When the lens was there; None if just now.
    message : str
        What is different, or why the lens was not seen.
    waiting : bool
        Whether the lens has not been seen yet, but its driver may still say where it is.
    """

    status: LensStatus
    value: float = math.nan
    at: Time | None = None
    message: str = ""
    waiting: bool = False


class DriverLens:
    """One lens of a driver node.

    Parameters
    ----------
    calls : DriverCalls
    profile : DriverProfile
    tolerance : Tolerance
    frames : Frames, optional
        Where the profile's driver publishes frames.
    """

    def __init__(
        self,
        calls: DriverCalls,
        profile: DriverProfile,
        tolerance: Tolerance,
        frames: Frames | None = None,
    ) -> None:
        self._calls = calls
        self._profile = profile
        self._tolerance = tolerance
        self._frames = frames if profile.frames else None
        self._first: tuple[Assignment, ...] = ()

    async def prepare(self) -> None:
        """Find the driver, and what it has.

        Raises
        ------
        UnreachableError
            If it is absent, or does not respond.
        RefusedError
            If it has no parameter for the lens.
        """
        await self._calls.wait()
        parameter, first = self._profile.parameter, self._profile.first
        has = await self._calls.having([parameter, *(name for name, _ in first)])
        if parameter not in has:
            raise RefusedError(
                f"{self._calls.name}: expected a driver with the parameter {parameter}, got one"
                " without it; set the adapter's parameter driver, or check that this camera has a"
                " focus motor"
            )
        self._first = tuple((name, value) for name, value in first if name in has)
        if self._frames is not None:
            # In calls of their own: a driver that lacks one parameter answers with none.
            frame_id, camera = [
                (await self._calls.get([name])).get(name) for name in ("frame_id", "camera")
            ]
            self._frames.expect(self._calls.name, FrameSource.of(frame_id, camera))

    async def set(self, value: float) -> None:
        """End autofocus and set the lens.

        Raises
        ------
        UnreachableError
            If the driver does not respond.
        RefusedError
            With the driver's reason.
        """
        values: tuple[Assignment, ...] = (*self._first, (self._profile.parameter, value))
        for call in [values] if self._profile.together else [(each,) for each in values]:
            await self._calls.set(call)

    async def observe(self, value: float, after: Time) -> Observation:
        """Return where the lens is, as far as its driver says.

        Parameters
        ----------
        value : int or float
            Where it is to be.
        after : Time
            What the driver said of the lens before does not count.

        Raises
        ------
        UnreachableError
            If the driver does not respond.
        """
        names = [self._profile.parameter, *(name for name, _ in self._first)]
        read = self._judge_parameters(value, await self._calls.get(names))
        if read.status is not LensStatus.ACCEPTED or self._frames is None:
            return read
        try:
            frames = self._frames.frames_of(self._calls.name, after)
        except InputError as error:
            return self._unseen(read.value, str(error))
        for frame in reversed(frames):
            seen = self._judge_frame(value, read.value, frame)
            if seen.status is not LensStatus.VERIFIED:
                return seen
        if len(frames) >= AGREEING:
            return seen
        return self._unseen(
            read.value,
            f"expected {AGREEING} frames on /diagnostics that are newer than the value sent, got"
            f" {len(frames)}; camera_ros publishes them from 0.7 on, and the clocks of both"
            " machines must agree",
            waiting=True,
        )

    def _judge_parameters(self, value: float, values: Mapping[str, object]) -> Observation:
        name, read = self._profile.parameter, values.get(self._profile.parameter)
        if isinstance(read, bool) or not isinstance(read, (int, float)):
            what = "none; restart the driver" if read is None else f"{_described(read)}; {_NO_LENS}"
            return self._differs(math.nan, f"expected to read back a number for {name}, got {what}")
        for switch, wanted in self._first:
            if values.get(switch) not in (wanted, None):
                return self._differs(
                    float(read),
                    f"expected {switch} = {wanted}, read {values[switch]}; another node has set it",
                )
        if not self._tolerance.accepts(float(value), float(read)):
            cause = _OF_THE_LENS if self._profile.measures else _OF_THE_PARAMETER
            return self._differs(
                float(read), f"expected {name} = {value:g}, read {read:g}; {cause}"
            )
        seen = LensStatus.VERIFIED if self._profile.measures else LensStatus.ACCEPTED
        return Observation(seen, float(read))

    def _judge_frame(self, value: float, parameter: float, frame: Frame) -> Observation:
        if frame.autofocus:
            return self._differs(
                frame.position,
                f"expected autofocus off, its frames say AfState = {frame.autofocus}; {_LOST}",
                frame.stamp,
            )
        if math.isnan(frame.position):
            return self._unseen(
                parameter,
                "expected frames that tell LensPosition, got some without; the lens"
                " cannot be verified",
            )
        if not self._tolerance.accepts(float(value), frame.position, RESOLUTION):
            return self._differs(
                frame.position,
                f"expected the lens at {value:g}, its frames say LensPosition = {frame.position:g};"
                f" {_LOST}, or {_OF_THE_LENS}",
                frame.stamp,
            )
        return Observation(LensStatus.VERIFIED, frame.position, frame.stamp)

    def _differs(self, value: float, message: str, at: Time | None = None) -> Observation:
        return Observation(LensStatus.DIFFERS, value, at, f"{self._calls.name}: {message}")

    def _unseen(self, value: float, message: str, waiting: bool = False) -> Observation:
        message = f"{self._calls.name}: {message}"
        return Observation(LensStatus.ACCEPTED, value, None, message, waiting)


def _described(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"the text {value!r}" if isinstance(value, str) else "a list"


_NO_LENS = "this parameter moves no lens: check the adapter's parameters driver and parameter"
_OF_THE_LENS = (
    "the lens is slow, at a limit or has backlash: raise verify_timeout or tolerance, or always"
    " approach from one side"
)
_OF_THE_PARAMETER = "the driver limits or rounds it, or another node has set it"
_LOST = "the driver dropped what was set, or another node has set it since"
