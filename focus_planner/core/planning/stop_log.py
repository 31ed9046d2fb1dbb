# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a plan was told at each question whether to go on, so that it can be made again.

A plan that a time budget or a callback ended depends on the moment at which it was ended. Given
the same answers at the same questions it comes out the same, bit for bit, whatever the clock of
the machine says. Two kinds of questions are asked:

- *timed* ones, after every part of ray casting and every step of a solver or bound, which the
  time budget and the callback answer together. All their answers are logged.
- *untimed* ones, while cells are found or solving is about to begin, which the callback alone
  answers. How many there are does not matter to the plan, so only a stop is logged.

Recorded runs store a log as a list of counts: how often in a row to continue, then how often in a
row to stop, and so on. The first counts continues and may be 0; all others would be positive, so
zeros in a row are free to mark where the callback first returned False. Two or three of them mark
a timed question, four or five an untimed one, whichever number makes the last a count of continues.

>>> StopLog((Entry(Answer.CONTINUE, 3), Entry(Answer.STOP, 2))).to_counts()
(3, 2)
>>> callback_stop = Entry(Answer.CALLBACK_STOP), Entry(Answer.STOP)
>>> StopLog((Entry(Answer.CONTINUE, 3), *callback_stop)).to_counts()
(3, 0, 0, 1)
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import groupby, repeat
from typing import NamedTuple

from focus_planner.core.brief import brief_repr


class Answer(Enum):
    """What was answered to whether to go on.

    The first two answer a timed question each. The others say that the callback returned False
    for the first time: at the timed question that comes next in the log, or at an untimed one
    before it. From there on all timed questions are answered with ``STOP``.
    """

    CONTINUE = "continue"
    STOP = "stop"
    CALLBACK_STOP = "callback stop"
    CALLBACK_STOP_UNTIMED = "callback stop, untimed"


class Entry(NamedTuple):
    """An answer, and how often it was given in a row."""

    answer: Answer
    times: int = 1


# How many zeros in a row stand for a callback's stop, or one more.
_ZEROS = {Answer.CALLBACK_STOP: 2, Answer.CALLBACK_STOP_UNTIMED: 4}


@dataclass(frozen=True)
class StopLog:
    """The answers that a plan was given, in order.

    Attributes
    ----------
    entries : tuple of Entry
        No two neighbours have the same answer.
    """

    entries: tuple[Entry, ...] = ()

    __repr__ = brief_repr

    @property
    def stopped(self) -> bool:
        """Whether anything was stopped before its end."""
        return any(entry.answer is not Answer.CONTINUE for entry in self.entries)

    def to_counts(self) -> tuple[int, ...]:
        """Return the log as recorded runs store it (``RunResult.msg``: ``answers``)."""
        if not self.entries:
            return ()
        counts = [0]  # the last of them counts continues if there is an odd number of them
        for answer, times in self.entries:
            of_continues = len(counts) % 2 == 1
            if answer in _ZEROS:
                counts += [0] * (_ZEROS[answer] if of_continues else _ZEROS[answer] + 1)
            elif of_continues == (answer is Answer.CONTINUE):
                counts[-1] += times
            else:
                counts.append(times)
        return tuple(counts)

    @staticmethod
    def from_counts(counts: Iterable[int]) -> StopLog:
        """Return the log that a recorded run stores as these counts."""
        recorder = StopRecorder()
        for zero, group in groupby(enumerate(counts), key=lambda each: each[1] == 0):
            neighbours = list(group)
            if not zero:
                for place, count in neighbours:
                    recorder.add(Answer.STOP if place % 2 else Answer.CONTINUE, count)
            elif len(neighbours) >= _ZEROS[Answer.CALLBACK_STOP_UNTIMED]:
                recorder.add(Answer.CALLBACK_STOP_UNTIMED)
            elif len(neighbours) >= _ZEROS[Answer.CALLBACK_STOP]:
                recorder.add(Answer.CALLBACK_STOP)
        return recorder.log


class StopRecorder:
    """Makes a log, answer by answer."""

    def __init__(self) -> None:
        self._entries: list[Entry] = []

    def add(self, answer: Answer, times: int = 1) -> None:
        """Log an answer that was given so often in a row."""
        if self._entries and self._entries[-1].answer is answer:
            times += self._entries.pop().times
        self._entries.append(Entry(answer, times))

    @property
    def log(self) -> StopLog:
        """The log so far."""
        return StopLog(tuple(self._entries))


class StopReplay:
    """Gives the answers of a log again, in order."""

    def __init__(self, log: StopLog) -> None:
        self._answers = _one_by_one(log)
        self._next = next(self._answers, None)

    def callback_stops(self, how: Answer) -> bool:
        """Return whether the log has a callback's stop of this kind here, and move past it."""
        if self._next is not how:
            return False
        self._next = next(self._answers, None)
        return True

    def answer(self) -> bool:
        """Return whether to go on at a timed question; True after the end of the log."""
        answer, self._next = self._next, next(self._answers, None)
        return answer is not Answer.STOP


def _one_by_one(log: StopLog) -> Iterator[Answer]:
    for answer, times in log.entries:
        yield from repeat(answer, times)
