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

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io import picture
from focus_planner.io.bodies import body
from focus_planner.io.endings import DRAWINGS
from focus_planner.io.surfaces import load_surface

MESH = load_surface(body("arms_raised"))


@pytest.fixture(autouse=True)
def fewer_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "_SAMPLES", 15_000)


def draw(scene: Scene, rig: Rig, methods: tuple[str, ...], path: Path, samples: int = 300) -> None:
    plans = {m: plan_focus(scene, rig, PlanRequest(m, samples)) for m in methods}
    picture.draw_plans(scene, rig, plans, path)


def test_four_plans_make_a_wide_small_picture(tmp_path: Path) -> None:
    path = tmp_path / "plans.png"
    draw(Scene(MESH), cylinder_rig(), ("closest", "average", "em", "k_view"), path)
    height, width, _ = imread(path).shape
    assert 1500 < width < 1700
    assert 500 < height < 1000
    assert path.stat().st_size < 400_000
    assert list(tmp_path.iterdir()) == [path]


def test_a_flat_surface_leaves_room_for_the_scales(tmp_path: Path) -> None:
    flat = replace(MESH, vertices=MESH.vertices * [1.0, 1.0, 0.1] + [0.0, 0.0, 0.7])
    draw(Scene(flat), cylinder_rig(3, 8), ("em",), tmp_path / "flat.png")
    # The label of the scale of cost is 2 inches long, at 100 pixels each.
    assert imread(tmp_path / "flat.png").shape[0] > 650


def test_a_cloud_is_drawn(tmp_path: Path) -> None:
    scene = Scene(PointCloud(MESH.vertices[::5]))
    draw(scene, cylinder_rig(3, 8), ("em",), tmp_path / "plan.png", samples=0)
    assert imread(tmp_path / "plan.png").shape[0] > 500


def test_what_has_no_importance_is_drawn_too(tmp_path: Path) -> None:
    # Where nothing is drawn the picture is white.
    inked = []
    for importance in (None, 1.0 * (MESH.vertices[:, 2] > 1.0)):
        scene = Scene(replace(MESH, vertex_importance=importance))
        draw(scene, cylinder_rig(3, 8), ("em",), tmp_path / "plan.png")
        inked.append((imread(tmp_path / "plan.png")[:, :, :3].min(axis=2) < 0.9).mean())
    assert inked[1] == pytest.approx(inked[0], rel=0.02)


def test_a_plan_of_several_shots_is_judged_by_all_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged = []
    write_title = picture._write_title

    def spy(axes: Any, title: str, problem: Problem, focus: FloatArray) -> None:
        judged.append(problem.cost(focus))
        write_title(axes, title, problem, focus)

    monkeypatch.setattr(picture, "_write_title", spy)
    scene, rig = Scene(MESH), cylinder_rig(3, 8)
    plans = {
        str(shots): plan_focus(scene, rig, PlanRequest("em", 2000, shots=shots))
        for shots in (1, 2, 3)
    }
    picture.draw_plans(scene, rig, plans, tmp_path / "plans.png")
    assert judged == sorted(judged, reverse=True)
    assert judged == pytest.approx([plan.cost for plan in plans.values()], rel=0.05)


def test_one_camera_is_drawn(tmp_path: Path) -> None:
    draw(Scene(MESH), cylinder_rig(1, 1), ("em",), tmp_path / "plan.png")
    assert (tmp_path / "plan.png").exists()


def test_a_picture_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="can be written"):
        draw(Scene(MESH), cylinder_rig(1, 2), ("em",), tmp_path / "none" / "plan.png")


STARTS = {
    "png": b"\x89PNG",
    "PNG": b"\x89PNG",
    "jpg": b"\xff\xd8\xff",
    "jpeg": b"\xff\xd8\xff",
    "tif": b"II*\0",
    "tiff": b"II*\0",
    "pdf": b"%PDF-",
    "Svg": b"<?xml",
}


def test_the_picture_is_what_its_name_says(tmp_path: Path) -> None:
    assert {f".{ending.lower()}" for ending in STARTS} == set(DRAWINGS)
    plans = {"em": plan_focus(Scene(MESH), cylinder_rig(3, 8), PlanRequest("em", 300))}
    for ending, start in STARTS.items():
        first, again = tmp_path / f"first.{ending}", tmp_path / f"again.{ending}"
        for path in (first, again):
            picture.draw_plans(Scene(MESH), cylinder_rig(3, 8), plans, path)
        assert first.read_bytes().startswith(start)
        assert first.read_bytes() == again.read_bytes()
    assert "<svg" in (tmp_path / "first.Svg").read_text()


def test_another_name_is_refused(tmp_path: Path) -> None:
    for name in ("plan.gif", "plan", "plan.png.bak", ".png"):
        with pytest.raises(InputError, match=r"picture: expected a name .*\.png"):
            picture.draw_plans(Scene(MESH), cylinder_rig(3, 8), {}, tmp_path / name)
    assert not list(tmp_path.iterdir())
