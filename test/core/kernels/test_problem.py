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


def evaluate(problem, focus):
    costs = np.empty(problem.sample_count)
    best = np.empty((problem.sample_count, problem.views), dtype=np.int32)
    pairs = kernels.PairCosts(
        problem.sample_offsets,
        problem.camera_index,
        problem.base_cost,
        problem.focus_near,
        problem.focus_far,
        problem.focus_weight,
    )
    kernels.best_cameras(pairs, np.asarray(focus, dtype=np.float64), problem.view, costs, best)
    return costs, best


@pytest.mark.parametrize("ties", [False, True])
def test_best_cameras(ties):
    unseen = 0
    for seed in range(20):
        problem = random_problem(seed, 25, 4, ties=ties, share=0.3)
        table = reference.table(problem)
        focus = np.random.default_rng(seed).uniform(0.5, 0.8, 4)
        costs, best = evaluate(problem, focus)
        best = best[:, 0]
        phi = reference.assign(table, focus)
        assert [None if c < 0 else c for c in best] == phi
        assert sum(table.share(p) * costs[p] for p in range(25)) == pytest.approx(
            reference.cost(table, focus), rel=1e-12
        )
        for p in range(25):
            if phi[p] is None:
                unseen += 1
                assert (costs[p], best[p]) == (1.0, kernels.UNSEEN)
            else:
                assert costs[p] == table.seen[p][phi[p]].cost(focus[phi[p]], 1 / 3)
    assert unseen > 10


@pytest.mark.parametrize("ties", [False, True])
@pytest.mark.parametrize(("views", "shots"), [(2, 1), (3, 1), (2, 3), (5, 2)])
def test_cameras_of_several_views(views, shots, ties):
    missing = 0
    for seed in range(10):
        problem = random_problem(seed, 25, 4, ties=ties, share=0.5, views=views, shots=shots)
        table = reference.table(problem)
        focus = np.random.default_rng(seed).uniform(0.5, 0.8, 4 * shots)
        costs, best = evaluate(problem, focus)
        phi = reference.assign_views(table, focus)
        assert [[c for c in row if c >= 0] for row in best.tolist()] == phi
        missing += (best < 0).sum()
        assert sum(table.share(p) * costs[p] for p in range(25)) == pytest.approx(
            reference.cost(table, focus), rel=1e-12
        )
    assert missing


def test_a_camera_without_a_focus_distance_holds_nothing_in_focus():
    problem = random_problem(0, 10, 2, share=1.0)
    costs, _ = evaluate(problem, [np.nan, np.nan])
    bases = problem.base_cost.reshape(10, 2)
    np.testing.assert_allclose(costs, bases.min(axis=1) + 1 / 3)


def test_pairs_are_resorted_by_sample_cameras_ascending():
    random = np.random.default_rng(0)
    seen = random.random((6, 40)) < 0.4  # cameras × samples
    _, sample = np.nonzero(seen)
    camera_offsets = np.concatenate([[0], np.cumsum(seen.sum(axis=1))])
    sample_offsets = np.zeros(41, dtype=np.int64)
    by_sample, by_camera = kernels.sort_by_sample(
        camera_offsets, sample.astype(np.int32), sample_offsets
    )
    expected_sample, expected_camera = np.nonzero(seen.T)
    np.testing.assert_array_equal(by_sample, expected_sample)
    np.testing.assert_array_equal(by_camera, expected_camera)
    np.testing.assert_array_equal(sample_offsets, np.cumsum([0, *seen.sum(axis=0)]))


def test_pairs_are_found_by_camera_in_their_own_order():
    camera = np.random.default_rng(0).integers(0, 5, 200).astype(np.int32)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(camera, minlength=7))])
    expected = np.argsort(camera, kind="stable")
    np.testing.assert_array_equal(kernels.sort_by_camera(camera, offsets), expected)


def test_a_sample_is_held_by_the_camera_it_is_asked_about_only():
    held_at_all = 0
    for seed in range(20):
        problem = random_problem(seed, 25, 4, share=0.5)
        random = np.random.default_rng(seed)
        focus, best = random.uniform(0.5, 0.8, 4), random.integers(-1, 4, 25)
        table = reference.table(problem)
        held = problem.in_focus(focus, best)
        assert held.tolist() == [
            c in table.seen[p] and table.seen[p][c].near <= focus[c] <= table.seen[p][c].far
            for p, c in enumerate(best.tolist())
        ]
        held_at_all += held.sum()
    assert held_at_all > 20
