# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A plan's progress, the callback that may stop it, and both in plain words."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

# The steps of these are counted on from stage to stage.
_COUNTED_ON = {"fresh", "visibility", "cells"}

#: The stage in which kernels are compiled, which is no part of a plan; and the same where no other
#: process will find them.
COMPILING, COMPILING_IN_VAIN = "compiling", "compiling, not kept"

#: What a planner does in each stage, in words for people.
STAGES: Mapping[str, str] = {
    COMPILING: "compiling, once",
    COMPILING_IN_VAIN: "compiling, not kept",
    "reading": "reading the inputs",
    "preparing": "preparing the surface",
    "fresh": "casting rays to judge by",
    "visibility": "casting rays to plan on",
    "cells": "finding focus ranges",
    "solving": "setting up the search",
    "closest": "focusing on the nearest",
    "average": "focusing on the mean",
    "em": "searching one by one",
    "greedy": "choosing one by one",
    "k_view": "searching in pairs",
    "k_view, triples": "searching in triples",
    "pictures": "choosing pictures",
    "exchanges": "exchanging pictures",
    "prices": "proving a bound",
    "kicks": "trying other plans",
    "cuts": "proving a tighter bound",
    "branching": "closing the gap",
}

_NO_PART_OF_A_PLAN = {COMPILING, COMPILING_IN_VAIN}


@dataclass(frozen=True)
class Progress:
    """How far a solver has come.

    Attributes
    ----------
    stage : str
        The solver's name.
    iteration : int
        Steps done in this stage, from 1; 0 while the stage is being set up. ``optimal``, which
        returns to its stages, counts all its steps.
    cost : float
        1000 × the weighted mean cost of the best choice of cells so far, or an upper bound on it.
    lower_bound : float, optional
        No plan for these samples costs less.
    share : float, optional
        How much of the stage is done, 0 to 1, where that is known. It is for display: it is not
        recorded, and steps that differ in nothing else are the same.
    expected : float, optional
        About how many seconds the stage will have taken, where that is known; for display too.
    """

    stage: str
    iteration: int
    cost: float
    lower_bound: float | None = None
    share: float | None = field(default=None, compare=False, repr=False)
    expected: float | None = field(default=None, compare=False, repr=False)

    @property
    def is_part_of_a_plan(self) -> bool:
        """Whether its time counts; that of compiling does not."""
        return self.stage not in _NO_PART_OF_A_PLAN


#: Called after every step; return False to stop.
ProgressCallback = Callable[[Progress], bool]


def never_stop(_: Progress) -> bool:
    """Let the solver run to its end: the default callback."""
    return True


# --- for people --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Standing:
    """How far a plan is, on the whole.

    Attributes
    ----------
    stage : str
    iteration : int
        Steps done in this stage. ``optimal`` counts all its steps.
    share : float or None
        How much of the stage is done, 0 to 1, where that is known.
    cost, lower_bound : float
        The best so far, of all stages; NaN if there is none.
    elapsed : float
        Seconds since planning began; while kernels are compiled, since that began.
    time_budget : float
        Seconds after which it will end; inf for no limit.
    expected : float or None
        About how many seconds the stage takes, where that is known.
    """

    stage: str
    iteration: int = 0
    share: float | None = None
    cost: float = math.nan
    lower_bound: float = math.nan
    elapsed: float = 0.0
    time_budget: float = math.inf
    expected: float | None = None

    @property
    def gap(self) -> float:
        """At most this part of the cost can be saved: NaN without a bound, and never below 0."""
        if math.isnan(self.cost) or not math.isfinite(self.lower_bound):
            return math.nan
        saved = max(self.cost - self.lower_bound, 0.0)
        return saved / self.cost if saved else 0.0

    @property
    def doing(self) -> str:
        """What the planner is doing, in words, and about how long that takes."""
        words = STAGES.get(self.stage, self.stage)
        return words if self.expected is None else f"{words}, about {roughly(self.expected)}"

    def figures(self) -> list[str]:
        """Return what there is to say besides: share or step, cost, gap."""
        figures = []
        if self.share is not None:
            figures.append(percent(self.share))
        elif self.iteration:
            figures.append(f"step {self.iteration}")
        if not math.isnan(self.cost):
            figures.append(f"cost {self.cost:.2f}")
        if not math.isnan(self.gap):
            # Only a gap that is closed is 0.
            figures.append("gap < 0.01%" if 0 < self.gap < 1e-4 else f"gap {self.gap:.2%}")
        return figures

    def __str__(self) -> str:
        return ", ".join([self.doing, *self.figures(), time_spent(self.elapsed, self.time_budget)])


class Tracker:
    """Follows a plan's steps, and tells at any time how far it is.

    Parameters
    ----------
    time_budget : float
        Seconds; inf for no limit.
    clock : callable, optional
        Returns seconds; monotonic.
    """

    def __init__(
        self, time_budget: float = math.inf, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._clock = clock
        self._began = clock()
        self._last = Standing("", time_budget=time_budget)
        self._before = 0  # steps counted before this stage

    def note(self, progress: Progress) -> Standing:
        """Take note of a step, and return how far the plan is with it."""
        last = self._last
        if progress.stage != last.stage:
            if last.stage in _NO_PART_OF_A_PLAN:
                self._began = self._clock()
            on = progress.stage in _COUNTED_ON
            self._before = max(progress.iteration - 1, 0) if on else 0
        self._last = replace(
            last,
            stage=progress.stage,
            iteration=progress.iteration - self._before,
            share=progress.share,
            # The best so far: a step may be about another plan than the solver's best.
            cost=_better(min, last.cost, progress.cost),
            lower_bound=_better(max, last.lower_bound, progress.lower_bound),
            expected=progress.expected,
        )
        return self.now()

    def now(self) -> Standing:
        """Return how far the plan is: time goes on while a step takes long."""
        timed = self._last.stage not in _NO_PART_OF_A_PLAN
        return replace(
            self._last,
            elapsed=self._clock() - self._began,
            time_budget=self._last.time_budget if timed else math.inf,
        )


def _better(choice: Callable[[float, float], float], old: float, new: float | None) -> float:
    if new is None or math.isnan(new):
        return old
    return new if math.isnan(old) else choice(old, new)


def percent(share: float) -> str:
    """Return a share in percent, which is 100 only of all."""
    return f"{math.floor(100 * share + 1e-9)}%"


def roughly(seconds: float) -> str:
    """Return seconds as far as an estimate can tell: in tens, or in minutes."""
    tens = 10 * max(math.ceil(seconds / 10), 1)
    return f"{tens} s" if tens < 120 else f"{math.ceil(seconds / 60)} min"


def time_spent(elapsed: float, time_budget: float = math.inf) -> str:
    """Return seconds elapsed, of a budget if there is one: ``12.3 s of 60 s``."""
    if math.isfinite(time_budget):
        return f"{elapsed:.1f} s of {time_budget:g} s"
    if elapsed < 99.95:
        return f"{elapsed:.1f} s"
    minutes, seconds = divmod(round(elapsed), 60)
    if minutes < 100:
        return f"{minutes} min {seconds:02} s"
    return f"{minutes // 60} h {minutes % 60:02} min"
