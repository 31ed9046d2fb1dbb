# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans for surfaces of which some parts matter more."""

import dataclasses

import numpy as np
import pytest

from focus_planner import (
    CostModel,
    InputError,
    Mesh,
    PlanRequest,
    PointCloud,
    Rig,
    Scene,
    cylinder_rig,
    plan_focus,
)
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.request import METHODS
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.plans import RIG, distances
from testing.problems import (
    around,
    body,
    forward,
    merged,
    pairs_of,
    plane,
    sphere,
    torus,
)

each_method = pytest.mark.parametrize("method", METHODS)


@each_method
def test_a_weighted_plan_agrees_with_the_paper_from_end_to_end(method):
    dense = sample_mesh(torus(0.4, 0.15), 300, 0)
    importance = np.random.default_rng(1).integers(0, 4, 300)
    cloud = PointCloud(dense.points, dense.normals, importance)
    scene, model = Scene(cloud), CostModel(0.3, 0.3, 0.4)
    plan = plan_focus(scene, RIG, PlanRequest(method, samples=0, fresh_samples=200), model)
    samples = Scene(PointCloud(dense.points, dense.normals)).sample(0, 0)
    visible = pairs_of(visible_pairs(scene, RIG, samples))
    weights = samples.weights * importance
    expected = reference.total_cost(
        samples.points, samples.normals, weights, RIG, visible, distances(plan), model
    )
    assert plan.cost == pytest.approx(expected, rel=1e-12)
    fresh = scene.fresh_samples(200, 0)
    visible = pairs_of(visible_pairs(scene, RIG, fresh))
    # Drawn by importance, all weigh the same.
    expected = reference.total_cost(
        fresh.points, fresh.normals, np.ones(200), RIG, visible, distances(plan), model
    )
    assert plan.fresh_cost == pytest.approx(expected, rel=1e-12)
    seen = np.array(sorted({p for p, _ in visible}))
    assert fresh.areas.std() > 0.1 * fresh.areas.mean()
    assert fresh.areas.sum() == pytest.approx(samples.areas[importance > 0].sum())
    assert plan.covered_area == pytest.approx(fresh.areas[seen].sum())
    assert (np.isfinite(distances(plan)) & (distances(plan) > 0)).all()


@each_method
def test_the_same_importance_everywhere_is_as_good_as_none(method):
    # Other draws of the same distribution.
    mesh, rig = torus(0.4, 0.15), around(6, 1.0)
    flat = dataclasses.replace(mesh, vertex_importance=np.full(len(mesh.vertices), 7.0))
    request = PlanRequest(method, samples=4000)
    one, other = (plan_focus(Scene(surface), rig, request) for surface in (mesh, flat))
    assert one.cost == pytest.approx(other.cost, rel=0.02)
    assert one.surface_area == other.surface_area
    assert one.in_focus_area == pytest.approx(other.in_focus_area, rel=0.05)


@pytest.mark.parametrize("method", ["em", "k_view"])
def test_a_plan_favours_what_is_important(method):
    mesh, rig = body(), cylinder_rig()
    upper = mesh.vertices[:, 2] > 1.0
    important = dataclasses.replace(mesh, vertex_importance=np.where(upper, 20.0, 1.0))
    plans = [plan_focus(Scene(m), rig, PlanRequest(method)) for m in (mesh, important)]
    problem = formulate_problem(Scene(mesh), rig, PlanRequest(samples=20_000, seed=1))
    above = problem.samples.points[:, 2] > 1.0
    costs = [problem.evaluate(distances(plan))[0] for plan in plans]
    assert costs[1][above].mean() < costs[0][above].mean()
    assert costs[1][~above].mean() > costs[0][~above].mean()


def test_areas_are_areas_whatever_the_importance():
    # From distance D a sphere of radius R shows the share (1 − R/D)/2.
    mesh, rig = sphere(0.25, subdivisions=4), Rig(around(1, 1.0, height=0).cameras)
    towards = mesh.vertices @ np.array(rig.cameras[0].position)
    scene = Scene(dataclasses.replace(mesh, vertex_importance=1 + 8 * (towards > 0)))
    plan = plan_focus(scene, rig, PlanRequest("em", 20_000, fresh_samples=20_000))
    assert plan.surface_area == Scene(mesh).area
    assert plan.covered_area / plan.surface_area == pytest.approx(0.75 / 2, abs=0.01)
    camera = plan.cameras[0]
    near, far = max(camera.near_limit, 0.75), min(camera.far_limit, 1 - 0.25**2)
    assert plan.in_focus_area == pytest.approx(2 * np.pi * 0.25 * (far - near), rel=0.04)


def test_half_a_surface_of_no_importance_is_neither_planned_for_nor_counted():
    # Two planes, one of which does not count: the camera could hold only one in focus.
    near, far = plane(0.4, 0.4, 0.7), plane(2.0, 2.0, 1.4)
    both, rig = merged(near, far), Rig((forward(),))
    for counting, depth, area in ((slice(0, 4), 0.7, 0.16), (slice(4, 8), 1.4, 4.0)):
        importance = np.zeros(8)
        importance[counting] = 5.0
        scene = Scene(dataclasses.replace(both, vertex_importance=importance))
        for method in ("closest", "average", "em"):
            plan = plan_focus(scene, rig, PlanRequest(method, 2000))
            camera = plan.cameras[0]
            assert camera.near_limit <= depth <= camera.far_limit
            assert plan.surface_area == pytest.approx(4.16)
            assert plan.covered_area == pytest.approx(plan.in_focus_area)
            assert plan.covered_area <= area * (1 + 1e-12)
        problem = formulate_problem(scene, rig, PlanRequest("em", 2000), by="area")
        counts = np.isclose(problem.samples.points[:, 2], depth)
        assert ((problem.samples.weights > 0) == counts).all()
        assert 0 < counts.sum() < 2000


def test_samples_of_which_none_counts_are_an_error():
    vertices = [[0, 0, 1], [0, 1e-3, 1], [1e-3, 0, 1]]
    tiny = Mesh(vertices, [[0, 1, 2]])
    scene = merged(plane(1.0, 1.0, 1.0), tiny)
    scene = Scene(dataclasses.replace(scene, vertex_importance=[0, 0, 0, 0, 1, 1, 1]))
    request = PlanRequest("em", samples=10)
    assert plan_focus(scene, Rig((forward(),)), request).cost < 1000
    message = "samples: expected enough for one to have some importance, got 10; take more"
    with pytest.raises(InputError, match=message):
        formulate_problem(scene, Rig((forward(),)), request, by="area")
