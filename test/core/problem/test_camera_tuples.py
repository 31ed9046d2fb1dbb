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

from focus_planner import Grid, Lens, cylinder_rig
from focus_planner.core.problem.camera_tuples import camera_tuples
from testing import reference
from testing.problems import body, problem_of, random_problem


def overlaps(problem):
    """How many samples each two cameras share, by counting."""
    shared = np.zeros((problem.camera_count, problem.camera_count), dtype=int)
    for seen in reference.table(problem).seen:
        for c, d in itertools.permutations(seen, 2):
            shared[c, d] += 1
    return shared


def test_on_a_grid_the_neighbours_are_the_grids():
    problem = random_problem(0, 60, 12)
    found = {tuple(sorted(t)) for t in camera_tuples(problem, 2, "all", Grid(3, 4)).cameras}
    expected = set()
    for row, column in itertools.product(range(3), range(4)):
        here = 4 * row + column
        around = 4 * row + (column + 1) % 4
        expected.add(tuple(sorted((here, around))))
        if row < 2:
            expected.add((here, here + 4))
    assert found == expected


@pytest.mark.parametrize(
    ("grid", "count"), [(Grid(1, 2), 1), (Grid(2, 1), 1), (Grid(1, 1), 0), (Grid(1, 3), 3)]
)
def test_small_grids_have_no_double_edges_nor_loops(grid, count):
    problem = random_problem(0, 60, grid.rows * grid.columns)
    tuples = camera_tuples(problem, 2, "all", grid)
    assert tuples.cameras.shape == (count, 2)


def edges_apart(grid):
    """How many edges of the grid there are between each two cameras, by walking them."""
    count = grid.rows * grid.columns
    apart = np.full((count, count), count)
    for row, column in itertools.product(range(grid.rows), range(grid.columns)):
        here = row * grid.columns + column
        apart[here, here] = 0
        beside = [row * grid.columns + (column + 1) % grid.columns]
        beside += [here + grid.columns] if row + 1 < grid.rows else []
        for there in beside:
            if there != here:
                apart[here, there] = apart[there, here] = 1
    for via in range(count):
        apart = np.minimum(apart, apart[:, via, None] + apart[None, via])
    return apart


@pytest.mark.parametrize("rings", [1, 2, 3, 9])
@pytest.mark.parametrize("grid", [Grid(3, 6), Grid(4, 3), Grid(1, 7), Grid(5, 1), Grid(2, 2)])
def test_neighbours_on_the_grid_are_up_to_so_many_edges_apart(grid, rings):
    problem = random_problem(0, 60, grid.rows * grid.columns)
    found = camera_tuples(problem, 2, "all", grid, rings=rings).cameras
    near = np.triu(edges_apart(grid) <= rings, 1)
    assert {tuple(sorted(pair)) for pair in found.tolist()} == set(map(tuple, np.argwhere(near)))
    assert len(found) == near.sum()


def test_without_a_grid_the_neighbours_are_the_strongest_overlaps():
    problem = random_problem(1, 80, 9, share=0.3)
    shared = overlaps(problem)
    found = {tuple(sorted(t)) for t in camera_tuples(problem, 2, "all", None).cameras.tolist()}
    expected = set()
    for c in range(9):
        others = sorted((d for d in range(9) if shared[c, d]), key=lambda d: (-shared[c, d], d))
        expected |= {tuple(sorted((c, d))) for d in others[:4]}
    assert found == expected


def test_triples_are_a_camera_and_two_of_its_neighbours():
    problem = random_problem(1, 80, 12)
    edges = {frozenset(t) for t in camera_tuples(problem, 2, "all", Grid(3, 4)).cameras.tolist()}
    triples = camera_tuples(problem, 3, "all", Grid(3, 4)).cameras.tolist()
    expected = {
        frozenset(t)
        for t in itertools.combinations(range(12), 3)
        if sum(frozenset(e) in edges for e in itertools.combinations(t, 2)) >= 2
    }
    assert {frozenset(t) for t in triples} == expected
    assert len(triples) == len(expected)
    counts = np.diff(problem.cells.offsets)
    assert all(counts[c] <= min(counts[a], counts[b]) for a, b, c in triples)


@pytest.mark.parametrize("k", [2, 3])
@pytest.mark.parametrize("scope", ["all", "assigned"])
def test_tuples_of_a_batch_do_not_influence_each_other(k, scope):
    rig = cylinder_rig(3, 8, bottom=0.4, top=1.4)
    problem = problem_of(body(), rig, 300)
    shared = overlaps(problem)
    tuples = camera_tuples(problem, k, scope, None)
    assert tuples.batch_offsets[0] == 0
    assert tuples.batch_offsets[-1] == len(tuples.cameras) > 20
    batches = list(itertools.pairwise(tuples.batch_offsets))
    assert max(high - low for low, high in batches) > 1
    for low, high in batches:
        assert high > low
        for a, b in itertools.combinations(tuples.cameras[low:high].tolist(), 2):
            assert not set(a) & set(b)
            if scope == "all":
                assert shared[np.ix_(a, b)].sum() == 0


def test_cameras_that_can_hold_nothing_in_focus_are_left_out():
    problem = random_problem(0, 40, 4, lens=Lens(0.05, 10.0, 5.0, 6.0))
    for k in (2, 3):
        tuples = camera_tuples(problem, k, "all", None)
        assert tuples.cameras.shape == (0, k)
        assert tuples.batch_offsets.tolist() == [0]
