"""Keeping a deadline: when to stop each stage so that a plan is there in time.

What a clock answered once it does not answer again. So the answers are kept, and a plan that a
deadline ended can be made again from them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from itertools import repeat

from focus_planner.core.solvers.k_view import STAGES
from focus_planner.core.solvers.solution import Progress, Watch

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


class Deadline:
    """Asks a watch, and a clock, whether to go on.

    Steps are told to it when they end: it says no when the next one, if it takes as long as the
    last, would end too late.

    Parameters
    ----------
    seconds : float
        From now; inf for no deadline.
    watch : callable
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

    def __init__(self, seconds: float, watch: Watch, replayed: Sequence[int] | None = None) -> None:
        self.started = self._last = time.perf_counter()
        self._seconds = seconds
        self._watch = watch
        self._cells = 0.0
        self._shots = 1
        self._reserve = 0.0
        self._stage = ""
        self._told_no = False
        self._asked = 0
        self._runs = [0]
        self._replayed = None if replayed is None else _each(replayed)
        self.stopped = False
        self.shortened = False

    @property
    def answers(self) -> tuple[int, ...]:
        """What was answered so far: how often in a row to go on, then how often not, and so on."""
        return tuple(self._runs)

    def allow_for(self, cells: float, bound: bool = False, shots: int = 1) -> None:
        """Leave time to set up stages and to wind up, known how long the cells took.

        The more shots per camera, the more tuples of cameras share all their samples. With
        ``bound``, leave time also to make one after the solver, out of no more than a third of
        the time.

        The watch is told of it, as stage "solving": all that was waited for till then is there.
        """
        self._ask(Progress("solving", 0, _NOT_YET))
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

    def within(self, stage: str, share: float) -> Callable[[], bool]:
        """Return a question to ask between parts of a stage that may take a share of the time."""
        until = self.started + share * self._seconds

        def go_on() -> bool:
            self._asked += 1
            self._ask(Progress(stage, self._asked, _NOT_YET))
            more = self._answer(time.perf_counter() < until)
            self.shortened = self.shortened or not more
            return more

        return go_on

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

    def _ask(self, progress: Progress) -> None:
        """Ask the user's watch, until it says no."""
        self._told_no = self._told_no or not self._watch(progress)

    def _answer(self, in_time: bool) -> bool:
        """Return, and keep, whether to go on: as then, or else if there is time."""
        go_on = in_time if self._replayed is None else next(self._replayed, True)
        go_on = go_on and not self._told_no
        if go_on == bool(len(self._runs) % 2):
            self._runs[-1] += 1
        else:
            self._runs.append(1)
        return go_on


def _each(runs: Sequence[int]) -> Iterator[bool]:
    for k, run in enumerate(runs):
        yield from repeat(k % 2 == 0, run)
