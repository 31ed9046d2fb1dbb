"""plan.json: a plan for programs and people."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.validation import InputError
from focus_planner.io.files import atomic_write, read_text

_LISTS = ("notes", "cameras")
_MAY_BE_INFINITE = ("far_limit", "from_sensor")
_MAY_BE_MISSING = ("device_value", "device_unit", "from_sensor")


def plan_to_json(plan: FocusPlan) -> str:
    """Return a plan as the text of plan.json.

    Numbers are written with all their digits; an infinite distance is null, as JSON has no
    infinity. A camera with several shots has the list ``shots``, and one whose lens has a table
    has ``device_value`` and ``device_unit``; other cameras do not have these keys, and those of
    older plans have no ``from_sensor``.
    """
    names = [each.name for each in fields(FocusPlan) if each.name not in _LISTS]
    lines = [f"  {json.dumps(name)}: {json.dumps(getattr(plan, name))}" for name in names]
    lines.append(f'  "shots": {plan.shots}')
    lines.append(_list_to_json("notes", [vars(note) for note in plan.notes]))
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
    text = read_text(path, "a plan.json")
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise InputError(str(path), "a plan.json", f"invalid JSON at {place}") from None
    except (RecursionError, ValueError):  # numbers of thousands of digits are refused as well
        raise InputError(str(path), "a plan.json", "JSON of something else") from None
    try:
        return _plan_from_json(data)
    except KeyError as error:
        raise InputError(str(path), f"a plan.json with the key {error}", "none") from None
    except (TypeError, AttributeError):
        raise InputError(str(path), "a plan.json", "JSON of something else") from None


def _list_to_json(name: str, entries: Iterable[dict[str, Any]]) -> str:
    """Return a list with one line per entry."""
    lines = ",\n".join(f"    {json.dumps(entry)}" for entry in entries)
    return f'  "{name}": [\n{lines}\n  ]' if lines else f'  "{name}": []'


def _camera_to_json(camera: CameraFocus) -> dict[str, Any]:
    values = _focus_to_json(asdict(camera)) | {"status": camera.status.name.lower()}
    shots = [_focus_to_json(shot) for shot in values.pop("shots")]
    return values | {"shots": shots} if len(shots) > 1 else values


def _focus_to_json(values: dict[str, Any]) -> dict[str, Any]:
    given = {key: value for key, value in values.items() if value is not None}
    return given | {key: None for key in _MAY_BE_INFINITE if given.get(key) == math.inf}


def _plan_from_json(data: dict[str, Any]) -> FocusPlan:
    known = {each.name: data[each.name] for each in fields(FocusPlan) if each.name not in _LISTS}
    # Version 0.1 wrote no notes.
    notes = tuple(Note(note["code"], note["text"]) for note in data.get("notes", ()))
    cameras = tuple(map(_camera_from_json, data["cameras"]))
    return FocusPlan(**known, notes=notes, cameras=cameras)


def _camera_from_json(data: dict[str, Any]) -> CameraFocus:
    # A single shot is described by the camera's own keys.
    shots = tuple(Shot(**_fields_of(Shot, shot)) for shot in data.get("shots", [data]))
    status = CameraStatus[data["status"].upper()]
    return CameraFocus(**_fields_of(CameraFocus, data | {"status": status, "shots": shots}))


def _fields_of(kind: type[CameraFocus | Shot], data: dict[str, Any]) -> dict[str, Any]:
    """Return the constructor's arguments for ``kind``."""
    infinite = {key: math.inf for key in _MAY_BE_INFINITE if key in data and data[key] is None}
    data = dict.fromkeys(_MAY_BE_MISSING) | data | infinite
    return {field.name: data[field.name] for field in fields(kind)}
