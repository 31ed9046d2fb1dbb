# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans from end to end, for every method."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from numba import config, get_num_threads

from focus_planner import (
    Camera,
    CameraStatus,
    CostModel,
    InputError,
    Lens,
    Mesh,
    PlanRequest,
    PointCloud,
    Rig,
    Scene,
    cylinder_rig,
    plan_focus,
)
from focus_planner.core import kernels
from focus_planner.core.planning.request import METHODS, SCOPES
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.plans import RIG, SCENE, assigned_and_sharp, away, distances, without_seconds
from testing.problems import (
    WIDE_ANGLE,
    around,
    body,
    forward,
    looking_at,
    merged,
    pairs_of,
    plane,
    sphere,
    torus,
    with_threads,
)

each_method = pytest.mark.parametrize("method", METHODS)


@each_method
def test_a_plan_agrees_with_the_paper_from_end_to_end(method):
    model = CostModel(0.3, 0.3, 0.4)
    request = PlanRequest(method, samples=150, seed=3, fresh_samples=120)
    plan = plan_focus(SCENE, RIG, request, model)
    samples = SCENE.sample(150, 3)
    visible = pairs_of(visible_pairs(SCENE, RIG, samples))
    focus = distances(plan)
    expected = reference.total_cost(
        samples.points, samples.normals, samples.weights, RIG, visible, focus, model
    )
    assert plan.cost == pytest.approx(expected, rel=1e-12)
    assert (plan.method, plan.samples, plan.seed, plan.converged) == (method, 150, 3, True)
    assert plan.lower_bound is None or plan.lower_bound <= plan.cost
    assigned, sharp = assigned_and_sharp(samples, visible, focus, model)
    assert [camera.assigned_samples for camera in plan.cameras] == assigned
    assert [camera.in_focus_samples for camera in plan.cameras] == sharp
    assert sum(assigned) == len({p for p, _ in visible})
    fresh = SCENE.fresh_samples(120, 3)
    visible = pairs_of(visible_pairs(SCENE, RIG, fresh))
    expected = reference.total_cost(
        fresh.points, fresh.normals, fresh.weights, RIG, visible, focus, model
    )
    assert plan.fresh_cost == pytest.approx(expected, rel=1e-12)
    assert plan.fresh_samples == 120
    assigned, sharp = assigned_and_sharp(fresh, visible, focus, model)
    assert plan.surface_area == pytest.approx(SCENE.area)
    assert plan.covered_area == pytest.approx(SCENE.area * sum(assigned) / 120)
    share = sum(sharp) / 120
    assert plan.in_focus_area == pytest.approx(SCENE.area * share)
    error = SCENE.area * math.sqrt(share * (1 - share) / 119)
    assert plan.in_focus_standard_error == pytest.approx(error)
    for camera, of_rig in zip(plan.cameras, RIG.cameras, strict=True):
        assert camera.name == of_rig.name
        limits = reference.depth_of_field(camera.focus_distance, of_rig.lens)
        assert (camera.near_limit, camera.far_limit) == pytest.approx(limits)
        assert camera.status is CameraStatus.PLANNED
    assert plan.total_seconds >= plan.solve_seconds > 0


def test_the_default_is_2_view_on_4096_samples_and_as_many_fresh_ones():
    default = PlanRequest("k_view", 4096, 0, 2, "all", "overlap", math.inf, 1, 0.0, 4096, 2.0)
    assert PlanRequest() == dataclasses.replace(default, bound="quick", gap=1e-4)
    plan = plan_focus(SCENE, RIG)
    assert (plan.method, plan.samples, plan.fresh_samples) == ("k_view", 4096, 4096)


@each_method
def test_a_plan_repeats_bit_for_bit(method):
    request = PlanRequest(method, samples=500, seed=9)
    first = plan_focus(Scene(torus(0.4, 0.15)), RIG, request)
    second = plan_focus(Scene(torus(0.4, 0.15)), RIG, request)
    assert without_seconds(first) == without_seconds(second)
    other = plan_focus(SCENE, RIG, dataclasses.replace(request, seed=10))
    assert other.cost != first.cost
    assert other.fresh_cost != first.fresh_cost


def test_a_plan_does_not_depend_on_the_threads():
    # Enough pairs for the kernels to share their work.
    scene, rig = Scene(body("arms_raised")), cylinder_rig()
    request = PlanRequest("em", samples=20_000)
    plans = [
        with_threads(count, lambda: plan_focus(scene, rig, request))
        for count in (1, config.NUMBA_NUM_THREADS)
    ]
    assert len(plans[0].problem.depth) > 200_000
    assert without_seconds(plans[0]) == without_seconds(plans[1])


def test_small_problems_run_on_one_thread_and_large_ones_on_all():
    before = get_num_threads()
    with kernels.threads_for(100):
        assert get_num_threads() == 1
    with kernels.threads_for(10**6):
        assert get_num_threads() == config.NUMBA_NUM_THREADS
    with pytest.raises(KeyError), kernels.threads_for(100):
        raise KeyError
    assert get_num_threads() == before


class TestStatuses:
    """What a plan says of a camera that has nothing to do."""

    @each_method
    def test_a_camera_that_sees_nothing_gets_the_others_median(self, method):
        rig = Rig((*RIG.cameras, away()))
        plan = plan_focus(SCENE, rig, PlanRequest(method, samples=300))
        alone = plan.cameras[-1]
        assert alone.status is CameraStatus.SEES_NOTHING
        assert (alone.assigned_samples, alone.in_focus_samples) == (0, 0)
        assert alone.focus_distance == np.median(distances(plan)[:-1])
        assert all(camera.status is CameraStatus.PLANNED for camera in plan.cameras[:-1])

    @pytest.mark.parametrize(
        ("lens", "expected"),
        [
            (Lens(0.05, 10.0, 3.0, 4.0), 3.0),
            (Lens(0.05, 10.0, 0.2, 0.3), 0.3),
            (Lens(0.5, 100.0), 1.0),
        ],
    )
    def test_as_far_as_its_lens_goes(self, lens, expected):
        rig = Rig((*RIG.cameras, away(lens=lens)))
        plan = plan_focus(SCENE, rig, PlanRequest(samples=300))
        assert plan.cameras[-1].status is CameraStatus.SEES_NOTHING
        assert plan.cameras[-1].focus_distance == expected

    def test_a_camera_that_can_hold_nothing_in_focus_is_not_planned_as_if_it_could(self):
        # It sees the torus from 1 m but focuses from 5 m on: its plan counts it as out of focus.
        blind = tuple(
            Camera(c.name, c.position, c.orientation, c.intrinsics, Lens(0.05, 10.0, 5.0, 9.0))
            for c in RIG.cameras[1:]
        )
        plan = plan_focus(SCENE, Rig((RIG.cameras[0], *blind)), PlanRequest(samples=300))
        assert plan.cameras[0].in_focus_samples > 0
        assert all(camera.in_focus_samples == 0 for camera in plan.cameras[1:])
        assert all(5.0 <= camera.focus_distance <= 9.0 for camera in plan.cameras[1:])
        table = reference.table(plan.problem)
        focus = [camera.focus_distance for camera in plan.cameras]
        assert plan.cost == pytest.approx(reference.cost(table, focus))

    def test_limits_between_which_nothing_comes_into_focus_are_an_error(self):
        blind = tuple(
            Camera(c.name, c.position, c.orientation, c.intrinsics, Lens(0.05, 10.0, 90.0))
            for c in RIG.cameras
        )
        with pytest.raises(InputError, match=r"max_focus: .* none of it, at depths .* not in met"):
            plan_focus(SCENE, Rig(blind), PlanRequest(samples=300))

    def test_a_camera_that_others_outdo_is_unassigned(self):
        # Behind each other on one axis: the nearer one images all better.
        near = looking_at("near", (1.0, 0, 0), (0, 0, 0))
        rig = Rig((near, looking_at("far", (3.0, 0, 0), (0, 0, 0))))
        scene = Scene(sphere(0.05))
        plan = plan_focus(scene, rig, PlanRequest("em", samples=200))
        assert [camera.status for camera in plan.cameras] == [
            CameraStatus.PLANNED,
            CameraStatus.UNASSIGNED,
        ]
        far = plan.cameras[1]
        assert far.assigned_samples == 0
        assert math.isfinite(far.focus_distance)
        assert far.focus_distance > 1


def test_far_limits_may_be_infinite():
    rig = around(6, 1.0, lens=Lens(0.05, 0.6))
    plan = plan_focus(SCENE, rig, PlanRequest(samples=200))
    assert all(camera.focus_distance > 0 for camera in plan.cameras)
    assert any(camera.far_limit == math.inf for camera in plan.cameras)


def test_a_camera_before_a_plane_focuses_on_it():
    # All or nothing: the interval of the depth, and the closed form of the cost.
    scene, rig = Scene(plane(0.6, 0.6, 0.8)), Rig((forward(),))
    mean_radius = 0.6 * (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 6
    for method in ("closest", "average", "em"):
        plan = plan_focus(scene, rig, PlanRequest(method, samples=20_000))
        camera = plan.cameras[0]
        assert 0.8 * 10.05 / 10.8 <= camera.focus_distance <= 0.8 * 9.95 / 9.2
        assert camera.near_limit <= 0.8 <= camera.far_limit
        assert camera.assigned_samples == camera.in_focus_samples == 20_000
        assert plan.cost == pytest.approx(1000 * (0.64 + mean_radius / 0.75) / 3, rel=2e-3)
        assert plan.covered_area == plan.in_focus_area == pytest.approx(0.36)


def test_a_planned_plane_is_centred_in_its_interval():
    plan = plan_focus(Scene(plane(0.6, 0.6, 0.8)), Rig((forward(),)), PlanRequest("em", 100))
    middle = (0.8 * 10.05 / 10.8 + 0.8 * 9.95 / 9.2) / 2
    assert distances(plan) == pytest.approx([middle])


def test_a_sphere_is_covered_as_far_as_it_is_seen():
    # From distance D a sphere of radius R shows the share (1 − R/D)/2.
    scene = Scene(sphere(0.25, subdivisions=4))
    request = PlanRequest("em", 20_000, fresh_samples=20_000)
    plan = plan_focus(scene, Rig(around(1, 1.0, height=0).cameras), request)
    assert plan.covered_area / plan.surface_area == pytest.approx(0.75 / 2, abs=0.01)
    assert plan.surface_area == pytest.approx(4 * np.pi / 16, rel=0.01)
    # What is in focus is a zone between two depths: 2πR·height.
    camera = plan.cameras[0]
    near, far = max(camera.near_limit, 0.75), min(camera.far_limit, 1 - 0.25**2)
    assert plan.in_focus_area == pytest.approx(2 * np.pi * 0.25 * (far - near), rel=0.03)


def test_a_cloud_is_planned_like_its_mesh():
    mesh = merged(sphere(0.2, (0.25, 0, 0), 4), sphere(0.3, (-0.3, 0.1, 0), 4))
    dense = sample_mesh(mesh, 30_000, 0)
    rig = around(8, 1.2)
    for normals in (dense.normals, None):
        scene = Scene(PointCloud(dense.points, normals))
        plan = plan_focus(scene, rig, PlanRequest(samples=4000))
        truth = plan_focus(Scene(mesh), rig, PlanRequest(samples=4000, seed=1))
        assert plan.cost == pytest.approx(truth.cost, rel=0.03)
        assert plan.surface_area == pytest.approx(truth.surface_area, rel=0.05)
        assert plan.covered_area == pytest.approx(truth.covered_area, rel=0.07)


def test_a_clouds_own_points_may_be_the_samples():
    dense = sample_mesh(sphere(0.4, subdivisions=3), 2000, 0)
    scene = Scene(PointCloud(dense.points, dense.normals))
    plan = plan_focus(scene, RIG, PlanRequest(samples=0))
    assert plan.samples == 2000
    np.testing.assert_array_equal(plan.problem.samples.points, dense.points)
    costs, _ = plan.problem.evaluate(distances(plan))
    weights = plan.problem.samples.weights
    assert weights.std() > 0.1 * weights.mean()
    assert plan.cost == pytest.approx(1000 * (weights * costs).sum() / weights.sum())


def test_stopping_down_costs_less():
    # A smaller hyperfocal distance is more depth of field: every interval contains the old one.
    for method in ("closest", "average"):
        costs = [
            plan_focus(SCENE, around(6, 1.0, lens=Lens(0.05, h)), PlanRequest(method, 300)).cost
            for h in (20.0, 10.0, 5.0, 1.0)
        ]
        assert costs == sorted(costs, reverse=True)
        assert costs[-1] < costs[0]


@pytest.mark.parametrize("k", [2, 3])
@pytest.mark.parametrize("scope", ["all", "assigned"])
@pytest.mark.parametrize("tuples", ["overlap", "grid"])
def test_every_kind_of_k_view(k, scope, tuples):
    rig = cylinder_rig(3, 6, bottom=0.3, top=1.5)
    scene = Scene(body())
    plan = plan_focus(scene, rig, PlanRequest(samples=500, k=k, scope=scope, tuples=tuples))
    em = plan_focus(scene, rig, PlanRequest("em", samples=500))
    assert plan.cost < em.cost
    more = PlanRequest(samples=500, k=k, scope=scope, tuples=tuples, shots=2)
    assert plan_focus(scene, rig, more).cost < 0.98 * plan.cost


@pytest.mark.parametrize("scope", SCOPES)
@pytest.mark.parametrize(
    ("cameras", "options"),
    [
        (1, {}),
        (1, {"k": 3}),
        (1, {"tuples": "grid"}),
        (1, {"k": 3, "shots": 2}),
        (2, {"k": 3}),
    ],
)
def test_of_fewer_cameras_than_k_the_plan_is_the_best(cameras, options, scope):
    rig = Rig(RIG.cameras[:cameras])
    plan = plan_focus(SCENE, rig, PlanRequest(samples=300, scope=scope, **options))
    shots = options.get("shots", 1)
    best = plan_focus(SCENE, rig, PlanRequest("optimal", samples=300, shots=shots, gap=0.0))
    assert plan.method == "k_view"
    assert plan.converged
    assert plan.cost == best.cost == pytest.approx(best.lower_bound, rel=1e-9)
    assert [camera.status for camera in plan.cameras] == [CameraStatus.PLANNED] * cameras


@pytest.mark.parametrize(
    ("rig", "request_", "message"),
    [
        (
            RIG,
            PlanRequest(samples=0, standard_error=1e-3),
            r"standard_error: expected at least 0\.\d+ for .* got 0\.001; it would take [\d.e+]+ s",
        ),
        (
            RIG,
            PlanRequest(samples=0, standard_error=1e-300),
            "standard_error: .* got 1e-300; it would take inf samples",
        ),
        (
            RIG,
            PlanRequest(tuples="grid"),
            "tuples: expected overlap, for a rig without a grid, got 'grid'; or give the rig's",
        ),
    ],
)
def test_requests_that_fit_neither_rig_nor_surface(rig, request_, message):
    with pytest.raises(InputError, match=message):
        plan_focus(SCENE, rig, request_)


def test_planning_leaves_its_inputs_alone():
    mesh = torus(0.4, 0.15)
    vertices, triangles = mesh.vertices.copy(), mesh.triangles.copy()
    scene = Scene(mesh)
    for method, samples in itertools.product(METHODS, (100, 200)):
        plan_focus(scene, RIG, PlanRequest(method, samples))
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.triangles, triangles)


def test_vertex_normals_count():
    # Smooth normals on a coarse sphere: other costs than its flat triangles' own.
    coarse = sphere(0.4, subdivisions=1)
    smooth = Mesh(coarse.vertices, coarse.triangles, coarse.vertices)
    flat, round_ = (plan_focus(Scene(m), RIG, PlanRequest("em", 2000)) for m in (coarse, smooth))
    assert flat.cost != round_.cost
    assert flat.cost == pytest.approx(round_.cost, rel=0.05)


def test_a_wide_image_sees_more():
    narrow = dataclasses.replace(WIDE_ANGLE, fx=1500.0, fy=1500.0)
    plans = [
        plan_focus(SCENE, around(6, 1.0, intrinsics=intrinsics), PlanRequest("em", 1000))
        for intrinsics in (narrow, WIDE_ANGLE)
    ]
    assert plans[0].covered_area < plans[1].covered_area <= plans[1].surface_area
