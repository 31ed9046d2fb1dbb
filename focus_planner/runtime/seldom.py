# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is done again only after some time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


class Seldom:
    """Knows when things were last done, by their names.

    Parameters
    ----------
    clock : callable, optional
        Returns seconds, monotonic.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._done: dict[str, float] = {}

    def is_due(self, name: str, period: float) -> bool:
        """Return whether a period has passed since something was done, in seconds."""
        return self._clock() - self._done.get(name, -math.inf) >= period

    def take(self, name: str, period: float) -> bool:
        """Return the same; if so, it counts as done now."""
        is_due = self.is_due(name, period)
        if is_due:
            self._done[name] = self._clock()
        return is_due
