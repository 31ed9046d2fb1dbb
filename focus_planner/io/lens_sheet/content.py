# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is on a lens sheet, whatever it is written as."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import Enum

from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.planning.plan_text import for_views, resolution_text
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.rig.walk import walking_order
from focus_planner.core.text import printable
from focus_planner.core.validation import InputError

Value = str | int | float | None

#: What only programs are told of a picture: its number in shooting order, whether it is needed (1)
#: or may be skipped (0), and the pose of the optical frame, in metres and as a quaternion, with the
#: name of the frame that it is in.
CAPTURE = ("picture", "take", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw", "frame")

# Decimals of a distance: at least millimetres, at most micrometres.
_FEWEST, _MOST = 3, 6
_WHOLE = 2**53  # beyond it, a float counts in steps of more than one
_NOTHING = {
    CameraStatus.SEES_NOTHING: "nothing, sees no surface: leave as it is",
    CameraStatus.UNASSIGNED: "nothing, others image it better: leave as it is",
    CameraStatus.DROPPED: "nothing, takes no picture: leave as it is",
    CameraStatus.UNKNOWN: "unknown",
}
_NOT_FINE = "nothing, sees no surface finely enough: leave as it is"
_SKIPPED = "nothing: skip this shot"
# Of one camera, and of several.
_COUNTED = {
    CameraStatus.PLANNED: ("planned", "planned"),
    CameraStatus.UNASSIGNED: (
        "sees only what others image better",
        "see only what others image better",
    ),
    CameraStatus.SEES_NOTHING: ("sees nothing", "see nothing"),
    CameraStatus.DROPPED: ("takes no picture", "take no picture"),
    CameraStatus.UNKNOWN: ("unknown", "unknown"),
}


class Kind(Enum):
    """What a column holds."""

    TEXT = "text"
    NUMBER = "number"
    BOX = "box"  # to tick


@dataclass(frozen=True)
class Column:
    """A column.

    Attributes
    ----------
    key : str
        Its name for programs, with the unit: ``distance_m``.
    heading, unit : str
        For people; either may be empty.
    kind : Kind
    """

    key: str
    heading: str
    unit: str = ""
    kind: Kind = Kind.NUMBER


@dataclass(frozen=True)
class Cell:
    """A value with all its digits, and as it is printed: a text is printable in both."""

    value: Value
    text: str


@dataclass(frozen=True)
class Row:
    """One camera, or one of its shots.

    Attributes
    ----------
    cells : tuple of Cell
        One per column.
    capture : tuple of Value
        One per name in ``CAPTURE``: what a program that moves the camera needs beside them.
    idle : bool
        Whether there is nothing to set.
    """

    cells: tuple[Cell, ...]
    capture: tuple[Value, ...]
    idle: bool


@dataclass(frozen=True)
class LensSheet:
    """A lens sheet.

    Attributes
    ----------
    title : str
    facts : tuple of (str, str)
        What was planned, and how good it is: name and text.
    measures : tuple of (str, str)
        How the columns are measured: heading and text.
    notes : tuple of str
        What whoever sets the lenses should know about the plan.
    columns : tuple of Column
    rows : tuple of Row
        As one walks the rig or, if its cameras are a sequence, in shooting order; the shots of a
        camera one after the other.
    """

    title: str
    facts: tuple[tuple[str, str], ...]
    measures: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]


def lens_sheet(
    plan: FocusPlan,
    rig: Rig,
    *,
    surface: str = "",
    rig_file: str = "",
    made: datetime | None = None,
) -> LensSheet:
    """Return the lens sheet of a plan.

    Parameters
    ----------
    plan : FocusPlan
    rig : Rig
        That the plan is for.
    surface, rig_file : str, optional
        Names of the files that it was made from.
    made : datetime, optional
        When it was made.

    Raises
    ------
    InputError
        If the plan is for other cameras.
    """
    if [camera.name for camera in plan.cameras] != [camera.name for camera in rig.cameras]:
        raise InputError(
            "rig", "the cameras that the plan is for, in their order", "others", "give its own rig"
        )
    fields = _fields(plan)
    entries = [
        _Entry(plan.cameras[i], rig.cameras[i], shot, k)
        for i in walking_order(rig)
        for k, shot in _shots(plan.cameras[i])
        # A camera that is moved does not stop where it takes no picture.
        if k or not rig.sequence
    ]
    pictures = itertools.count(1)
    rows = (
        Row(
            tuple(cell(entry) for _, cell in fields),
            _capture(entry, next(pictures) if entry.number else None, rig.frame_id),
            idle=not entry.shot.assigned_samples,
        )
        for entry in entries
    )
    return LensSheet(
        title=f"Lens sheet for {_counted(len(rig), 'camera')}",
        facts=tuple(_facts(plan, rig, surface, rig_file, made)),
        measures=tuple(_measures(plan, rig)),
        notes=tuple(printable(note.text) for note in plan.notes),
        columns=tuple(column for column, _ in fields),
        rows=tuple(rows),
    )


# --- the table ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Entry:
    """What a row is about; shots are counted from 1, and 0 is where a lens rests without one."""

    camera: CameraFocus
    at: Camera
    shot: Shot
    number: int


def _shots(camera: CameraFocus) -> list[tuple[int, Shot]]:
    """Return a camera's shots and their numbers; of one without a picture, where its lens rests."""
    if camera.shots:
        return list(enumerate(camera.shots, 1))
    rest = Shot(
        camera.focus_distance,
        camera.near_limit,
        camera.far_limit,
        assigned_samples=0,
        in_focus_samples=0,
        device_value=camera.device_value,
        from_sensor=camera.from_sensor,
    )
    return [(0, rest)]


_Field = tuple[Column, Callable[[_Entry], Cell]]


def _fields(plan: FocusPlan) -> list[_Field]:
    """Return the columns, and what is in them."""
    decimals = decimals_of(plan)
    fields: list[_Field] = [
        (Column("set", "set", kind=Kind.BOX), lambda _: Cell(None, "")),
        (Column("name", "camera", kind=Kind.TEXT), lambda e: _text(e.camera.name)),
    ]
    if plan.shots > 1:
        shot = Column("shot", "shot", f"of {plan.shots}")
        fields.append((shot, lambda e: Cell(e.number or None, str(e.number or "–"))))
    fields += [
        (
            Column("distance_m", "distance", "m"),
            lambda e: _number(e.shot.focus_distance, decimals),
        ),
        (
            Column("from_sensor_m", "from the sensor", "m"),
            lambda e: _number(e.shot.from_sensor, decimals),
        ),
        (Column("dioptres", "dioptres", "1/m"), lambda e: _number(1 / e.shot.focus_distance, 3)),
    ]
    if _any_table(plan):
        value, unit = Column("device_value", "device value"), Column("device_unit", "unit")
        fields += [
            (value, lambda e: _device(e.shot.device_value)),
            (replace(unit, kind=Kind.TEXT), lambda e: _text(e.camera.device_unit)),
        ]
    return [
        *fields,
        (Column("near_m", "near", "m"), lambda e: _number(e.shot.near_limit, decimals)),
        (Column("far_m", "far", "m"), lambda e: _number(e.shot.far_limit, decimals)),
        (
            Column("holds", "what it holds", "of the surface", Kind.TEXT),
            lambda e: _text(_holds(plan, e.camera, e.shot)),
        ),
        (Column("in_focus", "in focus", "of it"), lambda e: _in_focus(e.shot)),
        (Column("checked", "checked", kind=Kind.BOX), lambda _: Cell(None, "")),
    ]


def _capture(entry: _Entry, picture: int | None, frame_id: str) -> tuple[Value, ...]:
    take = int(entry.shot.assigned_samples > 0)
    return (picture, take, *entry.at.position, *entry.at.orientation, printable(frame_id))


def _any_table(plan: FocusPlan) -> bool:
    return any(camera.device_unit is not None for camera in plan.cameras)


def _text(text: str | None) -> Cell:
    shown = printable(text) if text else text
    return Cell(shown, shown or "–")


def _number(value: float | None, decimals: int) -> Cell:
    if value is None:
        return Cell(None, "–")
    return Cell(value, f"{value:.{decimals}f}" if math.isfinite(value) else "∞")


def _device(value: float | None) -> Cell:
    if value is None:
        return Cell(None, "–")
    if value.is_integer() and abs(value) < _WHOLE:
        return Cell(int(value), f"{value:.0f}")
    return Cell(value, f"{value:.6g}")


def _holds(plan: FocusPlan, camera: CameraFocus, shot: Shot) -> str:
    if not shot.assigned_samples:
        if camera.status is CameraStatus.SEES_NOTHING and math.isfinite(plan.max_mm_per_pixel):
            return _NOT_FINE
        return _SKIPPED if camera.assigned_samples else _NOTHING[camera.status]
    share = _percent(shot.assigned_samples / plan.samples)
    return f"{_counted(shot.assigned_samples, 'sample')}, {share}"


def _in_focus(shot: Shot) -> Cell:
    if not shot.assigned_samples:
        return Cell(None, "–")
    share = shot.in_focus_samples / shot.assigned_samples
    return Cell(share, f"{math.floor(100 * share)} %")


def decimals_of(plan: FocusPlan) -> int:
    """Return how many decimals of a metre tell a quarter of the shallowest depth of field."""
    depths = [s.far_limit - s.near_limit for camera in plan.cameras for s in camera.shots]
    shallowest = min((depth for depth in depths if depth > 0), default=math.inf)
    if math.isinf(shallowest):
        return _FEWEST
    return min(max(math.ceil(-math.log10(shallowest / 4)), _FEWEST), _MOST)


# --- the head ----------------------------------------------------------------------------------


def _facts(
    plan: FocusPlan, rig: Rig, surface: str, rig_file: str, made: datetime | None
) -> list[tuple[str, str]]:
    frame = f"frame {rig.frame_id}"
    facts = [
        ("surface", surface),
        ("rig", f"{rig_file}, {frame}" if rig_file else frame),
        ("planned", f"{made:%Y-%m-%d %H:%M}" if made else ""),
        ("method", _method(plan)),
        ("fresh cost", _cost(plan)),
        ("in focus", _area(plan)),
        ("sharp", _sharp(plan)),
        ("resolution", resolution_text(plan.resolution) if plan.resolution else ""),
        ("cameras", _statuses(plan)),
        ("pictures", f"{plan.pictures}, of at most {plan.images}" if plan.images else ""),
    ]
    return [(name, printable(text)) for name, text in facts if text]


def _method(plan: FocusPlan) -> str:
    text = f"{plan.method}{for_views(plan)}, on {plan.samples} samples, seed {plan.seed}"
    if plan.depth_tolerance:
        text += f", for errors of depth up to {1000 * plan.depth_tolerance:g} mm"
    if math.isfinite(plan.max_mm_per_pixel):
        text += f", of what is imaged at {plan.max_mm_per_pixel:g} mm per pixel or finer"
    return text if plan.converged else f"{text}, ended before it converged"


def _cost(plan: FocusPlan) -> str:
    return (
        f"{plan.fresh_cost:.1f} ± {plan.fresh_standard_error:.1f} of 1000{for_views(plan)}"
        " (0 is perfect), on"
        f" {plan.fresh_samples} samples unseen by the solver"
    )


def _area(plan: FocusPlan) -> str:
    area = f"{plan.in_focus_area:.3f} ± {plan.in_focus_standard_error:.3f} m²"
    if not plan.surface_area:
        return area
    return f"{area}, {_percent(plan.in_focus_area / plan.surface_area)} of the surface"


def _sharp(plan: FocusPlan) -> str:
    """Return how much is sharp in how many views; empty if that is not told."""
    if not plan.sharp_areas or not plan.surface_area:
        return ""
    shares = (
        (sharp.views, sharp.area / plan.surface_area, sharp.standard_error / plan.surface_area)
        for sharp in plan.sharp_areas
    )
    parts = (f"{_percent(share)} ± {_percent(error)} in {views}" for views, share, error in shares)
    return f"{', '.join(parts)} views or more, of the surface"


def _statuses(plan: FocusPlan) -> str:
    counts = Counter(camera.status for camera in plan.cameras)
    return ", ".join(
        f"{counts[each]} {words[counts[each] > 1]}"
        for each, words in _COUNTED.items()
        if counts[each]
    )


def _measures(plan: FocusPlan, rig: Rig) -> list[tuple[str, str]]:
    marked = "what a focus ring is marked with: the same distance, measured from the sensor plane"
    lenses = _lenses([camera.lens for camera in rig.cameras])
    measures = [
        ("distance", "along the optical axis from the centre of projection, as planned"),
        ("from the sensor", f"{marked}, for {lenses}"),
        ("near, far", "what is in focus, from the centre of projection"),
    ]
    if _any_table(plan):
        measures.append(("device value", "what the lens's driver takes, from the lens's table"))
    return measures


def _lenses(lenses: Sequence[Lens]) -> str:
    lengths = [lens.focal_length for lens in lenses]
    low, high = (f"{1000 * length:.4g}" for length in (min(lengths), max(lengths)))
    of_length = f"of {low} mm" if low == high else f"of {low} to {high} mm"
    if any(lens.hiatus for lens in lenses):
        return f"lenses {of_length} with the hiatus that the rig states"
    return f"thin lenses {of_length}"


def _percent(share: float) -> str:
    percent = 100 * share
    return f"{percent:.1f} %" if percent >= 1 or not percent else f"{percent:.2g} %"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
