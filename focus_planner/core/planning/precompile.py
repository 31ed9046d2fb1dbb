# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compiling what plans and pictures run, before the first of them, as a stage of its own.

Kernels are compiled for the types of their arguments, and those depend on what is done. So each
kind of work is done once, on a small ball: that compiles what it runs, or loads what an earlier
process has compiled, which takes a second. Only if something turns out to be missing is there a
stage to show. What it will take is then known: the kernels of each kind of work are those of some
modules, and how long each of these takes to compile was measured. As kernels get done, the machine
itself tells how much slower or faster it is. Where nothing is missing, one plan of the same kind
loads what is needed.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from focus_planner.core import kernels
from focus_planner.core.forks import refuse_forked_threads
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.work import (
    ALL,
    BUDGETS,
    CLOUDS,
    GREEDY,
    PLANNING,
    PROOFS,
    SECONDS,
    TUPLES_OF_CAMERAS,
    Work,
    plan_alike,
)
from focus_planner.core.progress import COMPILING, COMPILING_IN_VAIN, Progress, time_spent

# Once so much of the work is done, its pace tells how long the rest will take.
_TELLING = 0.1


@dataclass(frozen=True)
class Compiled:
    """What has been compiled.

    Attributes
    ----------
    seconds : dict of str to float
        How long the kernels of each module took. Those that were found compiled took none.
    kernels : int
        How many kernels were compiled, counted for each set of types.
    elapsed : float
        Seconds that it took in all; 0 if nothing was compiled.
    folder : Path or None
        Where they are kept for other processes; None if there is no such place.
    """

    seconds: dict[str, float]
    kernels: int
    elapsed: float
    folder: Path | None

    def __str__(self) -> str:
        if not self.kernels:
            return "all kernels are compiled"
        kernel = "kernel" if self.kernels == 1 else "kernels"
        done = f"compiled {self.kernels} {kernel} in {time_spent(self.elapsed)}"
        return f"{done}; they are kept in {self.folder}" if self.folder else f"{done}; {NOT_KEPT}"


#: What to do about kernels that no other process will find.
NOT_KEPT = (
    "no other process will find them, since no folder for them can be written to: set"
    " NUMBA_CACHE_DIR to one that can"
)


def works_for(request: PlanRequest, *, clouds: bool) -> tuple[Work, ...]:
    """Return the kinds of work that a plan consists of.

    Where others have compiled all of it, what such a plan itself runs has yet to be loaded.

    Parameters
    ----------
    request : PlanRequest
    clouds : bool
        Whether it is for a cloud; a mesh takes less.
    """
    works = [PLANNING, CLOUDS] if clouds else [PLANNING]
    if request.method in {"k_view", "optimal"}:
        works.append(TUPLES_OF_CAMERAS)
    if request.method == "optimal":
        works.append(PROOFS)
    if request.method == "greedy":
        works.append(GREEDY)
    if request.images:
        works.append(BUDGETS)
    if clouds or request.method == "optimal" or request.images or _done.issuperset(works):
        return tuple(works)
    if not _found.issuperset(works):
        if missing_kernels(works):
            return tuple(works)
        _found.update(works)
    return (plan_alike(request),)


def precompile(
    works: Collection[Work] | None = None,
    on_progress: Callable[[Progress], object] = lambda _: None,
) -> Compiled:
    """Compile, or load from disk, whatever kinds of work run, so that none waits for a compiler.

    It takes a second or two from the second time on, and none at all in a process that has done it
    before.

    Parameters
    ----------
    works : collection of Work, optional
        All by default.
    on_progress : callable, optional
        Called before and after each kernel that is compiled. What it raises ends the call.

    Raises
    ------
    RuntimeError
        If the process was forked from one in which threads of GNU OpenMP ran already: nothing can
        be planned there.
    """
    refuse_forked_threads()
    works = ALL if works is None else works
    stage = _Stage(works, on_progress)
    with kernels.listening(stage):
        for work in (*(each for each in works if each not in ALL), *ALL):
            if work in works and work not in _done:
                work.do()
                _done.add(work)
    return stage.compiled()


def missing_kernels(works: Collection[Work]) -> dict[kernels.Kernel, float]:
    """Return the kernels of some kinds of work that no process has compiled yet.

    Returns
    -------
    dict of Kernel to float
        About how many seconds each takes to compile, on one core of a cloud server.
    """
    modules = frozenset[str]().union(*(work.modules for work in works))
    relevant = [each for each in kernels.KERNELS if each.room in modules]
    alike = Counter(each.room for each in relevant)
    return {each: SECONDS[each.room] / alike[each.room] for each in relevant if not each.is_ready}


def progress_of(
    stage: str, compiled: int, elapsed: float, *, whole: float, left: float
) -> Progress:
    """Return how far compiling is.

    Parameters
    ----------
    stage : str
    compiled : int
        How many kernels have been compiled.
    elapsed : float
        Since when, seconds.
    whole, left : float
        How many seconds the whole and what is left of it take on the machine that was measured.
    """
    share = 1 - left / whole if whole else 0.0
    slow = elapsed / (share * whole) if share > _TELLING else 1.0
    return Progress(stage, compiled, math.nan, share=share, expected=elapsed + slow * left)


# --- the stage -----------------------------------------------------------------------------------


class _Stage:
    """Follows what is compiled; hears of every kernel before and after."""

    def __init__(
        self,
        works: Collection[Work],
        on_progress: Callable[[Progress], object],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._works = works
        self._on_progress = on_progress
        self._clock = clock
        self._name = ""
        self._began = self._ended = math.nan
        self._count = 0
        # What is being compiled, the innermost last: when it began, and seconds of others within.
        self._open: list[tuple[kernels.Kernel, float, float]] = []
        self._seconds: dict[str, float] = {}
        self._missing: dict[kernels.Kernel, float] = {}
        self._whole = self._left = 0.0

    def __call__(self, kernel: kernels.Kernel, is_ready: bool) -> None:
        """Take note of a kernel that is about to be compiled, or ready."""
        now = self._clock()
        if not is_ready:
            if not self._name:
                self._begin(now)
            self._open.append((kernel, now, 0.0))
            self._tell(now)
        else:
            self._left -= self._missing.pop(kernel, 0.0)
            if self._open and self._open[-1][0] is kernel:
                self._end(now)
                self._tell(now)

    def compiled(self) -> Compiled:
        """Return what has been compiled."""
        elapsed = self._ended - self._began if self._count else 0.0
        return Compiled(self._seconds, self._count, elapsed, kernels.kept_in())

    def _begin(self, now: float) -> None:
        self._name = COMPILING if kernels.kept_in() else COMPILING_IN_VAIN
        self._began = now
        self._missing = missing_kernels(self._works)
        self._whole = self._left = sum(self._missing.values())

    def _end(self, now: float) -> None:
        kernel, began, within = self._open.pop()
        self._ended = now
        self._count += 1
        took = self._seconds.get(kernel.room, 0.0) + now - began - within
        self._seconds[kernel.room] = took
        if self._open:
            outer, its_beginning, before = self._open.pop()
            self._open.append((outer, its_beginning, before + now - began))

    def _tell(self, now: float) -> None:
        elapsed = now - self._began
        self._on_progress(
            progress_of(self._name, self._count, elapsed, whole=self._whole, left=self._left)
        )


# What this process has done, and what it has found that others compiled.
_done: set[Work] = set()
_found: set[Work] = set()
