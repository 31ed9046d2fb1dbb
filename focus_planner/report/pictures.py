# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The pictures in a report, and how large they may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.subject import PlannedSubject

#: Of the plan that the report is about, and of the one shown beside it.
PICTURED_PLANS = 2


# Bytes of all pictures together, for which a report of 168 cameras has room beside its samples; and
# with more pixels, making them would take longer than all else.
_ROOM = 2_000_000
# Of a pixel of a picture that is partly background, at most.
_BYTES_PER_PIXEL = 0.25
_WIDTH_TO_HEIGHT = 2 / 3
_LEAST, _MOST = 64, 384


@dataclass(frozen=True)
class Pictures:
    """Pictures of what cameras will see.

    Attributes
    ----------
    make : callable
        Yields what each camera will see with a plan, as WebP, in the rig's order; the number is
        that of pixels along the longer side.
    about : str
        What they rest on; may be empty.
    """

    make: Callable[[PlannedSubject, FocusPlan, int], Iterable[bytes]]
    about: str = ""


def longest_side(cameras: int) -> int:
    """Return how many pixels the longer side of each picture gets, for this many cameras."""
    pixels = _ROOM / (PICTURED_PLANS * cameras * _BYTES_PER_PIXEL)
    return round(min(max(math.sqrt(pixels / _WIDTH_TO_HEIGHT), _LEAST), _MOST))
