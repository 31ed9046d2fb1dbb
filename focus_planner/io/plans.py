# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""plan.json: a plan for programs and people."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.core.validation import InputError, check_number, check_whole
from focus_planner.io.files import atomic_write, read_text
from focus_planner.io.json_values import read_json
from focus_planner.io.quoting import abbreviated, kind_of

_EXPECTED = "a plan.json"
_LARGEST = 1e15  # of all numbers: metres, seconds, what drivers take
_APART = ("notes", "subjects", "cameras", "sharp_areas", "resolution")
_MAY_BE_INFINITE = ("far_limit", "from_sensor", "max_mm_per_pixel")
_MAY_BE_NEGATIVE = ("device_value", "from_sensor")
_COUNT = re.compile(r"[1-9][0-9]{0,8}")
# Some have them, and older versions wrote neither views nor limits.
_MAY_BE_MISSING = (
    *("device_value", "device_unit", "from_sensor"),
    *("views", "images", "max_mm_per_pixel"),
)


def plan_to_json(plan: FocusPlan) -> str:
    """Return a plan as the text of plan.json.

    Numbers are written with all their digits; an infinite distance, or no limit, is null, as JSON
    has no infinity. A camera with several shots, or none, has the list ``shots``, and one whose
    lens has a table has ``device_value`` and ``device_unit``; other cameras do not have these keys,
    and those of older plans have no ``from_sensor``. Sharp areas go by the number of views; older
    plans have neither these nor a ``resolution``.
    """
    names = [each.name for each in fields(FocusPlan) if each.name not in _APART]
    values = {name: getattr(plan, name) for name in names} | {"shots": plan.shots}
    values["max_mm_per_pixel"] = _finite(plan.max_mm_per_pixel)
    values |= _sharpness_to_json(plan)
    lines = [f"  {json.dumps(name)}: {json.dumps(value)}" for name, value in values.items()]
    lines.append(_list_to_json("notes", [vars(note) for note in plan.notes]))
    lines.append(_list_to_json("subjects", [asdict(subject) for subject in plan.subjects]))
    lines.append(_list_to_json("cameras", map(_camera_to_json, plan.cameras)))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def save_plan(plan: FocusPlan, path: Path) -> None:
    """Write plan.json atomically.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with atomic_write(path) as file:
        file.write(plan_to_json(plan).encode())


def load_plan(path: Path) -> FocusPlan:
    """Read plan.json, ignoring unknown keys.

    Raises
    ------
    InputError
        If it is not a plan.
    """
    data = read_json(str(path), read_text(path, _EXPECTED), _EXPECTED)
    return _plan_from_json(str(path), data)


def _list_to_json(name: str, entries: Iterable[dict[str, Any]]) -> str:
    """Return a list with one line per entry."""
    lines = ",\n".join(f"    {json.dumps(entry)}" for entry in entries)
    return f'  "{name}": [\n{lines}\n  ]' if lines else f'  "{name}": []'


def _sharpness_to_json(plan: FocusPlan) -> dict[str, Any]:
    told: dict[str, Any] = {}
    if plan.sharp_areas:
        told["sharp_area"] = {str(each.views): each.area for each in plan.sharp_areas}
        told["sharp_standard_error"] = {
            str(each.views): each.standard_error for each in plan.sharp_areas
        }
        told["resolution"] = plan.resolution and vars(plan.resolution)
    return told


def _camera_to_json(camera: CameraFocus) -> dict[str, Any]:
    values = _focus_to_json(asdict(camera)) | {"status": camera.status.name.lower()}
    shots = [_focus_to_json(shot) for shot in values.pop("shots")]
    return values | {"shots": shots} if len(shots) != 1 else values


def _focus_to_json(values: dict[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in values.items() if value is not None}
    return given | {key: _finite(given[key]) for key in _MAY_BE_INFINITE if key in given}


def _finite(value: float) -> float | None:
    return None if value == math.inf else value


def _plan_from_json(where: str, data: Any) -> FocusPlan:
    known = _fields_of(FocusPlan, where, data)
    if known.get("views") == 0:
        raise InputError(f"{where}.views", "at least 1", "0")
    if known.get("max_mm_per_pixel") == 0:
        raise InputError(f"{where}.max_mm_per_pixel", "above 0, or null for no limit", "0")
    # Version 0.1 wrote no notes.
    notes = tuple(
        Note(**_fields_of(Note, at, note))
        for at, note in _entries(where, "notes", data.get("notes", []))
    )
    subjects = tuple(
        SubjectQuality(**_fields_of(SubjectQuality, at, subject))
        for at, subject in _entries(where, "subjects", data.get("subjects", []))
    )
    cameras = tuple(
        _camera_from_json(at, camera)
        for at, camera in _entries(where, "cameras", _value(where, data, "cameras"))
    )
    _check_shots(where, known.get("images", 0), cameras)
    return FocusPlan(
        **known,
        notes=notes,
        cameras=cameras,
        subjects=subjects,
        sharp_areas=_sharp_areas(where, data),
        resolution=_resolution(where, data),
    )


def _check_shots(where: str, images: int, cameras: tuple[CameraFocus, ...]) -> None:
    """Check how many shots cameras have."""
    counts = [len(camera.shots) for camera in cameras]
    if not images and len(set(counts)) > 1:
        raise InputError(f"{where}: cameras", "as many shots of each", "different numbers")
    if images and sum(counts) > images:
        expected = f"at most {images} shots, as images says"
        raise InputError(f"{where}: cameras", expected, str(sum(counts)))
    for i, (camera, count) in enumerate(zip(cameras, counts, strict=True)):
        at = f"{where}.cameras[{i}].shots"
        takes_none = camera.status in {CameraStatus.DROPPED, CameraStatus.SEES_NOTHING}
        if not count and not (images and takes_none):
            raise InputError(at, "at least one", "none")
        if count and camera.status is CameraStatus.DROPPED:
            raise InputError(at, "none, as status says", str(count))


def _sharp_areas(where: str, data: Any) -> tuple[SharpArea, ...]:
    told = {
        key: _by_views(f"{where}.{key}", data.get(key, {}))
        for key in ("sharp_area", "sharp_standard_error")
    }
    areas, errors = told.values()
    if areas.keys() != errors.keys():
        raise InputError(f"{where}: {' and '.join(told)}", "the same numbers of views", "others")
    return tuple(SharpArea(views, areas[views], errors[views]) for views in sorted(areas))


def _by_views(where: str, data: Any) -> dict[int, float]:
    """Return square metres by the number of views, which JSON has as text."""
    if not isinstance(data, dict):
        raise InputError(where, "square metres by the number of views", kind_of(data))
    for key in data:
        if not _COUNT.fullmatch(key):
            raise InputError(where, "numbers of views as keys", abbreviated(key))
    return {int(key): _number(f"{where}[{key}]", key, value) for key, value in data.items()}


def _resolution(where: str, data: Any) -> Resolution | None:
    told = data.get("resolution")
    if told is None:
        return None
    return Resolution(**_fields_of(Resolution, f"{where}.resolution", told))


def _camera_from_json(where: str, data: Any) -> CameraFocus:
    values = _fields_of(CameraFocus, where, data)
    # A single shot is described by the camera's own keys.
    shots = _entries(where, "shots", data.get("shots", [data]))
    return CameraFocus(
        **values,
        status=_status(f"{where}.status", _value(where, data, "status")),
        shots=tuple(Shot(**_fields_of(Shot, at, shot)) for at, shot in shots),
    )


def _status(where: str, name: Any) -> CameraStatus:
    for status in CameraStatus:
        if name == status.name.lower():
            return status
    known = ", ".join(status.name.lower() for status in CameraStatus)
    raise InputError(where, f"one of {known}", abbreviated(name))


def _entries(where: str, name: str, listed: Any) -> list[tuple[str, Any]]:
    """Return the entries of a list, and what to call each in errors."""
    if not isinstance(listed, list):
        raise InputError(f"{where}: {name}", "a list", kind_of(listed))
    return [(f"{where}: {name}[{i}]", entry) for i, entry in enumerate(listed)]


def _fields_of(kind: type[Any], where: str, data: Any) -> dict[str, Any]:
    """Return the constructor's arguments for ``kind``, without those that are lists."""
    if not isinstance(data, dict):
        raise InputError(where, _EXPECTED, kind_of(data))
    found = {}
    for name, read in ((f.name, _READERS.get(str(f.type))) for f in fields(kind)):
        if read is not None and (name in data or name not in _MAY_BE_MISSING):
            found[name] = read(f"{where}.{name}", name, _value(where, data, name))
    return found


def _value(where: str, data: dict[str, Any], key: str) -> Any:
    if key not in data:
        raise InputError(where, f"{_EXPECTED} with the key {key!r}", "none")
    return data[key]


def _number(where: str, name: str, value: Any) -> float:
    """Return a number; a distance must be one that a lens can obey."""
    if name in _MAY_BE_INFINITE and value is None:
        return math.inf
    above = 0.0 if name == "focus_distance" else None
    at_least = None if name in _MAY_BE_NEGATIVE else 0.0
    return check_number(where, value, above=above, at_least=at_least, at_most=_LARGEST)


def _optional_number(where: str, name: str, value: Any) -> float | None:
    return None if value is None and name not in _MAY_BE_INFINITE else _number(where, name, value)


def _truth(where: str, _: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(where, "true or false", kind_of(value))
    return value


def _text(where: str, _: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(where, "text", kind_of(value))
    return value


_READERS: dict[str, Callable[[str, str, Any], Any]] = {
    "str": _text,
    "str | None": lambda where, name, value: None if value is None else _text(where, name, value),
    "float": _number,
    "float | None": _optional_number,
    "int": lambda where, _, value: check_whole(where, value, 0),
    "bool": _truth,
}
