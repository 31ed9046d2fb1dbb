# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The arithmetic of a time budget: how long each stage of a plan may take.

A plan passes through fixed stages: rays are cast for the fresh samples, then for the samples to
plan on; the problem's cells are found; the solver runs; a lower bound is computed.

- Ray casting has to end within a share of the budget. Samples whose rays would come later are
  left out of the problem.
- What follows grows with the problem, and so does the time that its cells take. A stage of the
  solver is expected to need nearly as long to set up before its first step, a quarter of that to
  wind up, and a useful bound as long again.
- A step starts only if it would end in time even if it took half as long again as the last one.

The budget knows its clock and nothing else; :class:`~focus_planner.core.planning.pacer.Pacer`
asks it together with the caller's callback. What a deadline costs in quality is told in
``docs/quality.md``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from focus_planner.core.solvers.k_view import STAGES

#: Shares of the budget, from the start, after which no more rays are cast for fresh samples, and
#: for samples to plan on. Cells and solving are still to come, and take about as long.
FRESH_SHARE = 0.15
SAMPLES_SHARE = 0.45

# In units of the time that the problem's cells took. Tuples of cameras take long to set up, most
# of all triples.
_SET_UP, _SET_UP_TRIPLES = 0.8, 8.0
_WIND_UP = 0.25
_BOUND = 1.0
# The next step may take longer than the last.
_CAUTION = 1.5


class TimeBudget:
    """How a plan's time is divided among its stages.

    Parameters
    ----------
    seconds : float
        From now; inf for no limit.
    clock : callable, optional
        Returns seconds; monotonic.

    Attributes
    ----------
    started : float
        When the budget was made, by the clock.
    limited : bool
        Whether the time can run out.
    """

    def __init__(
        self, seconds: float = math.inf, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._clock = clock
        self._seconds = seconds
        self.started = self._last_step = clock()
        self.limited = seconds < math.inf
        self._stage = ""
        self._shots = 1
        self._cells_seconds = 0.0
        self._reserve = 0.0

    def elapsed(self) -> float:
        """Return the seconds since the start."""
        return self._clock() - self.started

    def has_share_left(self, share: float) -> bool:
        """Return whether less than this share of the budget has passed since the start."""
        return self._clock() < self.started + share * self._seconds

    def start_solver(self, cells_seconds: float, shots: int = 1, *, bound: bool = False) -> None:
        """Reserve time for what follows the solver; its first step starts now.

        Parameters
        ----------
        cells_seconds : float
            How long the problem's cells took.
        shots : int
            Per camera: the more there are, the more tuples of cameras see the same samples, and
            the longer they take to set up.
        bound : bool
            Whether to reserve time for a lower bound too, up to a third of what is left.
        """
        self._last_step = self._clock()
        self._cells_seconds, self._shots = cells_seconds, shots
        self._reserve = _WIND_UP * cells_seconds
        if bound:
            left = self.started + self._seconds - self._last_step - self._reserve
            self._reserve += max(min(_BOUND * cells_seconds, left / 3), 0.0)

    def start_bound(self) -> None:
        """Release the time reserved for the bound; its first step starts now."""
        self._last_step = self._clock()
        self._reserve = _WIND_UP * self._cells_seconds

    def next_step_fits(self, stage: str) -> bool:
        """Return whether there is time for another step, now that one of this stage has ended."""
        now = self._clock()
        needed, self._last_step = _CAUTION * (now - self._last_step), now
        if stage != self._stage:
            self._stage = stage
            set_up = _SET_UP_TRIPLES if stage == STAGES[3] else _SET_UP
            needed = max(needed, set_up * self._shots * self._cells_seconds)
        return self.started + self._seconds - now - self._reserve >= needed
