# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Proven optima where cuts are sought from the start, against all plans there are and HiGHS."""

from dataclasses import fields, replace

import numpy as np
import pytest

from focus_planner import Lens
from focus_planner.core.bounds.branch_and_cut import BranchingWithCuts
from focus_planner.core.kernels import compiling
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.solvers import Options, optimal
from testing import reference
from testing.optima import Log, check, least_cost
from testing.problems import random_problem, ring_mask, tiny_problem, with_threads

SHALLOW = Lens(0.05, 40.0)
EXACT = Options(gap=0.0)


def torn_problem(seed, samples=100, cameras=10, **options):
    """One that prices alone leave a gap of: each sample is seen by five cameras of a ring."""
    visible = ring_mask(samples, cameras)
    return random_problem(seed, samples, cameras, visible=visible, lens=Lens(0.05, 8.0), **options)


def search_without_cuts(monkeypatch, work):
    """Limit the search that comes first; 0 leaves it out."""
    monkeypatch.setattr(optimal, "_WITHOUT_CUTS", work)
    monkeypatch.setattr(optimal, "_PAIRS_IF_MUCH", work)


@pytest.fixture(autouse=True)
def cuts_from_the_start(monkeypatch):
    search_without_cuts(monkeypatch, 0)
    monkeypatch.setattr(optimal, "_FIRST_KICKS", 3)


def test_whatever_the_problem_the_optimum_is_found_and_proven():
    stages = {}
    for seed in range(600):
        problem, log = tiny_problem(seed), Log()
        solution = optimal.solve(problem, EXACT, log)
        check(problem, solution, least_cost(problem))
        assert solution.converged
        for stage in set(log.stages):
            stages[stage] = stages.get(stage, 0) + 1
    assert stages["cuts"] > 20
    assert stages["kicks"] > 20


@pytest.mark.parametrize("shots", [1, 2])
def test_the_optimum_is_that_of_highs(shots):
    branched = 0
    for seed in range(10):
        problem = random_problem(seed, 40, 5, share=0.8, lens=Lens(0.05, 8.0))
        problem, log = with_shots(problem, shots), Log()
        solution = optimal.solve(problem, EXACT, log)
        best, _ = reference.optimum(reference.table(problem))
        assert solution.converged
        assert solution.cost == pytest.approx(best, abs=1e-5)
        branched += "cuts" in log.stages
    assert branched > 3


def test_while_cuts_are_sought_the_plan_is_kicked_beside(monkeypatch):
    monkeypatch.setattr(optimal, "_FIRST_KICKS", 0)
    log = Log(60)
    optimal.solve(torn_problem(1, 200, 14), Options(gap=1e-4), log)
    assert "kicks" not in log.stages
    costs = [p.cost for p in log.progress if p.stage == "cuts"]
    assert costs[-1] < log.costs[log.stages.index("cuts") - 1]


def test_several_views_are_bounded_without_cuts():
    for seed in range(3):
        log = Log()
        assert optimal.solve(torn_problem(seed, 40, 6, views=2), Options(gap=1e-5), log).converged
        assert "prices" in log.stages
        assert not {"cuts", "kicks"} & set(log.stages)


def test_after_many_nodes_without_cuts_they_are_sought(monkeypatch):
    search_without_cuts(monkeypatch, 400)
    sought = 0
    for seed in range(10):
        problem, log = random_problem(seed, 40, 5, share=0.8, lens=Lens(0.05, 8.0)), Log()
        solution = optimal.solve(problem, EXACT, log)
        assert solution.converged
        check(problem, solution, least_cost(problem))
        sought += "cuts" in log.stages
    assert sought > 2


@pytest.mark.parametrize(("nearly", "cuts"), [(0.0, True), (1.0, False)])
def test_where_few_nodes_nearly_close_the_gap_no_cuts_are_sought(nearly, cuts, monkeypatch):
    search_without_cuts(monkeypatch, 10**9)
    monkeypatch.setattr(optimal, "_PAIRS_IF_MUCH", 400)
    monkeypatch.setattr(optimal, "_MUCH", 0.0)
    monkeypatch.setattr(optimal, "_NEARLY", nearly)
    sought = False
    for seed in range(10):
        problem, log = random_problem(seed, 40, 5, share=0.8, lens=Lens(0.05, 8.0)), Log()
        solution = optimal.solve(problem, EXACT, log)
        assert solution.converged
        check(problem, solution, least_cost(problem))
        sought |= "cuts" in log.stages
    assert sought == cuts


def test_where_the_first_nodes_close_little_cuts_are_sought_sooner(monkeypatch):
    search_without_cuts(monkeypatch, 10**9)
    problem = torn_problem(1, 200, 14)

    def nodes_without_cuts(fewest, hopeful):
        monkeypatch.setattr(optimal, "_EIGHTH", 0.0)
        monkeypatch.setattr(optimal, "_FEWEST_NODES", fewest)
        monkeypatch.setattr(optimal, "_HOPEFUL", hopeful)
        searched, counts = [], []
        close = optimal._Search._close

        def noting(search, branching, *go_on):
            searched.append(branching)
            close(search, branching, *go_on)
            counts.append(branching.nodes)

        with monkeypatch.context() as patch:
            patch.setattr(optimal._Search, "_close", noting)
            solution = optimal.solve(problem, EXACT)
        assert solution.converged
        return counts[0], any(isinstance(each, BranchingWithCuts) for each in searched)

    soon, cut = nodes_without_cuts(20, 0.999)
    assert cut
    later, cut = nodes_without_cuts(80, 0.999)
    assert cut
    enough, cut = nodes_without_cuts(20, -1.0)
    assert not cut
    assert 20 <= soon < 80 <= later < enough


def test_stopped_at_any_step_plan_and_bound_are_valid():
    random, unproven = np.random.default_rng(0), 0
    for seed in range(300):
        problem = random_problem(seed, 14, 4, share=0.8, lens=SHALLOW)
        log = Log(int(random.integers(1, 60)))
        solution = optimal.solve(problem, EXACT, log)
        check(problem, solution, least_cost(problem))
        assert len(log.progress) <= log.steps
        unproven += not solution.converged
    assert unproven > 30


def test_stopped_at_every_step_nothing_follows():
    problem = torn_problem(0)
    options, full = replace(EXACT, gap=1e-3), Log()
    whole = optimal.solve(problem, options, full)
    assert whole.converged
    assert {"kicks", "cuts"} <= set(full.stages)
    for steps in range(1, len(full.progress), max(1, len(full.progress) // 15)):
        log = Log(steps)
        solution = optimal.solve(problem, options, log)
        assert log.progress == full.progress[:steps]
        assert solution.lower_bound <= whole.cost


def test_progress_tells_cost_and_bound_of_every_step():
    problem, log = torn_problem(0), Log(400)
    optimal.solve(problem, EXACT, log)
    assert {"kicks", "cuts", "branching"} <= set(log.stages)
    costs, bounds = ([getattr(p, n) for p in log.progress] for n in ("cost", "lower_bound"))
    assert (np.diff(costs) <= 0).all()
    assert (np.diff(bounds) >= 0).all()


@pytest.mark.parametrize("threads", [1, 2])
def test_a_search_repeats_bit_for_bit(threads, monkeypatch):
    monkeypatch.setattr(compiling, "_PARALLEL_PAIRS", 0 if threads == 2 else 2**62)
    problem = torn_problem(0, 200, 14)

    def run():
        log = Log(90)
        solution = optimal.solve(problem, Options(gap=1e-6), log)
        return solution, log.progress

    (a, told_a), (b, told_b) = run(), with_threads(threads, run)
    assert "cuts" in {step.stage for step in told_a}
    assert told_a == told_b
    for field in fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        assert x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else x == y, field.name


def test_prices_of_a_solution_prove_no_more_than_the_bound():
    problem = torn_problem(1, 60, 8)
    solution = optimal.solve(problem, Options(gap=1e-3))
    assert ((solution.prices >= 0) & (solution.prices <= 1)).all()
    again = optimal.solve(problem, Options(gap=1e-3, prices=solution.prices))
    assert again.cost == pytest.approx(solution.cost, rel=1e-3)
