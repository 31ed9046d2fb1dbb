# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Surfaces that are planned for without being asked: which is next, and what became of the others.

The newest wins: of those that arrive while a plan is being made, it is planned for next, and those
before it never are.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from threading import Lock


@dataclass(frozen=True)
class Replanned:
    """What became of the surfaces that arrived to be planned for; each is one of these.

    Attributes
    ----------
    planned : int
        A plan for it, by itself or asked for, was made.
    stale : int
        A newer one took its place.
    refused : int
        It could not be used.
    failed : int
        There was no plan for it.
    waiting : int
        It waits for its turn, or for a rig.
    failure : str
        Why there is no plan for the newest that had its turn; empty if there is.
    """

    planned: int = 0
    stale: int = 0
    refused: int = 0
    failed: int = 0
    waiting: int = 0
    failure: str = ""


class Surfaces:
    """Keeps account of the surfaces that are to be planned for, by their numbers.

    Any thread may call.
    """

    def __init__(self) -> None:
        self._waiting: set[int] = set()
        self._counts = Replanned()
        self._lock = Lock()

    @property
    def counts(self) -> Replanned:
        """What became of all of them so far."""
        with self._lock:
            return replace(self._counts, waiting=len(self._waiting))

    @property
    def are_waiting(self) -> bool:
        """Whether there is one to plan for."""
        return bool(self._waiting)

    def receive(self, number: int) -> None:
        """Note that a surface has arrived."""
        with self._lock:
            self._waiting.add(number)

    def read(self, in_force: Collection[int], refused: Collection[int]) -> bool:
        """Note which surfaces are in force and which were refused; return if one in force waits.

        What is older than the newest in force, and not in force with it, is stale.
        """
        newest = max(in_force, default=-1)
        with self._lock:
            bad = self._waiting.intersection(refused)
            old = {each for each in self._waiting - bad if each < newest}.difference(in_force)
            self._waiting -= bad | old
            self._counts = replace(
                self._counts,
                refused=self._counts.refused + len(bad),
                stale=self._counts.stale + len(old),
            )
            return not self._waiting.isdisjoint(in_force)

    def end(self, in_force: Collection[int], failure: str = "") -> None:
        """Note that the surfaces in force were planned for, or why there is no plan for them."""
        with self._lock:
            ended = self._waiting.intersection(in_force)
            self._waiting -= ended
            counts = self._counts
            if failure:
                counts = replace(counts, failed=counts.failed + len(ended))
            else:
                counts = replace(counts, planned=counts.planned + len(ended))
            self._counts = replace(counts, failure=failure)


class Pace:
    """When the next plan may begin, at most one in a period."""

    def __init__(self) -> None:
        self._began = -math.inf

    def seconds_left(self, now: float, period: float) -> float:
        """Return how long to wait from now on, seconds; 0 if a plan may begin."""
        return max(self._began + period - now, 0.0)

    def begin(self, now: float) -> None:
        """Note that a plan begins."""
        self._began = now
