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
from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.optics import depth_of_field
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.io.bodies import body
from focus_planner.io.plans import save_plan
from focus_planner.io.problems import save_problem
from focus_planner.io.surfaces import load_surface


def mixed_rig() -> Rig:
    rig = cylinder_rig(3, 8)
    cameras = [
        camera.__class__(
            camera.name,
            camera.position,
            camera.orientation,
            lens=Lens(0.05, 4.0 + i % 3, 0.1 * (i % 4), np.inf if i % 2 else 0.7),
        )
        for i, camera in enumerate(rig.cameras)
    ]
    return Rig(tuple(cameras), grid=rig.grid)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(load_surface(body("arms_out")))


def recomputed_cost(npz: Path, json_path: Path) -> float:
    """Compute a plan's cost from its two files alone."""
    with np.load(npz) as file:
        data = dict(file)
    plan = json.loads(json_path.read_text())
    assert [camera["name"] for camera in plan["cameras"]] == data["camera_names"].tolist()
    focus = np.array([camera["focus_distance"] for camera in plan["cameras"]])
    camera, d = data["camera_index"], data["depth"]
    s, f = focus[camera], data["focal_length"][camera]
    h = data["hyperfocal_distance"][camera]
    near = np.maximum(d * (h + f) / (h + d), data["min_focus"][camera])
    far = np.where(d < h, d * (h - f) / np.where(d < h, h - d, 1), np.inf)
    far = np.minimum(far, data["max_focus"][camera])
    pair = data["base_cost"] + data["focus_weight"] * ~((near <= s) & (s <= far))
    cost = np.ones(len(data["weights"]))
    np.minimum.at(cost, data["sample_index"], pair)
    return 1000 * float((data["weights"] * cost).sum() / data["weights"].sum())


def save(plan: FocusPlan, folder: Path) -> tuple[Path, Path]:
    files = folder / "problem.npz", folder / "plan.json"
    save_problem(plan.problem, files[0])
    save_plan(plan, files[1])
    return files


@pytest.mark.parametrize("method", METHODS)
def test_the_cost_follows_from_the_files(tmp_path: Path, scene: Scene, method: str) -> None:
    plan = plan_focus(scene, mixed_rig(), PlanRequest(method, samples=500))
    assert recomputed_cost(*save(plan, tmp_path)) == pytest.approx(plan.cost, rel=1e-13)


def test_the_cost_of_brackets_follows_from_the_files(tmp_path: Path, scene: Scene) -> None:
    lens = Lens(min_focus=0.25, max_focus=1.25, focus_steps=64)
    rig = cylinder_rig(3, 8, lens=lens)
    plan = plan_focus(scene, rig, PlanRequest(samples=500, shots=3, depth_tolerance=0.004))
    npz, json_path = save(plan, tmp_path)
    with np.load(npz) as file:
        data = dict(file)
    assert data["shots"] == 3
    assert data["camera_names"].tolist() == [camera.name for camera in rig.cameras]
    cameras = json.loads(json_path.read_text())["cameras"]
    brackets = np.array([[shot["focus_distance"] for shot in c["shots"]] for c in cameras])
    s = brackets[data["camera_index"]]
    held = ((data["focus_near"][:, None] <= s) & (s <= data["focus_far"][:, None])).any(axis=1)
    cost = np.ones(len(data["weights"]))
    np.minimum.at(cost, data["sample_index"], data["base_cost"] + data["focus_weight"] * ~held)
    total = 1000 * float((data["weights"] * cost).sum() / data["weights"].sum())
    assert total == pytest.approx(plan.cost, rel=1e-13)
    # And what is held is so by the formulas, at both ends of the tolerance.
    for pair in np.flatnonzero(data["focus_near"] <= data["focus_far"])[::50]:
        for focus in (data["focus_near"][pair], data["focus_far"][pair]):
            near, far = depth_of_field(focus, lens)
            assert near <= data["depth"][pair] - 0.004
            assert data["depth"][pair] + 0.004 <= far


def test_a_tables_limits_are_what_the_lens_can_be_set_to(tmp_path: Path, scene: Scene) -> None:
    table = LensTable("steps", False, (0.4, 1.3), (0, 900))
    rig = cylinder_rig(3, 8, lens=Lens(min_focus=0.2, max_focus=1.1, table=table))
    plan = plan_focus(scene, rig, PlanRequest("em", samples=200))
    npz, json_path = save(plan, tmp_path)
    with np.load(npz) as file:
        assert set(file["min_focus"]) == {0.4}
        assert set(file["max_focus"]) == {1.1}
    assert recomputed_cost(npz, json_path) == pytest.approx(plan.cost, rel=1e-13)


def test_the_cost_of_a_clouds_own_points_follows_from_the_files(
    tmp_path: Path, scene: Scene
) -> None:
    cloud = Scene(PointCloud(scene.surface.vertices[::10]))
    plan = plan_focus(cloud, mixed_rig(), PlanRequest("em", samples=0))
    assert recomputed_cost(*save(plan, tmp_path)) == pytest.approx(plan.cost, rel=1e-13)


def test_areas_and_weights_differ_by_the_importance(tmp_path: Path, scene: Scene) -> None:
    points = scene.surface.vertices[::10]
    cloud = Scene(PointCloud(points, importance=points[:, 2].clip(0)))
    plan = plan_focus(cloud, mixed_rig(), PlanRequest("em", samples=0))
    npz, json_path = save(plan, tmp_path)
    assert recomputed_cost(npz, json_path) == pytest.approx(plan.cost, rel=1e-13)
    with np.load(npz) as data:
        assert data["areas"].sum() == pytest.approx(plan.surface_area)
        height = data["points"][:, 2].clip(0)
        np.testing.assert_allclose(data["weights"], data["areas"] * height / height.max())


def test_it_has_the_arrays_of_the_contract(tmp_path: Path, scene: Scene) -> None:
    plan = plan_focus(scene, mixed_rig(), PlanRequest("em", samples=300))
    npz, _ = save(plan, tmp_path)
    with np.load(npz) as data:
        assert data["points"].shape == data["normals"].shape == (300, 3)
        assert data["weights"].shape == (300,)
        assert data["weights"].sum() == pytest.approx(plan.surface_area)
        np.testing.assert_array_equal(data["areas"], data["weights"])
        pairs = len(plan.problem.depth)
        for name in ("sample_index", "camera_index", "depth", "base_cost", "focus_near"):
            assert data[name].shape == (pairs,)
        # Outward: a camera sees what faces it.
        positions = np.array([camera.position for camera in mixed_rig().cameras])
        towards = positions[data["camera_index"]] - data["points"][data["sample_index"]]
        assert ((towards * data["normals"][data["sample_index"]]).sum(axis=1) > 0).all()


def test_the_same_problem_gives_the_same_file(tmp_path: Path, scene: Scene) -> None:
    contents = set()
    for _ in range(2):
        npz, _ = save(plan_focus(scene, mixed_rig(), PlanRequest("em", samples=300)), tmp_path)
        contents.add(npz.read_bytes())
    assert len(contents) == 1
