# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans and notes from messages."""

from __future__ import annotations

import math
from dataclasses import fields
from itertools import zip_longest

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.messages.reading import Message


def shot_from_message(message: Message, device_value: float | None = None) -> Shot:
    """Return the shot; its device value comes from the bracket of its camera's message."""
    return Shot(
        focus_distance=message.focus_distance,
        near_limit=message.near_limit,
        far_limit=message.far_limit,
        assigned_samples=message.assigned_samples,
        in_focus_samples=message.in_focus_samples,
        device_value=device_value,
        from_sensor=_told(message.from_sensor),
    )


def camera_focus_from_message(message: Message) -> CameraFocus:
    """Return the focus of one camera."""
    # Without a unit, as in messages older than the unit, device values mean nothing.
    unit, bracket = message.device_unit or None, list(map(float, message.device_bracket))
    shots = zip_longest(message.shots, bracket)
    return CameraFocus(
        name=message.name,
        status=CameraStatus(message.status),
        focus_distance=message.focus_distance,
        near_limit=message.near_limit,
        far_limit=message.far_limit,
        assigned_samples=message.assigned_samples,
        in_focus_samples=message.in_focus_samples,
        shots=tuple(shot_from_message(shot, value) for shot, value in shots),
        device_value=message.device_value if unit else None,
        device_unit=unit,
        from_sensor=_told(message.from_sensor),
    )


def _told(from_sensor: float) -> float | None:
    """Return the distance; None for NaN, and for the 0 of runs older than the field."""
    return None if math.isnan(from_sensor) or from_sensor == 0 else from_sensor


def plan_from_message(message: Message) -> FocusPlan:
    """Return the plan, without the solved problem, which messages do not hold."""
    return FocusPlan(
        method=message.method,
        cost=message.cost,
        lower_bound=None if math.isnan(message.lower_bound) else message.lower_bound,
        converged=message.converged,
        samples=message.samples,
        seed=message.seed,
        views=message.views or 1,  # 0 in runs older than the field
        depth_tolerance=message.depth_tolerance,
        images=message.images,
        max_mm_per_pixel=message.max_mm_per_pixel or math.inf,
        fresh_cost=message.fresh_cost,
        fresh_standard_error=message.fresh_standard_error,
        fresh_samples=message.fresh_samples,
        surface_area=message.surface_area,
        covered_area=message.covered_area,
        in_focus_area=message.in_focus_area,
        in_focus_standard_error=message.in_focus_standard_error,
        sharp_areas=_sharp_areas(message),
        resolution=_resolution(message),
        solve_seconds=message.solve_seconds,
        total_seconds=message.total_seconds,
        notes=tuple(map(note_from_message, message.notes)),
        cameras=tuple(camera_focus_from_message(focus) for focus in message.cameras),
        subjects=tuple(map(subject_from_message, message.subjects)),
    )


def _sharp_areas(message: Message) -> tuple[SharpArea, ...]:
    told = (message.sharp_views, message.sharp_area, message.sharp_standard_error)
    views, areas, errors = (list(each) for each in told)
    return tuple(
        SharpArea(int(count), float(area), float(error))
        for count, area, error in zip(views, areas, errors, strict=True)
    )


def _resolution(message: Message) -> Resolution | None:
    median, most = message.median_mm_per_pixel, message.percentile_90_mm_per_pixel
    # 0 in runs older than the fields.
    return None if math.isnan(median) or median == 0 else Resolution(median, most)


def subject_from_message(message: Message) -> SubjectQuality:
    """Return what a plan is worth for one of several subjects."""
    names = (field.name for field in fields(SubjectQuality))
    return SubjectQuality(**{name: getattr(message, name) for name in names})


def note_from_message(message: Message) -> Note:
    """Return the note."""
    return Note(message.code, message.text)
