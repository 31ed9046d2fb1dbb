"""Keeping a deadline: when to stop each stage so that a plan is there in time.

What a clock answered once it does not answer again. So the answers are kept, and a plan that a
deadline ended can be made again from them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from itertools import groupby, repeat

from focus_planner.core.progress import Progress, ProgressCallback
from focus_planner.core.solvers.k_view import STAGES

# Shares of the time, from the start, after which fresh samples, and samples to plan on, are no
# longer added: as much as casting their rays takes is still to come for cells and solving.
FRESH_SHARE = 0.15
SAMPLES_SHARE = 0.45
# What a stage sets up before its first step (most of all pairs, or triples, of cameras), what
# follows the last one, and what a bound takes that is worth having, beside the time that the
# problem's cells took.
_SET_UP, _SET_UP_TRIPLES = 0.8, 8.0
_WIND_UP = 0.25
_BOUND = 1.0
# The next step may take longer than the last.
_CAUTION = 1.5
_NOT_YET = float("nan")
# Samples that a plan is made on in the time in which one who wants no more has to get it.
_ENOUGH_FOR_NOW = 4096


class _Said(Enum):
    """Where a watch said no: at a question that the clock was asked too, or at another."""

    NO = 2
    NO_UNASKED = 4


class Deadline:
    """Asks a watch, and a clock, whether to go on.

    Steps are told to it when they end: it says no when the next one, if it takes as long as the
    last, would end too late.

    Parameters
    ----------
    seconds : float
        From now; inf for no deadline.
    on_progress : callable
        The user's.
    replayed : sequence of int, optional
        The ``answers`` of a deadline for the same plan, to give again; the clock is not asked.

    Attributes
    ----------
    started : float
        By :func:`time.perf_counter`.
    stopped : bool
        Whether it has told a solver, or the watch has told it, not to go on.
    shortened : bool
        Whether samples were left out.
    """

    def __init__(
        self, seconds: float, on_progress: ProgressCallback, replayed: Sequence[int] | None = None
    ) -> None:
        self.started = self._last = time.perf_counter()
        self._seconds = seconds
        self._watch = on_progress
        self._cells = 0.0
        self._shots = 1
        self._reserve = 0.0
        self._stage = ""
        self._told_no = False
        self._asked = 0
        self._runs = [0]
        self._tape = None if replayed is None else _Tape(replayed)
        self.stopped = False
        self.shortened = False

    @property
    def answers(self) -> tuple[int, ...]:
        """What was answered so far: how often in a row to go on, then how often not, and so on.

        Two zeros in a row, or three, stand where the watch, not the clock, first said no; four or
        five where it did in a stage whose questions only the watch is asked, which are not kept.
        """
        return tuple(self._runs)

    def allow_for(self, cells: float, bound: bool = False, shots: int = 1) -> None:
        """Leave time to set up stages and to wind up, known how long the cells took.

        The more shots per camera, the more tuples of cameras share all their samples. With
        ``bound``, leave time also to make one after the solver, out of no more than a third of
        the time.

        The watch is told of it, as stage "solving": all that was waited for till then is there.
        """
        # There is no answer here, so a no of the tape is for the step that follows.
        self._ask(Progress("solving", 0, _NOT_YET), None)
        self._last = time.perf_counter()
        self._cells, self._shots = cells, shots
        self._reserve = _WIND_UP * cells
        self.stopped = self._told_no
        if bound:
            left = self.started + self._seconds - self._last - self._reserve
            self._reserve += max(min(_BOUND * cells, left / 3), 0.0)

    def bound_now(self) -> None:
        """Spend on the bound what was left for it."""
        self._last = time.perf_counter()
        self._reserve = _WIND_UP * self._cells
        self.stopped = self._told_no

    @property
    def told_no(self) -> bool:
        """Whether the watch said no: the plan is wanted now, not when the time is up."""
        return self._told_no

    def enough(self) -> float:
        """Return how many of the samples taken are enough, now that no more are."""
        return _ENOUGH_FOR_NOW if self._told_no else math.inf

    def asked(self, stage: str) -> bool:
        """Return whether the watch, whatever the time, wants a stage without steps to go on."""
        self._asked += 1
        self._ask(Progress(stage, self._asked, _NOT_YET), _Said.NO_UNASKED)
        return not self._told_no

    def within(self, stage: str, share: float) -> Callable[[], bool]:
        """Return a question to ask between parts of a stage that may take a share of the time."""
        until = self.started + share * self._seconds

        def keep_going() -> bool:
            self._asked += 1
            self._ask(Progress(stage, self._asked, _NOT_YET))
            more = self._answer(time.perf_counter() < until)
            self.shortened = self.shortened or not more
            return more

        return keep_going

    def __call__(self, progress: Progress) -> bool:
        """Return whether a solver is to go on: the watch it is given."""
        now = time.perf_counter()
        needed, self._last = _CAUTION * (now - self._last), now
        if progress.stage != self._stage:
            self._stage = progress.stage
            set_up = _SET_UP_TRIPLES if self._stage == STAGES[3] else _SET_UP
            needed = max(needed, set_up * self._shots * self._cells)
        self._ask(progress)
        in_time = self.started + self._seconds - now - self._reserve >= needed
        self.stopped = not self._answer(in_time and not self.stopped)
        return not self.stopped

    def _ask(self, progress: Progress, no: _Said | None = _Said.NO) -> None:
        """Ask the user's watch, and the tape for a no of this kind, until one says no."""
        if self._told_no:
            return
        self._told_no = not self._watch(progress) or (
            no is not None and self._tape is not None and self._tape.takes(no)
        )
        if self._told_no:
            # A zero more where the last are those told not to go on.
            self._runs += [0, 0] if len(self._runs) % 2 else [0, 0, 0]
            self._runs += [0, 0] if no is _Said.NO_UNASKED else []

    def _answer(self, in_time: bool) -> bool:
        """Return, and keep, whether to go on: as then, or else if there is time."""
        keep_going = in_time if self._tape is None else self._tape.answer()
        keep_going = keep_going and not self._told_no
        if keep_going == bool(len(self._runs) % 2):
            self._runs[-1] += 1
        else:
            self._runs.append(1)
        return keep_going


class _Tape:
    """The answers of another deadline, to give again."""

    def __init__(self, runs: Sequence[int]) -> None:
        self._items = _each(tuple(runs))
        self._next = next(self._items, True)

    def takes(self, no: _Said) -> bool:
        """Return whether the watch said no, in this way, before the next answer."""
        here = self._next is no
        if here:
            self._next = next(self._items, True)
        return here

    def answer(self) -> bool:
        """Return the next answer; to go on where there are no more."""
        answer, self._next = self._next, next(self._items, True)
        return answer is not False


def _each(runs: tuple[int, ...]) -> Iterator[bool | _Said]:
    """Yield every answer, and between them where the watch said no."""
    for empty, together in groupby(enumerate(runs), lambda each: each[1] == 0):
        of_these = list(together)
        if empty and len(of_these) > 1:
            yield _Said.NO if len(of_these) < _Said.NO_UNASKED.value else _Said.NO_UNASKED
        for k, run in of_these:
            yield from repeat(k % 2 == 0, run)
