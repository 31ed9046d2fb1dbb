# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What all solvers have in common."""

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import CostModel, Lens, Mesh, Rig, cylinder_rig
from focus_planner.core.problem.cells import UNITS
from focus_planner.core.problem.problem import Problem, build_problem
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.camera import Camera
from focus_planner.core.solvers import SOLVERS, Options, em, k_view
from focus_planner.core.solvers.solution import distances_of_cells, finish
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.optima import Log
from testing.problems import (
    around,
    body,
    mixed_lenses,
    problem_of,
    random_problem,
    sphere,
    stepped_lenses,
    torus,
    with_threads,
)

SETTINGS = {
    "closest": ("closest", Options()),
    "average": ("average", Options()),
    "em": ("em", Options()),
    "greedy": ("greedy", Options()),
    "2-view": ("k_view", Options()),
    "2-view assigned": ("k_view", Options(scope="assigned")),
    "3-view": ("k_view", Options(k=3)),
    "3-view assigned": ("k_view", Options(k=3, scope="assigned")),
    "optimal": ("optimal", Options()),
}
each_method = pytest.mark.parametrize("setting", SETTINGS.values(), ids=SETTINGS.keys())

PROBLEMS = {
    "random": random_problem(0, 60, 5),
    "ties": random_problem(1, 60, 5, ties=True, equal=True),
    "sparse": random_problem(2, 60, 8, share=0.15),
    "limits": random_problem(3, 60, 5, ties=True, lens=Lens(0.05, 10.0, 0.58, 2.0)),
    "sphere": problem_of(sphere(0.4), mixed_lenses(around(6, 1.1)), 200),
    "torus": problem_of(torus(0.4, 0.15), around(7, 1.0), 200),
    "list": random_problem(4, 60, 5, lens=Lens(focus_distances=(0.5, 0.57, 0.6, 0.66, 0.7, 8.0))),
    "one distance": random_problem(5, 60, 5, lens=Lens(focus_distances=(0.65,))),
    "steps": random_problem(6, 60, 5, lens=Lens(min_focus=0.4, max_focus=5.0, focus_steps=40)),
    "tolerance": random_problem(7, 60, 5, tolerance=0.01),
    "lists and steps": problem_of(torus(0.4, 0.15), stepped_lenses(around(7, 1.0)), 200),
    "shots": with_shots(random_problem(8, 40, 4), 3),
    "all of it": with_shots(
        problem_of(torus(0.4, 0.15), stepped_lenses(around(7, 1.0)), 200, tolerance=0.005), 2
    ),
}
each_problem = pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS.keys())


def solve(setting, problem, on_progress=lambda _: True):
    method, options = setting
    return SOLVERS[method](problem, options, on_progress)


@each_method
@each_problem
def test_a_solutions_cost_is_equation_2(setting, problem):
    solution = solve(setting, problem)
    assert solution.cost == problem.cost(solution.focus_distances)
    expected = reference.cost(reference.table(problem), solution.focus_distances)
    assert solution.cost == pytest.approx(expected, rel=1e-12)
    assert solution.converged
    assert solution.iterations >= 1


@each_method
@each_problem
def test_every_camera_that_sees_something_it_can_focus_gets_a_distance(setting, problem):
    solution = solve(setting, problem)
    sees = np.diff(problem.camera_offsets) > 0
    can = np.diff(problem.cells.offsets) > 0
    assert np.isfinite(solution.focus_distances[can]).all()
    assert np.isnan(solution.focus_distances[~sees]).all()
    for c in np.flatnonzero(can):
        lens = problem.lenses[c]
        assert lens.min_focus <= solution.focus_distances[c] <= lens.max_focus
        assert solution.focus_distances[c] > 0
        if lens.settable_distances is not None:
            assert solution.focus_distances[c] in lens.settable_distances


@each_method
@each_problem
def test_no_step_raises_the_cost(setting, problem):
    log = Log()
    solution = solve(setting, problem, log)
    assert (np.diff(log.costs) <= 1e-9).all()
    # Centring the cameras on what they hold may still lower it.
    assert solution.cost <= log.costs[-1] + 1e-9
    stages = [(progress.stage, progress.iteration) for progress in log.progress]
    if setting[0] == "optimal":  # goes back and forth between its stages
        assert set(dict(stages)) <= {"em", "k_view", "prices", "branching"}
        stages = [("optimal", iteration) for _, iteration in stages]
    for name in dict(stages):
        steps = [i for stage, i in stages if stage == name]
        # k_view sets up its tuples.
        assert steps == list(range(not name.startswith("k_view"), steps[-1] + 1))
    expected = ["em", "k_view", "k_view, triples"][: setting[1].k] if setting[0] == "k_view" else 0
    assert list(dict(stages)) == (expected or [setting[0]])
    assert solution.iterations == len([i for _, i in stages if i])


@pytest.mark.parametrize("name", ["em", "2-view", "2-view assigned", "3-view", "3-view assigned"])
def test_progress_tells_the_cost_at_the_cells_chosen_so_far(name, monkeypatch):
    def not_centred(problem, cell, iterations, converged):
        return finish(problem, distances_of_cells(problem, cell), iterations, converged)

    for module in (em, k_view):
        monkeypatch.setattr(module, "finish_cells", not_centred)
    for seed in range(30):
        problem = random_problem(seed, 60, 6, weight=[1 / 3, 0.1][seed % 2])
        full = Log()
        solve(SETTINGS[name], problem, full)
        for steps in range(1, len(full.progress) + 1):
            log = Log(steps)
            solution = solve(SETTINGS[name], problem, log)
            assert log.costs == full.costs[:steps]
            assert log.costs[-1] == pytest.approx(solution.cost, rel=1e-9)


def test_methods_are_ordered_on_every_problem():
    for seed in range(60):
        problem = random_problem(
            seed, 50, 6, share=[0.2, 0.5, 0.9][seed % 3], ties=seed % 2 == 0, equal=seed % 4 == 0
        )
        cost = {name: solve(setting, problem).cost for name, setting in SETTINGS.items()}
        for name in ("2-view", "2-view assigned", "3-view", "3-view assigned"):
            assert cost["optimal"] * (1 - 1e-6) <= cost[name] <= cost["em"] + 1e-9
        assert cost["em"] <= cost["closest"] + 1e-9


@each_method
@pytest.mark.parametrize("steps", [1, 2, 3])
def test_a_solver_that_is_stopped_returns_what_it_has(setting, steps):
    problem = random_problem(11, 400, 8)
    log = Log(steps)
    whole = solve(setting, problem)
    stopped = solve(setting, problem, log)
    assert len(log.progress) <= steps
    assert np.isfinite(stopped.focus_distances).all()
    assert stopped.iterations == len(log.progress)
    assert stopped.cost <= log.costs[-1] + 1e-9
    assert stopped.cost >= whole.cost - 1e-9
    if setting[0] in {"em", "k_view", "optimal"}:
        assert stopped.cost <= solve(SETTINGS["closest"], problem).cost
    assert stopped.converged == (whole.iterations <= steps)


@pytest.mark.parametrize("name", ["2-view", "2-view assigned", "3-view"])
def test_stopped_as_em_ends_k_view_does_not_begin(name):
    problem = random_problem(11, 400, 8)
    before = solve(SETTINGS["em"], problem)
    log = Log(before.iterations)
    stopped = solve(SETTINGS[name], problem, log)
    assert [progress.stage for progress in log.progress] == ["em"] * before.iterations
    assert not stopped.converged
    np.testing.assert_array_equal(stopped.focus_distances, before.focus_distances)


def reversed_cameras(rig):
    return Rig(rig.cameras[::-1], rig.frame_id)


@pytest.mark.parametrize("name", ["closest", "average", "em"])
def test_cameras_in_another_order_get_the_same_distances(name):
    # An odd number: opposite cameras share their axis, and their costs can tie.
    rig = cylinder_rig(3, 7, bottom=0.3, top=1.5)
    mesh = body()
    forth, back = (problem_of(mesh, r, 500) for r in (rig, reversed_cameras(rig)))
    a, b = (solve(SETTINGS[name], problem) for problem in (forth, back))
    np.testing.assert_array_equal(a.focus_distances, b.focus_distances[::-1])
    assert a.cost == pytest.approx(b.cost, rel=1e-12)


def test_two_cameras_in_another_order_get_the_same_distances_together():
    # The optimum of generic data is unique, and k_view finds it for k cameras: see below.
    rig = Rig(around(2, 1.0, height=0.0).cameras)
    turned = Rig((rig.cameras[0], around(9, 1.0, height=0.1).cameras[1]))
    mesh = torus(0.4, 0.15)
    for seed in range(5):
        forth, back = (problem_of(mesh, r, 200, seed) for r in (turned, reversed_cameras(turned)))
        a, b = (solve(SETTINGS["2-view"], problem) for problem in (forth, back))
        np.testing.assert_array_equal(a.focus_distances, b.focus_distances[::-1])


def test_more_cameras_in_another_order_come_as_near_the_optimum():
    # Which tuple moves first depends on the order, and with it where the steps end.
    rig = cylinder_rig(3, 8, bottom=0.3, top=1.5)
    mesh = body()
    costs = [
        solve(SETTINGS["2-view"], problem_of(mesh, r, 500)).cost
        for r in (rig, reversed_cameras(rig))
    ]
    best, _ = reference.optimum(reference.table(problem_of(mesh, rig, 500)))
    for cost in costs:
        assert best - 1e-6 <= cost <= 1.005 * best


METRES = ("focal_length", "hyperfocal_distance", "min_focus", "max_focus")


def scaled(mesh, rig, factor):
    """The same scene in other units: all lengths times ``factor``."""
    cameras = tuple(
        Camera(
            camera.name,
            tuple(factor * x for x in camera.position),
            camera.orientation,
            camera.intrinsics,
            replace(camera.lens, **{name: factor * getattr(camera.lens, name) for name in METRES}),
        )
        for camera in rig.cameras
    )
    model = CostModel(projected_area_scale=1 / factor**2, axis_deviation_limit=0.75 * factor)
    return problem_of(Mesh(factor * mesh.vertices, mesh.triangles), Rig(cameras), 400, 0, model)


@each_method
@pytest.mark.parametrize("factor", [4.0, 0.25])
def test_a_scaled_scene_gets_scaled_distances(setting, factor):
    # By powers of 2, so that rounding scales as well.
    mesh, rig = torus(0.4, 0.15), mixed_lenses(around(6, 1.0))
    one, other = scaled(mesh, rig, 1.0), scaled(mesh, rig, factor)
    np.testing.assert_array_equal(one.sample_index, other.sample_index)
    a, b = solve(setting, one), solve(setting, other)
    np.testing.assert_array_equal(factor * a.focus_distances, b.focus_distances)
    assert a.cost == pytest.approx(b.cost, rel=1e-12)


def with_weights(problem, weights):
    samples = replace(problem.samples, weights=weights)
    fields = {name: getattr(problem, name) for name in Problem.__dataclass_fields__}
    return Problem(**{**fields, "samples": samples})


@each_method
@each_problem
def test_only_the_ratio_of_weights_matters(setting, problem):
    doubled = with_weights(problem, 2 * problem.samples.weights)
    a, b = solve(setting, problem), solve(setting, doubled)
    np.testing.assert_array_equal(a.focus_distances, b.focus_distances)
    assert a.cost == b.cost


@each_method
@each_problem
def test_samples_of_no_weight_cost_nothing(setting, problem):
    counts = np.arange(problem.sample_count) % 3 > 0
    weighted = with_weights(problem, problem.samples.weights * counts)
    solution = solve(setting, weighted)
    expected = reference.cost(reference.table(weighted), solution.focus_distances)
    assert solution.cost == pytest.approx(expected, rel=1e-12)
    assert solution.converged
    without = with_samples(problem, np.flatnonzero(counts))
    assert without.cost(solution.focus_distances) == pytest.approx(solution.cost)
    best, _ = reference.optimum(reference.table(without))
    assert solution.cost >= best - 1e-6
    baselines = {"closest", "average"}
    if setting[0] in baselines:
        alone = solve(setting, without)
        np.testing.assert_allclose(solution.focus_distances, alone.focus_distances, rtol=1e-12)
    else:
        closest = SOLVERS["closest"](weighted)
        assert best - 1e-6 <= solution.cost <= closest.cost


def with_samples(problem, kept):
    """The problem of these samples; ones that are kept twice stand for twice as much."""
    pairs = np.concatenate([np.flatnonzero(problem.sample_index == p) for p in kept])
    counts = np.diff(problem.sample_offsets)[kept]
    fields = {name: getattr(problem, name) for name in Problem.__dataclass_fields__}
    fields |= {
        name: fields[name][pairs]
        for name in ("camera_index", "depth", "base_cost", "focus_near", "focus_far")
    }
    samples = problem.samples
    return Problem(
        **{
            **fields,
            "samples": Samples(
                samples.points[kept],
                samples.normals[kept],
                samples.areas[kept],
                samples.weights[kept],
            ),
            "sample_offsets": np.concatenate([[0], np.cumsum(counts)]),
            "sample_index": np.repeat(np.arange(len(kept)), counts).astype(np.int32),
        }
    )


@pytest.mark.parametrize("name", ["average", "em", "greedy", "2-view", "2-view assigned", "3-view"])
def test_a_sample_weighs_as_much_as_two_of_half_its_weight(name):
    problem = random_problem(5, 24, 4, share=0.6)
    parts = 1 + (np.arange(24) % 3 == 0)
    copies = np.repeat(np.arange(24), parts)
    split = with_samples(with_weights(problem, problem.samples.weights / parts), copies)
    a, b = solve(SETTINGS[name], problem), solve(SETTINGS[name], split)
    np.testing.assert_allclose(a.focus_distances, b.focus_distances, rtol=1e-12)
    assert a.cost == pytest.approx(b.cost)


@each_method
def test_without_a_focus_term_every_plan_costs_the_papers_bound(setting):
    rig, scene = around(6, 1.0), Scene(torus(0.4, 0.15))
    samples = scene.sample(300, 0)
    visibility = visible_pairs(scene, rig, samples)
    free = build_problem(samples, visibility, rig, CostModel(focus_weight=0.0))
    full = build_problem(samples, visibility, rig)
    least = np.ones(300)
    np.minimum.at(least, full.sample_index, full.base_cost)
    assert solve(setting, free).cost == pytest.approx(1000 * least.mean())
    assert solve(setting, full).cost > 1000 * least.mean()


@each_method
@each_problem
def test_a_run_repeats_bit_for_bit(setting, problem):
    a, b = solve(setting, problem), solve(setting, problem)
    assert a.focus_distances.tobytes() == b.focus_distances.tobytes()
    assert (a.cost, a.iterations) == (b.cost, b.iterations)


def test_threads_change_no_bit():
    mesh, rig = body("arms_out"), cylinder_rig()
    one, two = (with_threads(threads, lambda: problem_of(mesh, rig, 8192)) for threads in (1, 2))
    for name in Problem.__dataclass_fields__:
        a, b = getattr(one, name), getattr(two, name)
        if isinstance(a, np.ndarray):
            assert a.tobytes() == b.tobytes(), name
    for name in ("em", "greedy", "2-view", "2-view assigned"):
        # Batches of many tuples: none may read what another writes.
        a = with_threads(1, lambda name=name: solve(SETTINGS[name], one))
        for _ in range(3):
            b = with_threads(2, lambda name=name: solve(SETTINGS[name], two))
            assert a.focus_distances.tobytes() == b.focus_distances.tobytes()
            assert a.iterations == b.iterations


class TestDegenerateProblems:
    """Problems with next to nothing to decide."""

    @each_method
    def test_no_camera_sees_anything(self, setting):
        solution = solve(setting, random_problem(0, 5, 3, share=0.0))
        assert solution.cost == 1000.0
        assert np.isnan(solution.focus_distances).all()
        assert solution.converged

    @each_method
    def test_one_sample_one_camera(self, setting):
        problem = random_problem(1, 1, 1, share=1.0)
        solution = solve(setting, problem)
        assert solution.cost == pytest.approx(1000 * problem.base_cost[0])
        assert problem.focus_near[0] <= solution.focus_distances[0] <= problem.focus_far[0]

    @each_method
    def test_all_samples_at_one_depth(self, setting):
        problem = random_problem(2, 30, 4, share=0.7)
        problem.focus_near[:], problem.focus_far[:] = 0.6, 0.7
        problem.depth[:] = 0.65
        solution = solve(setting, problem)
        np.testing.assert_allclose(solution.focus_distances, 0.65)
        least = [min(seen.base for seen in s.values()) for s in reference.table(problem).seen if s]
        assert solution.cost == pytest.approx(reference.cost(reference.table(problem), [0.65] * 4))
        assert len(least) > 20

    @each_method
    def test_all_samples_beyond_the_hyperfocal_distance(self, setting):
        random = np.random.default_rng(4)
        problem = random_problem(3, 16, 3, share=0.8)
        depth = random.uniform(10.0, 40.0, len(problem.depth))
        problem.depth[:] = depth
        problem.focus_near[:], problem.focus_far[:] = depth * 10.05 / (10 + depth), np.inf
        solution = solve(setting, problem)
        assert np.isfinite(solution.focus_distances).all()
        if setting[0] != "average":
            # One distance holds them all; the closest depth is beyond it as well.
            assert (solution.focus_distances >= problem.focus_near.max()).all()
            assert solution.cost == pytest.approx(
                reference.optimum_by_enumeration(reference.table(problem))
            )

    @each_method
    def test_lenses_that_reach_no_sample(self, setting):
        problem = random_problem(4, 40, 3, lens=Lens(0.05, 10.0, 5.0, 6.0))
        solution = solve(setting, problem)
        table = reference.table(problem)
        assert solution.cost == pytest.approx(reference.cost(table, [5.5] * 3))
        if setting[0] in {"em", "k_view", "optimal"}:
            assert np.isnan(solution.focus_distances).all()

    @each_method
    def test_one_lens_of_several_reaches_no_sample(self, setting):
        problem = random_problem(5, 40, 3, share=0.9)
        blind = problem.camera_index == 1
        problem.focus_near[blind], problem.focus_far[blind] = np.inf, -np.inf
        solution = solve(setting, problem)
        focus = np.where(np.isnan(solution.focus_distances), 1.0, solution.focus_distances)
        assert solution.cost == pytest.approx(reference.cost(reference.table(problem), focus))

    @each_method
    def test_a_far_and_an_unreachable_sample(self, setting):
        # One held without end beside one not at all.
        problem = random_problem(6, 2, 2, share=1.0)
        problem.focus_near[:] = [6.0, np.inf, np.inf, 7.0]
        problem.focus_far[:] = [np.inf, -np.inf, -np.inf, np.inf]
        solution = solve(setting, problem)
        assert np.isfinite(solution.focus_distances).all()
        if setting[0] in {"em", "k_view", "optimal"}:
            assert (solution.focus_distances >= [6.0, 7.0]).all()
            assert (solution.focus_distances < 100).all()


def test_costs_in_units_fit_the_kernels_keys():
    # The dearest sample, of all the weight, leaves the bits of a ranking's key alone.
    assert UNITS < 2**44
    problem = random_problem(7, 1, 2, share=1.0)
    assert problem.cells.unseen[0] == UNITS
