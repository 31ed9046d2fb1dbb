"""Feedback to callers while a plan is being made."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from focus_planner.core.progress import Progress
from focus_planner.messages.writing import Fields

_MIN_PERIOD = 0.1


class Feedback:
    """Turns a solver's steps into feedback: on every new stage, otherwise at most ten a second.

    Parameters
    ----------
    time_budget : float
        Of the request, seconds; inf for none. Progress is reported as a part of it, and is NaN
        without one.
    """

    def __init__(self, time_budget: float) -> None:
        self._time_budget = time_budget
        self._started = time.monotonic()
        self._sent = -math.inf
        self._stages: set[str] = set()
        self._cost = math.nan
        self._lower_bound = math.nan

    def fields(self, progress: Progress) -> Fields | None:
        """Return the feedback after a step, or None if the last one was sent too recently."""
        # The best so far: a step may be about another plan than the solver's best.
        self._cost = _better(min, self._cost, progress.cost)
        self._lower_bound = _better(max, self._lower_bound, progress.lower_bound)
        now = time.monotonic()
        if progress.stage in self._stages and now - self._sent < _MIN_PERIOD:
            return None
        self._stages.add(progress.stage)
        self._sent = now
        elapsed = (now - self._started) / self._time_budget
        return {
            "stage": progress.stage,
            "progress": min(elapsed, 1.0) if math.isfinite(self._time_budget) else math.nan,
            "cost": self._cost,
            "lower_bound": self._lower_bound,
        }


def _better(choice: Callable[[float, float], float], old: float, new: float | None) -> float:
    if new is None or math.isnan(new):
        return old
    return new if math.isnan(old) else choice(old, new)
