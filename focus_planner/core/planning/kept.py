# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Problems kept between plans, for those on the same scene, rig, model and sampling.

What is kept is found by everything that it depends on: scenes by their identity, since neither they
nor the surfaces in them ever change; rigs, models and what is asked for by their values. It goes
with its scene, when there is no room for it, and when it is forgotten.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import count
from typing import Any, TypeVar
from weakref import WeakKeyDictionary, ref

import numpy as np

from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.derived import bytes_with_derived, keep_derived, keeps_derived
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Samples

#: The most that is kept between plans.
MOST_BYTES = 256 * 2**20
# Cells, tuples, gains and a copy sorted by place take so many times the memory of the problem that
# they are of.
_WITH_DERIVED = 6
# What a request asks of its solver; its samples and its problem are the same whatever it says.
_OF_SOLVERS = frozenset(
    {"method", "k", "scope", "tuples", "time_budget", "images", "bound", "gap", "worst"}
)

Data = TypeVar("Data", Problem, Samples)


@dataclass(frozen=True, eq=False)
class KeptProblem:
    """A problem on all samples that were asked for.

    Attributes
    ----------
    problem : Problem
    shares : tuple of float or None
        At which shares of ray casting it was asked whether to go on; None if it was not.
    """

    problem: Problem
    shares: tuple[float, ...] | None


@dataclass(eq=False)
class _Entry:
    """What is kept of a scene, and of others that are planned for together with it."""

    others: tuple[ref[Scene], ...]
    key: tuple[Any, ...]
    value: Any
    used: int
    bytes: int = 0

    def __post_init__(self) -> None:
        self.measure()

    def measure(self) -> None:
        """Note how much memory it takes now."""
        if isinstance(self.value, KeptProblem):
            self.bytes = bytes_with_derived(self.value.problem)


class Kept:
    """What plans have left for later ones; any thread may ask.

    Parameters
    ----------
    most_bytes : float
        Of all arrays kept. What was used longest ago goes first.
    """

    def __init__(self, most_bytes: float = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._entries: WeakKeyDictionary[Scene, list[_Entry]] = WeakKeyDictionary()
        self._clock = count()
        self.unlock()

    def unlock(self) -> None:
        """Be usable in a forked process, whatever other threads did when it was forked."""
        self._lock = threading.RLock()

    @property
    def bytes(self) -> int:
        """The memory of what is kept."""
        with self._lock:
            return sum(entry.bytes for _, entry in self._all())

    def find(self, scenes: Sequence[Scene], key: tuple[Any, ...]) -> Any:
        """Return what was kept under a key for these scenes; None if nothing is."""
        first, *others = scenes
        with self._lock:
            for entry in self._entries.get(first, ()):
                if _are(entry.others, others) and entry.key == key:
                    entry.used = next(self._clock)
                    return entry.value
        return None

    def measure(self, *problems: Problem) -> None:
        """Take note that more has been derived of problems, and make room for it."""
        with self._lock:
            for _, entry in self._all():
                if isinstance(entry.value, KeptProblem) and entry.value.problem in problems:
                    entry.measure()
            self.trim()

    def keep(self, scenes: Sequence[Scene], key: tuple[Any, ...], value: Any) -> None:
        """Keep a problem, or what was noticed of it, in place of what has the same key."""
        if isinstance(value, KeptProblem):
            if _WITH_DERIVED * bytes_with_derived(value.problem) > self._most_bytes:
                return
            keep_derived(value.problem)
        first, *others = scenes
        with self._lock:
            entries = self._entries.setdefault(first, [])
            entries[:] = [e for e in entries if not (_are(e.others, others) and e.key == key)]
            entries.append(_Entry(tuple(map(ref, others)), key, value, next(self._clock)))
            self.trim()

    def trim(self, most_bytes: float = math.inf) -> None:
        """Forget what there is no room for.

        Parameters
        ----------
        most_bytes : float
            That others leave.
        """
        most_bytes = min(most_bytes, self._most_bytes)
        with self._lock:
            total = self.bytes
            for scene, entry in sorted(self._all(), key=lambda each: each[1].used):
                if total > most_bytes or not all(each() for each in entry.others):
                    self._entries[scene].remove(entry)
                    total -= entry.bytes

    def forget(self) -> None:
        """Forget all."""
        with self._lock:
            self._entries.clear()

    def _all(self) -> list[tuple[Scene, _Entry]]:
        return [(scene, e) for scene, entries in list(self._entries.items()) for e in entries]


#: Those of this process.
KEPT = Kept()

if hasattr(os, "register_at_fork"):  # Windows has no forks
    os.register_at_fork(after_in_child=KEPT.unlock)


def problem_key(rig: Rig, request: PlanRequest, model: CostModel | None, *, fresh: bool) -> Any:
    """Return all that a scene's problem on so many samples depends on, beside the scene.

    Parameters
    ----------
    rig : Rig
    request : PlanRequest
        With the number of samples that was chosen, if it was left open.
    model : CostModel or None
    fresh : bool
        Whether it is the problem on fresh samples.
    """
    other_samples = "samples" if fresh else "fresh_samples"
    asked = tuple(
        getattr(request, each.name)
        for each in fields(request)
        if each.name not in _OF_SOLVERS and each.name != other_samples
    )
    return fresh, asked, model or CostModel(), rig


def notes_key(
    rig: Rig, request: PlanRequest, subjects: Sequence[Subject], parts: Sequence[Problem]
) -> Any:
    """Return all that the notes on some subjects' problems depend on, beside their scenes."""
    names = tuple((each.name, each.weight) for each in subjects)
    return names, request.max_mm_per_pixel, tuple(map(ref, parts)), rig.notes, rig


def joined_key(subjects: Sequence[Subject], parts: Sequence[Problem]) -> Any:
    """Return all that the problem of several subjects' problems depends on."""
    return tuple(each.weight for each in subjects), tuple(map(ref, parts))


def with_own_problems(plan: SolvedPlan) -> SolvedPlan:
    """Return a plan whose problems its owner may write to, which would change later plans."""
    if not keeps_derived(plan.problem) and not keeps_derived(plan.fresh_problem):
        return plan
    return replace(plan, problem=_own(plan.problem), fresh_problem=_own(plan.fresh_problem))


def _own(problem: Problem) -> Problem:
    return replace(_copied(problem), samples=_copied(problem.samples))


def _copied(data: Data) -> Data:
    values: dict[str, Any] = {each.name: getattr(data, each.name) for each in fields(data)}
    copies = {name: v.copy() for name, v in values.items() if isinstance(v, np.ndarray)}
    return type(data)(**(values | copies))


def _are(kept: Sequence[ref[Scene]], scenes: Sequence[Scene]) -> bool:
    """Return whether these scenes are those that something is kept of."""
    return len(kept) == len(scenes) and all(a() is b for a, b in zip(kept, scenes, strict=True))
