"""plan.json: what a plan says, for programs and people."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from focus_planner.core.checks import InputError
from focus_planner.core.planning import CameraFocus, FocusPlan
from focus_planner.core.types import CameraStatus
from focus_planner.io.files import read_text, whole_file


def plan_to_json(plan: FocusPlan) -> str:
    """Return a plan as the text of plan.json.

    Numbers have all their digits. JSON knows no infinity: a far limit that is infinite is null.
    """
    names = [field.name for field in fields(FocusPlan) if field.name != "cameras"]
    lines = [f"  {json.dumps(name)}: {json.dumps(getattr(plan, name))}" for name in names]
    cameras = ",\n".join(f"    {json.dumps(_camera_to_json(c))}" for c in plan.cameras)
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
    return asdict(camera) | {
        "status": camera.status.name.lower(),
        "far_limit": camera.far_limit if math.isfinite(camera.far_limit) else None,
    }


def _plan_from_json(data: dict[str, Any]) -> FocusPlan:
    known = {field.name: data[field.name] for field in fields(FocusPlan)}
    return FocusPlan(**known | {"cameras": tuple(map(_camera_from_json, data["cameras"]))})


def _camera_from_json(data: dict[str, Any]) -> CameraFocus:
    known = {field.name: data[field.name] for field in fields(CameraFocus)}
    return CameraFocus(
        **known
        | {
            "status": CameraStatus[data["status"].upper()],
            "far_limit": math.inf if data["far_limit"] is None else data["far_limit"],
        }
    )
