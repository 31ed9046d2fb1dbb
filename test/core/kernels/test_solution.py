# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner.core import kernels
from focus_planner.core.problem.cells import UNITS
from testing import reference
from testing.problems import random_problem


def assign(problem, cell):
    cells, best = problem.cells, np.empty((problem.sample_count, problem.views), dtype=np.int32)
    views = problem.camera_views
    units = kernels.assign(problem.pairs_by_sample, cells.focus, views, cell, best)
    return int(units), best


def random_cells(problem, random):
    return random.integers(0, np.diff(problem.cells.offsets)).astype(np.int32)


def distances(problem, cell):
    return problem.cells.distances()[problem.cells.offsets[:-1] + cell]


@pytest.mark.parametrize("ties", [False, True])
def test_assign_takes_each_samples_cheapest_camera(ties):
    for seed in range(20):
        problem = random_problem(seed, 25, 4, share=0.6, ties=ties, equal=ties)
        cell = random_cells(problem, np.random.default_rng(seed))
        units, best = assign(problem, cell)
        best = best[:, 0]
        table, focus = reference.table(problem), distances(problem, cell)
        if not ties:  # else what is equal in units may differ by rounding here
            assert [None if c < 0 else c for c in best] == reference.assign(table, focus)
        unseen = sum(table.share(p) for p in range(25) if best[p] < 0)
        assert 1000 * units / UNITS + unseen == pytest.approx(reference.cost(table, focus))


@pytest.mark.parametrize("ties", [False, True])
@pytest.mark.parametrize(("views", "shots"), [(2, 1), (3, 1), (2, 3), (5, 2)])
def test_assign_takes_cameras_of_different_views(views, shots, ties):
    for seed in range(10):
        problem = random_problem(seed, 25, 4, share=0.6, ties=ties, views=views, shots=shots)
        cell = random_cells(problem, np.random.default_rng(seed))
        units, best = assign(problem, cell)
        table, focus = reference.table(problem), distances(problem, cell)
        if not ties:
            assert [[c for c in row if c >= 0] for row in best.tolist()] == (
                reference.assign_views(table, focus)
            )
        missing = sum(table.share(p) / views for p in range(25) for c in best[p] if c < 0)
        assert 1000 * units / UNITS + missing == pytest.approx(reference.cost(table, focus))


def test_of_equal_cameras_the_first_is_taken():
    problem = random_problem(1, 20, 3, share=1.0)
    problem.base_cost[:] = 0.25
    cell = np.full(3, -1, dtype=np.int32)
    _, best = assign(problem, cell)
    assert (best == 0).all()


@pytest.mark.parametrize("ties", [False, True])
def test_focus_room_keeps_each_cameras_own_samples_in_focus(ties):
    kept = 0
    for seed in range(20):
        problem = random_problem(seed, 30, 3, ties=ties)
        table = reference.table(problem)
        focus = np.random.default_rng(seed).uniform(0.5, 0.8, 3)
        _, best = problem.assign(focus)
        near, far = np.full((2, 3), np.nan)
        kernels.focus_room(
            problem.sample_offsets,
            problem.camera_index,
            problem.focus_near,
            problem.focus_far,
            focus,
            best,
            near,
            far,
        )
        for c in range(3):
            own = [
                (seen.near, seen.far)
                for p, seen in table.of_camera(c).items()
                if best[p] == c and seen.near <= focus[c] <= seen.far
            ]
            if own:
                kept += 1
                assert near[c] == max(start for start, _ in own)
                assert far[c] == min(end for _, end in own)
            else:
                assert np.isnan([near[c], far[c]]).all()
    assert kept > 20
