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

from focus_planner.core import kernels
from focus_planner.core.solvers.solution import assign_samples
from testing import reference
from testing.problems import random_problem


def stab(problem, best, cell):
    cells = problem.cells
    held = np.empty(len(cells.near), dtype=np.int64)
    kernels.held_weights(problem.pairs_by_camera, cells.focus, cells.offsets, held)
    return kernels.stab(problem.pairs_by_camera, cells.focus, cells.offsets, held, best, cell)


def random_cells(problem, random):
    return random.integers(0, np.diff(problem.cells.offsets)).astype(np.int32)


def distances(problem, cell):
    return problem.cells.distances()[problem.cells.offsets[:-1] + cell]


@pytest.mark.parametrize("ties", [False, True])
@pytest.mark.parametrize("count", [1, 2])
def test_stab_finds_each_cameras_best_distance(count, ties):
    moved_at_all = 0
    for seed in range(30):
        random = np.random.default_rng(seed)
        problem = random_problem(seed, 30, 3, share=0.8, ties=ties)
        cell = random_cells(problem, random)
        best = random.integers(0, 3, (30, count)).astype(np.int32)
        table, before = reference.table(problem), distances(problem, cell)
        was = cell.copy()
        moved = stab(problem, best, cell)
        assert moved == (cell != was).sum()
        moved_at_all += moved
        after = distances(problem, cell)
        for c in range(3):
            wanted = reference.stab(table, c, best.tolist(), before[c])
            seen = table.of_camera(c).values()
            assert [s.near <= after[c] <= s.far for s in seen] == [
                s.near <= wanted <= s.far for s in seen
            ]
    assert moved_at_all > 30


def test_a_camera_without_cells_or_samples_stays():
    problem = random_problem(2, 20, 3)
    cell = random_cells(problem, np.random.default_rng(0))
    nobody = np.full((20, 1), kernels.UNSEEN, dtype=np.int32)
    stab(problem, nobody, cell)
    # Without samples of its own a camera takes what it sees most of, and is content there.
    assert stab(problem, nobody, cell) == 0


@pytest.mark.parametrize(("views", "shots"), [(2, 2), (3, 3)])
def test_the_shots_of_a_view_hold_the_most_that_they_can_together(views, shots):
    moved_at_all = 0
    for seed in range(12):
        problem = random_problem(seed, 18, 3, ties=seed % 2 == 1, views=views, shots=shots)
        cells, counts = problem.cells, np.diff(problem.cells.offsets)
        cell = random_cells(problem, np.random.default_rng(seed))
        best, before = assign_samples(problem, cell)
        was = cell.copy()
        moved_at_all += kernels.stab_brackets(
            problem.pairs_by_camera, cells.focus, problem.camera_views, cells.offsets, best, cell
        )
        assert assign_samples(problem, cell)[1] <= before
        for first in range(0, problem.camera_count, shots):
            own = np.arange(first, first + shots)
            ranges = own_ranges(problem, best, own)
            choices = itertools.combinations_with_replacement(range(counts[first]), shots)
            most = max(weight_held(ranges, chosen) for chosen in choices)
            assert weight_held(ranges, cell[own]) == most
            if weight_held(ranges, was[own]) == most:
                np.testing.assert_array_equal(cell[own], was[own])
    assert moved_at_all > 10


def own_ranges(problem, best, own):
    """The cells that hold each sample assigned to one of these shots, and its weight."""
    cells = problem.cells
    return [
        (cells.first[q], cells.last[q], int(cells.focus[p]))
        for q, (p, c) in enumerate(zip(problem.sample_index, problem.camera_index, strict=True))
        if c == own[0] and np.isin(best[p], own).any()
    ]


def weight_held(ranges, chosen):
    return sum(weight for first, last, weight in ranges if any(first <= k <= last for k in chosen))
