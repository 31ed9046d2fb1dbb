# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Whether a plan that comes from outside this process can be one of the planner's."""

from __future__ import annotations

import math
from collections import Counter

from focus_planner.core.planning.plan import CameraStatus
from focus_planner.core.rig.camera import check_camera_name
from focus_planner.core.validation import InputError, check_number
from focus_planner.messages.reading import Message

# Of two computations of the same number.
_ROUNDING = 1e-9
_STATUSES = set(CameraStatus) - {CameraStatus.UNKNOWN}
_MAX_UNIT = 64
_AT_LEAST_ZERO = (
    "cost",
    "fresh_cost",
    "surface_area",
    "covered_area",
    "in_focus_area",
    "depth_tolerance",
    "max_mm_per_pixel",
    "solve_seconds",
    "total_seconds",
)
_AT_LEAST_ZERO_OF_SUBJECTS = (
    *("weight", "multiplier", "cost", "fresh_cost", "fresh_standard_error", "surface_area"),
    *("covered_area", "covered_standard_error", "in_focus_area", "in_focus_standard_error"),
)


def check_values(message: Message) -> None:
    """Raise unless every value of a ``FocusPlan`` message is one that it can have.

    Raises
    ------
    InputError
        If a camera's name makes no topic, or a number is not one that it can be: a distance that is
        not above 0, a cost of NaN.
    """
    for name in _AT_LEAST_ZERO:
        check_number(name, getattr(message, name), at_least=0)
    _check_number_or_nan("lower_bound", message.lower_bound)
    for name in ("median_mm_per_pixel", "percentile_90_mm_per_pixel"):
        _check_number_or_nan(name, getattr(message, name), at_least=0)
    _check_sharp_areas(message)
    for subject in message.subjects:
        for name in _AT_LEAST_ZERO_OF_SUBJECTS:
            check_number(f"{subject.surface}: {name}", getattr(subject, name), at_least=0)
    for camera in message.cameras:
        check_camera_name(camera.name)
        where = f"{camera.name}: "
        for focus in (camera, *camera.shots):
            check_number(f"{where}focus_distance", focus.focus_distance, above=0)
            check_number(f"{where}near_limit", focus.near_limit, above=0)
            check_number(f"{where}far_limit", focus.far_limit, above=0, infinite=True)
            _check_number_or_nan(f"{where}from_sensor", focus.from_sensor)
        for distance in camera.bracket:
            check_number(f"{where}bracket", float(distance), above=0)
        for value in camera.device_bracket:
            check_number(f"{where}device_bracket", float(value))
        if camera.device_unit:
            check_number(f"{where}device_value", camera.device_value)


def _check_sharp_areas(message: Message) -> None:
    counts = {len(message.sharp_views), len(message.sharp_area), len(message.sharp_standard_error)}
    if len(counts) > 1:
        got = " and ".join(map(str, sorted(counts)))
        names = "sharp_views, sharp_area, sharp_standard_error"
        raise InputError(names, "as many values of each", got)
    if any(views < 1 for views in message.sharp_views):
        raise InputError("sharp_views", "numbers of at least 1", "0")
    for name in ("sharp_area", "sharp_standard_error"):
        for value in getattr(message, name):
            check_number(name, float(value), at_least=0)


def check_plan(message: Message) -> None:
    """Raise unless a ``FocusPlan`` message can be put in force.

    Raises
    ------
    InputError
        If a value is not one that it can have, or values contradict each other.
    """
    check_values(message)
    if not message.cameras:
        raise InputError("cameras", "at least one", "none")
    name, times = Counter(camera.name for camera in message.cameras).most_common(1)[0]
    if times > 1:
        raise InputError("cameras", "different names", f"{name!r} {times} times")
    _check_shots(message)
    for camera in message.cameras:
        _check_camera(camera, f"{camera.name}: ", message.samples)


def _check_shots(message: Message) -> None:
    """Check how many shots cameras have."""
    shots = [len(camera.shots) for camera in message.cameras]
    if not message.images and len(set(shots)) > 1:
        got = f"{min(shots)} and {max(shots)}"
        raise InputError("cameras", "the same number of shots for all", got)
    if message.images and sum(shots) > message.images:
        raise InputError(
            "cameras", f"at most {message.images} shots, as images says", str(sum(shots))
        )
    for camera, count in zip(message.cameras, shots, strict=True):
        takes_none = camera.status in {CameraStatus.DROPPED, CameraStatus.SEES_NOTHING}
        if not count and not (message.images and takes_none):
            raise InputError(f"{camera.name}: shots", "at least one", "none")
        if count and camera.status == CameraStatus.DROPPED:
            raise InputError(f"{camera.name}: shots", "none, as status says", str(count))


def _check_camera(camera: Message, where: str, samples: int) -> None:
    if camera.status not in _STATUSES:
        expected = f"{min(_STATUSES)} to {max(_STATUSES)}"
        raise InputError(f"{where}status", expected, str(camera.status))
    product = camera.dioptres * camera.focus_distance
    if not math.isclose(product, 1.0, rel_tol=_ROUNDING):
        expected = f"{1 / camera.focus_distance:g}, as focus_distance says"
        raise InputError(f"{where}dioptres", expected, f"{camera.dioptres:g}")
    for focus in (camera, *camera.shots):
        _check_order(focus, where, samples)
    distances = [shot.focus_distance for shot in camera.shots]
    if distances != sorted(distances) or (distances and camera.focus_distance not in distances):
        raise InputError(f"{where}shots", "ascending, the camera's among them", "others")
    if list(camera.bracket) != distances:
        raise InputError(f"{where}bracket", "the distances of the shots", "others")
    if len(camera.device_bracket) not in {0, len(distances)}:
        got = f"{len(camera.device_bracket)} for {len(distances)} shots"
        raise InputError(f"{where}device_bracket", "as many values as shots", got)
    for name in ("assigned_samples", "in_focus_samples"):
        total = sum(getattr(shot, name) for shot in camera.shots)
        if getattr(camera, name) != total:
            got = f"{getattr(camera, name)}"
            raise InputError(f"{where}{name}", f"the shots' total, {total}", got)
    if len(camera.device_unit) > _MAX_UNIT or not camera.device_unit.isprintable():
        expected = f"at most {_MAX_UNIT} printable characters"
        raise InputError(f"{where}device_unit", expected, repr(camera.device_unit))


def _check_order(focus: Message, where: str, samples: int) -> None:
    """Check what cameras and shots have in common."""
    near, distance, far = focus.near_limit, focus.focus_distance, focus.far_limit
    if not near * (1 - _ROUNDING) <= distance <= far * (1 + _ROUNDING):
        got = f"{near:g}, {distance:g}, {far:g}"
        raise InputError(f"{where}near_limit, focus_distance, far_limit", "ascending", got)
    if not focus.in_focus_samples <= focus.assigned_samples <= samples:
        got = f"{focus.in_focus_samples}, {focus.assigned_samples}, {samples}"
        what = f"{where}in_focus_samples, assigned_samples, samples of the plan"
        raise InputError(what, "ascending", got)


def _check_number_or_nan(name: str, value: float, at_least: float | None = None) -> None:
    """Check a number for which NaN stands for none."""
    if not math.isnan(value):
        check_number(name, value, at_least=at_least)
