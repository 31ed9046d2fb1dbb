# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Telling callers and the log how far a plan is, often enough and no oftener."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from focus_planner.core.progress import Progress, Standing, Tracker
from focus_planner.messages.writing import Fields

_MIN_PERIOD = 0.1
# A step may take long; its caller should not think that the planner is gone.
_MAX_PERIOD = 1.0
# The log is for plans that take longer than this, and the longer they take, the less often.
_FIRST_ENTRY, _NEXT_ENTRY, _LATER_ENTRIES = 5.0, 10.0, 60.0


class Feedback:
    """Chooses the steps worth telling: every new stage, otherwise at most ten a second.

    Parameters
    ----------
    time_budget : float
        Of the request, seconds; inf for none.
    """

    def __init__(self, time_budget: float) -> None:
        self._tracker = Tracker(time_budget, time.monotonic)
        self._sent = -math.inf
        self._stages: set[str] = set()

    def standing(self, progress: Progress) -> Standing | None:
        """Return how far the plan is, or None if that was told too recently."""
        standing = self._tracker.note(progress)
        now = time.monotonic()
        if progress.stage in self._stages and now - self._sent < _MIN_PERIOD:
            return None
        self._stages.add(progress.stage)
        self._sent = now
        return standing


def feedback_fields(standing: Standing) -> Fields:
    """Return the fields of a feedback message.

    Its progress is the part of the time budget that has passed, and is NaN without one.
    """
    limited = math.isfinite(standing.time_budget)
    return {
        "stage": standing.stage,
        "iteration": standing.iteration,
        "progress": min(standing.elapsed / standing.time_budget, 1.0) if limited else math.nan,
        "cost": standing.cost,
        "lower_bound": standing.lower_bound,
        "gap": standing.gap,
        "elapsed": standing.elapsed,
        "time_budget": standing.time_budget if limited else 0.0,
    }


class Teller:
    """Tells a caller and the log how far something is, also while a step takes long.

    The caller hears of every standing noted, and once a second in between; the log after five
    seconds, then ten later, then after ever longer pauses, up to a minute.

    Parameters
    ----------
    log : callable
        Takes a line of the log.
    label : str
        To begin every line with.
    send : callable, optional
        Takes what there is to send to a caller.
    """

    def __init__(
        self, log: Callable[[str], object], label: str, send: Callable[[Standing], object]
    ) -> None:
        self._log = log
        self._label = label
        self._send = send
        self._standing: Standing | None = None
        began = time.monotonic()
        self._noted = self._sent = began
        self._due, self._pause = began + _FIRST_ENTRY, _NEXT_ENTRY

    def note(self, standing: Standing) -> None:
        """Take note of how far it is now, and tell the caller."""
        self._standing, self._noted = standing, time.monotonic()
        self._tell(self._noted)

    def look(self) -> None:
        """Tell what is due by now; to be called often."""
        now = time.monotonic()
        if self._standing is None:
            return
        if now - self._sent >= _MAX_PERIOD:
            self._tell(now)
        if now >= self._due:
            self._log(f"{self._label}: {self._now(self._standing, now)}")
            self._due, self._pause = now + self._pause, min(2 * self._pause, _LATER_ENTRIES)

    def _tell(self, now: float) -> None:
        assert self._standing is not None
        self._sent = now
        self._send(self._now(self._standing, now))

    def _now(self, standing: Standing, now: float) -> Standing:
        return replace(standing, elapsed=standing.elapsed + now - self._noted)
