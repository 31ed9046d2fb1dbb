# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What messages of rigs leave untold of images and lenses, and the notes on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.circles import (
    CIRCLE,
    AssumedCircle,
    assumed_circle,
    note_on_circles,
)
from focus_planner.core.rig.defaults import assumed_values, keys_of, notes_on_defaults
from focus_planner.core.rig.rig import Rig

if TYPE_CHECKING:
    from focus_planner.messages.reading import Optics

Message = Any

_SET_TO_DEFAULT = "set to their defaults, they count as not set"


def lacks_circle(message: Message) -> bool:
    """Return whether a lens is told by its f-number, without a circle of confusion."""
    told = message.hyperfocal_distance or message.circle_of_confusion
    return not told and bool(message.f_number)


def circle_of(camera: Camera, message: Message, optics: Optics) -> AssumedCircle | None:
    """Return the circle of confusion that was assumed for a camera; None if it was told."""
    own = bool(message.lens.focal_length)
    if not (lacks_circle(message.lens) if own else optics.f_number):
        return None
    told = own or optics.focal_length_told
    return assumed_circle(camera.intrinsics, camera.lens.focal_length, focal_length_told=told)


def noted(
    rig: Rig,
    optics: Optics,
    lacking: list[tuple[bool, bool]],
    circles: Mapping[str, AssumedCircle],
) -> Rig:
    """Return the rig with notes on what nothing told of it.

    Parameters
    ----------
    rig : Rig
    optics : Optics
    lacking : list
        Per camera, whether the message lacks its image, and its lens.
    circles : mapping of str to AssumedCircle
        The circles of confusion that were assumed, by camera.
    """
    remedy = (
        "publish each lens's circle_of_confusion on ~/rig, or set the parameter"
        " lens.circle_of_confusion"
    )
    notes = (
        *_notes(optics, lacking),
        *note_on_circles(list(circles.values()), len(rig), remedy),
        *_note_on_f_number(optics, sum(lens for _, lens in lacking)),
    )
    return replace(rig, notes=notes, assumed={name: frozenset({CIRCLE}) for name in circles})


def _note_on_f_number(optics: Optics, cameras: int) -> Iterator[Note]:
    """Yield a note on an f-number without effect, if there are cameras that it would be of."""
    if optics.unused_f_number and cameras:
        yield Note(
            "default_lens",
            f"lens.f_number {optics.unused_f_number:g} is not used, because"
            f" lens.hyperfocal_distance is {optics.lens.hyperfocal_distance:g} m; set that to 0",
        )


def _notes(optics: Optics, lacking: list[tuple[bool, bool]]) -> tuple[Note, ...]:
    """Return the notes on the parameters that stand in for what a message lacks.

    Whether somebody has set a parameter to its default cannot be known, so that says nothing.

    Parameters
    ----------
    optics : Optics
    lacking : list
        Per camera, whether the message lacks its image, and its lens.
    """
    image, lens = vars(optics.intrinsics), vars(optics.lens)
    assumed = {
        each: assumed_values(
            lens,
            image,
            frozenset[str]().union(
                *(
                    keys_of(kind)
                    for kind, lacks in zip(("image", "lens"), each, strict=True)
                    if lacks
                )
            ),
        )
        for each in set(lacking)
    }
    return notes_on_defaults(
        (assumed[each] for each in lacking),
        "publish each camera's lens on ~/rig, or set the parameters lens.focal_length, and"
        " lens.f_number with lens.circle_of_confusion, or lens.hyperfocal_distance"
        f" ({_SET_TO_DEFAULT})",
        "publish each camera's CameraInfo on ~/rig, or set the parameters image.width, ..."
        f" ({_SET_TO_DEFAULT})",
    )
