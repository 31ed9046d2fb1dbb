# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a plan achieves, in a few plain sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.report.comparison import ComparedPlan, Worth, find_autofocus, shares_of
from focus_planner.report.rounding import ceiling, millimetres, percent

# What a note of each kind casts doubt on. Others tell what was done, not what may be wrong.
_DOUBTS = {
    "other_inputs": "the surface or the rig is probably not the plan's",
    "up_axis": "the surface and the cameras probably do not fit each other",
    "quaternion_order": "the surface and the cameras probably do not fit each other",
    "camera_axes": "the surface and the cameras probably do not fit each other",
    "inverted_poses": "the surface and the cameras probably do not fit each other",
    "unseen_cameras": "many cameras see nothing",
    "winding": "part of the surface is seen from behind only",
    "default_lens": "lenses or images are assumed",
    "default_image": "lenses or images are assumed",
    "noise": "the cloud is noisy",
    "left_out": "parts of the input were left out",
}
# Percentage points of standard error that are told.
_REMARKABLE = 1.0
# Of the surface, by rounding.
_NOTHING = 1e-9
# A gap that is wider says nothing of the plan.
_TELLING = 0.5


def verdict(
    plans: Sequence[ComparedPlan],
    worths: Sequence[Worth],
    notes: Sequence[Note],
    area: float,
    *,
    foreign: bool,
) -> str:
    """Return what the first of the plans achieves.

    Parameters
    ----------
    plans : sequence of ComparedPlan
        That the report is about first.
    worths : sequence of Worth
        Of each.
    notes : sequence of Note
        All that the report has.
    area : float
        Of the surface, square metres.
    foreign : bool
        Whether the plan was made for something else.
    """
    sentences = [
        _achieved(plans, worths, area, foreign=foreign),
        *_in_views(plans[0].plan, worths[0], area),
        _lacking(plans[0].plan, worths[0], area),
        *([] if foreign else _limits(plans[0].plan)),
        *_doubts(notes),
    ]
    return " ".join(sentences)


def _achieved(
    plans: Sequence[ComparedPlan], worths: Sequence[Worth], area: float, *, foreign: bool
) -> str:
    shares = [shares_of(worth, area).sharp for worth in worths]
    error = 100 * worths[0].in_focus_area.standard_error / area
    told = f" (± {error:.1g})" if error >= _REMARKABLE else ""
    autofocus = find_autofocus(plans)
    who = "With autofocus" if autofocus == 0 else "With this plan"
    here = " here" if foreign else ""
    tolerance = plans[0].plan.depth_tolerance
    spare = f", with {millimetres(tolerance)} of depth to spare" if tolerance else ""
    text = (
        f"{who} {percent(shares[0])}{told} of the surface is sharp{here} in the picture that"
        f" images it best{spare}"
    )
    others = [
        f"{plans[i].called} holds {percent(shares[i])}"
        for i in dict.fromkeys([1, autofocus])
        if i is not None and 0 < i < len(plans)
    ]
    return f"{text}{'; ' if others else ''}{' and '.join(others)}."


def _in_views(plan: FocusPlan, worth: Worth, area: float) -> Iterator[str]:
    """Yield, of a plan for several views, how much is sharp in as many."""
    if plan.views == 1:
        return
    sharp = [each for each in worth.sharp_areas if each.views <= plan.views]
    if sharp:
        enough = sharp[-1]  # the greatest number told that the plan was made for
        yield f"{percent(enough.area / area)} is sharp in {enough.views} views or more."


def _lacking(plan: FocusPlan, worth: Worth, area: float) -> str:
    shares = shares_of(worth, area)
    could_be = ", or could be" if plan.depth_tolerance else ""
    blurred, unseen = shares.blurred, shares.unseen
    ignored = 1 - worth.counted_area / area
    by_none = "in no picture" if plan.images else "seen by no camera"
    by_none += " finely enough" * math.isfinite(plan.max_mm_per_pixel)
    if not blurred and not unseen:
        text = "None of it was found blurred or unseen"
    elif not unseen:
        text = f"{percent(blurred)} is seen but blurred there{could_be}, and none was found unseen"
    elif not blurred:
        text = f"{percent(unseen)} is {by_none}, and none was found seen but blurred"
    else:
        text = (
            f"{percent(blurred)} is seen but blurred there{could_be}, and {percent(unseen)} is"
            f" {by_none}"
        )
    if ignored > _NOTHING:
        text += f"; {percent(ignored)} has no importance and was not planned for"
    return f"{text}."


def _limits(plan: FocusPlan) -> Iterator[str]:
    """Yield how far from the best the plan can be, and whether its search was cut short."""
    if plan.gap is not None and plan.gap <= 0:
        yield "No plan for its samples costs less."
    elif plan.gap is not None and plan.gap < _TELLING:
        yield f"No plan for its samples can cost more than {ceiling(plan.gap)} less."
    if plan.converged:
        return
    if plan.method == "optimal" and plan.gap is not None and plan.gap <= 0:
        yield "There was no time for all the samples that were asked for."
    elif plan.method == "optimal":
        yield "It could not be proven to be as close to the best as was asked for."
    else:
        yield "Its search was ended early: given more time, it may find a better plan."


def _doubts(notes: Sequence[Note]) -> Iterator[str]:
    codes = {note.code for note in notes}
    found = dict.fromkeys(doubt for code, doubt in _DOUBTS.items() if code in codes)
    if found:
        yield f"Read the notes first: {'; '.join(found)}."
