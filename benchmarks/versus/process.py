# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""A revision in a process of its own, which runs one stage at a time."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from tempfile import TemporaryFile

_INSIDE = Path(__file__).parent / "inside"


class EndedError(RuntimeError):
    """The process ended, or never began, with the last that it said."""


class LackingError(LookupError):
    """The revision cannot run a stage, with what it said."""


class Process:
    """A process that lives until it is closed.

    Parameters
    ----------
    python, root : Path
        The program, and the folder that ``focus_planner`` is imported from.
    surface : Path
        The file of the surface to plan for.
    threads : int, optional
        How many Numba may use; by default one per core.
    """

    def __init__(self, python: Path, root: Path, surface: Path, threads: int | None = None) -> None:
        environment = os.environ | {"PYTHONPATH": str(root)}
        if threads is not None:
            environment["NUMBA_NUM_THREADS"] = str(threads)
        self._log = TemporaryFile("w+")  # noqa: SIM115 - closed with the process
        self._process = subprocess.Popen(  # noqa: S603
            [python, _INSIDE, surface],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            env=environment,
        )

    def run(self, stage: str, number: int, seed: int) -> tuple[float, float]:
        """Return the seconds of a stage, and a figure of its result.

        Raises
        ------
        LackingError
            If the revision cannot.
        EndedError
            If the process does not live any more.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            print(json.dumps([stage, number, seed]), file=self._process.stdin, flush=True)
        except BrokenPipeError:
            raise EndedError(self._last_words()) from None
        line = self._process.stdout.readline()
        if not line:
            raise EndedError(self._last_words())
        outcome = json.loads(line)
        if isinstance(outcome, str):
            raise LackingError(outcome)
        seconds, result = outcome
        return seconds, result

    def _last_words(self) -> str:
        status = self._process.wait()
        self._log.seek(0)
        lines = self._log.read().strip().splitlines() or ["it said nothing"]
        return f"ended with {status}: {lines[-1]}"

    def close(self) -> None:
        """End the process."""
        self._process.communicate()  # without questions it ends
        self._log.close()
