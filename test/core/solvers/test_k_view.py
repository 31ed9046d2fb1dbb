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
from numba import config, get_num_threads

from focus_planner import Rig, cylinder_rig
from focus_planner.core import kernels
from focus_planner.core.kernels import compiling
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.solvers import Options, em, k_view
from focus_planner.core.solvers.solution import cells_at, distances_of_cells, start_cells
from focus_planner.core.validation import InputError
from testing import reference
from testing.problems import (
    around,
    body,
    body_optimum,
    forward,
    merged,
    plane,
    problem_of,
    random_problem,
    torus,
)


@pytest.mark.parametrize("ties", [False, True])
@pytest.mark.parametrize(("k", "samples"), [(2, 25), (3, 10)])
def test_k_cameras_reach_the_optimum(k, samples, ties):
    beyond_em = 0
    for seed in range(15):
        problem = random_problem(seed, samples, k, share=0.8, ties=ties, equal=ties)
        solution = k_view.solve(problem, Options(k=k))
        best = reference.optimum_by_enumeration(reference.table(problem))
        assert solution.cost == pytest.approx(best, abs=1e-9)
        beyond_em += em.solve(problem).cost > best + 1e-6
    if not ties:
        assert beyond_em >= 2


@pytest.mark.parametrize("scope", ["all", "assigned"])
def test_three_cameras_two_at_a_time_are_near_the_optimum_and_never_below(scope):
    excess = []
    for seed in range(15):
        problem = random_problem(seed, 12, 3, share=0.7)
        cost = k_view.solve(problem, Options(scope=scope)).cost
        best = reference.optimum_by_enumeration(reference.table(problem))
        assert cost >= best - 1e-9
        excess.append(cost / best - 1)
    assert np.mean(excess) < 0.01


def test_the_two_oracles_of_the_optimum_agree():
    for seed in range(10):
        table = reference.table(random_problem(seed, 12, 3, share=0.6, ties=seed % 2 == 1))
        best, bound = reference.optimum(table)
        assert best == pytest.approx(reference.optimum_by_enumeration(table), abs=1e-6)
        assert bound == pytest.approx(best, abs=1e-3)


@pytest.mark.parametrize("name", ["arms_down", "arms_out", "arms_raised"])
def test_bodies_are_planned_within_half_a_percent_of_the_optimum(name):
    problem, best, bound = body_optimum(name)
    costs = {
        (k, scope): k_view.solve(problem, Options(k=k, scope=scope)).cost
        for k, scope in [(2, "all"), (2, "assigned"), (3, "all")]
    }
    assert bound == pytest.approx(best, rel=1e-3)
    assert min(costs.values()) >= bound - 1e-6
    assert costs[2, "all"] <= 1.005 * best
    assert costs[3, "all"] <= 1.005 * best
    assert costs[2, "all"] <= costs[2, "assigned"] <= em.solve(problem).cost


def test_the_grids_neighbours_serve_as_well():
    rig = cylinder_rig()
    problem = problem_of(body(), rig, 1000)
    overlap, grid = (k_view.solve(problem, Options(grid=g)).cost for g in (None, rig.grid))
    assert grid == pytest.approx(overlap, rel=0.01)
    assert grid < em.solve(problem).cost


def test_two_cameras_share_two_planes():
    # Side by side they see both planes alike, one more of the one and one of the other.
    mesh = merged(plane(0.2, 0.2, 0.7), plane(0.5, 0.5, 1.0))
    rig = Rig((forward("a", (-0.01, 0, 0)), forward("b", (0.01, 0, 0))))
    problem = problem_of(mesh, rig, 800)
    solution = k_view.solve(problem)
    held = sorted(solution.focus_distances)
    assert 0.7 * 10.05 / 10.7 <= held[0] <= 0.7 * 9.95 / 9.3
    assert 10.05 / 11 <= held[1] <= 9.95 / 9
    table = reference.table(problem)
    assert solution.cost == pytest.approx(reference.optimum_by_enumeration(table))


def test_steps_start_where_em_ends():
    for seed in range(40):
        problem = random_problem(seed, 40, 6, share=0.4, ties=seed % 2 == 0)
        log = []
        k_view.solve(problem, Options(), lambda progress, log=log: not log.append(progress))
        last_em = [progress for progress in log if progress.stage == "em"][-1]
        first = next(progress for progress in log if progress.stage == "k_view")
        assert first.cost <= min(last_em.cost, em.solve(problem).cost) + 1e-9


@pytest.mark.parametrize("scope", ["all", "assigned"])
def test_a_descent_is_its_passes_one_after_the_other(scope, monkeypatch):
    monkeypatch.setattr(k_view, "_SAMPLES_BETWEEN_CALLS", 500)
    problem = problem_of(body(), cylinder_rig(), 300)
    start = start_cells(problem, em.solve(problem).focus_distances)
    descent, log = k_view.Descent(problem, Options(scope=scope)), []
    steps = descent.run(start.copy(), lambda progress: not log.append(progress.cost))
    cell, units = descent.cell, descent.units
    passes = [[cost_of_units(each) for each in taken] for taken in descent.passes(start.copy())]
    assert len(passes) >= 2
    assert min(map(len, passes)) > 1
    assert [cost for taken in passes for cost in taken] == log
    assert steps == (len(log), True)
    assert passes[-1][-1] == passes[-2][-1] < passes[0][0]
    assert descent.units == units
    np.testing.assert_array_equal(descent.cell, cell)


def test_pairs_reach_as_far_as_the_rings():
    rig = cylinder_rig()
    problem = problem_of(body(), rig, 1000)
    one, two = (k_view.solve(problem, Options(grid=rig.grid, rings=r)).cost for r in (1, 2))
    assert one != two
    assert two == pytest.approx(one, rel=0.005)


def test_a_single_camera_is_left_to_em():
    problem = problem_of(torus(0.4, 0.15), Rig(around(3, 1.0).cameras[:1]), 200)
    for k in (2, 3):
        solution = k_view.solve(problem, Options(k=k))
        assert solution.converged
        assert solution.cost == em.solve(problem).cost


def test_triples_start_where_pairs_end():
    problem = problem_of(body("arms_out"), cylinder_rig(), 500)
    pairs, log = k_view.solve(problem), []
    triples = k_view.solve(problem, Options(k=3), lambda progress: not log.append(progress))
    assert triples.cost <= pairs.cost
    first = next(progress for progress in log if progress.stage == "k_view, triples")
    last = [progress for progress in log if progress.stage == "k_view"][-1]
    assert (first.iteration, first.cost) == (0, last.cost)
    until = k_view.solve(problem, Options(k=3), lambda p: p.stage != "k_view, triples")
    assert not until.converged
    assert until.cost == pairs.cost
    np.testing.assert_array_equal(until.focus_distances, pairs.focus_distances)


def test_only_tuples_that_may_move_at_once_take_several_threads(monkeypatch):
    threads, improve_tuples = [], kernels.improve_tuples
    improve_in_turn = kernels.improve_in_turn

    def at_once(*arguments):
        threads.append(get_num_threads())
        return improve_tuples(*arguments)

    def in_turn(*arguments):
        threads.append(1)
        return improve_in_turn(*arguments)

    monkeypatch.setattr(kernels, "improve_tuples", at_once)
    monkeypatch.setattr(kernels, "improve_in_turn", in_turn)
    monkeypatch.setattr(compiling, "_PARALLEL_PAIRS", 1)
    monkeypatch.setattr(k_view, "_SAMPLES_AT_ONCE", 10)

    def used(problem):
        threads.clear()
        with kernels.threads_for(len(problem.depth)):
            k_view.solve(problem)
        return set(threads)

    assert used(random_problem(1, 60, 8, share=1.0)) == {1}
    problem = problem_of(body(), cylinder_rig(), 500)
    assert used(problem) == {config.NUMBA_NUM_THREADS}
    monkeypatch.setattr(k_view, "_SAMPLES_AT_ONCE", 1000)
    assert used(problem) == {1}


@pytest.mark.parametrize("options", [{}, {"ties": True}, {"views": 2}, {"shots": 2}])
def test_a_pair_gains_what_trying_all_its_distances_gains(options):
    gained = 0.0
    for seed in range(6):
        problem = random_problem(seed, 10, 4, share=0.7, **options)
        if (np.diff(problem.cells.offsets) == 0).any():
            continue
        cell = cells_at(problem, em.solve(problem).focus_distances)
        focus = distances_of_cells(problem, cell)
        pairs = np.array(list(itertools.combinations(range(problem.camera_count), 2)))[:8]
        table = reference.table(problem)
        before = reference.cost(table, focus)
        everything = k_view.gains_of_pairs(problem, focus, pairs)
        assigned = k_view.gains_of_pairs(problem, focus, pairs, "assigned")
        for pair, gain, own in zip(pairs.tolist(), everything, assigned, strict=True):
            best, _ = reference.best_step(table, focus, pair, "all")
            assert gain == pytest.approx(before - best, abs=1e-8)
            # What other samples gain by the pair's new distances comes on top.
            kept, _ = reference.best_step(table, focus, pair, "assigned")
            assert before - kept - 1e-8 <= own <= gain + 1e-8
        gained += everything.sum()
    assert gained > 1


@pytest.mark.parametrize("pair", [[2, 2], [0, 4]])
def test_a_camera_that_cannot_focus_makes_no_pair(pair):
    problem = random_problem(1, 20, 5)
    problem.focus_near[problem.camera_index == 4] = np.inf
    problem.focus_far[problem.camera_index == 4] = -np.inf
    with pytest.raises(InputError, match="pairs: expected two different cameras that can each"):
        k_view.gains_of_pairs(problem, np.full(5, 0.6), np.array([[0, 1], pair]))
