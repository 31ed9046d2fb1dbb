"""What HiGHS makes of what is left, against all plans there are."""

import subprocess
import sys

import highspy
import numpy as np
import pytest
import reference
from core.build import random_problem, ring_mask, tiny_problem

from focus_planner import Lens
from focus_planner.core.proof import program
from focus_planner.core.proof.gains import gains_of
from focus_planner.core.proof.prices import Prices
from focus_planner.core.proof.program import Program
from focus_planner.core.solvers import Options, optimal

SHALLOW = Lens(0.05, 40.0)


def prices_of(gains, steps, goal=0):
    prices = Prices(gains)
    prices.descend(goal)
    while prices.steps < steps and not prices.settled(goal):
        prices.descend(goal)
    return prices


def larger(seed=0, samples=150, cameras=12):
    """Gains, and prices with a gap that takes HiGHS several rounds of cuts."""
    mask = ring_mask(samples, cameras)
    gains = gains_of(random_problem(seed, samples, cameras, visible=mask, lens=SHALLOW))
    prices = prices_of(gains, 400)
    return gains, prices, int(0.93 * prices.bound)


class Asked:
    """Says yes so many times; counts."""

    def __init__(self, times=np.inf):
        self.times, self.count = times, 0

    def __call__(self):
        self.count += 1
        return self.count < self.times


@pytest.fixture
def statuses(monkeypatch):
    """What HiGHS ended with, run by run."""
    seen, run = [], highspy.Highs.run

    def remember(self):
        result = run(self)
        seen.append(self.getModelStatus())
        return result

    monkeypatch.setattr(highspy.Highs, "run", remember)
    return seen


def test_the_best_plan_is_found_and_proven(statuses):
    found = refuted = 0
    for seed in range(90):
        gains = gains_of(tiny_problem(seed))
        most = reference.largest_gain(gains)
        for steps in (1, 60):  # much slack, and little
            prices = prices_of(gains, steps, most)
            goals = {0, most // 2, most - 1, most, most + 3, prices.bound}
            for goal in sorted(g for g in goals if 0 <= g <= prices.bound):
                asked = Asked()
                bound, cell = Program(gains, prices.price, prices.bound, goal).solve(asked)
                assert bound >= max(most, goal)
                assert bound <= max(most, goal) * (1 + 3e-8) + 2
                if cell is not None:
                    gained = reference.cells_gain(gains, cell)
                    assert gained >= most * (1 - 1e-9)
                    found += 1
                else:
                    assert most <= goal * (1 + 2e-8) + 1
                    refuted += 1
    assert found > 150
    assert refuted > 150
    status = highspy.HighsModelStatus
    assert {status.kOptimal, status.kInfeasible} <= set(statuses)


def test_larger_problems_have_the_optimum_that_the_oracle_finds():
    for seed in range(6):
        problem = random_problem(seed, 40, 6, share=0.6, lens=SHALLOW)
        gains = gains_of(problem)
        best, _ = reference.optimum(reference.table(problem))
        prices = prices_of(gains, 100)
        bound, cell = Program(gains, prices.price, prices.bound, prices.bound // 2).solve(Asked())
        scale = program._SCALE
        assert scale * (gains.out - bound) == pytest.approx(best, abs=1e-4)
        gained = reference.cells_gain(gains, cell)
        assert scale * (gains.out - gained) == pytest.approx(best, abs=1e-4)
        assert gained <= bound


def test_interrupted_whenever_bound_and_plan_are_valid(statuses):
    gains, prices, goal = larger()
    whole = Asked()
    most, best = Program(gains, prices.price, prices.bound, goal).solve(whole)
    assert whole.count > 4
    assert reference.cells_gain(gains, best) == pytest.approx(most, rel=3e-8)
    plans = 0
    for times in range(1, whole.count):
        asked = Asked(times)
        bound, cell = Program(gains, prices.price, prices.bound, goal).solve(asked)
        assert asked.count == times
        assert statuses[-1] == highspy.HighsModelStatus.kInterrupt
        assert bound >= reference.cells_gain(gains, best)
        if cell is not None:
            plans += 1
            assert goal < reference.cells_gain(gains, cell) <= bound
    assert plans


def test_interrupted_at_once_nothing_is_claimed():
    for seed in range(60):
        gains = gains_of(tiny_problem(seed))
        most = reference.largest_gain(gains)
        prices = prices_of(gains, 1, most)
        bound, cell = Program(gains, prices.price, prices.bound, 0).solve(lambda: False)
        assert bound >= most
        assert cell is None or 0 <= reference.cells_gain(gains, cell) <= most


def test_it_is_the_same_every_time():
    gains, prices, goal = larger(1)
    runs = []
    for _ in range(2):
        asked = Asked()
        bound, cell = Program(gains, prices.price, prices.bound, goal).solve(asked)
        runs.append((bound, cell.tobytes(), asked.count))
    assert runs[0] == runs[1]


def test_a_goal_that_no_plan_exceeds_is_proven():
    gains, prices, goal = larger(2, 60, 6)
    most, _ = Program(gains, prices.price, prices.bound, goal).solve(Asked())
    between = most + (prices.bound - most) // 2
    assert between < prices.bound
    bound, cell = Program(gains, prices.price, prices.bound, between).solve(Asked())
    assert (bound, cell) == (between, None)


def test_what_cannot_be_part_of_a_better_plan_is_left_out():
    gains, prices, _ = larger(3)
    wide = Program(gains, prices.price, prices.bound, 0)
    narrow = Program(gains, prices.price, prices.bound, int(0.99 * prices.bound))
    assert narrow.size < wide.size
    at_bound = Program(gains, prices.price, prices.bound, prices.bound)
    assert at_bound.size < narrow.size
    assert (np.diff(at_bound._cell_offsets) >= 1).all()
    dear = Program(gains, gains.most.copy(), int(gains.most.sum()), int(gains.most.sum()))
    assert dear.size <= len(gains.gain)


def test_cameras_without_cells_have_none():
    seen = 0
    for seed in range(40):
        problem = random_problem(seed, 14, 4, share=0.9, lens=SHALLOW)
        blind = problem.camera_index == seed % 4
        problem.focus_near[blind], problem.focus_far[blind] = np.inf, -np.inf
        gains = gains_of(problem)
        counts = np.diff(gains.cell_offsets)
        prices = prices_of(gains, 20)
        _, cell = Program(gains, prices.price, prices.bound, 0).solve(Asked())
        assert cell.dtype == np.int32
        assert cell[seed % 4] == -1
        assert (np.delete(cell, seed % 4) >= 0).all()
        assert (cell < counts).all()
        seen += 1
    assert seen == 40


def test_with_nothing_to_gain_the_goal_is_all():
    problem = random_problem(0, 20, 3, share=0.8)
    problem.focus_near[:], problem.focus_far[:] = np.inf, -np.inf
    gains = gains_of(problem)
    assert Program(gains, gains.most, 0, 0).solve(Asked()) == (0, None)
    nobody = gains_of(random_problem(0, 20, 3, share=0.0))
    assert Program(nobody, nobody.most, 0, 0).solve(Asked()) == (0, None)


@pytest.mark.parametrize("error", [KeyError, KeyboardInterrupt])
def test_what_the_watch_raises_comes_through(error):
    gains, prices, goal = larger(4)

    def fail():
        raise error

    left = Program(gains, prices.price, prices.bound, goal)
    with pytest.raises(error):
        left.solve(fail)
    bound, cell = left.solve(Asked())
    assert reference.cells_gain(gains, cell) <= bound < prices.bound


_WITH_OTHER_THREADS = """
import highspy
from core.proof.test_program import Asked, larger
from focus_planner.core.proof.program import Program
other = highspy.Highs()
other.setOptionValue("output_flag", False)
other.setOptionValue("threads", 2)
other.addVar(0, 1)
other.run()
gains, prices, goal = larger()
bound, cell = Program(gains, prices.price, prices.bound, goal).solve(Asked())
print(bound >= prices.bound, cell is None)
"""


def test_where_highs_refuses_to_run_nothing_is_claimed(request):
    # It does once something else in the process has used it with another number of threads.
    done = subprocess.run(
        [sys.executable, "-c", _WITH_OTHER_THREADS],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": ":".join(path for path in sys.path if path)},
    )
    assert done.stdout.split() == ["True", "True"]


def test_optimal_leaves_small_rests_to_it(monkeypatch):
    solved, solve = [], Program.solve

    def remember(left, go_on):
        solved.append(solve(left, go_on))
        return solved[-1]

    monkeypatch.setattr(Program, "solve", remember)
    monkeypatch.setattr(optimal, "_PATIENT_NODES", 1)
    for seed in range(150):
        problem = tiny_problem(20_000 + seed)
        solution = optimal.solve(problem, Options(gap=0.0))
        gains = gains_of(problem)
        best = program._SCALE * (gains.out - reference.largest_gain(gains))
        assert solution.converged
        assert solution.cost == pytest.approx(best, abs=1e-8)
        assert solution.lower_bound <= best + 1e-9
    assert len(solved) > 10
