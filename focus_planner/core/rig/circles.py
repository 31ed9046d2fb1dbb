# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The circle of confusion where nobody gives one.

It is the largest blur on the sensor that counts as sharp, and depends on what the pictures are
used for. An f-number alone therefore tells no depth of field. Where it is all there is, and where
pictures are to be drawn of a lens that is given by its hyperfocal distance alone, this is assumed:

- **Two pixels**, where their size is known. It is the focal length in metres over that in pixels,
  F / fx: both somebody must have told. A blur of two pixels is the least that such pictures show.
- Otherwise **the sensor's diagonal / 1500**, as tables of depth of field have it for prints. The
  diagonal follows from the angle of view, that is from the image's size in focal lengths, and the
  focal length: of either what is told, or else the paper's.

Pixels are those of the image's full resolution. They are not known to be the sensor's where nobody
told fx (an image with the default's fx counts as such: the paper's images are reduced), nor where
they would be larger than 50 µm, which no camera's are: the image is a reduced one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.plausible import CIRCLE_OF_CONFUSION
from focus_planner.core.text import how_many

#: Stands for the circle of confusion among what is assumed of a camera.
CIRCLE = "lens.circle_of_confusion"

_PIXELS = 2
_LARGEST_PIXEL = 50e-6  # metres
_CIRCLES_PER_DIAGONAL = 1500
_BEGINNING = "nothing tells the circle of confusion of "


class AssumedCircle(NamedTuple):
    """A circle of confusion that nobody gave.

    Attributes
    ----------
    metres : float
    how : str
        How it came about, in words.
    """

    metres: float
    how: str


def assumed_circle(
    intrinsics: CameraIntrinsics, focal_length: float, *, focal_length_told: bool = True
) -> AssumedCircle:
    """Return the circle of confusion to assume.

    Parameters
    ----------
    intrinsics : CameraIntrinsics
    focal_length : float
        Metres.
    focal_length_told : bool
        Whether somebody gave the focal length; else it is the default.
    """
    pixel = focal_length / intrinsics.fx
    if focal_length_told and pixel <= _LARGEST_PIXEL and intrinsics.fx != CameraIntrinsics().fx:
        return AssumedCircle(max(_PIXELS * pixel, CIRCLE_OF_CONFUSION.least), "two pixels")
    across, down = intrinsics.width / intrinsics.fx, intrinsics.height / intrinsics.fy
    diagonal = focal_length * math.sqrt(across * across + down * down)
    low, high = CIRCLE_OF_CONFUSION.least, CIRCLE_OF_CONFUSION.most
    return AssumedCircle(
        min(max(diagonal / _CIRCLES_PER_DIAGONAL, low), high),
        f"the sensor's diagonal / {_CIRCLES_PER_DIAGONAL}",
    )


def circles_in_words(circles: Sequence[AssumedCircle], cameras: int) -> str:
    """Return what was assumed, of how many of a rig's cameras and how it came about."""
    micrometres = [1e6 * circle.metres for circle in circles]
    low, high = f"{min(micrometres):.3g}", f"{max(micrometres):.3g}"
    values = low if low == high else f"{low} to {high}"
    how = " or ".join(sorted({circle.how for circle in circles}))
    return f"{_BEGINNING}{how_many(len(circles), cameras)}: {values} µm is assumed, {how}"


def note_on_circles(
    circles: Sequence[AssumedCircle], cameras: int, remedy: str
) -> tuple[Note, ...]:
    """Return the note ``default_lens`` on circles of confusion, if some were assumed.

    Parameters
    ----------
    circles : sequence of AssumedCircle
        Those assumed, one per camera that an f-number without one tells the lens of.
    cameras : int
        How many the rig has.
    remedy : str
        What to do to describe them, as a clause.
    """
    if not circles:
        return ()
    text = circles_in_words(circles, cameras)
    return (Note("default_lens", f"{text}; the depth of field is proportional to it; {remedy}"),)


def is_on_circles(note: Note) -> bool:
    """Return whether a note is one on circles of confusion."""
    return note.text.startswith(_BEGINNING)
