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
_STATUSES = {CameraStatus.PLANNED, CameraStatus.UNASSIGNED, CameraStatus.SEES_NOTHING}
_MAX_UNIT = 64


def check_plan(message: Message) -> None:
    """Raise unless a ``FocusPlan`` message can be put in force.

    Raises
    ------
    InputError
        If a camera's name makes no topic, a number is not one that it can be (a distance that is
        not above 0, a cost of NaN), or numbers contradict each other.
    """
    for name in ("cost", "fresh_cost", "surface_area", "covered_area", "in_focus_area"):
        check_number(name, getattr(message, name), at_least=0)
    for name in ("depth_tolerance", "solve_seconds", "total_seconds"):
        check_number(name, getattr(message, name), at_least=0)
    if not math.isnan(message.lower_bound):
        check_number("lower_bound", message.lower_bound)
    if not message.cameras:
        raise InputError("cameras", "at least one", "none")
    names = Counter(camera.name for camera in message.cameras)
    name, times = names.most_common(1)[0]
    if times > 1:
        raise InputError("cameras", "different names", f"{name!r} {times} times")
    shots = {len(camera.shots) for camera in message.cameras}
    if len(shots) > 1:
        got = f"{min(shots)} and {max(shots)}"
        raise InputError("cameras", "the same number of shots for all", got)
    for camera in message.cameras:
        check_camera_name(camera.name)
        _check_camera(camera, f"{camera.name}: ", message.samples)


def _check_camera(camera: Message, where: str, samples: int) -> None:
    if camera.status not in _STATUSES:
        expected = f"{min(_STATUSES)} to {max(_STATUSES)}"
        raise InputError(f"{where}status", expected, str(camera.status))
    _check_focus(camera, where, samples)
    if camera.dioptres and not _same(camera.dioptres * camera.focus_distance, 1.0):
        got = f"{camera.dioptres:g}"
        raise InputError(f"{where}dioptres", f"{1 / camera.focus_distance:g}", got)
    shots = camera.shots
    distances = [shot.focus_distance for shot in shots]
    if shots:
        for shot in shots:
            _check_focus(shot, where, samples)
        _check_sum(where, "assigned_samples", camera)
        _check_sum(where, "in_focus_samples", camera)
        if distances != sorted(distances) or camera.focus_distance not in distances:
            raise InputError(f"{where}shots", "ascending, the camera's among them", "others")
        if list(camera.bracket) != distances:
            raise InputError(f"{where}bracket", "the distances of the shots", "others")
    for distance in camera.bracket:
        check_number(f"{where}bracket", float(distance), above=0)
    _check_device(camera, where)


def _check_focus(focus: Message, where: str, samples: int) -> None:
    """Check what cameras and shots have in common."""
    distance = check_number(f"{where}focus_distance", focus.focus_distance, above=0)
    near = check_number(f"{where}near_limit", focus.near_limit, above=0)
    far = check_number(f"{where}far_limit", focus.far_limit, above=0, infinite=True)
    if near > distance * (1 + _ROUNDING) or far < distance * (1 - _ROUNDING):
        got = f"{near:g}, {distance:g}, {far:g}"
        raise InputError(f"{where}near_limit, focus_distance, far_limit", "ascending", got)
    if not math.isnan(focus.from_sensor):
        check_number(f"{where}from_sensor", focus.from_sensor, at_least=0)
    if not focus.in_focus_samples <= focus.assigned_samples <= samples:
        got = f"{focus.in_focus_samples}, {focus.assigned_samples}, {samples}"
        what = f"{where}in_focus_samples, assigned_samples, samples of the plan"
        raise InputError(what, "ascending", got)


def _check_sum(where: str, name: str, camera: Message) -> None:
    total = sum(getattr(shot, name) for shot in camera.shots)
    if getattr(camera, name) != total:
        raise InputError(f"{where}{name}", f"the shots' total, {total}", f"{getattr(camera, name)}")


def _check_device(camera: Message, where: str) -> None:
    unit = camera.device_unit
    if len(unit) > _MAX_UNIT or not unit.isprintable():
        expected = f"at most {_MAX_UNIT} printable characters"
        raise InputError(f"{where}device_unit", expected, repr(unit))
    if unit:
        check_number(f"{where}device_value", camera.device_value)
    for value in camera.device_bracket:
        check_number(f"{where}device_bracket", float(value))
    if len(camera.device_bracket) not in {0, len(camera.bracket)}:
        got = f"{len(camera.device_bracket)} for {len(camera.bracket)}"
        raise InputError(f"{where}device_bracket", "as many as distances in the bracket", got)


def _same(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=_ROUNDING)
