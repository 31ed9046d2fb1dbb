# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What names of frames tell of cameras: which frames are optical, and what to call a camera."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from focus_planner.core.validation import check_choice, first_few

if TYPE_CHECKING:
    from focus_planner.core.rig.frames import Similarity

CONVENTIONS = ("optical", "body")

_OPTICAL = re.compile(r"(^|[_/])optical(_frame)?$")
_PART = re.compile(r"[_/](optical|link|frame)$")


def is_optical(frame: str) -> bool:
    """Return whether a frame is named like an optical frame, by REP 103."""
    return _OPTICAL.search(frame) is not None


def without_optical(frame: str) -> str:
    """Return a frame's name without ``_optical_frame``, to name a camera by."""
    return _OPTICAL.sub("", frame) or frame


def device_of(frame: str) -> str:
    """Return what the frames of one camera have in common: ``cam0`` of ``cam0_optical_frame``.

    Also of ``cam0_link``, ``cam0_frame`` and ``cam0``.
    """
    while _PART.search(frame):
        frame = _PART.sub("", frame)
    return frame


def body_frames(frames: Sequence[str], convention: str) -> list[str]:
    """Return those of the cameras' frames that are body frames, x forward, y left, z up.

    Parameters
    ----------
    frames : sequence of str
    convention : str
        ``"optical"`` or ``"body"``, for all; "" to tell by their names, as in REP 103.

    Raises
    ------
    InputError
        If there is no such convention.
    """
    if convention:
        check_choice("convention", convention, CONVENTIONS)
        return list(frames) if convention == "body" else []
    return [frame for frame in frames if not is_optical(frame)]


def note_on_bodies(bodies: Sequence[str]) -> str:
    """Return the assumption that is made of frames whose names do not say that they are optical."""
    return f"assumed from their names to be body frames, x forward: {first_few(bodies)}"


def frame_from_optical(*, is_body: bool) -> Similarity:
    """Return the pose of a camera in its own frame."""
    from focus_planner.core.rig.frames import (  # noqa: PLC0415 - loads SciPy
        BODY_FROM_OPTICAL,
        Similarity,
    )

    return BODY_FROM_OPTICAL if is_body else Similarity()
