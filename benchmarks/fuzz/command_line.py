# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command line in a process that is not started anew each time, unless it hangs or dies."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.processes import end_all, family, watched

# Seconds and MiB that a call on a small file may take.
_SECONDS, _MOST = 30.0, 2500.0
_WORKERS = 2


@dataclass(frozen=True)
class Case:
    """A command, and what it was given, which is kept where it does harm."""

    argv: list[str]
    given: Path


class CommandLine:
    """Runs commands, one after the other."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, argv: list[str]) -> dict[str, Any]:
        """Return what a command did; ``fault`` says what it must not do."""
        process = self._started()
        began = time.perf_counter()
        assert process.stdin is not None
        assert process.stdout is not None
        with watched(process.pid, _MOST) as watch:
            process.stdin.write(json.dumps(argv).encode() + b"\n")
            process.stdin.flush()
            ready = select.select([process.stdout], [], [], _SECONDS)[0]
            line = process.stdout.readline() if ready else b""
        took = time.perf_counter() - began
        if line.endswith(b"\n"):
            answer = json.loads(line)
            return answer | {"fault": _fault(answer), "seconds": took}
        self.close()
        fault = f"took more than {_MOST:.0f} MiB" if watch.killed else "died"
        return {"fault": fault if ready else f"hung for {_SECONDS:.0f} s", "seconds": took}

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            end_all(family(self._process.pid))
            self._process.communicate()
            self._process = None

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            command = [sys.executable, "-m", "benchmarks.fuzz.worker"]
            self._process = subprocess.Popen(  # noqa: S603
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "NUMBA_NUM_THREADS": "1"},
            )
        return self._process


def _fault(answer: dict[str, Any]) -> str:
    """Return what is wrong with how a command ended, "" if nothing is."""
    if answer["raised"]:
        return "raised " + answer["raised"].strip().splitlines()[-1]
    for word in ("Traceback", "Warning:", "internal error"):
        if word in answer["err"]:
            return next(line for line in answer["err"].splitlines() if word in line)
    if answer["status"] not in {0, 1, 2}:
        return f"status {answer['status']}"
    if answer["status"] == 2 and not (answer["err"] or answer["out"]).strip():
        return "status 2 without a word"
    return ""


def run_all(
    cases: Iterable[Case], judge: Callable[[dict[str, Any]], str]
) -> tuple[Counter[str], list[str]]:
    """Run commands in a few processes, and remove what they were given.

    Parameters
    ----------
    cases : iterable of Case
    judge : callable
        Returns what an answer counts as.

    Returns
    -------
    Counter
        Answers by what they count as.
    list of str
        What was wrong, with the name of what was given; that is kept.
    """
    counts: Counter[str] = Counter()
    faults: list[str] = []
    lock, left = threading.Lock(), iter(cases)

    def work() -> None:
        line = CommandLine()
        try:
            while True:
                with lock:
                    case = next(left, None)
                if case is None:
                    return
                answer = line.run(case.argv)
                with lock:
                    counts[(answer["fault"] and "a fault") or judge(answer)] += 1
                    if answer["fault"]:
                        faults.append(f"{case.given.name}: {answer['fault']}")
        finally:
            line.close()

    with ThreadPoolExecutor(_WORKERS) as pool:
        for done in [pool.submit(work) for _ in range(_WORKERS)]:
            done.result()
    return counts, faults
