# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What other solvers do, on small problems, against what is obvious of them."""

import numpy as np
import pytest

from benchmarks.peers import choices as kernels
from benchmarks.peers import cma_es, heuristics, highs, ours
from benchmarks.peers.choices import choices_of, stood_at, taken_pairs
from benchmarks.peers.found import found_at
from benchmarks.peers.problem_file import load_problem
from benchmarks.peers.racing import PEERS, race
from benchmarks.peers.tables import Row, peer_table
from focus_planner import Lens
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.solvers import SOLVERS
from focus_planner.io.problems import save_problem
from testing.problems import random_problem

SHALLOW = Lens(0.05, 40.0)
SEEDS = range(3)
BLIND = 6  # of the last problem: a camera without cells


def small(seed):
    visible = np.random.default_rng(seed).random((40, 7)) < 0.5
    visible[:, BLIND] = seed < 2
    return random_problem(seed, 40, 7, visible=visible, lens=SHALLOW)


@pytest.fixture(params=SEEDS)
def problem(request):
    return small(request.param)


def some_cells(choices, seed=0):
    random = np.random.default_rng(seed)
    at = random.integers(0, np.maximum(choices.cells, 1))
    return np.where(choices.cells > 0, at, -1).astype(np.int32)


def room_of(choices):
    return np.empty(choices.cells.max() + 1, dtype=np.int64)


def test_the_gain_of_cells_is_what_the_planner_says_of_their_distances(problem):
    choices, gains = choices_of(problem)
    for seed in range(10):
        cell = some_cells(choices, seed)
        cost = cost_of_units(gains.out - kernels.total(choices, cell))
        assert problem.cost(found_at(problem, cell).focus_distances) == pytest.approx(cost)


def test_the_best_cell_is_that_of_all_and_a_change_what_it_changes(problem):
    choices, _ = choices_of(problem)
    cell = some_cells(choices)
    before = kernels.total(choices, cell)
    for c in np.flatnonzero(choices.cells):
        totals = []
        for j in range(choices.cells[c]):
            moved = cell.copy()
            moved[c] = j
            totals.append(kernels.total(choices, moved))
            assert kernels.change(choices, c, cell, np.int32(j)) == totals[-1] - before
        best, most, own = kernels.best_cell(choices, c, cell, room_of(choices))
        assert totals[best] == max(totals)
        assert most - own == max(totals) - before


def test_greedy_takes_what_adds_most(problem):
    choices, _ = choices_of(problem)
    cell = np.full(len(choices.cells), -1, dtype=np.int32)
    for _ in np.flatnonzero(choices.cells):
        every = [
            (kernels.best_cell(choices, c, cell, room_of(choices))[1], -c)
            for c in np.flatnonzero((cell < 0) & (choices.cells > 0))
        ]
        c = -max(every)[1]
        cell[c] = kernels.best_cell(choices, c, cell, room_of(choices))[0]
    assert heuristics.greedy_cells(choices).tolist() == cell.tolist()


def test_no_camera_can_move_alone_after_a_descent(problem):
    choices, _ = choices_of(problem)
    cell = some_cells(choices)
    kernels.descend(choices, cell, room_of(choices))
    for c in np.flatnonzero(choices.cells):
        _, most, own = kernels.best_cell(choices, c, cell, room_of(choices))
        assert most == own


def test_annealing_knows_what_it_gains(problem):
    choices, _ = choices_of(problem)
    cell = some_cells(choices)
    best, gained = cell.copy(), kernels.total(choices, cell)
    warm = float(choices.gain.mean())
    random = np.random.default_rng(1)
    gained, most = kernels.anneal(choices, cell, best, gained, gained, warm, 2000, random)
    assert gained == kernels.total(choices, cell)
    assert most == kernels.total(choices, best) >= gained


def test_taken_pairs_gain_what_the_plan_does_and_stand_where_it_does(problem):
    choices, _ = choices_of(problem)
    cell = some_cells(choices)
    taken = taken_pairs(choices, cell)
    assert choices.gain[taken].sum() == kernels.total(choices, cell)
    assert len(np.unique(choices.sample[taken])) == taken.sum()
    stands = np.split(stood_at(choices, cell), np.cumsum(choices.cells)[:-1])
    firsts = [each.argmax() if len(each) else -1 for each in stands]
    assert firsts == cell.tolist()


@pytest.mark.parametrize("solve", [highs.highs, ours.optimal])
def test_on_small_problems_some_prove_the_optimum(problem, solve):
    optimum = SOLVERS["optimal"](problem)
    found = solve(problem, 60.0, 1)
    assert problem.cost(found.focus_distances) == pytest.approx(optimum.cost, rel=1e-6)
    assert found.lower_bound == pytest.approx(optimum.cost, rel=1e-5)


@pytest.mark.parametrize(
    "solve",
    [heuristics.coordinate_descent, heuristics.simulated_annealing, cma_es.cma_es],
)
def test_what_starts_from_greedy_is_no_worse_and_not_below_the_optimum(problem, solve):
    optimum = SOLVERS["optimal"](problem)
    greedy = problem.cost(heuristics.greedy(problem, 0.0, 1).focus_distances)
    cost = problem.cost(solve(problem, 0.2, 1).focus_distances)
    assert optimum.lower_bound <= cost <= greedy * (1 + 1e-12)


@pytest.mark.parametrize("solve", [ours.em, ours.k_view])
def test_our_quick_methods_come_with_a_bound(problem, solve):
    found = solve(problem, 60.0, 1)
    assert found.lower_bound <= SOLVERS["optimal"](problem).cost
    assert problem.cost(found.focus_distances) >= found.lower_bound


def test_without_time_for_a_bound_there_is_none():
    problem = random_problem(0, 400, 20, share=0.6, lens=SHALLOW)
    found = highs.highs(problem, 0.0, 1)
    greedy = heuristics.greedy(problem, 0.0, 1)
    cost = problem.cost(greedy.focus_distances)
    assert found.lower_bound is None or -np.inf < found.lower_bound <= cost
    assert problem.cost(found.focus_distances) <= cost * (1 + 1e-12)


@pytest.mark.processes
def test_cp_sat_proves_the_optimum_in_a_process_of_its_own(tmp_path):
    problem, path = small(0), tmp_path / "problem.npz"
    save_problem(problem, path)
    optimum = SOLVERS["optimal"](problem)
    name = next(name for name in PEERS if name.startswith("CP-SAT"))
    found, seconds = race(name, path, 60.0, 1)
    assert problem.cost(found.focus_distances) == pytest.approx(optimum.cost, rel=1e-6)
    assert found.lower_bound == pytest.approx(optimum.cost, rel=1e-5)
    assert seconds > 0


def test_a_problem_is_read_back_as_it_was(problem, tmp_path):
    save_problem(problem, tmp_path / "problem.npz")
    again = load_problem(tmp_path / "problem.npz")
    for name, solve in SOLVERS.items():
        plans = [solve(each).focus_distances.tolist() for each in (problem, again)]
        assert repr(plans[0]) == repr(plans[1]), name


def test_a_table_tells_each_ones_gap_and_the_distance_from_the_best_bound():
    rows = [
        Row("greedy", 110.0, None, 0.01),
        Row("HiGHS", 104.0, 100.0, 30.0),
        Row("optimal", 102.0, 101.0, 1.5),
    ]
    table = peer_table(rows, "a body")
    cells = list(zip(*(column._cells for column in table.columns), strict=True))
    assert cells == [
        ("greedy", "110.000", "–", "–", "8.9109%", "0.01"),
        ("HiGHS", "104.000", "100.000", "3.8462%", "2.9703%", "30.00"),
        ("optimal", "102.000", "101.000", "0.9804%", "0.9901%", "1.50"),
    ]
