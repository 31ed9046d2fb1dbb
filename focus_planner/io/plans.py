"""plan.json: what a plan says, for programs and people."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.validation import InputError
from focus_planner.io.files import read_text, whole_file


def plan_to_json(plan: FocusPlan) -> str:
    """Return a plan as the text of plan.json.

    Numbers have all their digits. JSON knows no infinity: a far limit that is infinite is null.
    Cameras have the list ``shots`` where they take several, and ``device_value`` and
    ``device_unit`` where their lenses have a table: a plan without tables is the text that it
    always was.
    """
    names = [field.name for field in fields(FocusPlan) if field.name != "cameras"]
    lines = [f"  {json.dumps(name)}: {json.dumps(getattr(plan, name))}" for name in names]
    cameras = ",\n".join(f"    {json.dumps(_camera_to_json(c))}" for c in plan.cameras)
    lines.append(f'  "shots": {plan.shots}')
    lines.append(f'  "cameras": [\n{cameras}\n  ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def save_plan(plan: FocusPlan, path: Path) -> None:
    """Write plan.json, whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with whole_file(path) as file:
        file.write(plan_to_json(plan).encode())


def load_plan(path: Path) -> FocusPlan:
    """Read plan.json; what it does not know of is passed over.

    Raises
    ------
    InputError
        If it is not a plan.
    """
    text = read_text(path, "a plan.json")
    try:
        data = json.loads(text)
    except ValueError as error:
        raise InputError(str(path), "a plan.json", f"no JSON: {error}") from None
    try:
        return _plan_from_json(data)
    except KeyError as error:
        raise InputError(str(path), f"a plan.json with the key {error}", "none") from None
    except (TypeError, AttributeError) as error:
        raise InputError(str(path), "a plan.json", str(error)) from None


def _camera_to_json(camera: CameraFocus) -> dict[str, Any]:
    values = _sharp_to_json(asdict(camera)) | {"status": camera.status.name.lower()}
    shots = [_sharp_to_json(shot) for shot in values.pop("shots")]
    return values | {"shots": shots} if len(shots) > 1 else values


def _sharp_to_json(values: dict[str, Any]) -> dict[str, Any]:
    far = values["far_limit"]
    given = {k: v for k, v in values.items() if v is not None or not k.startswith("device_")}
    return given | {"far_limit": far if math.isfinite(far) else None}


def _plan_from_json(data: dict[str, Any]) -> FocusPlan:
    known = {field.name: data[field.name] for field in fields(FocusPlan)}
    return FocusPlan(**known | {"cameras": tuple(map(_camera_from_json, data["cameras"]))})


def _camera_from_json(data: dict[str, Any]) -> CameraFocus:
    # What an only shot is, is what is said of the camera itself.
    shots = tuple(Shot(**_known(Shot, shot)) for shot in data.get("shots", [data]))
    status = CameraStatus[data["status"].upper()]
    return CameraFocus(**_known(CameraFocus, data | {"status": status, "shots": shots}))


def _known(kind: type[CameraFocus | Shot], data: dict[str, Any]) -> dict[str, Any]:
    """Return what ``kind`` is made of."""
    far = math.inf if data["far_limit"] is None else data["far_limit"]
    data = {"device_value": None, "device_unit": None} | data
    return {field.name: data[field.name] for field in fields(kind)} | {"far_limit": far}
