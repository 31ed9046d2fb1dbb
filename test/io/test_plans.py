# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from focus_planner.io.bodies import body
from focus_planner.io.plans import load_plan, plan_to_json, save_plan
from focus_planner.io.surfaces import load_surface

KEYS = [
    *("method", "cost", "lower_bound", "converged", "samples", "seed", "depth_tolerance"),
    *("fresh_cost", "fresh_standard_error", "fresh_samples"),
    *("surface_area", "covered_area", "in_focus_area", "in_focus_standard_error"),
    *("solve_seconds", "total_seconds", "views", "images", "max_mm_per_pixel", "shots"),
]
LIST_KEYS = ["notes", "subjects", "cameras"]
SHARP_KEYS = ["sharp_area", "sharp_standard_error", "resolution"]
CAMERA_KEYS = [
    *("name", "status", "focus_distance", "near_limit", "far_limit"),
    *("assigned_samples", "in_focus_samples"),
]
SENSOR_KEY = "from_sensor"
DEVICE_KEYS = ["device_value", "device_unit"]


def one_shot(name: str, status: CameraStatus, *values: Any) -> CameraFocus:
    *values, from_sensor = values
    shot = Shot(*values, from_sensor=from_sensor)
    return CameraFocus(name, status, *values, (shot,), from_sensor=from_sensor)


PLAN = FocusPlan(
    "em",
    1000 / 3,
    None,
    False,
    4096,
    2**40 + 1,
    0.001,
    *(1001 / 3, 0.1 + 0.2, 8192),
    *(1.9, 1.8, 1.7 + 1e-16, 1 / 7),
    *(0.1, 0.30000000000000004),
    (Note("default_lens", "nothing tells the lens"), Note("winding", "both ways")),
    (
        one_shot("a", CameraStatus.PLANNED, 0.1 + 0.2, 0.29, 0.31, 5, 4, 0.36 + 1e-16),
        one_shot("b", CameraStatus.UNASSIGNED, 12.0, 5.5, math.inf, 0, 0, 12.05 / 3),
        one_shot("c", CameraStatus.SEES_NOTHING, 1 / 3, 0.3, 0.4, 0, 0, math.inf),
    ),
)


def refuse_constant(name: str) -> float:
    raise AssertionError(name)


def test_it_has_the_keys_of_the_contract_and_is_standard_json() -> None:
    data = json.loads(plan_to_json(PLAN), parse_constant=refuse_constant)
    assert list(data) == KEYS + LIST_KEYS
    assert all(list(camera) == [*CAMERA_KEYS, SENSOR_KEY] for camera in data["cameras"])
    statuses = [camera["status"] for camera in data["cameras"]]
    assert statuses == ["planned", "unassigned", "sees_nothing"]
    assert data["cameras"][1]["far_limit"] is None
    assert [camera["from_sensor"] for camera in data["cameras"]] == [0.36 + 1e-16, 12.05 / 3, None]
    assert data["lower_bound"] is None
    assert data["cost"] == 1000 / 3


def test_it_comes_back_bit_for_bit(tmp_path: Path) -> None:
    save_plan(PLAN, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == PLAN
    bounded = replace(PLAN, lower_bound=1 / 7)
    save_plan(bounded, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == bounded
    assert list(tmp_path.iterdir()) == [tmp_path / "plan.json"]


SUBJECTS = tuple(
    SubjectQuality(name, 1.5, 0.25, 7, 300.0 / 7, 9, 1 / 3, 0.1, 1.8, 1.7, 0.01, 1.6, 0.02, preset)
    for name, preset in (("a.ply", 1), ("b.ply", 2))
)


def test_several_subjects_come_back(tmp_path: Path) -> None:
    plan = replace(PLAN, subjects=SUBJECTS)
    save_plan(plan, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == plan
    told = json.loads(plan_to_json(plan))["subjects"][1]
    assert (told["surface"], told["preset"], told["in_focus_area"]) == ("b.ply", 2, 1.6)


def test_plans_of_older_versions_have_no_subjects(tmp_path: Path) -> None:
    data = json.loads(plan_to_json(PLAN))
    del data["subjects"]
    (tmp_path / "plan.json").write_text(json.dumps(data), encoding="utf-8")
    assert load_plan(tmp_path / "plan.json") == PLAN


def test_several_shots_come_back(tmp_path: Path) -> None:
    near, far = Shot(0.5, 0.48, 0.52, 3, 3), Shot(12.0, 5.5, math.inf, 5, 4)
    camera = CameraFocus("a", CameraStatus.PLANNED, 12.0, 5.5, math.inf, 8, 7, (near, far))
    plan = replace(PLAN, cameras=(camera,))
    save_plan(plan, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == plan
    data = json.loads(plan_to_json(plan), parse_constant=refuse_constant)
    assert data["shots"] == 2
    assert list(data["cameras"][0]) == [*CAMERA_KEYS, "shots"]
    assert [shot["focus_distance"] for shot in data["cameras"][0]["shots"]] == [0.5, 12.0]
    assert data["cameras"][0]["shots"][1]["far_limit"] is None


def test_cameras_without_a_picture_come_back(tmp_path: Path) -> None:
    cameras = (
        PLAN.cameras[0],
        replace(PLAN.cameras[1], status=CameraStatus.DROPPED, shots=()),
        replace(PLAN.cameras[2], shots=()),
    )
    plan = replace(PLAN, images=2, cameras=cameras)
    save_plan(plan, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == plan
    data = json.loads(plan_to_json(plan), parse_constant=refuse_constant)
    assert (data["images"], data["shots"]) == (2, 1)
    assert [camera.get("shots") for camera in data["cameras"]] == [None, [], []]
    assert data["cameras"][1]["status"] == "dropped"
    # A shot more than the budget, none without a budget, or one where the status says none.
    for change, why in (
        ({"images": 0}, "as many shots of each"),
        (
            {"images": 0, "cameras": data["cameras"][1:]},
            r"cameras\[0\].shots: expected at least one",
        ),
        ({"cameras": 3 * data["cameras"][:1]}, "at most 2 shots, as images says, got 3"),
        ({"cameras": [data["cameras"][0] | {"shots": []}]}, r"cameras\[0\].shots: .* at least one"),
        (
            {"cameras": [data["cameras"][0] | {"status": "dropped"}]},
            r"cameras\[0\].shots: expected none, as status says, got 1",
        ),
    ):
        (tmp_path / "plan.json").write_text(json.dumps(data | change), encoding="utf-8")
        with pytest.raises(InputError, match=why):
            load_plan(tmp_path / "plan.json")


def test_device_values_come_back_and_are_not_there_without_tables(tmp_path: Path) -> None:
    near, far = Shot(0.5, 0.48, 0.52, 3, 3, 180.0), Shot(1.0, 0.9, 1.1, 5, 4, 90.0)
    camera = CameraFocus("a", CameraStatus.PLANNED, 1.0, 0.9, 1.1, 8, 7, (near, far), 90.0, "steps")
    only = replace(camera, assigned_samples=5, in_focus_samples=4, shots=(far,))
    for told, keys in ((camera, [*DEVICE_KEYS, "shots"]), (only, DEVICE_KEYS)):
        plan = replace(PLAN, cameras=(told,))
        save_plan(plan, tmp_path / "plan.json")
        assert load_plan(tmp_path / "plan.json") == plan
        data = json.loads(plan_to_json(plan))["cameras"][0]
        assert list(data) == [*CAMERA_KEYS, *keys]
        assert (data["device_value"], data["device_unit"]) == (90.0, "steps")
    data = json.loads(plan_to_json(replace(PLAN, cameras=(camera,))))["cameras"][0]
    assert [shot["device_value"] for shot in data["shots"]] == [180.0, 90.0]
    assert "device" not in plan_to_json(PLAN)


def test_a_plan_of_an_earlier_version_tells_no_distance_from_the_sensor(tmp_path: Path) -> None:
    data = json.loads(plan_to_json(PLAN))
    for camera in data["cameras"]:
        del camera["from_sensor"]
    (tmp_path / "plan.json").write_text(json.dumps(data))
    plan = load_plan(tmp_path / "plan.json")
    told = [each.from_sensor for camera in plan.cameras for each in (camera, *camera.shots)]
    assert told == [None] * 6
    assert "from_sensor" not in plan_to_json(plan)
    save_plan(plan, tmp_path / "again.json")
    assert load_plan(tmp_path / "again.json") == plan


def test_shots_have_their_own_distances_from_the_sensor(tmp_path: Path) -> None:
    shots = tuple(Shot(d, d - 0.1, d + 0.1, 1, 1, None, d + 0.06) for d in (0.4, 0.5))
    camera = CameraFocus("a", CameraStatus.PLANNED, 0.5, 0.4, 0.6, 2, 2, shots, from_sensor=0.56)
    plan = replace(PLAN, cameras=(camera,))
    save_plan(plan, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json") == plan
    (data,) = json.loads(plan_to_json(plan))["cameras"]
    assert [shot["from_sensor"] for shot in data["shots"]] == [0.4 + 0.06, 0.56]
    assert data["from_sensor"] == 0.56


SHARP = replace(
    PLAN,
    views=3,
    max_mm_per_pixel=0.1 + 0.2,
    sharp_areas=(SharpArea(1, 1.75 + 1e-16, 1 / 7), SharpArea(10, 0.0, 0.0)),
    resolution=Resolution(1 / 3, 0.7),
)


def test_views_sharp_areas_and_resolution_come_back(tmp_path: Path) -> None:
    unresolved = replace(SHARP, resolution=None)
    for plan in (SHARP, unresolved):
        save_plan(plan, tmp_path / "plan.json")
        assert load_plan(tmp_path / "plan.json") == plan
    data = json.loads(plan_to_json(SHARP), parse_constant=refuse_constant)
    assert list(data) == KEYS + SHARP_KEYS + LIST_KEYS
    assert (data["views"], data["max_mm_per_pixel"]) == (3, 0.1 + 0.2)
    assert data["sharp_area"] == {"1": 1.75 + 1e-16, "10": 0.0}
    assert data["sharp_standard_error"] == {"1": 1 / 7, "10": 0.0}
    assert data["resolution"] == {"median": 1 / 3, "percentile_90": 0.7}
    assert json.loads(plan_to_json(unresolved))["resolution"] is None
    assert json.loads(plan_to_json(PLAN))["max_mm_per_pixel"] is None


def test_a_plan_of_an_earlier_version_is_for_one_view_and_tells_no_sharpness(
    tmp_path: Path,
) -> None:
    data = json.loads(plan_to_json(SHARP))
    for key in ("views", "max_mm_per_pixel", *SHARP_KEYS):
        del data[key]
    (tmp_path / "plan.json").write_text(json.dumps(data))
    plan = load_plan(tmp_path / "plan.json")
    assert (plan.views, plan.max_mm_per_pixel) == (1, math.inf)
    assert (plan.sharp_areas, plan.resolution) == ((), None)
    assert "sharp" not in plan_to_json(plan)


@pytest.mark.parametrize(
    ("wrong", "telling"),
    [
        ({"views": 0}, r"plan\.json\.views: expected at least 1, got 0"),
        ({"views": 1.5}, r"\.views: expected a whole number"),
        ({"max_mm_per_pixel": 0}, r"max_mm_per_pixel: expected above 0, or null"),
        ({"max_mm_per_pixel": "fine"}, r"max_mm_per_pixel: expected a number"),
        ({"sharp_area": 1.0}, r"sharp_area: expected square metres by the number of views"),
        (
            {"sharp_area": {"many": 1.0}},
            r"sharp_area: expected numbers of views as keys, got .many",
        ),
        ({"sharp_area": {"0": 1.0}}, r"sharp_area: expected numbers of views as keys"),
        ({"sharp_area": {"01": 1.0}}, r"sharp_area: expected numbers of views as keys"),
        ({"sharp_area": {"1": -1.0, "10": 0}}, r"sharp_area\[1\]: expected a number of at least 0"),
        ({"sharp_area": {"1": 1.0}}, r"sharp_area and sharp_standard_error: expected the same"),
        ({"resolution": 0.5}, r"resolution: expected a plan\.json"),
        ({"resolution": {"median": 0.5}}, "the key 'percentile_90'"),
        ({"resolution": {"median": None, "percentile_90": 1}}, r"median: expected a number"),
    ],
)
def test_views_sharp_areas_and_resolutions_that_cannot_be_are_refused(
    tmp_path: Path, wrong: dict[str, Any], telling: str
) -> None:
    (tmp_path / "plan.json").write_text(json.dumps(json.loads(plan_to_json(SHARP)) | wrong))
    with pytest.raises(InputError, match=telling):
        load_plan(tmp_path / "plan.json")


def test_what_is_planned_is_what_is_saved(tmp_path: Path) -> None:
    # Focused beyond the hyperfocal distance, what is sharp has no end.
    rig = cylinder_rig(2, 6, lens=Lens(hyperfocal_distance=0.5))
    scene = Scene(load_surface(body("arms_down")))
    plan = plan_focus(scene, rig, PlanRequest("em", samples=200))
    save_plan(plan, tmp_path / "plan.json")
    saved = load_plan(tmp_path / "plan.json")
    for field in fields(FocusPlan):
        assert getattr(saved, field.name) == getattr(plan, field.name)
    assert any(math.isinf(camera.far_limit) for camera in saved.cameras)


def test_keys_it_does_not_know_are_passed_over(tmp_path: Path) -> None:
    data = json.loads(plan_to_json(PLAN)) | {"later": 1}
    (tmp_path / "plan.json").write_text(json.dumps(data))
    assert load_plan(tmp_path / "plan.json") == PLAN


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("", "an empty file"),
        ("{", "invalid JSON"),
        ("[]", r"plan\.json"),
        ("{}", "the key 'method'"),
        (
            plan_to_json(PLAN).replace("unassigned", "lost"),
            r"cameras\[1\]\.status: expected one of .*, got 'lost'",
        ),
        (plan_to_json(PLAN)[:-40], "invalid JSON"),
    ],
)
def test_what_is_no_plan_is_refused(tmp_path: Path, text: str, telling: str) -> None:
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(InputError, match=telling):
        load_plan(tmp_path / "plan.json")
