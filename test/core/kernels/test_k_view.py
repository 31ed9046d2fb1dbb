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

from focus_planner import Grid, Lens
from focus_planner.core import kernels
from focus_planner.core.problem.camera_tuples import camera_tuples
from focus_planner.core.problem.cells import UNITS
from focus_planner.core.rig.rig import MAX_CAMERAS
from focus_planner.core.solvers.solution import assign_samples
from testing import reference
from testing.problems import random_problem, ring_mask, with_threads


class Search:
    """The kernels' state on one problem, from random cells, as the solver keeps it."""

    def __init__(self, problem, k, scope, seed, grid=None):
        self.problem, self.scope, self.k = problem, scope, k
        self.step = kernels.improve_tuples
        counts = np.diff(problem.cells.offsets)
        self.cell = np.random.default_rng(seed).integers(0, counts).astype(np.int32)
        self.best, self.units = assign_samples(problem, self.cell)
        self.tuples = camera_tuples(problem, k, scope, grid)
        ranked = len(self.best) if scope == "all" else 0
        self.ranking = np.empty((ranked, problem.views + k), dtype=np.int64)
        self.rank(self.ranking)
        self.steps = np.empty(len(problem.cells.near) + len(counts), dtype=np.int64)
        self.summed = np.zeros(len(counts), dtype=np.int64)
        self.solved = np.zeros(len(self.tuples.cameras), dtype=np.int64)
        self.touched, self.clock = np.ones(len(counts), np.int64), np.ones(1, np.int64)

    @property
    def state(self):
        return kernels.DescentState(
            **{name: getattr(self, name) for name in kernels.DescentState._fields}
        )

    def rank(self, ranking):
        problem = self.problem
        kernels.rank_views(
            problem.pairs_by_sample,
            problem.cells.focus,
            problem.camera_views,
            self.cell,
            ranking,
        )

    def improve(self, batches=None):
        problem, cells = self.problem, self.problem.cells
        return self.step(
            self.tuples,
            0,
            len(self.tuples.batch_offsets) - 1 if batches is None else batches,
            problem.pairs_by_camera,
            problem.pairs_by_sample,
            cells.focus,
            problem.camera_views,
            cells.offsets,
            self.state,
        )

    def reassign(self):
        problem = self.problem
        return kernels.reassign(
            problem.pairs_by_sample, problem.cells.focus, problem.camera_views, self.state
        )

    def focus(self):
        return self.problem.cells.distances()[self.problem.cells.offsets[:-1] + self.cell]


PROBLEMS = {
    "random": {},
    "ties": {"ties": True, "equal": True},
    "few distances": {"lens": Lens(0.05, 10.0, 0.6, 0.7)},
    "deep field": {"lens": Lens(0.05, 3.0)},
    "sparse": {"share": 0.25},
    "little weight": {"weight": 0.1},
    "two views": {"views": 2},
    "three views, ties": {"views": 3, "ties": True},
    "five views, sparse": {"views": 5, "share": 0.4},
    "shots": {"shots": 2},
    "two views, shots": {"views": 2, "shots": 2},
    "three views, three shots": {"views": 3, "shots": 3},
}


@pytest.mark.parametrize("options", PROBLEMS.values(), ids=PROBLEMS.keys())
@pytest.mark.parametrize("scope", ["all", "assigned"])
@pytest.mark.parametrize(("k", "samples"), [(2, 16), (3, 8)])
def test_a_step_is_the_best_of_all(k, samples, scope, options):
    gained = 0
    for seed in range(12):
        problem = random_problem(seed, samples, 4, **{"share": 0.7} | options)
        if (np.diff(problem.cells.offsets) == 0).any():
            continue
        search = Search(problem, k, scope, seed)
        if not len(search.tuples.cameras):
            continue
        table, before = reference.table(problem), search.focus()
        # The first batch's first tuple alone.
        search.tuples.batch_offsets[1] = 1
        members = search.tuples.cameras[0].tolist()
        phi = reference.assign_views(table, before)
        gain = 1000 * search.improve(1) / UNITS
        best, _ = reference.best_step(table, before, members, scope)
        after = search.focus()
        others = [c for c in range(problem.camera_count) if c not in members]
        np.testing.assert_array_equal(after[others], before[others])
        if scope == "all":
            reached = reference.cost(table, after)
        else:
            reached = reference.assigned_cost(table, after, phi, members)
        assert reached == pytest.approx(best, abs=1e-9)
        assert gain == pytest.approx(reference.cost(table, before) - best, abs=1e-9)
        gained += gain > 1e-6
    assert gained


@pytest.mark.parametrize("options", PROBLEMS.values(), ids=PROBLEMS.keys())
@pytest.mark.parametrize(("k", "samples"), [(2, 40), (3, 20)])
def test_gains_add_up_to_the_fall_of_the_total(k, samples, options):
    for seed in range(12):
        problem = random_problem(seed, samples, 7, **{"share": 0.4} | options)
        if (np.diff(problem.cells.offsets) == 0).any():
            continue
        search = Search(problem, k, "all", seed)
        units, gain = search.units, 1
        while gain:
            gain = search.improve()
            assert gain >= 0
            units -= gain
            assert units == assign_samples(problem, search.cell)[1]
            # Rankings are kept up to date move by move.
            fresh = np.empty_like(search.ranking)
            search.rank(fresh)
            np.testing.assert_array_equal(search.ranking, fresh)


@pytest.mark.parametrize("options", PROBLEMS.values(), ids=PROBLEMS.keys())
@pytest.mark.parametrize(("k", "samples"), [(2, 40), (3, 20)])
def test_assigned_steps_and_reassignment_lower_the_total(k, samples, options):
    for seed in range(12):
        problem = random_problem(seed, samples, 7, **{"share": 0.4} | options)
        if (np.diff(problem.cells.offsets) == 0).any():
            continue
        search = Search(problem, k, "assigned", seed)
        units, gain = search.units, 1
        while gain:
            gain = search.improve()
            assert gain >= 0
            gain += search.reassign()
            best, now = assign_samples(problem, search.cell)
            # A step may also hand over what an earlier one left with the wrong camera.
            assert now <= units - gain
            assert search.reassign() == 0
            np.testing.assert_array_equal(
                cost_in_units(search, search.best), cost_in_units(search, best)
            )
            units = now


def cost_in_units(search, best):
    """Each sample's cost in the cameras that it is assigned to."""
    cells, problem = search.problem.cells, search.problem
    costs = problem.views * cells.unseen
    for q, (p, c) in enumerate(zip(problem.sample_index, problem.camera_index, strict=True)):
        if c in best[p]:
            held = cells.first[q] <= search.cell[c] <= cells.last[q]
            costs[p] += cells.base[q] + (0 if held else cells.focus[p]) - cells.unseen[p]
    return costs


@pytest.mark.parametrize("scope", ["all", "assigned"])
@pytest.mark.parametrize(("k", "samples"), [(2, 14), (3, 7)])
def test_when_nothing_gains_no_tuple_can_be_improved(k, samples, scope):
    for seed in range(6):
        problem = random_problem(seed, samples, 5, share=0.6)
        if (np.diff(problem.cells.offsets) == 0).any():
            continue
        search = Search(problem, k, scope, seed)
        while search.improve() + (search.reassign() if scope == "assigned" else 0):
            pass
        table, focus = reference.table(problem), search.focus()
        cost = reference.cost(table, focus)
        assert len(search.tuples.cameras) > 3
        for members in search.tuples.cameras.tolist():
            best, _ = reference.best_step(table, focus, members, scope)
            assert best >= cost - 1e-9


@pytest.mark.parametrize(("k", "samples"), [(2, 20), (3, 9)])
def test_one_tuple_of_all_cameras_reaches_the_optimum(k, samples):
    for seed in range(10):
        problem = random_problem(seed, samples, k, share=0.8, ties=seed % 2 == 1)
        search = Search(problem, k, "all", seed, Grid(1, k))
        search.improve()
        best = reference.optimum_by_enumeration(reference.table(problem))
        assert 1000 * assign_samples(problem, search.cell)[1] / UNITS == pytest.approx(best)


@pytest.mark.parametrize("scope", ["all", "assigned"])
@pytest.mark.parametrize("k", [2, 3])
def test_what_is_passed_over_has_nothing_to_gain(k, scope):
    # What is known of one pass serves the next; a search that knows nothing finds nothing more.
    gaining = 0
    for seed in range(8):
        problem = random_problem(seed, 500, 25, visible=ring_mask(500, 25))
        search, passes = Search(problem, k, scope, seed), 0
        while search.improve() + (search.reassign() if scope == "assigned" else 0):
            passes += 1
        gaining += passes > 1
        fresh = Search(problem, k, scope, seed)
        fresh.cell[:] = search.cell
        fresh.best, _ = assign_samples(problem, fresh.cell)
        fresh.rank(fresh.ranking)
        assert fresh.improve() == 0
    assert gaining


def test_tuples_that_nothing_touched_are_passed_over():
    problem = random_problem(3, 60, 6, share=0.3)
    search = Search(problem, 2, "all", 0, Grid(2, 3))
    while search.improve():
        pass
    solved = search.solved.copy()
    assert search.improve() == 0
    np.testing.assert_array_equal(search.solved, solved)


@pytest.mark.parametrize("k", [2, 3])
@pytest.mark.parametrize(("views", "shots"), [(1, 1), (3, 1), (2, 2)])
def test_a_ranking_holds_the_cheapest_views_in_order(k, views, shots):
    problem = random_problem(5, 40, 6, share=0.4, ties=True, views=views, shots=shots)
    search = Search(problem, k, "all", 1)
    costs = [{} for _ in range(40)]
    cells = problem.cells
    for q, (p, c) in enumerate(zip(problem.sample_index, problem.camera_index, strict=True)):
        held = cells.first[q] <= search.cell[c] <= cells.last[q]
        cost = int(cells.base[q]) + (0 if held else int(cells.focus[p]))
        costs[p][int(c) // shots] = min(cost, costs[p].get(int(c) // shots, cost))
    for p in range(40):
        missing = kernels.NEVER if views == 1 else int(cells.unseen[p])
        cheapest = sorted((cost, v) for v, cost in costs[p].items() if cost <= missing)
        keys = [(cost << kernels.VIEW_BITS) | v for cost, v in cheapest][: views + k]
        assert search.ranking[p, : len(keys)].tolist() == keys
        for key in search.ranking[p, len(keys) :]:
            assert key >> kernels.VIEW_BITS == missing


def test_batches_run_in_parallel_give_what_they_give_one_by_one():
    problem = random_problem(6, 3000, 60, visible=ring_mask(3000, 60))
    together = Search(problem, 2, "all", 0)
    apart = Search(problem, 2, "all", 0)
    batches = list(itertools.pairwise(together.tuples.batch_offsets))
    assert max(high - low for low, high in batches) > 1
    apart.tuples = together.tuples._replace(
        batch_offsets=np.arange(len(together.tuples.cameras) + 1)
    )
    in_turn = Search(problem, 2, "all", 0)
    in_turn.step = kernels.improve_in_turn
    gain = with_threads(2, together.improve)
    assert gain == with_threads(1, apart.improve) == in_turn.improve() > 0
    np.testing.assert_array_equal(together.cell, apart.cell)
    np.testing.assert_array_equal(together.cell, in_turn.cell)


def test_every_camera_of_the_largest_rig_has_a_number_of_its_own():
    assert MAX_CAMERAS < 2**kernels.VIEW_BITS - 1
