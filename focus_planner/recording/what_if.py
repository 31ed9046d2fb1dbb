"""What another request, lens or cost would have given: a recorded run with changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import hyperfocal_distance
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import RIG
from focus_planner.parameters.declaration import Value, group
from focus_planner.parameters.planner import DECLARATIONS, Settings
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.run import Run, rig_message

_DEFAULTS: dict[str, Value] = {
    declaration.name: declaration.default for declaration in DECLARATIONS
}
_OF_CAMERAS = ("lens.", "image.")
# What says nothing of how to plan, or cannot be changed afterwards.
_FIXED = ("frame_id", "warm_start")
# The usual choice of what is sharp on a sensor: its diagonal over 1500.
_CIRCLES_PER_DIAGONAL = 1500


@dataclass(frozen=True)
class Changed:
    """A run with changes, not yet planned.

    Attributes
    ----------
    run : Run
    notes : tuple of str
        What was assumed.
    """

    run: Run
    notes: tuple[str, ...]


def settable_names() -> list[str]:
    """Return the names that can be changed."""
    names = [d.name for d in DECLARATIONS if d.plans and d.name not in _FIXED]
    return names + [name.removeprefix("lens.") for name in names if name.startswith("lens.")]


def parse_changes(assignments: list[str]) -> dict[str, Value]:
    """Return the changes that texts such as ``"samples=65536"`` ask for, by parameter.

    Raises
    ------
    InputError
        If one is not NAME=VALUE, or names or says what cannot be set.
    """
    changes: dict[str, Value] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise InputError("--set", "NAME=VALUE", repr(assignment))
        if name not in settable_names():
            raise InputError("--set", f"one of {', '.join(settable_names())}", repr(name))
        name = name if name in _DEFAULTS else f"lens.{name}"
        if name in changes:
            raise InputError("--set", f"{name} once", "twice")
        changes[name] = _value(name, text)
    return changes


def with_changes(run: Run, changes: Mapping[str, Value]) -> Changed:
    """Return the run with parameters changed, under a name of its own.

    What the request said itself gives way to them. Changes of lens and image apply to every
    camera, whether it brought its own or not. A lens is given by its hyperfocal distance, or by
    f-number and circle of confusion: one of these may come from the recording, and the circle,
    where neither says it, is the sensor's diagonal over 1500.

    Raises
    ------
    InputError
        If a value is out of range, or the changes contradict each other.
    """
    before = run.beginning
    values = dict(before.settings.values)
    of_cameras = {n: v for n, v in changes.items() if n.startswith(_OF_CAMERAS)}
    values |= {n: v for n, v in changes.items() if n not in of_cameras}
    asked = {n: type(v)() if n in changes else v for n, v in before.asked.items()}
    text = None if "lens_tables" in changes else before.settings.lens_tables_text
    settings = Settings.from_values(values, text)
    beginning = replace(before, run_id=new_run_id(), settings=settings, asked=asked)
    _ = beginning.request
    changed = replace(run, beginning=beginning, ending=None, fault="not planned yet")
    if not of_cameras:
        return Changed(changed, ())
    notes: list[str] = []
    return Changed(_with_cameras(changed, of_cameras, notes), tuple(notes))


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
        kind = kinds.get(type(default), "numbers with commas between")
        raise InputError(f"--set {name}", kind, repr(text)) from None


def _with_cameras(run: Run, changes: Mapping[str, Value], notes: list[str]) -> Run:
    """Return the run with every rig that can be read changed, and said in full."""
    planner, optics = run.beginning.planner, run.beginning.settings.optics
    changed = {}
    for arrival in run.rigs():
        try:
            rig = arrival.read(optics)
        except InputError:
            continue  # it was refused, and still is
        circles = _circles(run, arrival.payload)
        cameras = tuple(_changed(camera, changes, circles, notes) for camera in rig.cameras)
        changed[arrival.payload] = Rig(cameras, rig.frame_id, rig.grid)
    inputs = tuple(
        rig_message(planner, changed[message.payload], message.at)
        if message.payload in changed
        else message
        for message in run.inputs
    )
    return replace(run, inputs=inputs)


def _circles(run: Run, payload: bytes) -> dict[str, float]:
    """Return the circles of confusion that a rig's message says, by camera, and the default's."""
    values: dict[str, Any] = dict(run.beginning.settings.values)
    circles: dict[str, float] = {"": values["lens.circle_of_confusion"]}
    message = next(message for message in run.inputs if message.payload == payload)
    if message.type_name == RIG:
        for camera in message.read().cameras:
            if camera.lens.focal_length:
                circles[camera.name] = camera.lens.circle_of_confusion
    return circles


def _changed(
    camera: Camera, changes: Mapping[str, Any], circles: Mapping[str, float], notes: list[str]
) -> Camera:
    intrinsics = replace(camera.intrinsics, **group(changes, "image."))
    of_lens = group(changes, "lens.")
    focal_length = of_lens.get("focal_length", camera.lens.focal_length)
    known = circles.get(camera.name, circles[""])

    def circle() -> float:
        return known or _usual_circle(intrinsics, focal_length, notes)

    lens = _changed_lens(camera.lens, of_lens, focal_length, circle)
    return replace(camera, intrinsics=intrinsics, lens=lens)


def _usual_circle(intrinsics: CameraIntrinsics, focal_length: float, notes: list[str]) -> float:
    diagonal = focal_length * math.hypot(
        intrinsics.width / intrinsics.fx, intrinsics.height / intrinsics.fy
    )
    circle = diagonal / _CIRCLES_PER_DIAGONAL
    note = (
        f"the recording says no circle of confusion: that of {1e3 * circle:.4f} mm, the sensor's"
        " diagonal over 1500, is taken (--set circle_of_confusion=... for another)"
    )
    if note not in notes:
        notes.append(note)
    return circle


def _changed_lens(
    lens: Lens, changes: dict[str, Any], focal_length: float, circle: Callable[[], float]
) -> Lens:
    f_number = changes.pop("f_number", None)
    given_circle = changes.pop("circle_of_confusion", None)
    if f_number is not None or given_circle is not None:
        if changes.get("hyperfocal_distance"):
            raise InputError(
                "--set", "hyperfocal_distance, or f_number and circle_of_confusion", "both"
            )
        f_number = _f_number(lens, circle()) if f_number is None else f_number
        blur = circle() if given_circle is None else given_circle
        changes["hyperfocal_distance"] = hyperfocal_distance(focal_length, f_number, blur)
    elif "hyperfocal_distance" not in changes:
        # The same f-number, and the same blur.
        ratio = focal_length / lens.focal_length
        changes["hyperfocal_distance"] = lens.hyperfocal_distance * ratio * ratio
    if "max_focus" in changes:
        changes["max_focus"] = changes["max_focus"] or math.inf
    if "focus_distances" in changes:
        changes["focus_distances"] = tuple(d for d in changes["focus_distances"] if d) or None
    if "focus_steps" in changes:
        changes["focus_steps"] = changes["focus_steps"] or None
    return replace(lens, **changes)


def _f_number(lens: Lens, circle: float) -> float:
    return float(lens.focal_length**2 / (lens.hyperfocal_distance * circle))
