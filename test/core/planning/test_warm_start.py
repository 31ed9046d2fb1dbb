# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planning again after something has changed a little."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from focus_planner import (
    InputError,
    Lens,
    PlanRequest,
    PointCloud,
    Rig,
    Scene,
    cylinder_rig,
    plan_focus,
)
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.planning.request import METHODS
from focus_planner.core.planning.warm_start import warm_options, warm_prices
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.solvers import Options
from focus_planner.core.surface.sampling import sample_mesh
from testing.problems import around, body, random_problem, torus

SCENE = Scene(torus(0.4, 0.15))
RIG = around(6, 1.0)
BODY = Scene(body("arms_out"))
BODY_RIG = cylinder_rig(4, 9)


class Log:
    """A callback that counts steps by stage."""

    def __init__(self):
        self.steps = Counter()

    def __call__(self, progress):
        self.steps[progress.stage] += 1
        return True


def planned(scene=BODY, rig=BODY_RIG, request=None, before=None, **changes):
    """A plan and the steps that it took."""
    log = Log()
    request = replace(request or PlanRequest("optimal", 600, gap=1e-5), **changes)
    return plan_focus(
        scene, rig, request, on_progress=log, warm_start=before and before.warm_start
    ), log.steps


def check(plan, request):
    """What holds of every plan, wherever it started."""
    assert np.isfinite(plan.focus_distances).all()
    assert plan.cost == pytest.approx(plan.problem.cost(plan.focus_distances), rel=1e-12)
    assert plan.lower_bound is None or plan.lower_bound <= plan.cost
    assert plan.converged
    assert plan.method == request.method


def nudged(rig, metres=0.002, degrees=0.1, seed=0):
    """The same rig, every camera moved and turned a little."""
    random = np.random.default_rng(seed)
    return replace(
        rig,
        cameras=tuple(
            replace(
                c,
                position=tuple(np.array(c.position) + random.normal(0, metres, 3)),
                orientation=tuple(
                    (
                        Rotation.from_rotvec(random.normal(0, np.radians(degrees), 3))
                        * Rotation.from_quat(c.orientation)
                    ).as_quat()
                ),
            )
            for c in rig.cameras
        ),
    )


class TestOptions:
    """What is handed to the solver."""

    @staticmethod
    def warm_start(problem, prices=True):
        distances = np.linspace(0.5, 0.9, problem.camera_count)
        random = np.random.default_rng(0)
        points = problem.samples.points
        prices = random.random(len(points)) if prices else None
        return WarmStart(problem.names, distances, points, prices)

    def test_the_same_problem_gets_the_same_back(self):
        problem = random_problem(0, 30, 4)
        before = self.warm_start(problem)
        options = warm_options(Options(k=3, gap=0.1), before, problem)
        np.testing.assert_array_equal(options.start, before.focus_distances)
        np.testing.assert_array_equal(warm_prices(before, problem), before.prices)
        assert (options.k, options.gap) == (3, 0.1)

    def test_cameras_are_known_by_name(self):
        problem = random_problem(0, 30, 4)
        before = self.warm_start(problem)
        others = replace(problem, names=("c2", "new", "c0", "c3"))
        start = warm_options(Options(), before, others).start
        expected = before.focus_distances[[2, 0, 3]]
        np.testing.assert_array_equal(start[[0, 2, 3]], expected)
        assert np.isnan(start[1])

    def test_new_cameras_start_as_they_would_have(self):
        problem = random_problem(0, 30, 4)
        others = replace(problem, names=("c2", "new", "c0", "newer"))
        own = np.array([0.1, 0.2, 0.3, np.nan])
        options = warm_options(Options(start=own), self.warm_start(problem), others)
        assert options.start[1] == 0.2
        assert np.isnan(options.start[3])
        np.testing.assert_array_equal(own[:3], [0.1, 0.2, 0.3])

    def test_shots_are_known_by_their_order(self):
        one = random_problem(0, 30, 2)
        two, three = with_shots(one, 2), with_shots(one, 3)
        own = np.full(6, 7.0)
        turned = replace(three, names=("c1", "c1", "c1", "c0", "c0", "c0"))
        start = warm_options(Options(start=own), self.warm_start(three), turned).start
        d = self.warm_start(three).focus_distances
        np.testing.assert_array_equal(start, d[[3, 4, 5, 0, 1, 2]])
        # What is best for some shots is no start for more or fewer of them.
        start = warm_options(Options(start=own), self.warm_start(two), three).start
        np.testing.assert_array_equal(start, own)
        assert np.isnan(warm_options(Options(), self.warm_start(three), one).start).all()

    def test_a_sample_takes_the_price_of_the_nearest(self):
        before = self.warm_start(random_problem(0, 50, 3))
        problem = random_problem(1, 80, 3)
        prices = warm_prices(before, problem)
        old, new = before.points, problem.samples.points
        for p, price in enumerate(prices):
            away = np.linalg.norm(old - new[p], axis=1)
            assert price == before.prices[away.argmin()]

    def test_without_prices_only_distances_are_known(self):
        problem = random_problem(0, 30, 4)
        before = self.warm_start(problem, prices=False)
        assert warm_prices(before, problem) is None
        assert warm_options(Options(), before, problem).start is not None

    def test_without_an_earlier_plan_there_are_no_prices(self):
        assert warm_prices(None, random_problem(0, 30, 4)) is None


def test_the_same_again_takes_far_fewer_steps():
    changes = {"rig": cylinder_rig(), "samples": 1000, "gap": 1e-4}
    cold, steps = planned(**changes)
    warm, again = planned(**changes, before=cold)
    assert cold.converged
    assert warm.converged
    assert warm.cost <= cold.cost * (1 + 1e-4)
    assert warm.lower_bound <= cold.cost
    assert again["prices"] < 0.5 * steps["prices"]
    assert again["em"] < steps["em"]
    assert again.total() < 0.7 * steps.total()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_starts_from_the_plan_before(method):
    request = PlanRequest(method, 500)
    cold, steps = planned(request=request)
    warm, again = planned(request=request, before=cold)
    check(warm, request)
    assert warm.cost <= cold.cost * (1 + 1e-6)
    assert again.total() <= steps.total()
    if method in {"closest", "average", "greedy"}:  # which start nowhere
        assert warm.cameras == cold.cameras


def test_after_a_small_change_it_is_as_good_and_sooner():
    changes = {"samples": 1000, "gap": 1e-4}
    cold, _ = planned(rig=cylinder_rig(), bound="tight", method="k_view", **changes)
    moved = nudged(cylinder_rig())
    fresh, steps = planned(rig=moved, **changes)
    warm, again = planned(rig=moved, before=cold, **changes)
    check(warm, PlanRequest("optimal"))
    assert warm.cost == pytest.approx(fresh.cost, rel=2e-4)
    assert max(warm.lower_bound, fresh.lower_bound) <= min(warm.cost, fresh.cost)
    assert again["prices"] < steps["prices"]


@pytest.mark.parametrize("method", ["em", "k_view", "optimal"])
def test_it_may_start_from_anything(method):
    request = PlanRequest(method, 300, gap=1e-4)
    cold, _ = planned(SCENE, RIG, request)
    names = [replace(c, name=f"other_{i}") for i, c in enumerate(RIG.cameras)]
    near = Lens(0.05, 10.0, 0.5, 0.6)  # nothing that was planned can be set
    cases = {
        "renamed": ({"rig": Rig(tuple(names))}, {}),
        "some renamed": ({"rig": Rig((*names[:3], *RIG.cameras[3:]))}, {}),
        "more": ({"rig": around(8, 1.0)}, {}),
        "fewer": ({"rig": Rig(RIG.cameras[2:])}, {}),
        "in another order": ({"rig": Rig(RIG.cameras[::-1])}, {}),
        "two shots": ({}, {"shots": 2}),
        "more samples": ({}, {"samples": 900}),
        "fewer samples": ({}, {"samples": 40}),
        "other samples": ({}, {"seed": 5}),
        "less depth": ({}, {"depth_tolerance": 0.01}),
        "another surface": ({"scene": Scene(torus(0.35, 0.1))}, {}),
        "other limits": ({"rig": around(6, 1.0, lens=near)}, {}),
        "a list": ({"rig": around(6, 1.0, lens=Lens(focus_distances=(0.6, 0.8, 1.0)))}, {}),
    }
    for others, changes in cases.values():
        where = {"scene": SCENE, "rig": RIG, "request": request} | others
        warm, _ = planned(**where, before=cold, **changes)
        fresh, _ = planned(**where, **changes)
        check(warm, request)
        tolerance = 2e-4 if method == "optimal" else 0.05
        assert warm.cost == pytest.approx(fresh.cost, rel=tolerance)
        for focus, camera in zip(warm.cameras, where["rig"].cameras, strict=True):
            assert camera.name == focus.name
            assert camera.lens.min_focus <= focus.focus_distance <= camera.lens.max_focus
            settable = camera.lens.settable_distances
            assert settable is None or focus.focus_distance in settable


def test_in_another_order_cameras_keep_what_they_had():
    request = PlanRequest("k_view", 500)
    cold, _ = planned(SCENE, RIG, request)
    warm, steps = planned(SCENE, Rig(RIG.cameras[::-1]), request, before=cold)
    assert warm.cost == pytest.approx(cold.cost, rel=1e-6)
    assert steps["em"] == 1
    for focus, before in zip(warm.cameras, reversed(cold.cameras), strict=True):
        assert focus.focus_distance == pytest.approx(before.focus_distance, abs=0.02)


def test_brackets_go_on_from_brackets():
    request = PlanRequest("k_view", 400, shots=2)
    cold, steps = planned(SCENE, RIG, request)
    warm, again = planned(SCENE, RIG, request, before=cold)
    assert warm.cost <= cold.cost * (1 + 1e-9)
    assert again.total() <= steps.total()
    one, _ = planned(SCENE, RIG, request, before=cold, shots=1)
    check(one, request)
    assert one.cost > warm.cost


def test_clouds_are_planned_again_too():
    dense = sample_mesh(torus(0.4, 0.15), 600, 0)
    request = PlanRequest("optimal", 0, gap=1e-4)
    cold, steps = planned(Scene(PointCloud(dense.points, dense.normals)), RIG, request)
    shaken = dense.points + np.random.default_rng(0).normal(0, 5e-4, dense.points.shape)
    moved = Scene(PointCloud(shaken, dense.normals))
    warm, again = planned(moved, RIG, request, before=cold)
    fresh, _ = planned(moved, RIG, request)
    check(warm, request)
    assert warm.cost == pytest.approx(fresh.cost, rel=2e-4)
    assert again["prices"] <= steps["prices"]


def test_a_plan_without_a_bound_leaves_its_distances():
    cold, _ = planned(bound="none", method="k_view")
    assert cold.lower_bound is None
    assert cold.prices is None
    fresh, steps = planned(bound="tight", method="k_view")
    warm, again = planned(bound="tight", method="k_view", before=cold)
    assert warm.cost <= fresh.cost * (1 + 1e-6)
    assert warm.lower_bound is not None
    assert again.total() <= steps.total()


def test_a_warm_plan_repeats_bit_for_bit():
    cold, _ = planned(SCENE, RIG, samples=300)
    moved = nudged(RIG)
    one, other = (planned(SCENE, moved, samples=300, before=cold)[0] for _ in range(2))
    assert one.cameras == other.cameras
    assert (one.cost, one.lower_bound) == (other.cost, other.lower_bound)
    assert one.prices.tobytes() == other.prices.tobytes()


def test_the_plan_before_is_left_alone():
    cold, _ = planned(SCENE, RIG, samples=300)
    prices, focus = cold.prices.copy(), cold.focus_distances
    planned(SCENE, nudged(RIG), samples=300, before=cold)
    np.testing.assert_array_equal(cold.prices, prices)
    np.testing.assert_array_equal(cold.focus_distances, focus)


def test_what_cannot_be_planned_cannot_be_planned_from_a_plan():
    cold, _ = planned(SCENE, RIG, samples=300)
    request = PlanRequest(samples=300, tuples="grid")
    with pytest.raises(InputError, match="tuples: expected overlap, for a rig without a grid"):
        plan_focus(SCENE, Rig(RIG.cameras[:2]), request, warm_start=cold.warm_start)


def test_one_camera_is_planned_from_a_plan_of_many():
    cold, _ = planned(SCENE, RIG, samples=300)
    one, request = Rig(RIG.cameras[:1]), PlanRequest(samples=300)
    plan = plan_focus(SCENE, one, request, warm_start=cold.warm_start)
    assert plan.cost == plan_focus(SCENE, one, request).cost
