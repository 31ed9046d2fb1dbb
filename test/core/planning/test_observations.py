# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Notes of plans: what was seen, what it means, what to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Mesh, PlanRequest, PointCloud, Rig, Scene, cylinder_rig, plan_focus
from focus_planner.core.notes import Note
from focus_planner.core.surface.sampling import sample_mesh
from testing.clock import Clock
from testing.problems import around, body, looking_at, sphere

REQUEST = PlanRequest("em", samples=500, fresh_samples=500, bound="none")
BODY = body()
RIG = cylinder_rig(4, 8, radius=1.2)


def notes_of(surface: Mesh | PointCloud, rig: Rig = RIG) -> dict[str, str]:
    plan = plan_focus(Scene(surface), rig, REQUEST)
    assert len({note.code for note in plan.notes}) == len(plan.notes)
    return {note.code: note.text for note in plan.notes}


def test_a_plan_for_what_is_right_has_none() -> None:
    assert notes_of(BODY) == {}


def test_notes_on_what_was_read_are_passed_on() -> None:
    mine = Note("left_out", "half of it"), Note("default_lens", "a guess")
    plan = plan_focus(Scene(replace(BODY, notes=mine[:1])), replace(RIG, notes=mine[1:]), REQUEST)
    assert plan.notes == mine
    assert plan.summary().endswith("; see its notes: left_out, default_lens")


def test_notes_change_nothing_else() -> None:
    noted = plan_focus(Scene(replace(BODY, notes=(Note("noise", "a lot"),))), RIG, REQUEST)
    plan = plan_focus(Scene(BODY), RIG, REQUEST)
    assert (noted.cost, noted.cameras) == (plan.cost, plan.cameras)


def test_a_surface_that_lies_on_its_side() -> None:
    notes = notes_of(replace(BODY, vertices=BODY.vertices @ [[1, 0, 0], [0, 0, -1], [0, 1, 0]]))
    assert "with the surface's y axis up" in notes["up_axis"]
    assert "--up y" in notes["up_axis"]


@pytest.mark.parametrize("blind", [1, 2])
def test_cameras_that_see_nothing(blind: int) -> None:
    # Of four a quarter is not remarkable, two are.
    cameras = around(4, 1.2).cameras
    away = [
        looking_at(c.name, c.position, np.add(c.position, (0.5, 0, 3))) for c in cameras[:blind]
    ]
    notes = notes_of(sphere(0.4), Rig((*away, *cameras[blind:])))
    if blind == 1:
        assert "unseen_cameras" not in notes
    else:
        names = ", ".join(c.name for c in cameras[:blind])
        assert notes["unseen_cameras"].startswith(f"2 of 4 cameras see nothing ({names}): ")


def test_cameras_that_see_what_does_not_count_see_something() -> None:
    importance = (BODY.vertices[:, 2] > 1.4).astype(float)
    notes = notes_of(replace(BODY, vertex_importance=importance), cylinder_rig(7, 8))
    assert set(notes) == {"importance"}


def test_cameras_are_not_to_be_left_out_where_a_mistake_explains_them() -> None:
    notes = notes_of(
        replace(BODY, vertices=BODY.vertices @ [[1, 0, 0], [0, 0, -1], [0, 1, 0]]), cylinder_rig()
    )
    assert "up_axis" in notes
    assert notes["unseen_cameras"].endswith("check its frame and size and the camera poses")


@pytest.mark.parametrize("kind", ["turned", "both sides", "cloud"])
def test_triangles_and_normals_that_face_both_ways(kind: str) -> None:
    wrong = np.random.default_rng(0).random(len(BODY.triangles)) < 0.5
    if kind == "cloud":
        samples = sample_mesh(BODY, 8000, 0)
        signs = np.where(np.random.default_rng(0).random(8000) < 0.3, -1.0, 1.0)
        notes = notes_of(PointCloud(samples.points, samples.normals * signs[:, None]))
        assert "normals probably point inward" in notes["winding"]
        return
    turned = BODY.triangles[:, ::-1]
    if kind == "turned":
        triangles = np.where(wrong[:, None], turned, BODY.triangles)
    else:
        triangles = np.concatenate([BODY.triangles, turned])
    notes = notes_of(replace(BODY, triangles=triangles))
    assert "% of the surface is seen from behind only, and counts as unseen" in notes["winding"]


def test_an_importance_that_counts() -> None:
    importance = np.where(np.arange(len(BODY.vertices)) % 4 == 0, 0.0, 2.5)
    notes = notes_of(replace(BODY, vertex_importance=importance))
    assert notes["importance"].startswith(
        "the surface has an importance, from 0 to 2.5, 0 at 25% of its vertices: "
    )


def test_samples_that_a_time_budget_left_out() -> None:
    request = PlanRequest("em", samples=5000, fresh_samples=1000, time_budget=0.5, bound="none")
    plan = plan_focus(Scene(BODY), RIG, request, clock=Clock(1.0))
    (note,) = plan.notes
    assert note.code == "budget"
    assert note.text == (
        f"the time budget of 0.5 s left room for {plan.samples} samples, of 5000, and"
        f" {plan.fresh_samples} fresh ones, of 1000: the plan fits the surface less well than one"
        " on all of them; allow more time, or ask for fewer samples"
    )
    assert plan.samples < 5000


def test_samples_that_were_left_out_because_the_caller_stopped() -> None:
    stopping = iter([True, False])
    plan = plan_focus(
        Scene(BODY),
        RIG,
        PlanRequest("em", samples=20_000, fresh_samples=500, bound="none"),
        on_progress=lambda progress: progress.stage == "fresh" or next(stopping, False),
    )
    assert plan.samples < 20_000
    (note,) = plan.notes
    assert note.text.startswith(f"the request was stopped when there were {plan.samples} samples")
