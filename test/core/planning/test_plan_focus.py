import dataclasses
import itertools
import math
import time

import numpy as np
import pytest
from numba import config, get_num_threads

from focus_planner import (
    Camera,
    CameraStatus,
    CostModel,
    InputError,
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
from focus_planner.core import kernels
from focus_planner.core.planning.formulation import formulate_fresh_problem, formulate_problem
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.planning.request import METHODS
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
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
    stepped_lenses,
    torus,
    with_threads,
)

SCENE = Scene(torus(0.4, 0.15))
RIG = around(6, 1.0)
_NOT_THE_PLAN = {
    *("solve_seconds", "total_seconds"),
    *("problem", "fresh_problem", "prices", "answers"),
}
each_method = pytest.mark.parametrize("method", METHODS)


def distances(plan):
    return np.array([camera.focus_distance for camera in plan.cameras])


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


def assigned_and_sharp(samples, visible, focus, model, rig=RIG):
    """Per camera the samples that it images best, and those of them in focus, from Eq. 1 alone."""
    assigned, sharp = [0] * len(rig), [0] * len(rig)
    for p, (point, normal) in enumerate(zip(samples.points, samples.normals, strict=True)):
        costs = {
            c: reference.pointwise_cost(point, normal, camera, focus[c], model)
            for c, camera in enumerate(rig.cameras)
            if (p, c) in visible
        }
        if costs:
            best = min(costs, key=costs.get)
            camera = rig.cameras[best]
            depth = (point - camera.position) @ reference.camera_axes(camera)[2]
            assigned[best] += 1
            sharp[best] += reference.in_focus(depth, focus[best], camera.lens)
    return assigned, sharp


def test_the_default_is_2_view_on_4096_samples_and_as_many_fresh_ones():
    default = PlanRequest("k_view", 4096, 0, 2, "all", "overlap", math.inf, 1, 0.0, 4096, 2.0)
    assert PlanRequest() == dataclasses.replace(default, bound="quick", gap=1e-4)
    plan = plan_focus(SCENE, RIG)
    assert (plan.method, plan.samples, plan.fresh_samples) == ("k_view", 4096, 4096)


def without_seconds(plan):
    values = {field.name: getattr(plan, field.name) for field in dataclasses.fields(plan)}
    return {name: value for name, value in values.items() if name not in _NOT_THE_PLAN}


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

    @staticmethod
    def away(name="away", **changes):
        return looking_at(name, (1.0, 0, 0), (2.0, 0, 0), **changes)

    @each_method
    def test_a_camera_that_sees_nothing_gets_the_others_median(self, method):
        rig = Rig((*RIG.cameras, self.away()))
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
            (Lens(0.8, 100.0), 1.6),
        ],
    )
    def test_as_far_as_its_lens_goes(self, lens, expected):
        rig = Rig((*RIG.cameras, self.away(lens=lens)))
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
            Camera(c.name, c.position, c.orientation, c.intrinsics, Lens(0.05, 10.0, 300.0))
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


@each_method
def test_lens_limits_are_kept_exactly(method):
    lens = Lens(0.05, 10.0, 0.8, 0.95)
    rig = around(6, 1.0, lens=lens)
    plan = plan_focus(SCENE, rig, PlanRequest(method, samples=300))
    assert ((distances(plan) >= 0.8) & (distances(plan) <= 0.95)).all()
    free = plan_focus(SCENE, RIG, PlanRequest(method, samples=300))
    assert ((distances(free) < 0.8) | (distances(free) > 0.95)).any()


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


@each_method
def test_a_time_budget_ends_the_solver_with_a_valid_plan(method):
    scene, rig = Scene(body()), cylinder_rig(3, 8, bottom=0.3, top=1.5)
    whole = plan_focus(scene, rig, PlanRequest(method, samples=500))
    hasty = plan_focus(scene, rig, PlanRequest(method, samples=500, time_budget=1e-9))
    assert whole.converged
    assert not hasty.converged
    assert np.isfinite(distances(hasty)).all()
    assert hasty.lower_bound is not None
    assert hasty.lower_bound <= hasty.cost
    closest = plan_focus(scene, rig, PlanRequest("closest", samples=500))
    if method != "average":
        assert whole.cost <= hasty.cost <= closest.cost


def test_a_watch_hears_of_every_step_and_may_end_it():
    heard = []

    def on_progress(progress):
        heard.append(progress)
        return progress.stage != "em" or progress.iteration < 2

    plan = plan_focus(SCENE, RIG, PlanRequest(samples=1000), on_progress=on_progress)
    assert [(p.stage, p.iteration) for p in heard[-2:]] == [("em", 1), ("em", 2)]
    stages = list(dict.fromkeys(p.stage for p in heard))
    assert stages == ["fresh", "visibility", "cells", "solving", "em"]
    assert all(math.isnan(p.cost) for p in heard[:-2])
    assert not plan.converged
    assert heard[-2].cost >= heard[-1].cost >= plan.cost - 1e-6  # whole units, rounded


class Impatient:
    """A watch that says no once it was asked so often."""

    def __init__(self, patience):
        self.left = patience
        self.said_no = False

    def __call__(self, progress):
        self.left -= 1
        self.said_no = self.left < 0
        return not self.said_no


@pytest.mark.parametrize(
    "request_",
    [
        PlanRequest(samples=3000, fresh_samples=3000),
        PlanRequest("optimal", samples=2000, bound="none", gap=0.0),
        PlanRequest("k_view", samples=2000, k=3, shots=2, bound="tight"),
        PlanRequest("em", samples=0, standard_error=6.0),
        PlanRequest("closest", samples=2000, bound="tight"),
    ],
)
def test_a_plan_that_was_ended_is_made_again_from_its_answers(request_):
    ended = 0
    rig = cylinder_rig(3, 6, bottom=0.3, top=1.5)
    scene = Scene(body())
    for patience in (0, 1, 2, 3, 5, 8, 13, 21, 34, 55):
        on_progress = Impatient(patience)
        plan = plan_focus(scene, rig, request_, on_progress=on_progress)
        again = plan_focus(scene, rig, request_, answers=plan.answers)
        assert (without_seconds(again), again.answers) == (without_seconds(plan), plan.answers)
        assert plan.converged or on_progress.said_no or request_.gap == 0
        ended += on_progress.said_no
        # A clock that has run out changes nothing either.
        hurried = dataclasses.replace(request_, time_budget=1e-9)
        again = plan_focus(scene, rig, hurried, answers=plan.answers)
        assert without_seconds(again) == without_seconds(plan)
    assert ended >= 4


@pytest.mark.parametrize("budget", [0.01, 0.05, 0.2])
def test_a_plan_that_a_budget_ended_is_made_again_from_its_answers(budget):
    request = PlanRequest("optimal", samples=8192, gap=0.0, time_budget=budget)
    rig, scene = cylinder_rig(4, 9), Scene(body())
    plan = plan_focus(scene, rig, request)
    assert not plan.converged
    again = plan_focus(scene, rig, request, answers=plan.answers)
    assert (without_seconds(again), again.answers) == (without_seconds(plan), plan.answers)


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


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"method": "best"}, "method: expected one of closest, average, em, k_view"),
        ({"samples": -1}, "samples: expected a whole number of at least 0, got -1"),
        ({"samples": 10.0}, "samples: expected a whole number of at least 0, got 10.0"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"k": 1}, "k: expected 2 or 3, got 1"),
        ({"k": 4}, "k: expected 2 or 3, got 4"),
        ({"scope": "some"}, "scope: expected one of all, assigned, got 'some'"),
        ({"tuples": "none"}, "tuples: expected one of overlap, grid, got 'none'"),
        ({"time_budget": 0}, "time_budget: expected a number above 0, got 0"),
        ({"time_budget": math.nan}, "time_budget: expected a number above 0, got nan"),
        ({"shots": 0}, "shots: expected a whole number of at least 1, got 0"),
        ({"shots": 17}, "shots: expected at most 16, got 17"),
        ({"shots": 2.0}, "shots: expected a whole number of at least 1, got 2.0"),
        ({"depth_tolerance": -0.1}, "depth_tolerance: expected a number of at least 0, got -0.1"),
        (
            {"depth_tolerance": math.inf},
            "depth_tolerance: expected a number of at least 0, got inf",
        ),
        ({"samples": 2_000_001}, "samples: expected at most 2000000, got 2000001"),
        ({"fresh_samples": 1}, "fresh_samples: expected a whole number of at least 2, got 1"),
        ({"fresh_samples": 2_000_001}, "fresh_samples: expected at most 2000000, got 2000001"),
        ({"standard_error": 0}, "standard_error: expected a number above 0, got 0"),
        ({"standard_error": math.inf}, "standard_error: expected a number above 0, got inf"),
        ({"standard_error": math.nan}, "standard_error: expected a number above 0, got nan"),
        ({"bound": "some"}, "bound: expected one of none, quick, tight, got 'some'"),
        ({"gap": -1e-9}, "gap: expected a number of at least 0, got -1e-09"),
        ({"gap": math.nan}, "gap: expected a number of at least 0, got nan"),
        ({"gap": "tight"}, "gap: expected a number of at least 0, got 'tight'"),
        ({"gap": 1e300}, r"gap: expected at most 1, the whole cost, got 1e\+300"),
    ],
)
def test_requests_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        PlanRequest(**values)


@pytest.mark.parametrize(
    ("rig", "request_", "message"),
    [
        (
            Rig(RIG.cameras[:1]),
            PlanRequest(),
            "k: expected at most 1, the number of cameras, got 2; a single camera .* method em",
        ),
        (Rig(RIG.cameras[:2]), PlanRequest(k=3), "k: expected at most 2, the number of cameras"),
        (
            Rig(RIG.cameras[:1]),
            PlanRequest(k=3, shots=2),
            "k: expected at most 2, the number of cameras times shots, got 3",
        ),
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


@pytest.mark.parametrize("shots", [1, 2])
def test_a_formulated_problem_is_the_plans(shots):
    request = PlanRequest(samples=200, shots=shots, depth_tolerance=0.001)
    problem, plan = formulate_problem(SCENE, RIG, request), plan_focus(SCENE, RIG, request)
    np.testing.assert_array_equal(problem.base_cost, plan.problem.base_cost)
    assert problem.cost(plan.focus_distances) == plan.cost


@each_method
@pytest.mark.parametrize("shots", [2, 3])
def test_a_plan_of_several_shots_adds_up(method, shots):
    rig = Rig((*RIG.cameras, TestStatuses.away()))
    request = PlanRequest(method, samples=200, seed=3, shots=shots, fresh_samples=150)
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


@each_method
def test_every_distance_that_a_plan_names_can_be_set(method):
    rig = stepped_lenses(Rig((*RIG.cameras, TestStatuses.away(), TestStatuses.away("far_away"))))
    assert rig.cameras[-1].lens.focus_steps == 8
    for shots, tolerance in ((1, 0.0), (2, 0.0), (3, 0.002)):
        request = PlanRequest(method, samples=300, shots=shots, depth_tolerance=tolerance)
        plan = plan_focus(SCENE, rig, request)
        assert without_seconds(plan) == without_seconds(plan_focus(SCENE, rig, request))
        for camera, of_rig in zip(plan.cameras, rig.cameras, strict=True):
            settable = of_rig.lens.settable_distances
            if settable is not None:
                assert {shot.focus_distance for shot in camera.shots} <= set(settable)
                assert camera.focus_distance in settable


@each_method
def test_device_values_are_what_the_tables_say_and_whole_where_they_must_be(method):
    tables = (
        LensTable("focus_absolute", True, (0.55, 0.8, 1.3), (90, 40.5, 3)),
        LensTable("steps", False, (0.6, 1.0, math.inf), (0, 500, 900)),
        LensTable("dioptres"),
        None,
    )
    rig = Rig((*RIG.cameras, TestStatuses.away(), TestStatuses.away("far_away")))
    rig = Rig(
        tuple(
            dataclasses.replace(camera, lens=Lens(table=tables[i % len(tables)]))
            for i, camera in enumerate(rig.cameras)
        )
    )
    plan = plan_focus(SCENE, rig, PlanRequest(method, samples=300, shots=2))
    assert {camera.device_unit for camera in plan.cameras} == {
        *("focus_absolute", "steps", "dioptres", None)
    }
    for camera, of_rig in zip(plan.cameras, rig.cameras, strict=True):
        table = of_rig.lens.table
        if table is None:
            assert (camera.device_value, camera.device_unit) == (None, None)
            assert all(shot.device_value is None for shot in camera.shots)
            continue
        assert camera.device_unit == table.unit
        for shot in (camera, *camera.shots):
            assert table.nearest <= shot.focus_distance <= table.farthest
            assert shot.device_value == table.value_at(shot.focus_distance)
            if table.whole:
                assert table.distance_at(round(shot.device_value)) == shot.focus_distance


def test_a_table_that_allows_every_distance_changes_no_plan():
    told = around(6, 1.0, lens=Lens(table=LensTable("dioptres")))
    for method in METHODS:
        plain, with_table = (
            plan_focus(SCENE, rig, PlanRequest(method, samples=300)) for rig in (RIG, told)
        )
        assert plain.cost == with_table.cost
        np.testing.assert_array_equal(plain.focus_distances, with_table.focus_distances)


def test_tables_with_nothing_in_reach_are_an_error():
    table = LensTable("steps", True, (400.0, 500.0), (0, 10))
    rig = around(6, 1.0, lens=Lens(table=table))
    with pytest.raises(InputError, match=r"^lens.table, lens.min_focus, .* none of it, at depths"):
        plan_focus(SCENE, rig, PlanRequest(samples=300))


def test_a_list_is_planned_on_not_rounded_to():
    # AcceptedInput in focus as far as the listed distances allow, which rounding misses.
    lens = Lens(focus_distances=tuple(np.arange(0.6, 1.4, 0.06)))
    request = PlanRequest(samples=1000)
    exact = plan_focus(SCENE, around(6, 1.0, lens=lens), request)
    free = plan_focus(SCENE, RIG, request)
    rounded = [
        lens.settable_distances[np.abs(lens.settable_distances - s).argmin()]
        for s in free.focus_distances
    ]
    assert free.cost < exact.cost < exact.problem.cost(np.array(rounded))


def test_a_list_with_nothing_in_reach_leaves_a_camera_out_of_focus():
    blind = dataclasses.replace(RIG.cameras[0], lens=Lens(focus_distances=(4.0, 5.0)))
    for method in METHODS:
        plan = plan_focus(SCENE, Rig((blind, *RIG.cameras[1:])), PlanRequest(method, 300))
        camera = plan.cameras[0]
        assert (camera.focus_distance, camera.in_focus_samples) == (4.0, 0)
        assert camera.status in {CameraStatus.PLANNED, CameraStatus.UNASSIGNED}


def test_lists_with_nothing_in_reach_are_an_error():
    rig = around(6, 1.0, lens=Lens(focus_distances=(400.0, 500.0)))
    with pytest.raises(InputError, match=r"^lens.focus_distances, .* none of it, at depths from"):
        plan_focus(SCENE, rig, PlanRequest(samples=300))


def test_a_tolerance_shrinks_what_is_in_focus():
    plans = [
        plan_focus(SCENE, RIG, PlanRequest(samples=500, depth_tolerance=t))
        for t in (0.0, 0.005, 0.01, 0.02)
    ]
    assert [plan.depth_tolerance for plan in plans] == [0.0, 0.005, 0.01, 0.02]
    assert np.diff([plan.cost for plan in plans]).min() > 0
    in_focus = [sum(camera.in_focus_samples for camera in plan.cameras) for plan in plans]
    assert np.diff(in_focus).max() < 0
    # And of what one plan has in focus on fresh samples less counts.
    focus = plans[0].focus_distances
    fresh = [
        estimate_quality(formulate_fresh_problem(SCENE, RIG, PlanRequest(depth_tolerance=t)), focus)
        for t in (0.0, 0.005, 0.01, 0.02)
    ]
    assert fresh[0].in_focus_area.value == plans[0].in_focus_area
    assert np.diff([quality.in_focus_area.value for quality in fresh]).max() < 0
    assert len({quality.covered_area for quality in fresh}) == 1
    # A plan made with it is in focus wherever the surface is within it: every sample's depth may
    # move as far.
    sure = plans[2]
    problem, focus = sure.problem, sure.focus_distances
    chosen = focus[problem.camera_index]
    counted = (problem.focus_near <= chosen) & (chosen <= problem.focus_far)
    for depth, s in zip(problem.depth[counted], chosen[counted], strict=True):
        assert reference.in_focus(depth - 0.01, s, Lens())
        assert reference.in_focus(depth + 0.01, s, Lens())


def test_a_tolerance_beyond_every_depth_of_field_is_an_error():
    with pytest.raises(InputError, match=r"depth_tolerance: expected .*, got 0.5, with which noth"):
        plan_focus(SCENE, RIG, PlanRequest(samples=300, depth_tolerance=0.5))


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


def test_posing_that_is_ended_poses_the_problem_of_fewer_samples():
    request = PlanRequest(samples=3000, seed=3)
    whole = formulate_problem(SCENE, RIG, request)
    ended = formulate_problem(SCENE, RIG, request, keep_going=lambda: False)
    assert 0 < ended.sample_count < whole.sample_count
    first = slice(0, ended.sample_count)
    np.testing.assert_array_equal(ended.samples.points, whole.samples.points[first])
    assert ended.samples.weights.sum() == pytest.approx(SCENE.area)
    pairs = slice(0, len(ended.depth))
    for name in ("sample_index", "camera_index", "depth", "base_cost", "focus_near"):
        np.testing.assert_array_equal(getattr(ended, name), getattr(whole, name)[pairs])


@pytest.mark.parametrize("normals", [True, False], ids=["normals given", "estimated"])
def test_posing_that_is_ended_takes_a_clouds_points_from_everywhere(normals):
    drawn = sample_mesh(sphere(0.4, subdivisions=4), 5000, 1)
    order = np.argsort(drawn.points[:, 0])  # as a scanner might
    cloud = PointCloud(drawn.points[order], drawn.normals[order] if normals else None)
    scene, request = Scene(cloud), PlanRequest(samples=0)
    whole = formulate_problem(scene, RIG, request)
    asked = formulate_problem(scene, RIG, request, keep_going=lambda: True)
    np.testing.assert_array_equal(asked.samples.points, cloud.points)
    np.testing.assert_array_equal(asked.samples.weights, whole.samples.weights)
    np.testing.assert_array_equal(asked.base_cost, whole.base_cost)
    ended = formulate_problem(scene, RIG, request, keep_going=lambda: False)
    assert ended.sample_count == 512
    assert (np.diff(ended.samples.points[:, 0]) >= 0).all()
    assert abs(np.median(ended.samples.points[:, 0])) < 0.05
    assert ended.samples.weights.sum() == pytest.approx(whole.samples.weights.sum())


@each_method
def test_every_plan_may_have_a_bound(method):
    scene, rig = Scene(body("arms_out")), cylinder_rig(4, 9)
    optimum = plan_focus(scene, rig, PlanRequest("optimal", 500))
    assert optimum.converged
    plans = {
        bound: plan_focus(scene, rig, PlanRequest(method, 500, bound=bound))
        for bound in ("none", "quick", "tight")
    }
    assert len({plan.cameras for plan in plans.values()}) == 1
    if method != "optimal":
        assert plans["none"].lower_bound is plans["none"].gap is plans["none"].prices is None
        assert plans["quick"].lower_bound < plans["tight"].lower_bound
        del plans["none"]
    for plan in plans.values():
        assert 0.99 * optimum.cost < plan.lower_bound <= optimum.cost <= plan.cost
        assert plan.gap == (plan.cost - plan.lower_bound) / plan.cost
        assert plan.prices.shape == (500,)
        assert plan.converged
    assert plans["tight"].lower_bound > 0.997 * optimum.cost


def test_a_gap_is_near_enough():
    scene, rig = Scene(body("arms_out")), cylinder_rig(4, 9)
    steps = []
    for gap in (1e-6, 1e-3, 0.05, 1.0):
        heard = []
        request = PlanRequest("optimal", 500, gap=gap)
        plan = plan_focus(
            scene, rig, request, on_progress=lambda p, heard=heard: not heard.append(p)
        )
        assert plan.converged
        assert plan.gap <= gap + 1e-9
        steps.append(len(heard))
        loose = plan_focus(scene, rig, PlanRequest("em", 500, bound="tight", gap=gap))
        assert loose.lower_bound <= plan.cost
    assert steps == sorted(steps, reverse=True)
    assert steps[0] > steps[-1]


def test_a_plan_that_costs_nothing_is_the_best():
    plan = plan_focus(SCENE, RIG, PlanRequest("em", 100))
    free = dataclasses.replace(plan, cost=0.0, lower_bound=0.0)
    assert free.gap == 0.0


@each_method
def test_in_no_time_a_plan_is_made_on_what_was_seen(method):
    scene, rig = Scene(body()), cylinder_rig()
    request = PlanRequest(method, 8192, time_budget=1e-6)
    plan = plan_focus(scene, rig, request)
    whole = plan_focus(scene, rig, PlanRequest("em", 8192))
    assert 0 < plan.samples < 8192
    assert 1 < plan.fresh_samples < 4096
    assert not plan.converged
    assert np.isfinite(distances(plan)).all()
    assert (distances(plan) > 0).all()
    assert plan.lower_bound <= plan.cost
    assert plan.cost == pytest.approx(plan.problem.cost(plan.focus_distances), rel=1e-12)
    # What there is stands for all of the surface.
    assert plan.surface_area == whole.surface_area
    assert plan.covered_area == pytest.approx(whole.covered_area, rel=0.1)
    assert 0.2 * whole.in_focus_area < plan.in_focus_area <= plan.covered_area
    assert plan.problem.samples.weights.sum() == pytest.approx(
        whole.problem.samples.weights.sum(), rel=1e-9
    )


@each_method
def test_enough_time_changes_nothing(method):
    request = PlanRequest(method, 1500, seed=2)
    scene, rig = Scene(body("arms_out")), cylinder_rig(3, 8)
    ample = dataclasses.replace(request, time_budget=1000.0)
    plans = [plan_focus(scene, rig, r) for r in (request, ample)]
    assert without_seconds(plans[0]) == without_seconds(plans[1])
    assert plans[0].converged
    assert plans[0].prices.tobytes() == plans[1].prices.tobytes()


def test_a_deadline_is_kept_on_many_samples():
    scene, rig = Scene(body()), cylinder_rig()
    plan_focus(scene, rig, PlanRequest(samples=500))  # loads what is compiled
    began = time.perf_counter()
    plan = plan_focus(scene, rig, PlanRequest("optimal", 65_536, time_budget=1.0))
    assert time.perf_counter() - began < 3
    assert not plan.converged
    assert plan.lower_bound <= plan.cost
    assert plan.samples > 512


STAGES = ("fresh", "visibility", "em", "k_view", "prices", "branching")


@pytest.mark.parametrize(
    ("stage", "step"),
    [(stage, step) for stage in STAGES for step in (1, 2) if (stage, step) != ("branching", 2)],
)
def test_a_watch_may_end_any_stage(stage, step):
    scene, rig = Scene(body("arms_out")), cylinder_rig(4, 9)
    request, heard = PlanRequest("optimal", 2000), []

    def on_progress(progress):
        heard.append(progress.stage)
        return heard.count(stage) < step

    plan = plan_focus(scene, rig, request, on_progress=on_progress)
    assert heard[-1] == stage
    assert heard.count(stage) == step
    assert not plan.converged
    assert (plan.samples < 2000) == (stage in {"fresh", "visibility"})
    assert np.isfinite(distances(plan)).all()
    assert (distances(plan) > 0).all()
    assert plan.lower_bound <= plan.cost


@pytest.mark.parametrize("method", ["closest", "average", "em", "k_view"])
def test_a_watch_may_end_the_bound(method):
    heard = []

    def on_progress(progress):
        heard.append(progress)
        return progress.stage != "prices"

    whole = plan_focus(SCENE, RIG, PlanRequest(method, 1000, bound="tight"))
    plan = plan_focus(SCENE, RIG, PlanRequest(method, 1000, bound="tight"), on_progress=on_progress)
    assert [p.stage for p in heard].count("prices") == 1
    assert heard[-1].cost == pytest.approx(plan.cost, rel=1e-9)
    assert heard[-1].lower_bound == plan.lower_bound <= whole.lower_bound
    assert plan.cameras == whole.cameras


def test_fresh_samples_left_out_are_told():
    def on_progress(progress):
        return progress.stage != "fresh"

    plan = plan_focus(SCENE, RIG, PlanRequest("closest", 300), on_progress=on_progress)
    assert plan.fresh_samples < 4096
    assert plan.samples == 300
    assert not plan.converged


def test_bounds_of_poor_plans_aim_at_a_good_one():
    # Aiming at the plan's own cost, 40 % above the best, as many steps end 3 % lower.
    scene, rig = Scene(body("arms_out")), cylinder_rig()
    poor, good = (plan_focus(scene, rig, PlanRequest(m, 1000)) for m in ("closest", "em"))
    assert poor.cost > 1.2 * good.cost
    assert poor.lower_bound == pytest.approx(good.lower_bound, rel=0.005)
