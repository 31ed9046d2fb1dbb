# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which frames are cameras, and where their intrinsics are published."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property

from focus_planner.core.validation import InputError, check_choice, shown
from focus_planner.io.camera_frames import CONVENTIONS
from focus_planner.messages.frames import frame_name

_CAMERA = "{camera}"
_WILD = re.compile(r"[*?\[]")
_SET = re.compile(r"\[[^\] ]*\]")  # one character of those
_MAX_PATTERNS = 10_000


@dataclass(frozen=True)
class CameraFrames:
    """What the parameters say of a rig that is put together from frames.

    Attributes
    ----------
    frames : tuple of str
        Names of the cameras' frames, or patterns; empty for no such rig.
    convention : str
        How they are oriented: "optical", "body", or "" to tell by their names.
    topics : tuple of str
        Patterns of topics of ``CameraInfo``, in which ``{camera}`` stands for a camera's name;
        empty for all of that type.

    Raises
    ------
    InputError
        If there is no such convention, or there are too many patterns.
    """

    frames: tuple[str, ...] = ()
    convention: str = ""
    topics: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.convention:
            check_choice("camera_convention", self.convention, CONVENTIONS)
        for name, given in (("camera_frames", self.frames), ("camera_info_topics", self.topics)):
            if len(given) > _MAX_PATTERNS:
                raise InputError(name, f"at most {_MAX_PATTERNS:,} names", f"{len(given):,}")

    @classmethod
    def from_values(cls, frames: str, convention: str, topics: str) -> CameraFrames:
        """Return what parameters say, whose lists are separated by spaces.

        Raises
        ------
        InputError
            If they are separated by commas, or what the class refuses.
        """
        for name, given in (("camera_frames", frames), ("camera_info_topics", topics)):
            if "," in _SET.sub("", given):
                expected = "names or patterns, separated by spaces"
                raise InputError(
                    name, expected, shown(given), "leave out commas and outer brackets"
                )
        names = tuple(dict.fromkeys(map(frame_name, frames.split())))
        return cls(names, convention, tuple(topics.split()))

    @property
    def names(self) -> tuple[str, ...]:
        """Those that are no patterns: frames that there must be."""
        return tuple(frame for frame in self.frames if not _WILD.search(frame))

    @property
    def patterns(self) -> tuple[str, ...]:
        """Those that are."""
        return tuple(frame for frame in self.frames if _WILD.search(frame))

    def has(self, frame: str) -> bool:
        """Return whether a frame is one of the cameras'."""
        return frame in self.names or any(fnmatchcase(frame, each) for each in self.patterns)

    def camera_of(self, topic: str) -> str | None:
        """Return the camera that a topic is of: "" if its messages tell; None if it is not used."""
        if not self.topics:
            return ""
        for expression in self._expressions:
            found = expression.fullmatch(topic)
            if found:
                return found.groupdict().get("camera", "")
        return None

    @cached_property
    def _expressions(self) -> tuple[re.Pattern[str], ...]:
        return tuple(map(_expression, self.topics))


def _expression(pattern: str) -> re.Pattern[str]:
    before, camera, after = pattern.partition(_CAMERA)
    text = _glob(before)
    if camera:
        text += r"(?P<camera>\w+)" + _glob(after)
    return re.compile(text)


def _glob(pattern: str) -> str:
    parts = {"*": ".*", "?": "."}
    return "".join(parts.get(character) or re.escape(character) for character in pattern)
