# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a process and all that it started take: memory, processor time, and their end."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_TICKS = os.sysconf("SC_CLK_TCK")
_SECONDS_BETWEEN_LOOKS = 0.05


def family(pid: int) -> list[int]:
    """Return a process and all processes that it started, and those that they started."""
    parents = {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended
            parents[int(entry.parent.name)] = int(_stat(entry)[1])
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def memory_of(pids: list[int]) -> float:
    """Return the memory of processes, MiB; pages that they share count once."""
    total = 0
    for pid in pids:
        with suppress(OSError):
            lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
            total += next(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total / 1024


def status_of(pid: int, field: str) -> int:
    """Return a figure of a process's status; 0 once it has ended."""
    with suppress(OSError):
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
        return next((int(line.split()[1]) for line in lines if line.startswith(field)), 0)
    return 0


def processor_seconds(pids: list[int]) -> float:
    """Return the processor time that processes have taken."""
    ticks = 0
    for pid in pids:
        with suppress(OSError):
            ticks += sum(map(int, _stat(Path(f"/proc/{pid}/stat"))[11:13]))
    return ticks / _TICKS


def end_all(pids: list[int]) -> None:
    """Kill processes that this one started."""
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


class Watch:
    """The peak of a process's memory, and whether it was killed for taking too much."""

    def __init__(self) -> None:
        self.peak = 0.0
        self.killed = False


@contextmanager
def watched(pid: int, most: float) -> Iterator[Watch]:
    """Look at the memory of a process and its children, and kill them above ``most`` MiB.

    Resident memory is the quick one to read; what they share counts for each.
    """
    watch, ending = Watch(), threading.Event()

    def look() -> None:
        while not ending.wait(_SECONDS_BETWEEN_LOOKS):
            pids = family(pid)
            resident = sum(status_of(one, "VmRSS") for one in pids) / 1024
            watch.peak = max(watch.peak, resident)
            if resident > most:
                watch.killed = True
                end_all(pids)
                return

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield watch
    finally:
        ending.set()
        thread.join()


def _stat(path: Path) -> list[str]:
    """Return the fields of ``stat`` from the state on; the name before it may hold anything."""
    return path.read_text().rpartition(")")[2].split()
