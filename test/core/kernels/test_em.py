import numpy as np
import pytest

from focus_planner.core import kernels
from focus_planner.core.problem.cells import UNITS
from testing import reference
from testing.problems import random_problem


def assign(problem, cell):
    cells, best = problem.cells, np.empty(problem.sample_count, dtype=np.int32)
    units = kernels.assign(
        problem.sample_offsets,
        problem.camera_index,
        cells.base,
        cells.focus,
        cells.first,
        cells.last,
        cell,
        best,
    )
    return int(units), best


def stab(problem, best, cell):
    cells = problem.cells
    return kernels.stab(
        problem.camera_offsets,
        cells.seen,
        cells.seen_first,
        cells.seen_last,
        cells.focus,
        cells.offsets,
        best,
        cell,
    )


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
        table, focus = reference.table(problem), distances(problem, cell)
        if not ties:  # else what is equal in units may differ by rounding here
            assert [None if c < 0 else c for c in best] == reference.assign(table, focus)
        unseen = sum(table.share(p) for p in range(25) if best[p] < 0)
        assert 1000 * units / UNITS + unseen == pytest.approx(reference.cost(table, focus))


def test_of_equal_cameras_the_first_is_taken():
    problem = random_problem(1, 20, 3, share=1.0)
    problem.base_cost[:] = 0.25
    cell = np.full(3, -1, dtype=np.int32)
    _, best = assign(problem, cell)
    assert (best == 0).all()


@pytest.mark.parametrize("ties", [False, True])
def test_stab_finds_each_cameras_best_distance(ties):
    moved_at_all = 0
    for seed in range(30):
        random = np.random.default_rng(seed)
        problem = random_problem(seed, 30, 3, share=0.8, ties=ties)
        cell = random_cells(problem, random)
        best = random.integers(0, 3, 30).astype(np.int32)
        table, before = reference.table(problem), distances(problem, cell)
        was = cell.copy()
        moved = stab(problem, best, cell)
        assert moved == (cell != was).sum()
        moved_at_all += moved
        after = distances(problem, cell)
        for c in range(3):
            wanted = reference.stab(table, c, list(best), before[c])
            seen = table.of_camera(c).values()
            assert [s.near <= after[c] <= s.far for s in seen] == [
                s.near <= wanted <= s.far for s in seen
            ]
    assert moved_at_all > 30


def test_a_camera_without_cells_or_samples_stays():
    problem = random_problem(2, 20, 3)
    cell = random_cells(problem, np.random.default_rng(0))
    nobody = np.full(20, kernels.UNSEEN, dtype=np.int32)
    stab(problem, nobody, cell)
    # Without samples of its own a camera takes what it sees most of, and is content there.
    assert stab(problem, nobody, cell) == 0
