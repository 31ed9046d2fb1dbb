# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import itertools

import numpy as np
import pytest

from focus_planner import CostModel, Lens, LensTable, Problem, Rig, Scene, focus_interval
from focus_planner.core.problem.cells import middle, settable
from focus_planner.core.problem.problem import build_problem, mean_cost
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.optics import nearest_settable
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference
from testing.problems import (
    around,
    forward,
    merged,
    mixed_lenses,
    pairs_of,
    plane,
    problem_of,
    random_problem,
    sphere,
    torus,
)

MODELS = {
    "paper": CostModel(),
    "other": CostModel(0.2, 0.5, 0.1, projected_area_scale=0.7, axis_deviation_limit=0.2),
}


def mixed_rig(count=5):
    return mixed_lenses(around(count, 1.1, target=(0.1, 0.0, 0.05)))


def test_every_camera_may_have_a_table_of_its_own():
    # More kinds of lenses than a byte tells apart.
    lenses = tuple(
        Lens(table=LensTable("steps", i % 2 == 0, (0.5, 0.9 + i / 1000), (0, 40)))
        for i in range(300)
    )
    cameras = np.random.default_rng(0).integers(0, 300, 2000)
    asked = np.random.default_rng(1).uniform(0.3, 1.5, 2000)
    moved = settable(lenses, cameras, asked)
    for camera, distance, told in zip(cameras, asked, moved, strict=True):
        assert told == nearest_settable(np.array([distance]), lenses[camera])[0]
    rig = Rig(tuple(forward(f"c{i}", lens=lens) for i, lens in enumerate(lenses)))
    problem = problem_of(plane(0.1, 0.1, 0.7), rig, 5)
    assert len(problem.depth) == 5 * 300
    for i, lens in enumerate(lenses):
        pairs = problem.camera_index == i
        expected = focus_interval(problem.depth[pairs], lens)
        np.testing.assert_array_equal(
            (problem.focus_near[pairs], problem.focus_far[pairs]), expected
        )


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
@pytest.mark.parametrize("surface", [sphere(0.4), torus(0.4, 0.15)], ids=["sphere", "torus"])
def test_pairs_cost_what_equation_1_says(surface, model):
    rig, scene = mixed_rig(), Scene(surface)
    samples = scene.sample(80, 0)
    visibility = visible_pairs(scene, rig, samples)
    problem = build_problem(samples, visibility, rig, model)
    pairs = list(zip(problem.sample_index.tolist(), problem.camera_index.tolist(), strict=True))
    assert pairs == sorted(pairs_of(visibility))
    assert problem.names == tuple(camera.name for camera in rig.cameras)
    for q, (p, c) in enumerate(pairs):
        camera = rig.cameras[c]
        depth = (samples.points[p] - camera.position) @ reference.camera_axes(camera)[2]
        assert problem.depth[q] == pytest.approx(depth, rel=1e-12)
        for s in (
            0.999 * problem.focus_near[q],
            1.001 * problem.focus_near[q],
            0.999 * problem.focus_far[q],
            1.001 * problem.focus_far[q],
            0.9,
        ):
            held = problem.focus_near[q] <= s <= problem.focus_far[q]
            if camera.lens.min_focus <= s <= camera.lens.max_focus:
                expected = reference.pointwise_cost(
                    samples.points[p], samples.normals[p], camera, s, model
                )
                cost = problem.base_cost[q] + (0 if held else problem.focus_weight)
                assert cost == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
def test_the_total_is_equation_2(model):
    rig, surface = mixed_rig(), merged(sphere(0.35), plane(0.1, 0.1, 0.6))
    scene = Scene(surface)
    drawn = scene.sample(70, 3)
    random = np.random.default_rng(0)
    samples = Samples(drawn.points, drawn.normals, drawn.areas, random.uniform(0.1, 2.0, 70))
    visibility = visible_pairs(scene, rig, samples)
    problem = build_problem(samples, visibility, rig, model)
    for _ in range(10):
        focus = random.uniform(0.4, 1.3, len(rig))
        expected = reference.total_cost(
            samples.points,
            samples.normals,
            samples.weights,
            rig,
            pairs_of(visibility),
            focus,
            model,
        )
        assert problem.cost(focus) == pytest.approx(expected, rel=1e-12)
        assert reference.cost(reference.table(problem), focus) == pytest.approx(expected)


def test_a_sample_that_no_camera_sees_costs_1():
    problem = problem_of(sphere(0.4), Rig((forward(position=(0, 0, -1.5)),)), 200)
    costs, best = problem.evaluate(np.array([1.1]))
    unseen = np.setdiff1d(np.arange(200), problem.sample_index)
    assert len(unseen) > 80
    np.testing.assert_array_equal(costs[unseen], 1.0)
    np.testing.assert_array_equal(best[unseen], -1)
    assert (costs[problem.sample_index] < 1).all()
    assert (best[problem.sample_index] == 0).all()


def test_a_surface_on_the_slant_from_the_axis_has_the_largest_first_term():
    # Visible off the axis, though its normal points away along the axis.
    point, normal = np.array([[0.5, 0.0, 1.0]]), np.array([[-0.995, 0.0, 0.0999]])
    samples = Samples(point, normal, np.ones(1), np.ones(1))
    rig = Rig((forward(),))
    visibility = visible_pairs(Scene(plane(1, 1, 9.0)), rig, samples)
    problem = build_problem(samples, visibility, rig)
    assert problem.base_cost.tolist() == pytest.approx([1 / 3 + 0.5 / 0.75 / 3])


# The mean distance of the unit square from its centre.
MEAN_RADIUS = (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 6


@pytest.mark.parametrize(
    ("width", "depth", "focus", "in_focus"),
    [
        (0.02, 0.7, 0.7, True),
        (0.02, 0.7, 0.9, False),
        (0.02, 0.9, 0.95, True),
        (0.02, 1.5, 1.5, True),  # beyond 1/√ε₁ the first term is at its most
        (0.6, 0.8, 0.8, True),
        (0.6, 0.8, 0.8 * 10.05 / 10.8 * 1.0001, True),  # all or nothing, to the limits
        (0.6, 0.8, 0.8 * 10.05 / 10.8 * 0.9999, False),
        (0.6, 0.8, 0.8 * 9.95 / 9.2 * 0.9999, True),
        (0.6, 0.8, 0.8 * 9.95 / 9.2 * 1.0001, False),
    ],
)
def test_a_square_face_on_costs_its_integral(width, depth, focus, in_focus):
    problem = problem_of(plane(width, width, depth), Rig((forward(),)), 20_000)
    expected = (min(depth**2, 1) + width * MEAN_RADIUS / 0.75 + (not in_focus)) / 3
    assert problem.cost(np.array([focus])) == pytest.approx(1000 * expected, rel=2e-3)


def test_cameras_of_one_rig_may_have_different_lenses():
    rig = mixed_rig(6)
    problem = problem_of(sphere(0.4), rig, 100)
    cut = 0
    for q, c in enumerate(problem.camera_index):
        lens = rig.cameras[c].lens
        near, far = problem.focus_near[q], problem.focus_far[q]
        if near > far:
            cut += 1
            continue
        assert lens.min_focus <= near <= far <= lens.max_focus
        assert reference.in_focus(problem.depth[q], (near + far) / 2, lens)
        for outside in (near * (1 - 1e-6), far * (1 + 1e-6)):
            if lens.min_focus < outside < lens.max_focus:
                assert not reference.in_focus(problem.depth[q], outside, lens)
    assert problem.lenses == tuple(camera.lens for camera in rig.cameras)


def held(problem, c, s):
    pairs = problem.camera_pairs[problem.camera_offsets[c] : problem.camera_offsets[c + 1]]
    inside = (problem.focus_near[pairs] <= s) & (s <= problem.focus_far[pairs])
    return frozenset(pairs[inside].tolist())


CASES = {
    "random": random_problem(0, 40, 4),
    "ties": random_problem(1, 40, 4, ties=True),
    "limits": random_problem(2, 40, 4, ties=True, lens=Lens(0.05, 10.0, 0.58, 2.0)),
    "sphere": problem_of(sphere(0.4), mixed_rig(), 60),
    "tolerance": random_problem(3, 40, 4, tolerance=0.01),
    "list": random_problem(4, 40, 4, lens=Lens(focus_distances=(0.5, 0.57, 0.58, 0.66, 0.9, 8.0))),
    "list, ties": random_problem(5, 40, 4, ties=True, lens=Lens(focus_distances=(0.5, 0.55, 0.8))),
    "steps": random_problem(6, 40, 4, lens=Lens(min_focus=0.4, focus_steps=60)),
    "shots": with_shots(random_problem(7, 40, 4), 3),
}


@pytest.mark.parametrize("problem", CASES.values(), ids=CASES.keys())
def test_cells_hold_all_that_any_distance_holds(problem):
    cells, table = problem.cells, reference.table(problem)
    middles = cells.distances()
    for c in range(problem.camera_count):
        part = slice(cells.offsets[c], cells.offsets[c + 1])
        inside = [held(problem, c, s) for s in middles[part]]
        for s in reference.camera_candidates(table, c):
            assert any(held(problem, c, s) <= content for content in inside)
        for a, b in itertools.permutations(inside, 2):
            assert not a <= b
        assert (middles[part] >= cells.near[part]).all()
        assert (middles[part] <= cells.far[part]).all()
        if (takes := problem.lenses[c].settable_distances) is not None:
            assert set(middles[part]) <= set(takes)


@pytest.mark.parametrize("problem", CASES.values(), ids=CASES.keys())
def test_ranges_of_cells_say_what_is_in_focus(problem):
    cells = problem.cells
    middles = cells.distances()
    for q, c in enumerate(problem.camera_index):
        part = middles[cells.offsets[c] : cells.offsets[c + 1]]
        inside = (problem.focus_near[q] <= part) & (part <= problem.focus_far[q])
        np.testing.assert_array_equal(
            np.flatnonzero(inside), np.arange(cells.first[q], cells.last[q] + 1)
        )
    pairs = problem.camera_pairs
    np.testing.assert_array_equal(cells.seen, problem.sample_index[pairs])
    np.testing.assert_array_equal(cells.seen_base, cells.base[pairs])
    np.testing.assert_array_equal(cells.seen_first, cells.first[pairs])
    np.testing.assert_array_equal(cells.seen_last, cells.last[pairs])
    order = np.lexsort((problem.sample_index[pairs], problem.camera_index[pairs]))
    np.testing.assert_array_equal(order, np.arange(len(pairs)))


def test_units_are_shares_of_the_total():
    problem = random_problem(0, 40, 4, weight=0.2)
    cells, weights = problem.cells, problem.samples.weights / problem.samples.weights.sum()
    one = 2.0**43
    np.testing.assert_allclose(cells.unseen, weights * one, atol=0.5)
    np.testing.assert_allclose(cells.focus, weights * 0.2 * one, atol=0.5)
    np.testing.assert_allclose(
        cells.base, weights[problem.sample_index] * problem.base_cost * one, atol=0.5
    )


def test_the_middle_of_an_open_range_is_that_of_its_dioptres():
    near, far = np.array([1.0, 2.0, 3.0]), np.array([2.0, np.inf, 3.0])
    np.testing.assert_array_equal(middle(near, far), [1.5, 4.0, 3.0])
    assert 1 / 4.0 == (1 / 2.0 + 0) / 2


def test_mean_cost_is_weighted_per_mille():
    assert mean_cost(np.array([1.0, 3.0]), np.array([1.0, 0.2])) == pytest.approx(400.0)


def test_a_problem_of_nothing_seen():
    problem = random_problem(0, 5, 2, share=0.0)
    assert isinstance(problem, Problem)
    assert problem.cost(np.array([1.0, 1.0])) == 1000.0
    assert len(problem.cells.near) == 0
