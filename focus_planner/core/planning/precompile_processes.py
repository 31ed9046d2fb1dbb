# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compiling in several processes at once, for who has cores to spare.

A compiler uses one core. Each kind of work is done by a process that is free, once the kinds that
it comes after are done, and the kernels are found where they are kept. In the end this process does
them all: that loads what the others have compiled, and compiles what one that was ended has left.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import TYPE_CHECKING

from numba import config

from focus_planner.core import kernels
from focus_planner.core.planning.precompile import (
    Compiled,
    missing_kernels,
    precompile,
    progress_of,
)
from focus_planner.core.planning.work import ALL, Work
from focus_planner.core.progress import COMPILING, Progress

if TYPE_CHECKING:
    if sys.platform == "win32":
        from multiprocessing.connection import PipeConnection as Connection
    else:
        from multiprocessing.connection import Connection

_SECONDS_BETWEEN_LOOKS = 1.0
# So many kinds of work at once; more processes would take memory, and wait.
_USEFUL = 4


def useful_processes() -> int:
    """Return how many processes are worth starting on this machine."""
    return min(int(config.NUMBA_NUM_THREADS), _USEFUL)


def precompile_in_processes(
    works: Collection[Work],
    on_progress: Callable[[Progress], object],
    processes: int,
) -> Compiled:
    """Compile what kinds of work run, in several processes at once.

    Parameters
    ----------
    works : collection of Work
    on_progress : callable
        Called now and then. What it raises ends the call.
    processes : int
        How many at most, at least 1; no more are started than there are kinds of work to do.

    Returns
    -------
    Compiled
        The seconds of its modules are those of all processes together.
    """
    if processes == 1 or kernels.kept_in() is None:
        return precompile(works, on_progress)
    began = time.perf_counter()
    missing = _Missing(works, min(processes, len(works)))
    if not missing.kernels:
        return precompile(works, on_progress)
    with _started(missing.processes) as connections:
        done = _share_out(works, connections, lambda: missing.tell(on_progress))
    done.append(precompile(works, on_progress))
    return _sum(done, time.perf_counter() - began)


def _share_out(
    works: Collection[Work], idle: list[Connection], on_wait: Callable[[], object]
) -> list[Compiled]:
    """Have each kind of work done by a process; return what they have compiled."""
    waiting = [work for work in ALL if work in works]
    busy: dict[Connection, Work] = {}
    done: list[Compiled] = []
    while (waiting and idle) or busy:
        for work in _ready(waiting, busy.values())[: len(idle)]:
            connection = idle.pop()
            with suppress(BrokenPipeError):  # that it has ended is noticed below
                connection.send(ALL.index(work))
            waiting.remove(work)
            busy[connection] = work
        heard = wait(list(busy), _SECONDS_BETWEEN_LOOKS)
        for connection in [each for each in busy if each in heard]:
            busy.pop(connection)
            # A process may have been ended, for want of memory for instance.
            with suppress(EOFError, ConnectionResetError):
                done.append(connection.recv())
                idle.append(connection)
        on_wait()
    return done


def _ready(waiting: Collection[Work], being_done: Collection[Work]) -> list[Work]:
    """Return what can be done now, first what most has to wait for."""

    def seconds_to_the_end(work: Work) -> float:
        followers = [seconds_to_the_end(other) for other in waiting if work in other.after]
        return work.seconds + max(followers, default=0.0)

    undone = {*waiting, *being_done}
    ready = [work for work in waiting if undone.isdisjoint(work.after)]
    return sorted(ready, key=seconds_to_the_end, reverse=True)


class _Missing:
    """What is still to be compiled, as the folder shows in which all processes keep it."""

    def __init__(self, works: Collection[Work], processes: int) -> None:
        self.kernels = self._left = missing_kernels(works)
        self.processes = processes
        self._began = time.perf_counter()

    def tell(self, on_progress: Callable[[Progress], object]) -> None:
        self._left = {each: took for each, took in self._left.items() if not each.is_ready}
        on_progress(
            progress_of(
                COMPILING,
                len(self.kernels) - len(self._left),
                time.perf_counter() - self._began,
                whole=sum(self.kernels.values()) / self.processes,
                left=sum(self._left.values()) / self.processes,
            )
        )


def _sum(done: Collection[Compiled], elapsed: float) -> Compiled:
    seconds: dict[str, float] = {}
    for each in done:
        for module, took in each.seconds.items():
            seconds[module] = seconds.get(module, 0.0) + took
    count = sum(each.kernels for each in done)
    return Compiled(seconds, count, elapsed if count else 0.0, kernels.kept_in())


# --- the processes -------------------------------------------------------------------------------


@contextmanager
def _started(count: int) -> Iterator[list[Connection]]:
    """Start processes, and end them with the block."""
    context = get_context("spawn")
    started, connections = [], []
    try:
        for _ in range(count):
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs,), daemon=True)
            process.start()
            theirs.close()  # so that it is noticed when the other end is gone
            started.append(process)
            connections.append(ours)
        yield connections
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.join()


def _serve(connection: Connection) -> None:
    """Do one kind of work after the other, by its number, as long as somebody wants it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # on Ctrl-C the other process ends this one
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            connection.send(precompile((ALL[connection.recv()],), _end_with_parent))


def _end_with_parent(_: Progress) -> None:
    parent = parent_process()
    if parent is None or not parent.is_alive():
        raise SystemExit
