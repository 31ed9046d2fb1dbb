# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What-if analysis: a recorded run with another request, lens, image or cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.circles import (
    CIRCLE,
    AssumedCircle,
    assumed_circle,
    is_on_circles,
    note_on_circles,
)
from focus_planner.core.rig.defaults import FOCAL_LENGTH, KINDS, keys_of, told_by
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import hyperfocal_distance
from focus_planner.core.rig.plausible import check_circle, check_focal_length
from focus_planner.core.rig.rig import Rig
from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError
from focus_planner.parameters.declaration import Value, group
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.run import Run
from focus_planner.recording.run_inputs import rig_message, with_frames

_DEFAULTS: dict[str, Value] = {
    declaration.name: declaration.default for declaration in DECLARATIONS
}
_CAMERA_PREFIXES = ("lens.", "image.")
# These do not affect a plan, or cannot be changed afterwards.
_NOT_SETTABLE = ("frame_id", "subjects", "warm_start")
# After a change of these, nothing depends any more on a circle of confusion that was assumed.
_TELL_CIRCLE = frozenset({CIRCLE, "lens.hyperfocal_distance"})


@dataclass(frozen=True)
class Changed:
    """A changed run that has not been planned yet.

    Attributes
    ----------
    run : Run
    notes : tuple of str
        Assumptions that were made.
    """

    run: Run
    notes: tuple[str, ...]


def settable_names() -> list[str]:
    """Return the names of the parameters that can be changed."""
    names = [d.name for d in DECLARATIONS if d.plans and d.name not in _NOT_SETTABLE]
    return names + [name.removeprefix("lens.") for name in names if name.startswith("lens.")]


def parse_changes(assignments: list[str]) -> dict[str, Value]:
    """Return the changes in texts such as ``"samples=65536"``, by parameter.

    Raises
    ------
    InputError
        If a text is not NAME=VALUE, the parameter cannot be changed, or the value is invalid.
    """
    changes: dict[str, Value] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise InputError("--set", "NAME=VALUE", repr(assignment))
        if name not in settable_names():
            raise InputError(
                "--set",
                "a parameter that can be changed",
                repr(name),
                did_you_mean(name, settable_names())
                or f"these can be: {', '.join(settable_names())}",
            )
        name = name if name in _DEFAULTS else f"lens.{name}"
        if name in changes:
            raise InputError("--set", f"{name} once", "twice")
        changes[name] = _value(name, text)
    return changes


def with_changes(run: Run, changes: Mapping[str, Value]) -> Changed:
    """Return the run with changed parameters, under a new name.

    Changes override the values of the recorded request. Changes of lens and image apply to every
    camera, whether or not it has values of its own. A lens is given by its hyperfocal distance,
    or by f-number and circle of confusion. If only one of the latter two is given, the other is
    taken from the recording; a circle of confusion that is not recorded is assumed
    (:mod:`focus_planner.core.rig.circles`), of which plans have a note.

    Raises
    ------
    InputError
        If a value is out of range, or the changes contradict each other.
    """
    before = run.beginning
    values = dict(before.settings.values)
    of_cameras = {n: v for n, v in changes.items() if n.startswith(_CAMERA_PREFIXES)}
    values |= {n: v for n, v in changes.items() if n not in of_cameras}
    asked = {n: type(v)() if n in changes else v for n, v in before.asked.items()}
    text = None if "lens_tables" in changes else before.settings.lens_tables_text
    settings = Settings.from_values(values, text)
    beginning = replace(before, run_id=new_run_id(), settings=settings, asked=asked)
    _ = beginning.request
    changed = replace(run, beginning=beginning, ending=None, fault="not planned yet")
    if not of_cameras:
        return Changed(changed, ())
    input_notes = tuple(_still_true(before.input_notes, of_cameras))
    changed = replace(changed, beginning=replace(beginning, input_notes=input_notes))
    notes: list[Note] = []
    changed = _with_cameras(changed, of_cameras, notes)
    beginning = replace(changed.beginning, input_notes=(*input_notes, *notes))
    return Changed(replace(changed, beginning=beginning), tuple(note.text for note in notes))


def _still_true(notes: Iterable[Note], changes: Mapping[str, Value]) -> Iterator[Note]:
    """Yield the notes on a run's files, as far as they hold after changes of lens and image."""
    for note in notes:
        kind = note.code.removeprefix("default_")
        if is_on_circles(note):
            if not changes.keys() & _TELL_CIRCLE:
                yield note
        elif kind not in KINDS or not any(name.startswith(f"{kind}.") for name in changes):
            yield note
        elif not told_by(changes) >= keys_of(kind):
            yield Note(
                note.code,
                f"nothing told the {kind} of the recorded cameras: what was not changed of it since"
                " is assumed, as in the paper, and the plan holds for nothing else",
            )


def _value(name: str, text: str) -> Value:
    default = _DEFAULTS[name]
    try:
        if isinstance(default, bool):
            return {"true": True, "false": False}[text.lower()]
        if isinstance(default, tuple):
            return tuple(float(part) for part in text.strip("[]").split(","))
        return type(default)(text)
    except (ValueError, KeyError):
        kinds = {bool: "true or false", int: "a whole number", float: "a number"}
        kind = kinds.get(type(default), "numbers separated by commas")
        raise InputError(f"--set {name}", kind, repr(text)) from None


def _with_cameras(run: Run, changes: Mapping[str, Value], notes: list[Note]) -> Run:
    """Return the run with every valid rig changed, in its full form."""
    planner, optics = run.beginning.planner, run.beginning.settings.optics
    changed = {}
    for arrival in run.rigs():
        try:
            rig = arrival.read(optics)
        except InputError:
            continue  # it was rejected, and still is
        circles: list[AssumedCircle] = []
        with _errors_of(changes):
            cameras = tuple(_changed_camera(rig, c, changes, circles) for c in rig.cameras)
        remedy = "use --set circle_of_confusion=... for another"
        notes += [n for n in note_on_circles(circles, len(rig), remedy) if n not in notes]
        changed[arrival.payload, arrival.heard] = Rig(cameras, rig.frame_id, rig.grid)
    heard = {id(message): frames for message, frames in with_frames(run.inputs)}
    inputs = tuple(
        rig_message(planner, changed[key], message.at) if key in changed else message
        for message in run.inputs
        for key in ((message.payload, heard.get(id(message))),)
    )
    return replace(run, inputs=inputs)


@contextmanager
def _errors_of(changes: Mapping[str, Value]) -> Iterator[None]:
    """Blame the changes for errors, also of what was recorded and does not go with them."""
    try:
        yield
    except InputError as error:
        if error.argument.startswith("--set"):
            raise
        name = error.argument.rpartition(" ")[2]
        if name in changes:
            argument, expected = name, error.expected
        else:
            argument, expected = ", ".join(changes), f"{error.argument} to be {error.expected}"
        raise InputError(f"--set {argument}", expected, error.got, error.remedy) from None


def _changed_camera(
    rig: Rig, camera: Camera, changes: Mapping[str, Any], circles: list[AssumedCircle]
) -> Camera:
    """Return a changed camera; a circle of confusion that was assumed for it joins the others."""
    intrinsics = replace(camera.intrinsics, **group(changes, "image."))
    lens_changes = group(changes, "lens.")
    focal_length = lens_changes.get("focal_length", camera.lens.focal_length)
    if CIRCLE in rig.assumed.get(camera.name, ()) and not changes.keys() & _TELL_CIRCLE:
        circles.append(assumed_circle(camera.intrinsics, camera.lens.focal_length))

    def circle() -> float:
        if camera.lens.circle_of_confusion is not None:
            return camera.lens.circle_of_confusion
        circles.append(assumed_circle(intrinsics, check_focal_length(FOCAL_LENGTH, focal_length)))
        return circles[-1].metres

    lens = _changed_lens(camera.lens, lens_changes, focal_length, circle)
    return replace(camera, intrinsics=intrinsics, lens=lens)


def _changed_lens(
    lens: Lens, changes: dict[str, Any], focal_length: float, circle: Callable[[], float]
) -> Lens:
    f_number = changes.pop("f_number", None)
    given_circle = changes.pop("circle_of_confusion", None)
    if f_number is not None or given_circle is not None:
        if changes.get("hyperfocal_distance"):
            raise InputError(
                "--set", "either hyperfocal_distance or f_number and circle_of_confusion", "both"
            )
        if f_number is None:
            blur = check_circle(CIRCLE, given_circle)
            distance = lens.hyperfocal_distance * (focal_length / lens.focal_length) ** 2
            changes["hyperfocal_distance"] = distance * (circle() / blur)
        else:
            blur = circle() if given_circle is None else given_circle
            changes["hyperfocal_distance"] = hyperfocal_distance(focal_length, f_number, blur)
        changes["circle_of_confusion"] = blur
    elif "hyperfocal_distance" not in changes:
        # Keep the f-number and the circle of confusion.
        ratio = focal_length / lens.focal_length
        changes["hyperfocal_distance"] = lens.hyperfocal_distance * ratio * ratio
    if "max_focus" in changes:
        changes["max_focus"] = changes["max_focus"] or math.inf
    if "focus_distances" in changes:
        changes["focus_distances"] = tuple(d for d in changes["focus_distances"] if d) or None
    if "focus_steps" in changes:
        changes["focus_steps"] = changes["focus_steps"] or None
    return replace(lens, **changes)
