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
from testing.problems import random_problem

CASES = [(1, 1), (2, 1), (1, 3), (3, 2)]


class Pictures:
    """Some pictures of a problem in random cells, as the solver keeps them."""

    def __init__(self, problem, seed):
        random = np.random.default_rng(seed)
        self.problem, counts = problem, np.diff(problem.cells.offsets)
        drawn = random.integers(0, np.maximum(counts, 1)).astype(np.int32)
        taken = random.random(problem.camera_count) < 0.5
        self.cell = np.where(taken, drawn, kernels.NO_PICTURE).astype(np.int32)
        self.views = problem.camera_views._replace(missing=problem.cells.unseen)
        self.ranking = np.empty((problem.sample_count, problem.views + 1), dtype=np.int64)
        self.rank()

    def rank(self):
        kernels.rank_views(*self.pairs, self.views, self.cell, self.ranking)

    @property
    def pairs(self):
        return self.problem.pairs_by_sample, self.problem.cells.focus

    def units(self):
        return int(kernels.cost_of_rankings(self.ranking, self.views.needed, self.views.missing))

    def gains(self):
        problem, views = self.problem, len(self.views.offsets) - 1
        gain, where = np.empty(views, dtype=np.int64), np.empty(views, dtype=np.int32)
        kernels.gains_of_pictures(
            problem.pairs_by_camera,
            problem.cells.focus,
            self.views,
            problem.cells.offsets,
            self.cell,
            self.ranking,
            gain,
            where,
        )
        return gain, where

    def place(self, camera, cell):
        by_sample, focus = self.pairs
        by_camera = self.problem.pairs_by_camera
        kernels.place(
            camera, cell, by_camera, by_sample, focus, self.views, self.cell, self.ranking
        )

    def distances(self):
        cells, taken = self.problem.cells, self.cell >= 0
        focus = np.where(self.cell == kernels.NO_PICTURE, kernels.UNTAKEN, np.nan)
        focus[taken] = cells.distances()[cells.offsets[:-1][taken] + self.cell[taken]]
        return focus


@pytest.mark.parametrize(("views", "shots"), CASES)
def test_rankings_cost_what_the_distances_do(views, shots):
    for seed in range(6):
        problem = random_problem(seed, 30, 4, share=0.6, views=views, shots=shots)
        pictures = Pictures(problem, seed)
        cost = problem.cost(pictures.distances())
        assert 1000 * pictures.units() / UNITS == pytest.approx(cost)


@pytest.mark.parametrize(("views", "shots"), CASES)
@pytest.mark.parametrize("ties", [False, True])
def test_the_best_picture_of_a_view_gains_what_all_its_cells_are_tried_for(views, shots, ties):
    tried = 0
    for seed in range(6):
        problem = random_problem(seed, 25, 4, share=0.6, ties=ties, views=views, shots=shots)
        pictures = Pictures(problem, seed)
        gain, where = pictures.gains()
        before, counts = pictures.units(), np.diff(problem.cells.offsets)
        for view in range(4):
            free = [
                c
                for c in range(view * shots, (view + 1) * shots)
                if pictures.cell[c] == kernels.NO_PICTURE
            ]
            if not free:
                assert gain[view] == -1
                continue
            gains = []
            for cell in range(counts[free[0]]):
                pictures.place(free[0], cell)
                gains.append(before - pictures.units())
                pictures.place(free[0], kernels.NO_PICTURE)
            assert pictures.units() == before
            assert gain[view] == max(gains)
            assert where[view] == np.argmax(gains)
            tried += 1
    assert tried > 5


def test_a_camera_that_cannot_focus_on_anything_gains_what_it_sees_blurred():
    problem = random_problem(3, 30, 3, share=0.8)
    problem.focus_near[problem.camera_index == 1] = np.inf
    problem.focus_far[problem.camera_index == 1] = -np.inf
    pictures = Pictures(problem, 0)
    pictures.cell[:] = kernels.NO_PICTURE
    pictures.rank()
    gain, where = pictures.gains()
    assert where[1] == -1
    seen = problem.camera_index == 1
    weights = problem.samples.weights / problem.samples.weights.sum()
    saved = weights[problem.sample_index[seen]] * (1 - problem.base_cost[seen] - 1 / 3)
    assert gain[1] / UNITS == pytest.approx(saved.sum())
