import numpy as np
import pytest

from focus_planner.core import kernels
from testing import reference
from testing.problems import random_problem


def evaluate(problem, focus):
    costs, best = np.empty(problem.sample_count), np.empty(problem.sample_count, dtype=np.int32)
    kernels.best_cameras(
        problem.sample_offsets,
        problem.camera_index,
        problem.base_cost,
        problem.focus_near,
        problem.focus_far,
        problem.focus_weight,
        np.asarray(focus, dtype=np.float64),
        costs,
        best,
    )
    return costs, best


@pytest.mark.parametrize("ties", [False, True])
def test_best_cameras(ties):
    unseen = 0
    for seed in range(20):
        problem = random_problem(seed, 25, 4, ties=ties, share=0.3)
        table = reference.table(problem)
        focus = np.random.default_rng(seed).uniform(0.5, 0.8, 4)
        costs, best = evaluate(problem, focus)
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


def test_a_camera_without_a_focus_distance_holds_nothing_in_focus():
    problem = random_problem(0, 10, 2, share=1.0)
    costs, _ = evaluate(problem, [np.nan, np.nan])
    bases = problem.base_cost.reshape(10, 2)
    np.testing.assert_allclose(costs, bases.min(axis=1) + 1 / 3)


@pytest.mark.parametrize("ties", [False, True])
def test_focus_room_keeps_each_cameras_own_samples_in_focus(ties):
    kept = 0
    for seed in range(20):
        problem = random_problem(seed, 30, 3, ties=ties)
        table = reference.table(problem)
        focus = np.random.default_rng(seed).uniform(0.5, 0.8, 3)
        _, best = evaluate(problem, focus)
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
