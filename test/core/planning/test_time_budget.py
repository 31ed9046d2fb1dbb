# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How a time budget is divided, by a clock that the tests move."""

import math
import time

import pytest

from focus_planner.core.planning.time_budget import FRESH_SHARE, SAMPLES_SHARE, TimeBudget
from testing.clock import Clock


@pytest.fixture
def clock():
    return Clock()


def seconds_until_none_fits(clock, budget, step, stage="em", at_most=1000):
    """Take steps of equal length for as long as the next fits; return the time at the last."""
    for _ in range(at_most):
        clock.now += step
        if not budget.next_step_fits(stage):
            return budget.elapsed()
    return math.inf


def step_fits(clock, budget, stage, at, last=0.001):
    """Return whether a step fits at this time, after one that took so long."""
    clock.now = budget.started + at - last
    budget._last_step = clock.now
    clock.now += last
    return budget.next_step_fits(stage)


def test_without_a_limit_everything_fits(clock):
    budget = TimeBudget(math.inf, clock)
    assert not budget.limited
    assert all(budget.has_share_left(share) for share in (FRESH_SHARE, SAMPLES_SHARE))
    budget.start_solver(1e6, bound=True)
    assert seconds_until_none_fits(clock, budget, 1e6) == math.inf
    budget.start_bound()
    assert seconds_until_none_fits(clock, budget, 1e6, "prices") == math.inf
    assert budget.has_share_left(FRESH_SHARE)


def test_elapsed_time_is_by_the_clock(clock):
    budget = TimeBudget(10.0, clock)
    assert (budget.started, budget.elapsed(), budget.limited) == (1000.0, 0.0, True)
    clock.now += 2.5
    assert budget.elapsed() == 2.5


def test_by_default_the_clock_runs():
    before = time.perf_counter()
    assert before <= TimeBudget().started <= time.perf_counter()


@pytest.mark.parametrize("share", [FRESH_SHARE, SAMPLES_SHARE, 1.0])
def test_shares_count_from_the_start(clock, share):
    budget = TimeBudget(10.0, clock)
    clock.now = 1000.0 + 10 * share - 0.01
    assert budget.has_share_left(share)
    clock.now += 0.02
    assert not budget.has_share_left(share)


@pytest.mark.parametrize("step", [0.3, 0.7, 1.3])
def test_the_next_step_has_to_end_in_time_even_if_it_takes_half_as_long_again(clock, step):
    seconds = seconds_until_none_fits(clock, TimeBudget(10.0, clock), step)
    assert seconds + 1.5 * step > 10 >= seconds - step + 1.5 * step


def test_a_step_is_judged_by_the_last_one(clock):
    budget = TimeBudget(10.0, clock)
    clock.now += 5
    assert not budget.next_step_fits("em")
    quicker = TimeBudget(10.0, clock)
    for _ in range(50):
        clock.now += 0.1
        assert quicker.next_step_fits("em")


def test_a_new_stage_takes_time_to_set_up(clock):
    # Cells took 2 s: 0.5 s are kept to wind up, and a stage needs 1.6 s before its first step.
    for at, expected in ((97.89, True), (97.91, False)):
        budget = TimeBudget(100.0, clock)
        budget.start_solver(2.0)
        assert step_fits(clock, budget, "em", at) is expected
    budget = TimeBudget(100.0, clock)
    budget.start_solver(2.0)
    assert step_fits(clock, budget, "em", 90.0)
    assert step_fits(clock, budget, "em", 99.0)  # the same stage
    assert not step_fits(clock, budget, "k_view", 99.1)
    budget = TimeBudget(100.0, clock)
    budget.start_solver(2.0)
    assert not step_fits(clock, budget, "em", 90.0, last=7.0)  # whichever is longer


@pytest.mark.parametrize(
    ("stage", "shots", "set_up"),
    [("k_view", 1, 1.6), ("k_view, triples", 1, 16.0), ("k_view", 3, 4.8), ("prices", 3, 4.8)],
)
def test_triples_and_shots_take_longer_to_set_up(clock, stage, shots, set_up):
    for early, expected in ((0.01, True), (-0.01, False)):
        budget = TimeBudget(100.0, clock)
        budget.start_solver(2.0, shots)
        assert step_fits(clock, budget, "em", 50.0)
        assert step_fits(clock, budget, stage, 100 - 0.5 - set_up - early) is expected


def test_time_is_reserved_to_wind_up(clock):
    for at, expected in ((98.9, True), (99.1, False)):
        budget = TimeBudget(100.0, clock)
        budget.start_solver(4.0)
        assert step_fits(clock, budget, "em", 50.0)
        assert step_fits(clock, budget, "em", at) is expected


@pytest.mark.parametrize(("cells", "reserve"), [(0.2, 0.2), (8.0, (10 - 2) / 3)])
def test_a_bound_has_as_long_as_cells_took_but_no_more_than_a_third(clock, cells, reserve):
    budget = TimeBudget(10.0, clock)
    budget.start_solver(cells, bound=True)
    end = 10 - 0.25 * cells - reserve
    budget._stage = "em"
    seconds = seconds_until_none_fits(clock, budget, 0.01, at_most=2000)
    assert end - 0.03 < seconds <= end
    budget.start_bound()
    budget._stage = "prices"
    seconds = seconds_until_none_fits(clock, budget, 0.01, "prices", at_most=2000)
    assert 10 - 0.25 * cells - 0.03 < seconds <= 10 - 0.25 * cells


def test_nothing_is_reserved_for_a_bound_that_comes_too_late(clock):
    budget = TimeBudget(1.0, clock)
    clock.now += 5
    budget.start_solver(1.0, bound=True)
    assert budget._reserve == 0.25
