# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The discrete problem of a request, whole and cut short."""

import numpy as np
import pytest

from focus_planner import (
    PlanRequest,
    PointCloud,
    Scene,
    plan_focus,
)
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.surface.sampling import sample_mesh
from testing.plans import RIG, SCENE
from testing.problems import (
    sphere,
)


@pytest.mark.parametrize("shots", [1, 2])
def test_a_formulated_problem_is_the_plans(shots):
    request = PlanRequest(samples=200, shots=shots, depth_tolerance=0.001)
    problem, plan = formulate_problem(SCENE, RIG, request), plan_focus(SCENE, RIG, request)
    np.testing.assert_array_equal(problem.base_cost, plan.problem.base_cost)
    assert problem.cost(plan.focus_distances) == plan.cost


def test_stopped_early_it_is_the_problem_on_fewer_samples():
    request = PlanRequest(samples=3000, seed=3)
    whole = formulate_problem(SCENE, RIG, request)
    ended = formulate_problem(SCENE, RIG, request, keep_going=lambda _: False)
    assert 0 < ended.sample_count < whole.sample_count
    first = slice(0, ended.sample_count)
    np.testing.assert_array_equal(ended.samples.points, whole.samples.points[first])
    assert ended.samples.weights.sum() == pytest.approx(SCENE.area)
    pairs = slice(0, len(ended.depth))
    for name in ("sample_index", "camera_index", "depth", "base_cost", "focus_near"):
        np.testing.assert_array_equal(getattr(ended, name), getattr(whole, name)[pairs])


@pytest.mark.parametrize("normals", [True, False], ids=["normals given", "estimated"])
def test_stopped_early_it_takes_a_clouds_points_from_everywhere(normals):
    drawn = sample_mesh(sphere(0.4, subdivisions=4), 5000, 1)
    order = np.argsort(drawn.points[:, 0])  # as a scanner might
    cloud = PointCloud(drawn.points[order], drawn.normals[order] if normals else None)
    scene, request = Scene(cloud), PlanRequest(samples=0)
    whole = formulate_problem(scene, RIG, request)
    asked = formulate_problem(scene, RIG, request, keep_going=lambda _: True)
    np.testing.assert_array_equal(asked.samples.points, cloud.points)
    np.testing.assert_array_equal(asked.samples.weights, whole.samples.weights)
    np.testing.assert_array_equal(asked.base_cost, whole.base_cost)
    ended = formulate_problem(scene, RIG, request, keep_going=lambda _: False)
    assert ended.sample_count == 512
    assert (np.diff(ended.samples.points[:, 0]) >= 0).all()
    assert abs(np.median(ended.samples.points[:, 0])) < 0.05
    assert ended.samples.weights.sum() == pytest.approx(whole.samples.weights.sum())
