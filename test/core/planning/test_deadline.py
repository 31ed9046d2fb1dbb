"""Deadlines, by a clock that the tests move."""

import math

import pytest

from focus_planner.core.planning import deadline
from focus_planner.core.planning.deadline import FRESH_SHARE, SAMPLES_SHARE, Deadline
from focus_planner.core.solvers import Progress, never_stop


class Clock:
    """Stands for the module ``time``."""

    def __init__(self):
        self.now = 1000.0

    def perf_counter(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(deadline, "time", clock)
    return clock


def steps_until_told_no(clock, kept, step, stage="em", most=1000):
    """Tell of steps of equal length; return how many were begun."""
    for count in range(1, most):
        clock.now += step
        if not kept(Progress(stage, count, 1.0)):
            return count
    return math.inf


def test_without_a_deadline_nothing_ends(clock):
    kept = Deadline(math.inf, never_stop)
    for share in (FRESH_SHARE, SAMPLES_SHARE):
        assert kept.within("visibility", share)()
    kept.allow_for(1e6, bound=True)
    assert steps_until_told_no(clock, kept, 1e6) == math.inf
    kept.bound_now()
    assert steps_until_told_no(clock, kept, 1e6, "prices") == math.inf
    assert not kept.stopped
    assert not kept.shortened


@pytest.mark.parametrize("share", [FRESH_SHARE, SAMPLES_SHARE, 1.0])
def test_a_stage_takes_its_share_from_the_start(clock, share):
    kept = Deadline(10.0, never_stop)
    clock.now = 1000.0 + 10 * share - 0.01
    go_on_now = kept.within("visibility", share)
    assert go_on_now()
    assert not kept.shortened
    clock.now += 0.02
    assert not go_on_now()
    assert kept.shortened


def test_what_an_earlier_stage_left_out_is_not_forgotten(clock):
    kept = Deadline(10.0, never_stop)
    fresh, visibility = (kept.within(s, share) for s, share in (("fresh", 0.1), ("visible", 0.9)))
    clock.now += 2
    assert not fresh()
    assert visibility()
    assert kept.shortened


def test_the_next_step_has_to_end_in_time_if_it_takes_as_long_and_half(clock):
    for step in (0.3, 0.7, 1.3):
        kept = Deadline(10.0, never_stop)
        steps = steps_until_told_no(clock, kept, step)
        assert steps * step + 1.5 * step > 10
        assert (steps - 1) * step + 1.5 * step <= 10
        assert kept.stopped


def test_a_step_is_judged_by_the_last_one(clock):
    kept = Deadline(10.0, never_stop)
    clock.now += 5
    assert not kept(Progress("em", 1, 1.0))
    quicker = Deadline(10.0, never_stop)
    for _ in range(50):
        clock.now += 0.1
        assert quicker(Progress("em", 1, 1.0))


def test_once_told_no_a_solver_is_told_no_again(clock):
    kept = Deadline(10.0, never_stop)
    clock.now += 9
    assert not kept(Progress("em", 1, 1.0))
    assert not kept(Progress("em", 2, 1.0))  # though this one took no time at all


def tell(clock, kept, stage, at, last=0.001):
    """Tell, some seconds after the start, of a step that took so long."""
    clock.now = kept.started + at - last
    kept._last = clock.now
    clock.now += last
    return kept(Progress(stage, 1, 1.0))


def test_a_new_stage_takes_some_setting_up(clock):
    # Cells took 2 s: 0.5 s are kept to wind up, and a stage needs 1.6 s before its first step.
    for at, expected in ((97.89, True), (97.91, False)):
        kept = Deadline(100.0, never_stop)
        kept.allow_for(2.0)
        assert tell(clock, kept, "em", at) is expected
    kept = Deadline(100.0, never_stop)
    kept.allow_for(2.0)
    assert tell(clock, kept, "em", 90.0)
    assert tell(clock, kept, "em", 99.0)  # the same stage
    assert not tell(clock, kept, "k_view", 99.1)
    kept = Deadline(100.0, never_stop)
    kept.allow_for(2.0)
    assert not tell(clock, kept, "em", 90.0, last=7.0)  # whichever is longer


@pytest.mark.parametrize(
    ("stage", "shots", "set_up"),
    [("k_view", 1, 1.6), ("k_view, triples", 1, 16.0), ("k_view", 3, 4.8), ("prices", 3, 4.8)],
)
def test_triples_and_shots_take_longer_to_set_up(clock, stage, shots, set_up):
    for early, expected in ((0.01, True), (-0.01, False)):
        kept = Deadline(100.0, never_stop)
        kept.allow_for(2.0, shots=shots)
        assert tell(clock, kept, "em", 50.0)
        assert tell(clock, kept, stage, 100 - 0.5 - set_up - early) is expected


def test_time_is_kept_to_wind_up(clock):
    for at, expected in ((98.9, True), (99.1, False)):
        kept = Deadline(100.0, never_stop)
        kept.allow_for(4.0)
        assert tell(clock, kept, "em", 50.0)
        assert tell(clock, kept, "em", at) is expected


@pytest.mark.parametrize(("cells", "reserve"), [(0.2, 0.2), (8.0, (10 - 2) / 3)])
def test_a_bound_has_as_long_as_cells_took_but_no_more_than_a_third(clock, cells, reserve):
    kept = Deadline(10.0, never_stop)
    kept.allow_for(cells, bound=True)
    end = 10 - 0.25 * cells - reserve
    kept._stage = "em"
    steps = steps_until_told_no(clock, kept, 0.01, most=2000) * 0.01
    assert end - 0.03 < steps <= end
    assert kept.stopped
    kept.bound_now()
    assert not kept.stopped
    kept._stage = "prices"
    steps += steps_until_told_no(clock, kept, 0.01, "prices", most=2000) * 0.01
    assert 10 - 0.25 * cells - 0.03 < steps <= 10 - 0.25 * cells


def test_a_bound_that_comes_too_late_takes_nothing(clock):
    kept = Deadline(1.0, never_stop)
    clock.now += 5
    kept.allow_for(1.0, bound=True)
    assert kept._reserve == 0.25


def test_a_watch_hears_what_solvers_tell_and_is_not_asked_after_it_said_no(clock):
    heard = []

    def on_progress(progress):
        heard.append(progress)
        return len(heard) < 3

    kept = Deadline(math.inf, on_progress)
    part = kept.within("visibility", 0.5)
    assert part()
    told = Progress("em", 1, 3.0, 2.0)
    assert kept(told)
    assert not kept(told)
    assert [(p.stage, p.iteration) for p in heard] == [("visibility", 1), ("em", 1), ("em", 1)]
    assert math.isnan(heard[0].cost)
    assert heard[1] is told
    kept.allow_for(0.0, bound=True)
    assert not kept(told)
    kept.bound_now()
    assert kept.stopped
    assert not kept(told)
    assert not part()
    assert kept.shortened
    assert len(heard) == 3


def test_a_watch_is_told_even_when_it_is_late(clock):
    heard = []
    kept = Deadline(1.0, lambda progress: heard.append(progress) or True)
    clock.now += 2
    assert not kept(Progress("em", 1, 1.0))
    kept.bound_now()
    assert not kept(Progress("prices", 1, 1.0, 0.5))
    assert len(heard) == 2


def test_answers_are_kept_in_runs_and_given_again(clock):
    kept = Deadline(1.0, never_stop)
    part = kept.within("visibility", 0.5)
    asked = [part, lambda: kept(Progress("em", 1, 1.0))]
    script = [(0, 0.1), (0, 0.1), (1, 0.1), (0, 0.5), (1, 0.5), (1, 0.0)]
    said = []
    for which, seconds in script:
        clock.now += seconds
        said.append(asked[which]())
    assert said == [True, True, True, False, False, False]
    assert kept.answers == (3, 3)
    kept.bound_now()
    assert not kept(Progress("prices", 1, 1.0))
    assert kept.answers == (3, 4)

    clock.now += 1000
    again = Deadline(1.0, never_stop, kept.answers)
    part = again.within("visibility", 0.5)
    asked = [part, lambda: again(Progress("em", 1, 1.0))]
    assert [asked[which]() for which, _ in script] == said
    assert again.shortened
    assert again.stopped
    again.bound_now()
    assert not again.stopped
    assert not again(Progress("prices", 1, 1.0))
    assert again.answers == kept.answers
    # What was not asked then is not refused now.
    assert again(Progress("prices", 2, 1.0)) is True


def test_a_first_no_is_a_run_too(clock):
    kept = Deadline(1.0, never_stop)
    clock.now += 2
    assert not kept(Progress("em", 1, 1.0))
    assert kept.answers == (0, 1)
    again = Deadline(math.inf, never_stop, (0, 1))
    assert not again(Progress("em", 1, 1.0))


def test_a_watch_that_says_no_is_obeyed_where_answers_are_given_again(clock):
    again = Deadline(math.inf, lambda _: False, (5,))
    assert not again(Progress("em", 1, 1.0))
    assert again.answers == (0, 0, 0, 1)


@pytest.mark.parametrize("before", [0, 1, 3])
@pytest.mark.parametrize("late", [False, True])
def test_where_the_watch_said_no_is_kept_and_given_again(clock, before, late):
    left = before

    def on_progress(_):
        nonlocal left
        left -= 1
        return left >= 0

    kept = Deadline(10.0, on_progress)
    question = kept.within("visibility", 1.0)
    told = []
    for _ in range(before + 2):
        clock.now += 10.0 if late else 0.1
        told.append((question(), kept.told_no, kept.enough()))
    assert told[before:] == [(False, True, 4096)] * 2
    assert [each[1] for each in told[:before]] == [False] * before
    again = Deadline(math.inf, never_stop, kept.answers)
    question = again.within("visibility", 1.0)
    assert [(question(), again.told_no, again.enough()) for _ in told] == told
    assert again.answers == kept.answers


@pytest.mark.parametrize("before", [0, 1, 3])
@pytest.mark.parametrize("late", [False, True])
def test_where_the_watch_alone_is_asked_only_its_no_is_kept(clock, before, late):
    kept = Deadline(10.0, lambda progress: progress.iteration < before + 4)

    def told(deadline):
        question, answers = deadline.within("visibility", 1.0), []
        for _ in range(before):
            clock.now += 10.0 if late else 0.1
            answers.append(question())
        assert not deadline.told_no
        cells = [deadline.asked("cells") for _ in range(5)]
        assert deadline.told_no
        return answers, cells, deadline(Progress("em", 1, 1.0))

    assert told(kept) == ([not late] * before, [True, True, True, False, False], False)
    again = Deadline(math.inf, never_stop, kept.answers)
    # Not after as many questions: what follows is the same.
    assert told(again) == ([not late] * before, [False] * 5, False)
    assert again.answers == kept.answers


def test_a_plan_without_such_questions_is_made_again_with_them(clock):
    again = Deadline(math.inf, never_stop, (2, 1, 1, 1))
    question = again.within("visibility", 1.0)
    assert [question() for _ in range(3)] == [True, True, False]
    assert again.asked("cells")
    assert again(Progress("em", 1, 1.0))
    assert not again(Progress("em", 2, 1.0))


def test_a_clock_that_said_no_is_no_watch_that_did(clock):
    kept = Deadline(1.0, never_stop)
    clock.now += 2.0
    assert not kept.within("visibility", 0.5)()
    assert not kept.told_no
    assert kept.enough() == math.inf
    assert kept.asked("cells")  # whatever the time
    again = Deadline(math.inf, never_stop, kept.answers)
    assert not again.within("visibility", 0.5)()
    assert not again.told_no


def test_a_watch_is_told_before_solving_begins(clock):
    heard = []
    kept = Deadline(math.inf, lambda progress: heard.append(progress) or True)
    kept.allow_for(1.0)
    assert [(p.stage, p.iteration) for p in heard] == [("solving", 0)]
    assert math.isnan(heard[0].cost)
    assert kept.answers == (0,)


def test_what_a_pilot_had_no_time_for_does_not_stop_the_solver(clock):
    kept = Deadline(1.0, never_stop)
    clock.now += 0.5
    assert not kept(Progress("em", 1, 1.0))  # would take 0.75 s
    kept.allow_for(0.01)
    clock.now += 0.01
    assert kept(Progress("em", 1, 1.0))
