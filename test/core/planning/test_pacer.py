# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Who is asked whether to go on, and what is logged, by a clock that the tests move."""

import math

import pytest

from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.planning.stop_log import Answer, Entry, StopLog
from focus_planner.core.planning.time_budget import FRESH_SHARE, SAMPLES_SHARE, TimeBudget
from focus_planner.core.progress import Progress, never_stop
from testing.clock import Clock

STEP = Progress("em", 1, 1.0)


@pytest.fixture
def clock():
    return Clock()


def paced(clock, seconds=math.inf, on_progress=never_stop, replayed=None):
    return Pacer(TimeBudget(seconds, clock), on_progress, replayed)


def counts(pacer):
    return pacer.stop_log.to_counts()


def test_without_a_limit_nothing_is_stopped(clock):
    pacer = paced(clock)
    for share in (FRESH_SHARE, SAMPLES_SHARE):
        assert pacer.within("visibility", share)(0.5)
    assert pacer.untimed("cells")()
    pacer.start_solver(1e6, bound=True)
    for _ in range(10):
        clock.now += 1e6
        assert pacer(STEP)
    pacer.start_bound()
    assert pacer(STEP)
    assert not pacer.stopped
    assert not pacer.samples_left_out
    assert counts(pacer) == (13,)
    assert not pacer.stop_log.stopped


def test_what_can_end_a_plan_early_is_known_beforehand(clock):
    assert not paced(clock).may_stop
    assert paced(clock, 1.0).may_stop
    assert paced(clock, on_progress=lambda _: True).may_stop
    assert paced(clock, replayed=StopLog()).may_stop


def test_a_stage_takes_its_share(clock):
    pacer = paced(clock, 10.0)
    keep_going = pacer.within("visibility", 0.5)
    clock.now += 4.99
    assert keep_going(0.5)
    assert not pacer.samples_left_out
    clock.now += 0.02
    assert not keep_going(0.5)
    assert pacer.samples_left_out


def test_what_an_earlier_stage_left_out_is_not_forgotten(clock):
    pacer = paced(clock, 10.0)
    fresh, visibility = (pacer.within(s, share) for s, share in (("fresh", 0.1), ("visible", 0.9)))
    clock.now += 2
    assert not fresh(0.5)
    assert visibility(0.5)
    assert pacer.samples_left_out


def test_a_solver_is_stopped_for_good(clock):
    pacer = paced(clock, 10.0)
    clock.now += 9
    assert not pacer(STEP)
    assert pacer.stopped
    assert not pacer(STEP)  # though this step took no time at all


def test_a_bound_starts_afresh(clock):
    pacer = paced(clock, 10.0)
    pacer.start_solver(1.0, bound=True)
    clock.now += 8.5
    assert not pacer(STEP)
    pacer.start_bound()
    assert not pacer.stopped
    clock.now += 0.1
    assert pacer(Progress("prices", 1, 1.0))


def test_what_a_pilot_had_no_time_for_does_not_stop_the_solver(clock):
    pacer = paced(clock, 1.0)
    clock.now += 0.5
    assert not pacer(STEP)  # would take 0.75 s
    pacer.start_solver(0.01)
    clock.now += 0.01
    assert pacer(STEP)


def test_a_callback_gets_what_solvers_report_and_is_not_called_after_it_stopped(clock):
    heard = []

    def on_progress(progress):
        heard.append(progress)
        return len(heard) < 3

    pacer = paced(clock, on_progress=on_progress)
    keep_going = pacer.within("visibility", 0.5)
    assert keep_going(0.5)
    step = Progress("em", 1, 3.0, 2.0)
    assert pacer(step)
    assert not pacer(step)
    assert [(p.stage, p.iteration) for p in heard] == [("visibility", 1), ("em", 1), ("em", 1)]
    assert math.isnan(heard[0].cost)
    assert heard[1] is step
    pacer.start_solver(0.0, bound=True)
    assert not pacer(step)
    pacer.start_bound()
    assert pacer.stopped
    assert not pacer(step)
    assert not keep_going(0.5)
    assert pacer.samples_left_out
    assert len(heard) == 3


def test_a_callback_is_called_even_when_time_is_up(clock):
    heard = []
    pacer = paced(clock, 1.0, lambda progress: heard.append(progress) or True)
    clock.now += 2
    assert not pacer(STEP)
    pacer.start_bound()
    assert not pacer(Progress("prices", 1, 1.0, 0.5))
    assert len(heard) == 2


def test_a_callback_is_called_before_solving_begins(clock):
    heard = []
    pacer = paced(clock, on_progress=lambda progress: heard.append(progress) or True)
    pacer.start_solver(1.0)
    assert [(p.stage, p.iteration) for p in heard] == [("solving", 0)]
    assert math.isnan(heard[0].cost)
    assert pacer.stop_log == StopLog()


def test_a_stop_before_solving_is_replayed_at_the_first_step(clock):
    pacer = paced(clock, on_progress=lambda progress: progress.stage != "solving")
    again = paced(clock, replayed=StopLog.from_counts((0, 0, 0, 1)))
    for each, stopped in ((pacer, True), (again, False)):
        each.start_solver(1.0)
        assert each.stopped is each.callback_stopped is stopped
        assert not each(STEP)
        assert each.callback_stopped
        assert counts(each) == (0, 0, 0, 1)


def test_the_time_budgets_answers_are_logged_and_given_again(clock):
    pacer = paced(clock, 1.0)
    keep_going = pacer.within("visibility", 0.5)
    asked = [lambda: keep_going(0.5), lambda: pacer(STEP)]
    script = [(0, 0.1), (0, 0.1), (1, 0.1), (0, 0.5), (1, 0.5), (1, 0.0)]
    answered = []
    for which, seconds in script:
        clock.now += seconds
        answered.append(asked[which]())
    assert answered == [True, True, True, False, False, False]
    assert pacer.stop_log == StopLog((Entry(Answer.CONTINUE, 3), Entry(Answer.STOP, 3)))
    pacer.start_bound()
    assert not pacer(Progress("prices", 1, 1.0))
    assert counts(pacer) == (3, 4)

    clock.now += 1000
    again = paced(clock, 1.0, replayed=pacer.stop_log)
    keep_going = again.within("visibility", 0.5)
    asked = [lambda: keep_going(0.5), lambda: again(STEP)]
    assert [asked[which]() for which, _ in script] == answered
    assert again.samples_left_out
    assert again.stopped
    again.start_bound()
    assert not again.stopped
    assert not again(Progress("prices", 1, 1.0))
    assert again.stop_log == pacer.stop_log
    # What was not asked then is not stopped now.
    assert again(Progress("prices", 2, 1.0))


def test_a_stop_at_the_first_question_is_logged_too(clock):
    pacer = paced(clock, 1.0)
    clock.now += 2
    assert not pacer(STEP)
    assert counts(pacer) == (0, 1)
    assert not paced(clock, replayed=pacer.stop_log)(STEP)


def test_a_callback_may_stop_a_replay(clock):
    again = paced(clock, on_progress=lambda _: False, replayed=StopLog.from_counts((5,)))
    assert not again(STEP)
    assert counts(again) == (0, 0, 0, 1)


@pytest.mark.parametrize("before", [0, 1, 3])
@pytest.mark.parametrize("late", [False, True])
def test_where_the_callback_stopped_is_logged_and_replayed(clock, before, late):
    left = before

    def on_progress(_):
        nonlocal left
        left -= 1
        return left >= 0

    pacer = paced(clock, 10.0, on_progress)
    keep_going = pacer.within("visibility", 1.0)
    answered = []
    for _ in range(before + 2):
        clock.now += 10.0 if late else 0.1
        answered.append((keep_going(0.5), pacer.callback_stopped, pacer.enough()))
    assert answered[before:] == [(False, True, 4096)] * 2
    assert [stopped for _, stopped, _ in answered[:before]] == [False] * before
    again = paced(clock, replayed=pacer.stop_log)
    keep_going = again.within("visibility", 1.0)
    assert [(keep_going(0.5), again.callback_stopped, again.enough()) for _ in answered] == answered
    assert again.stop_log == pacer.stop_log


@pytest.mark.parametrize("before", [0, 1, 3])
@pytest.mark.parametrize("late", [False, True])
def test_of_untimed_questions_only_a_stop_is_logged(clock, before, late):
    pacer = paced(clock, 10.0, lambda progress: progress.iteration < before + 4)

    def ask(pacer):
        keep_going, answers = pacer.within("visibility", 1.0), []
        for _ in range(before):
            clock.now += 10.0 if late else 0.1
            answers.append(keep_going(0.5))
        assert not pacer.callback_stopped
        cells = pacer.untimed("cells")
        found = [cells() for _ in range(5)]
        assert pacer.callback_stopped
        return answers, found, pacer(STEP)

    assert ask(pacer) == ([not late] * before, [True, True, True, False, False], False)
    again = paced(clock, replayed=pacer.stop_log)
    # Not after as many questions, but what follows is the same.
    assert ask(again) == ([not late] * before, [False] * 5, False)
    assert again.stop_log == pacer.stop_log


def test_logs_from_before_there_were_untimed_questions_are_replayed(clock):
    again = paced(clock, replayed=StopLog.from_counts((2, 1, 1, 1)))
    keep_going = again.within("visibility", 1.0)
    assert [keep_going(0.5) for _ in range(3)] == [True, True, False]
    assert again.untimed("cells")()
    assert again(STEP)
    assert not again(STEP)


def test_a_stop_by_the_time_budget_is_not_one_by_the_callback(clock):
    pacer = paced(clock, 1.0)
    clock.now += 2.0
    assert not pacer.within("visibility", 0.5)(0.5)
    assert not pacer.callback_stopped
    assert pacer.enough() == math.inf
    assert pacer.untimed("cells")()  # whatever the time
    again = paced(clock, replayed=pacer.stop_log)
    assert not again.within("visibility", 0.5)(0.5)
    assert not again.callback_stopped
