# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Proven optima and bounds against all plans there are, and against HiGHS."""

from dataclasses import fields, replace

import numpy as np
import pytest

from focus_planner import Lens, cylinder_rig
from focus_planner.core.bounds import branch_and_bound as branching
from focus_planner.core.kernels import compiling
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.solvers import Options, em, k_view, optimal
from testing import reference
from testing.optima import Log, check, least_cost
from testing.problems import (
    TABLE_LENSES,
    TINY_LENSES,
    body,
    body_optimum,
    problem_of,
    random_problem,
    ring_mask,
    tiny_problem,
    with_threads,
)

SHALLOW = Lens(0.05, 40.0)
EXACT = Options(gap=0.0)


def test_the_optimum_is_that_of_the_table():
    for seed in range(150):
        problem = tiny_problem(seed, most_choices=60)
        best = reference.optimum_by_enumeration(reference.table(problem))
        assert least_cost(problem) == pytest.approx(best, abs=1e-8)
        solution = optimal.solve(problem, EXACT)
        assert solution.converged
        assert solution.cost == pytest.approx(best, abs=1e-8)


def test_whatever_the_problem_the_optimum_is_found_and_proven():
    stages = {}
    for seed in range(1500):
        problem, log = tiny_problem(seed), Log()
        solution = optimal.solve(problem, EXACT, log)
        check(problem, solution, least_cost(problem))
        assert solution.converged
        for stage in set(log.stages):
            stages[stage] = stages.get(stage, 0) + 1
    assert stages["branching"] > 50
    assert stages["prices"] > 400


@pytest.mark.parametrize(
    "lens",
    TINY_LENSES + TABLE_LENSES,
    ids=["any", "limits", "list", "steps", "shallow", "table", "whole"],
)
@pytest.mark.parametrize("tolerance", [0.0, 0.012])
@pytest.mark.parametrize(("cameras", "shots"), [(1, 1), (1, 3), (2, 2), (3, 1)])
def test_brackets_and_lenses_are_planned_at_their_optimum(lens, tolerance, cameras, shots):
    # From depths and lenses alone: no interval, no cell.
    for seed in range(3):
        one = random_problem(seed, 8, cameras, share=0.8, lens=lens, tolerance=tolerance)
        solution = optimal.solve(with_shots(one, shots), EXACT)
        best = reference.bracket_optimum(one, shots, tolerance)
        assert solution.converged
        assert solution.cost == pytest.approx(best, abs=1e-8)


@pytest.mark.parametrize("options", [{}, {"ties": True, "equal": True}], ids=["random", "ties"])
def test_the_optimum_is_that_of_highs(options):
    branched = 0
    for seed in range(12):
        problem, log = random_problem(seed, 30, 5, share=0.6, lens=SHALLOW, **options), Log()
        solution = optimal.solve(problem, EXACT, log)
        best, _ = reference.optimum(reference.table(problem))
        assert solution.converged
        assert solution.cost == pytest.approx(best, abs=1e-5)
        branched += "branching" in log.stages
    assert branched > 1 or options


@pytest.mark.parametrize("name", ["arms_down", "arms_out", "arms_raised"])
def test_on_bodies_the_optimum_is_that_of_highs(name):
    problem, best, bound = body_optimum(name)
    solution = optimal.solve(problem)
    assert solution.converged
    assert solution.cost - solution.lower_bound <= 1.1e-6 * solution.cost
    assert bound - 1e-5 <= solution.cost <= best * (1 + 1e-6) + 1e-5
    assert solution.lower_bound <= best + 1e-5
    assert solution.cost <= k_view.solve(problem).cost


def test_stopped_at_any_step_plan_and_bound_are_valid():
    stopped = unproven = 0
    random = np.random.default_rng(0)
    for seed in range(2000):
        problem = tiny_problem(10_000 + seed)
        log = Log(int(random.integers(1, 12)))
        solution = optimal.solve(problem, EXACT, log)
        check(problem, solution, least_cost(problem))
        assert len(log.progress) <= log.steps
        assert solution.cost <= log.progress[-1].cost + 1e-9
        stopped += len(log.progress) == log.steps
        unproven += not solution.converged
        assert solution.converged or len(log.progress) == log.steps
    assert stopped > 400
    assert unproven > 100


@pytest.mark.parametrize("seed", range(4))
def test_stopped_at_every_step_nothing_follows(seed):
    problem = random_problem(seed, 80, 8, share=0.6, lens=SHALLOW)
    full = Log()
    whole = optimal.solve(problem, replace(EXACT, gap=1e-3), full)
    assert whole.converged
    assert {"em", "k_view", "prices"} <= set(full.stages)
    assert "branching" in full.stages or seed < 2
    every = max(1, len(full.progress) // 40)
    for steps in [*range(1, min(30, len(full.progress))), *range(30, len(full.progress), every)]:
        log = Log(steps)
        solution = optimal.solve(problem, replace(EXACT, gap=1e-3), log)
        assert log.progress == full.progress[:steps]
        assert solution.iterations == steps
        assert solution.cost == problem.cost(solution.focus_distances)
        assert solution.cost <= log.progress[-1].cost + 1e-9
        assert log.progress[-1].lower_bound <= solution.lower_bound + 1e-9
        assert solution.lower_bound <= whole.cost
        assert np.isfinite(solution.focus_distances).all()


def test_progress_tells_the_best_plan_and_the_best_bound_so_far():
    polished = 0
    for seed in range(25):
        problem, log = random_problem(seed, 60, 6, share=0.6, lens=SHALLOW), Log()
        solution = optimal.solve(problem, replace(EXACT, gap=0.002 * (seed % 3)), log)
        assert solution.converged
        costs, bounds = (
            [getattr(p, name) for p in log.progress] for name in ("cost", "lower_bound")
        )
        assert (np.diff(costs) <= 0).all()
        assert (np.diff(bounds) >= 0).all()
        assert bounds[-1] <= solution.cost <= costs[-1] + 1e-9
        iterations = [progress.iteration for progress in log.progress]
        assert iterations == list(range(1, len(iterations) + 1))
        assert solution.iterations == len(iterations)
        after = log.stages[log.stages.index("prices") :] if "prices" in log.stages else []
        polished += "k_view" in after
    assert polished > 10


def test_the_gap_tells_when_to_end():
    problem = random_problem(2, 80, 8, share=0.6, lens=SHALLOW)
    best, steps = optimal.solve(problem, replace(EXACT, gap=1e-5)), []
    for gap in (1e-5, 0.01, 0.05, 0.5):
        solution = optimal.solve(problem, Options(gap=gap))
        assert solution.converged
        assert solution.cost - solution.lower_bound <= gap * solution.cost
        assert best.lower_bound - 1e-9 <= solution.cost <= best.cost / (1 - gap)
        assert solution.lower_bound <= best.cost
        steps.append(solution.iterations)
    assert steps == sorted(steps, reverse=True)
    assert len(set(steps)) == 4


@pytest.mark.parametrize("seed", range(1, 4))
def test_a_gap_that_is_reached_is_no_larger_than_asked(seed):
    problem = problem_of(body("arms_out"), cylinder_rig(), 1000, seed)
    solution = optimal.solve(problem, Options(gap=1e-6))
    assert solution.converged
    assert (solution.cost - solution.lower_bound) / solution.cost <= 1e-6


def test_prices_of_a_solution_give_the_same_optimum_sooner():
    problem = problem_of(body("arms_out"), cylinder_rig(3, 8), 500)
    cold_log, warm_log = Log(), Log()
    cold = optimal.solve(problem, Options(), cold_log)
    assert (cold.prices >= 0).all()
    assert (cold.prices <= 1).all()
    warm = optimal.solve(problem, Options(prices=cold.prices), warm_log)
    assert cold.converged
    assert warm.converged
    assert warm.cost == pytest.approx(cold.cost, rel=1e-6)
    assert warm_log.stages.count("prices") < cold_log.stages.count("prices")
    bounds = [
        [p.lower_bound for p in log.progress if p.stage == "prices"] for log in (cold_log, warm_log)
    ]
    assert bounds[1][0] >= bounds[0][-1] - 1e-9 > bounds[0][0]


def test_a_bound_from_any_prices_is_a_bound():
    for seed in range(300):
        problem, random = tiny_problem(seed), np.random.default_rng(seed)
        prices = random.random(problem.sample_count) * random.choice([0.0, 0.3, 1.0])
        solution = optimal.solve(problem, replace(EXACT, prices=prices))
        check(problem, solution, least_cost(problem))
        assert solution.converged


def test_what_needs_no_bound_from_prices_returns_none():
    one = optimal.solve(random_problem(0, 30, 1, share=1.0, lens=Lens(0.05, 2.0)))
    assert one.converged
    assert one.prices is None
    assert one.lower_bound == pytest.approx(one.cost, abs=1e-8)


def test_k_scope_and_shots_change_no_optimum():
    problem = with_shots(random_problem(3, 20, 3, share=0.8, lens=SHALLOW), 2)
    costs = {
        optimal.solve(problem, Options(k=k, scope=scope, gap=0.0)).cost
        for k in (2, 3)
        for scope in ("all", "assigned")
    }
    assert len(costs) == 1


def test_any_start_ends_at_the_optimum():
    for seed in range(40):
        problem, random = tiny_problem(seed), np.random.default_rng(seed)
        start = random.uniform(0.4, 1.0, problem.camera_count)
        solution = optimal.solve(problem, replace(EXACT, start=start))
        assert solution.cost == pytest.approx(least_cost(problem), abs=1e-8)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_search_repeats_bit_for_bit(threads, monkeypatch):
    monkeypatch.setattr(compiling, "_PARALLEL_PAIRS", 0 if threads == 2 else 2**62)
    problem = problem_of(body("arms_out"), cylinder_rig(4, 9), 400)

    def run():
        log = Log()
        solution = optimal.solve(problem, Options(gap=1e-5), log)
        return solution, log.progress

    (a, told_a), (b, told_b) = run(), with_threads(threads, run)
    assert told_a == told_b
    for field in fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        assert x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else x == y, field.name


def test_without_room_for_nodes_it_ends_unproven(monkeypatch):
    monkeypatch.setattr(branching, "_OPEN_BYTES", 0)
    visible = ring_mask(400, 20)
    problem, log = random_problem(0, 400, 20, visible=visible, lens=SHALLOW), Log()
    solution = optimal.solve(problem, EXACT, log)
    assert log.stages[-1] == "branching"
    assert not solution.converged
    assert 0.9 * solution.cost < solution.lower_bound < solution.cost
    assert solution.cost <= em.solve(problem).cost


def test_of_a_large_rig_every_step_is_within_the_bound():
    problem, log = random_problem(7, 2000, 60, visible=ring_mask(2000, 60)), Log(400)
    solution = optimal.solve(problem, EXACT, log)
    assert solution.lower_bound <= solution.cost <= k_view.solve(problem).cost + 1e-9
    assert solution.cost - solution.lower_bound < 0.03 * solution.cost
    table = reference.table(problem)
    assert solution.cost == pytest.approx(reference.cost(table, solution.focus_distances))


def test_where_there_is_no_time_to_polish_a_plan_from_prices_is_kept():
    problem = problem_of(body("arms_out"), cylinder_rig(), 1000)
    solution = optimal.solve(problem, EXACT, lambda progress: progress.stage != "k_view")
    assert not solution.converged
    assert solution.cost < 0.99 * em.solve(problem).cost
    assert solution.lower_bound <= solution.cost
