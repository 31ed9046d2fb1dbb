"""What whoever waits for a plan is told meanwhile."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from focus_planner.core.progress import Progress
from focus_planner.messages.writing import Fields

_SECONDS_BETWEEN = 0.1


class Feedback:
    """Turns steps into feedback: every stage when it first comes, else ten a second at most.

    Parameters
    ----------
    time_budget : float
        Of the request, seconds; inf for none. What part of a plan is done can be told by it only.
    """

    def __init__(self, time_budget: float) -> None:
        self._time_budget = time_budget
        self._began = time.monotonic()
        self._told = -math.inf
        self._stages: set[str] = set()
        self._cost = math.nan
        self._lower_bound = math.nan

    def fields(self, progress: Progress) -> Fields | None:
        """Return the feedback that a step gives rise to, None if it is too early for one."""
        # The best so far: a step of a solver may be about another plan than its best.
        self._cost = _better(min, self._cost, progress.cost)
        self._lower_bound = _better(max, self._lower_bound, progress.lower_bound)
        now = time.monotonic()
        if progress.stage in self._stages and now - self._told < _SECONDS_BETWEEN:
            return None
        self._stages.add(progress.stage)
        self._told = now
        part = (now - self._began) / self._time_budget
        return {
            "stage": progress.stage,
            "progress": min(part, 1.0) if math.isfinite(self._time_budget) else math.nan,
            "cost": self._cost,
            "lower_bound": self._lower_bound,
        }


def _better(choice: Callable[[float, float], float], old: float, new: float | None) -> float:
    if new is None or math.isnan(new):
        return old
    return new if math.isnan(old) else choice(old, new)
