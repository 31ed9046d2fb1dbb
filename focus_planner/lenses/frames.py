# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the frames of ``camera_ros`` say of a lens.

From version 0.7 on ``camera_ros`` publishes libcamera's metadata of every frame on
``/diagnostics``: a ``DiagnosticArray`` with the image's header and one status without a name. Its
``hardware_id`` is libcamera's name of the camera, its values are libcamera's controls as text.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

from focus_planner.core.validation import InputError
from focus_planner.lenses.orders import Time

#: camera_ros gives this to the frames of every camera unless its parameter ``frame_id`` is set.
UNNAMED = "camera"
#: libcamera writes positions with six decimals.
RESOLUTION = 1e-6
#: So many in a row must agree: a lens may pass a position, and frames of two cameras alternate.
AGREEING = 3

# Names of libcamera's controls, and AfStateIdle: what a lens in manual focus always reports.
_POSITION, _STATE, _IDLE = "LensPosition", "AfState", "0"


@dataclass(frozen=True)
class Frame:
    """What one frame says of the lens.

    Attributes
    ----------
    stamp : Time
        When the frame was exposed, by the clock of the driver's machine.
    frame_id : str
    hardware_id : str
    position : float
        Of the lens, dioptres: what libcamera last told the motor, at the speed it allows. NaN if
        the frame does not say.
    autofocus : str
        The state of an autofocus that is on; "" if it is off, or the frame does not say.
    """

    stamp: Time
    frame_id: str
    hardware_id: str
    position: float
    autofocus: str


@dataclass(frozen=True)
class FrameSource:
    """By what the frames of a driver node are recognized.

    Attributes
    ----------
    frame_id : str
        Its parameter.
    hardware_id : str
        Its parameter ``camera``; "" if that is not a name.
    """

    frame_id: str
    hardware_id: str = ""

    @classmethod
    def of(cls, frame_id: object, camera: object) -> FrameSource | None:
        """Return the source that a driver's parameters describe; None without a frame_id."""
        if not isinstance(frame_id, str):
            return None
        return cls(frame_id, camera if isinstance(camera, str) else "")

    def may_be(self, frame_id: str, hardware_id: str) -> bool:
        """Return whether it may publish frames of these names; "" is any hardware."""
        named = self.hardware_id and hardware_id
        return self.frame_id == frame_id and (not named or self.hardware_id == hardware_id)


class FrameLog:
    """The newest frames of every camera, by what frames are called."""

    def __init__(self) -> None:
        self._newest: dict[tuple[str, str], deque[Frame]] = {}
        self._sources: dict[str, FrameSource] = {}
        self._frame_ids: set[str] = set()

    def add(self, frame: Frame) -> None:
        """Note a frame, if it may be one of a driver's that is expected."""
        if frame.frame_id in self._frame_ids:
            key = frame.frame_id, frame.hardware_id
            self._newest.setdefault(key, deque(maxlen=AGREEING)).append(frame)

    def forget(self) -> None:
        """Forget all frames; what they are called is kept."""
        self._newest.clear()

    def expect(self, driver: str, source: FrameSource | None) -> None:
        """Note what a driver node's frames are called."""
        self._sources.pop(driver, None)
        if source is not None:
            self._sources[driver] = source
        self._frame_ids = {each.frame_id for each in self._sources.values()}

    def frames_of(self, driver: str, after: Time) -> tuple[Frame, ...]:
        """Return a driver's newest frames, at most :data:`AGREEING`, of those not before a time.

        Raises
        ------
        InputError
            If it is not certain which frames are this driver's.
        """
        source = self._sources.get(driver)
        if source is None:
            return ()
        recent = {
            key: tuple(frame for frame in frames if frame.stamp >= after)
            for key, frames in self._newest.items()
            if source.may_be(*key)
        }
        found = [frames for frames in recent.values() if frames]
        others = (other for name, other in self._sources.items() if name != driver)
        shared = any(source.may_be(other.frame_id, other.hardware_id) for other in others)
        if shared or len(found) > 1:
            raise unclear(source.frame_id)
        return found[0] if found else ()

    def is_unnamed(self, driver: str) -> bool:
        """Return whether a driver's frames have the name that all have by default."""
        source = self._sources.get(driver)
        return source is not None and source.frame_id == UNNAMED


def unclear(frame_id: str) -> InputError:
    """Return the error that several drivers may have published a frame."""
    return InputError(
        "frame_id",
        "a frame_id of its own for each camera driver",
        f"{frame_id!r} for several",
        "set the drivers' parameter frame_id: frames on /diagnostics are told apart by it",
    )


def frame_from_message(message: Any) -> Frame | None:
    """Return the frame in a ``DiagnosticArray``; None if it holds something else."""
    # One without values is of a frame that was cancelled.
    if len(message.status) != 1 or message.status[0].name or not message.status[0].values:
        return None
    (status,) = message.status
    said = {entry.key: entry.value for entry in status.values}
    stamp = message.header.stamp
    state = said.get(_STATE, _IDLE)
    return Frame(
        stamp=(stamp.sec, stamp.nanosec),
        frame_id=message.header.frame_id,
        hardware_id=status.hardware_id,
        position=_number(said.get(_POSITION, "")),
        autofocus="" if state == _IDLE else state,
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
