# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Logs of where a plan was ended, and how recorded runs store them."""

from itertools import groupby

import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.core.planning.stop_log import (
    Answer,
    Entry,
    StopLog,
    StopRecorder,
    StopReplay,
)

CONTINUE, STOP = Answer.CONTINUE, Answer.STOP
CALLBACK_STOP, UNTIMED = Answer.CALLBACK_STOP, Answer.CALLBACK_STOP_UNTIMED


def log_of(*answers):
    return StopLog(tuple(Entry(a, len(list(group))) for a, group in groupby(answers)))


# Any answers by the time budget, and from where the callback stopped on nothing but STOP.
answers = st.builds(
    lambda timed, stop, stopped: timed + ([stop] + [STOP] * stopped if stop else []),
    st.lists(st.sampled_from([CONTINUE, STOP])),
    st.sampled_from([None, CALLBACK_STOP, UNTIMED]),
    st.integers(0, 4),
)
logs = answers.map(lambda each: log_of(*each))


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        ((), []),
        ((3,), [CONTINUE] * 3),
        ((0, 1), [STOP]),
        ((3, 2), [CONTINUE] * 3 + [STOP] * 2),
        ((2, 1, 1, 1), [CONTINUE, CONTINUE, STOP, CONTINUE, STOP]),
        ((0, 0, 0), [CALLBACK_STOP]),
        ((0, 0, 0, 1), [CALLBACK_STOP, STOP]),
        ((3, 0, 0, 1), [CONTINUE] * 3 + [CALLBACK_STOP, STOP]),
        ((0, 2, 0, 0, 0, 1), [STOP] * 2 + [CALLBACK_STOP, STOP]),
        ((1, 2, 0, 0, 0, 2), [CONTINUE] + [STOP] * 2 + [CALLBACK_STOP] + [STOP] * 2),
        ((0, 0, 0, 0, 0), [UNTIMED]),
        ((3, 0, 0, 0, 0, 4), [CONTINUE] * 3 + [UNTIMED] + [STOP] * 4),
        ((3, 1, 0, 0, 0, 0, 0, 1), [CONTINUE] * 3 + [STOP, UNTIMED, STOP]),
    ],
)
def test_recorded_runs_store_counts(counts, expected):
    assert log_of(*expected).to_counts() == counts
    assert StopLog.from_counts(counts) == log_of(*expected)


@given(logs)
def test_stored_and_read_a_log_is_the_same(log):
    counts = log.to_counts()
    assert StopLog.from_counts(counts) == log
    assert all(count >= 0 for count in counts)


@given(answers)
def test_counts_are_as_version_0_1_wrote_them(given_answers):
    # Its code, which kept counts and nothing else.
    runs = [0]
    for answer in given_answers:
        if answer in {CALLBACK_STOP, UNTIMED}:
            runs += [0, 0] if len(runs) % 2 else [0, 0, 0]
            runs += [0, 0] if answer is UNTIMED else []
        elif (answer is CONTINUE) == bool(len(runs) % 2):
            runs[-1] += 1
        else:
            runs.append(1)
    assert log_of(*given_answers).to_counts() == (tuple(runs) if given_answers else ())


@given(answers)
def test_a_recorder_logs_every_answer(given_answers):
    recorder = StopRecorder()
    for answer in given_answers:
        recorder.add(answer)
    assert recorder.log == log_of(*given_answers)


@given(logs)
def test_a_log_that_is_replayed_gives_its_answers(log):
    replay, again = StopReplay(log), StopRecorder()
    for answer, count in log.entries:
        for _ in range(count):
            stops = {stop for stop in (CALLBACK_STOP, UNTIMED) if replay.callback_stops(stop)}
            assert stops == ({answer} if answer in {CALLBACK_STOP, UNTIMED} else set())
            if not stops:
                again.add(CONTINUE if replay.answer() else STOP)
            else:
                again.add(answer)
    assert again.log == log
    # It goes on after the end.
    assert replay.answer()
    assert not replay.callback_stops(CALLBACK_STOP)


@given(st.lists(st.integers(0, 2**32 - 1) | st.just(0)))
def test_any_counts_can_be_read_and_replayed(counts):
    replay = StopReplay(StopLog.from_counts(counts))
    for _ in range(10):
        replay.callback_stops(CALLBACK_STOP)
        replay.answer()


@pytest.mark.parametrize(
    ("log", "stopped"),
    [
        (log_of(), False),
        (log_of(CONTINUE, CONTINUE), False),
        (log_of(CONTINUE, STOP), True),
        (log_of(CONTINUE, CALLBACK_STOP), True),
        (log_of(UNTIMED), True),
    ],
)
def test_a_log_knows_whether_anything_was_stopped(log, stopped):
    assert log.stopped is stopped
