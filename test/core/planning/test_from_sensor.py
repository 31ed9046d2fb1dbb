# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planned distances as focus rings are marked."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from focus_planner import CameraStatus, Lens, PlanRequest, Rig, Scene, plan_focus
from focus_planner.core.planning.request import METHODS
from testing.plans import RIG, SCENE
from testing.problems import looking_at, torus

LENSES = (Lens(), Lens(0.035, 5.0), Lens(0.05, 10.0, hiatus=-0.02))


def of_lenses(lenses):
    """The rig with these lenses in turn."""
    return Rig(tuple(replace(c, lens=lenses[k % len(lenses)]) for k, c in enumerate(RIG.cameras)))


@pytest.mark.parametrize("shots", [1, 2])
@pytest.mark.parametrize("method", METHODS)
def test_every_shot_tells_its_distance_from_the_sensor(method, shots):
    rig = of_lenses(LENSES)
    request = PlanRequest(method, samples=150, shots=shots, fresh_samples=100, gap=0.1)
    plan = plan_focus(SCENE, rig, request)
    for camera, of_rig in zip(plan.cameras, rig.cameras, strict=True):
        lens = of_rig.lens
        for each in (camera, *camera.shots):
            # Gauss's equation, 1/s + 1/v = 1/F.
            image = 1 / (1 / lens.focal_length - 1 / each.focus_distance)
            expected = each.focus_distance + image + lens.hiatus
            assert each.from_sensor == pytest.approx(expected, rel=1e-12)
        assert camera.from_sensor in [shot.from_sensor for shot in camera.shots]
    shots_ = [shot for camera in plan.cameras for shot in camera.shots]
    offsets = [shot.from_sensor - shot.focus_distance for shot in shots_]
    assert plan.sensor_offsets == (min(offsets), max(offsets))


def test_a_hiatus_changes_distances_from_the_sensor_and_nothing_else():
    request = PlanRequest(samples=150, fresh_samples=100)
    thin = plan_focus(SCENE, RIG, request)
    thick = plan_focus(SCENE, of_lenses([Lens(hiatus=0.012)]), request)
    assert (thick.cost, thick.fresh_cost) == (thin.cost, thin.fresh_cost)
    for before, after in zip(thin.cameras, thick.cameras, strict=True):
        assert after.from_sensor == pytest.approx(before.from_sensor + 0.012, rel=1e-12)
        assert replace(after, shots=before.shots, from_sensor=before.from_sensor) == before


@pytest.mark.parametrize("method", ["closest", "k_view"])
def test_nothing_is_planned_where_a_lens_forms_no_image(method):
    # Within the focal length of the first camera, and just beyond that of the second.
    scene = Scene(torus(0.012, 0.004))
    cameras = (looking_at(f"c{k}", (x, 0.0, 0.0), (0.0,) * 3) for k, x in enumerate((0.03, 0.068)))
    request = PlanRequest(method, samples=100, fresh_samples=100)
    first, second = plan_focus(scene, Rig(tuple(cameras)), request).cameras
    assert first.status is CameraStatus.SEES_NOTHING
    assert second.focus_distance < 0.07
    for camera in (first, second):
        assert math.isfinite(camera.from_sensor)
        assert camera.from_sensor >= 0.2


def test_an_older_plan_has_no_distances_from_the_sensor():
    plan = plan_focus(SCENE, RIG, PlanRequest("em", samples=100, fresh_samples=100))
    older = [
        replace(c, shots=tuple(replace(s, from_sensor=None) for s in c.shots)) for c in plan.cameras
    ]
    assert replace(plan, cameras=tuple(older)).sensor_offsets is None
