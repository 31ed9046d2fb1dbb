# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans in which each camera takes several pictures."""

import dataclasses

import pytest

from focus_planner import (
    CameraStatus,
    CostModel,
    PlanRequest,
    Rig,
    plan_focus,
)
from focus_planner.core.planning.request import METHODS
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.plans import RIG, SCENE, assigned_and_sharp, away
from testing.problems import (
    pairs_of,
)

each_method = pytest.mark.parametrize("method", METHODS)


@each_method
@pytest.mark.parametrize("shots", [2, 3])
def test_a_plan_of_several_shots_adds_up(method, shots):
    rig = Rig((*RIG.cameras, away()))
    # The proof takes long where shots can be exchanged, and does not matter here.
    request = PlanRequest(method, samples=200, seed=3, shots=shots, fresh_samples=150, gap=0.05)
    plan = plan_focus(SCENE, rig, request)
    # As many rigs as there are ways to choose a shot per camera would cost the least of them; so
    # does a rig in which every shot is a camera.
    every_shot = Rig(
        tuple(
            dataclasses.replace(camera, name=f"{camera.name}_{i}")
            for camera in rig.cameras
            for i in range(shots)
        )
    )
    focus, model = plan.focus_distances, CostModel()
    fresh = SCENE.fresh_samples(150, 3)
    for samples, cost in ((SCENE.sample(200, 3), plan.cost), (fresh, plan.fresh_cost)):
        visible = pairs_of(visible_pairs(SCENE, rig, samples))
        repeated = {(p, c * shots + i) for p, c in visible for i in range(shots)}
        expected = reference.total_cost(
            samples.points, samples.normals, samples.weights, every_shot, repeated, focus, model
        )
        assert cost == pytest.approx(expected, rel=1e-12)
        assigned, sharp = assigned_and_sharp(samples, repeated, focus, model, every_shot)
        if samples is fresh:
            assert plan.covered_area == pytest.approx(SCENE.area * sum(assigned) / 150)
            assert plan.in_focus_area == pytest.approx(SCENE.area * sum(sharp) / 150)
        else:
            each = [shot for camera in plan.cameras for shot in camera.shots]
            assert sum(shot.assigned_samples for shot in each) == sum(assigned)
            assert sum(shot.in_focus_samples for shot in each) == sum(sharp)
    assert plan.shots == shots
    for camera, of_rig in zip(plan.cameras, rig.cameras, strict=True):
        assert camera.name == of_rig.name
        each = [shot.focus_distance for shot in camera.shots]
        assert len(each) == shots
        assert each == sorted(each)
        assert camera.assigned_samples == sum(shot.assigned_samples for shot in camera.shots)
        assert camera.in_focus_samples == sum(shot.in_focus_samples for shot in camera.shots)
        main = max(camera.shots, key=lambda shot: shot.assigned_samples)
        assert (camera.focus_distance, camera.near_limit, camera.far_limit) == (
            main.focus_distance,
            main.near_limit,
            main.far_limit,
        )
        for shot in camera.shots:
            limits = reference.depth_of_field(shot.focus_distance, of_rig.lens)
            assert (shot.near_limit, shot.far_limit) == pytest.approx(limits)
    idle = plan.cameras[-1]
    assert idle.status is CameraStatus.SEES_NOTHING
    assert len({shot.focus_distance for shot in idle.shots}) == 1


def test_more_shots_cost_less_and_one_camera_may_take_them():
    rig = Rig(RIG.cameras[:1])
    costs = [
        plan_focus(SCENE, rig, PlanRequest("em", 500, shots=shots)).cost for shots in (1, 2, 3, 4)
    ]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < costs[0]
    plan = plan_focus(SCENE, rig, PlanRequest(samples=500, shots=2))
    assert plan.method == "k_view"
    assert len(plan.cameras) == 1
