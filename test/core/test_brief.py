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

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import focus_planner
from focus_planner import (
    Camera,
    Lens,
    LensTable,
    Mesh,
    PlanRequest,
    PointCloud,
    Rig,
    Scene,
    cylinder_rig,
    plan_focus,
)
from focus_planner.core.notes import Note
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.planning.subject import PlannedSubject
from testing.problems import sphere

SURFACE = sphere(0.4, subdivisions=3)
SCENE, RIG = Scene(SURFACE), cylinder_rig(3, 24, bottom=-0.5, top=0.5)
PLAN = plan_focus(SCENE, RIG, PlanRequest(samples=300, fresh_samples=100, shots=8))


def test_arrays_are_told_by_their_shape() -> None:
    mesh = Mesh(np.eye(3), [[0, 1, 2]])
    assert repr(mesh) == "Mesh(vertices=<3 × 3 float64>, triangles=<1 × 3 int32>)"
    cloud = PointCloud(np.eye(3).repeat(9, axis=0), notes=(Note("winding", "x" * 200),))
    assert repr(cloud) == "PointCloud(points=<27 × 3 float64>, notes=<1 Note>)"


def test_what_is_the_default_is_left_out_and_what_is_long_is_counted() -> None:
    assert repr(Lens()) == "Lens()"
    assert repr(Lens(0.035, min_focus=0.4)) == "Lens(focal_length=0.035, min_focus=0.4)"
    assert repr(Lens(focus_distances=(1.0, 2.0))) == "Lens(focus_distances=(1.0, 2.0))"
    long = Lens(focus_distances=tuple(np.linspace(0.5, 2, 900)))
    assert repr(long) == "Lens(focus_distances=<900 float>)"
    table = LensTable("dioptres")
    assert repr(Lens(table=table)) == "Lens(table=LensTable(unit='dioptres'))"
    camera = Camera("a", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))
    assert repr(camera) == (
        "Camera(name='a', position=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))"
    )
    assert eval(repr(camera), {"Camera": Camera}) == camera
    assert repr(RIG) == "Rig(cameras=<72 Camera>, grid=Grid(rows=3, columns=24))"


@pytest.mark.parametrize(
    "big",
    [
        SURFACE,
        SCENE,
        RIG,
        Rig(RIG.cameras[:3]),
        *RIG.cameras[:1],
        PLAN,
        PLAN.cameras,
        PLAN.cameras[0],
        PLAN.problem,
        PLAN.problem.samples,
        PLAN.problem.cells,
        PLAN.warm_start,
        PLAN.stop_log,
        PlannedSubject(SCENE, RIG, PlanRequest(), PLAN),
    ],
    ids=lambda big: type(big).__name__,
)
def test_no_object_takes_more_than_a_few_lines_of_a_notebook(big: object) -> None:
    limit = 600 * (len(big) if isinstance(big, tuple) else 1)
    assert len(repr(big)) <= limit
    assert "\n" not in repr(big)


def test_a_plan_prints_as_twelve_lines() -> None:
    plan = dataclasses.replace(
        plan_focus(SCENE, Rig(RIG.cameras[:2]), PlanRequest(samples=300, fresh_samples=100)),
        cost=800.0,
        lower_bound=796.0,
        fresh_cost=810.5,
        fresh_standard_error=3.25,
        surface_area=2.0,
        covered_area=1.5,
        in_focus_area=1.0,
        in_focus_standard_error=0.02,
        sharp_areas=tuple(SharpArea(n, 1.2 / n, 0.01) for n in (1, 2, 3, 5)),
        resolution=Resolution(0.41234, 1.2),
        solve_seconds=0.25,
        total_seconds=0.5,
        notes=(Note("winding", "a"), Note("default_lens", "b"), Note("default_lens", "c")),
    )
    shots = [shot.focus_distance for camera in plan.cameras for shot in camera.shots]
    assert str(plan) == (
        "k_view plan for 2 cameras\n"
        "  cost         800.00 of 1000, on 300 samples, seed 0\n"
        "  lower bound  796.00: within 0.5 % of the best\n"
        "  fresh cost   810.50 ± 3.25, on 100 samples unseen by the solver\n"
        "  seen         1.500 m², 75.0% of the surface\n"
        "  in focus     1.000 ± 0.020 m², 50.0%\n"
        "  sharp views  1+ 60.0 ± 0.5%, 2+ 30.0 ± 0.5%, 3+ 20.0 ± 0.5%, 5+ 12.0 ± 0.5%\n"
        "  resolution   0.412 mm per pixel in the median, 1.2 or finer for 90% of it\n"
        "  cameras      2 planned\n"
        f"  focused at   {min(shots):.3f} to {max(shots):.3f} m\n"
        "  time         0.500 s, of which 0.250 s solving\n"
        "  notes        3: winding, default_lens"
    )
    assert repr(plan) == (
        "<SolvedPlan: k_view, 2 cameras, cost 800.0 on 300 samples, 810.5 ± 3.2 on 100 fresh ones>"
    )


def test_a_plan_for_several_views_says_so_beside_its_costs() -> None:
    plan = dataclasses.replace(PLAN, views=3, cost=800.0)
    assert str(plan).splitlines()[1].startswith("  cost         800.00 of 1000 for 3 views, on ")
    assert ", cost 800.0 for 3 views on " in repr(plan)
    assert ", cost 800.0 for 3 views on " in plan.summary()
    assert "views on" not in dataclasses.replace(plan, views=1).summary()


def test_what_an_older_plan_does_not_tell_is_in_no_line() -> None:
    older = dataclasses.replace(PLAN, sharp_areas=(), resolution=None)
    assert len(str(older).splitlines()) == 10
    assert "sharp" not in str(older)


def test_a_plan_with_nothing_to_tell_has_as_many_lines(tmp_path: Path) -> None:
    unbounded = dataclasses.replace(
        PLAN, lower_bound=None, notes=(), converged=False, surface_area=0.0
    )
    for plan in (PLAN, unbounded, dataclasses.replace(unbounded, cameras=())):
        assert len(str(plan).splitlines()) == 12
    assert max(map(len, str(PLAN).splitlines())) <= 80
    assert str(unbounded).startswith("k_view plan for 72 cameras of 8 shots, stopped early\n")
    assert "none sought" in str(unbounded)
    focus_planner.save_plan(PLAN, tmp_path / "plan.json")
    read = focus_planner.load_plan(tmp_path / "plan.json")
    assert str(read) == str(PLAN)
    assert repr(read).startswith("<FocusPlan: k_view, 72 cameras of 8 shots")
