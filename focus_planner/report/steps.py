# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The steps of a search, for showing how it converged."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from itertools import zip_longest

from focus_planner.core.progress import Progress, ProgressCallback
from focus_planner.report.content import Step


class StepCollector:
    """A callback that keeps the steps it is told of, and when they were done.

    Parameters
    ----------
    on_progress : callable
        Called with every step; what it returns is returned.
    clock : callable, optional
        Returns seconds, monotonic.
    """

    def __init__(
        self, on_progress: ProgressCallback, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._on_progress = on_progress
        self._clock = clock
        self._began = clock()
        self._progress: list[Progress] = []
        self._elapsed: list[float] = []

    def __call__(self, progress: Progress) -> bool:
        """Keep a step; return whether to go on."""
        self._progress.append(progress)
        self._elapsed.append(self._clock() - self._began)
        return self._on_progress(progress)

    @property
    def elapsed(self) -> tuple[float, ...]:
        """When each of them was done, seconds since this was made."""
        return tuple(self._elapsed)

    @property
    def steps(self) -> tuple[Step, ...]:
        """Those kept so far."""
        return steps_of(self._progress, self._elapsed)


def steps_of(progress: Iterable[Progress], elapsed: Iterable[float]) -> tuple[Step, ...]:
    """Return steps with the seconds after which each was done, as far as these are known."""
    return tuple(
        Step(step.stage, step.iteration, _known(step.cost), _known(step.lower_bound), seconds)
        for step, seconds in zip_longest(progress, elapsed)
        if step is not None
    )


def _known(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
