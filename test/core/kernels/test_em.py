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
from testing import reference
from testing.problems import random_problem


def stab(problem, best, cell):
    cells = problem.cells
    return kernels.stab(problem.pairs_by_camera, cells.focus, cells.offsets, best, cell)


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
