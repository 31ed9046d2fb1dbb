# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a worker of Dask runs.

Imports nothing that takes long: it sets the threads of libraries before they are loaded.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import nullcontext, suppress
from functools import cache
from typing import TYPE_CHECKING, Any

from distributed import get_worker
from distributed.diagnostics.plugin import WorkerPlugin

from focus_planner.runtime.cores import share_cores

if TYPE_CHECKING:
    from focus_planner.evaluation.experiment import Conditions, Row
    from focus_planner.evaluation.running.work import Failed, Measure, Parcel, Succeeded
    from focus_planner.evaluation.subject import Subject


class OneThread(WorkerPlugin):
    """Lets every worker plan in one thread, and leave Ctrl-C to whoever started it."""

    name = "focus_planner: one thread"
    idempotent = True

    def setup(self, worker: Any) -> None:
        """Set up a worker, before its first task."""
        share_cores()
        os.environ["NUMBA_NUM_THREADS"] = "1"
        if "numba" in sys.modules:  # a program's main module, which has been imported again, may
            from numba.core import config

            config.reload_config()
        if worker.nanny:
            with suppress(ValueError):  # not in the main thread
                signal.signal(signal.SIGINT, signal.SIG_IGN)


class OtherProgramError(Exception):
    """The worker does not run the program that asks it."""


class Unpacked:
    """A subject on a worker.

    Parameters
    ----------
    subject : Subject or Failed
    nbytes : int
        About how much it takes to send it to another, by which Dask decides whether to.
    """

    def __init__(self, subject: Subject | Failed, nbytes: int) -> None:
        self.subject = subject
        self._nbytes = nbytes

    def __sizeof__(self) -> int:
        """Return about how many bytes travel with it."""
        return self._nbytes


def program_of(dask_worker: Any) -> dict[str, str]:
    """Return the versions of a worker's program, and how many tasks it runs at once."""
    from focus_planner.evaluation.running.program import program

    return {**program(), "threads": str(dask_worker.state.nthreads)}


def unpack(program: dict[str, str], parcel: Parcel | Failed) -> Unpacked:
    """Return a subject, for all tasks of this worker that take it."""
    _get_ready(program)
    from focus_planner.evaluation.running.work import unpacked

    return Unpacked(unpacked(parcel), _nbytes(parcel))


def measure(
    program: dict[str, str],
    experiment: Measure,
    setting: Row,
    conditions: Conditions,
    *subjects: Unpacked,
) -> Succeeded | Failed:
    """Return what a task has found; or why it has failed."""
    _get_ready(program)
    from focus_planner.evaluation.running.work import measured

    return measured(experiment, setting, conditions, [each.subject for each in subjects])


def _get_ready(program: dict[str, str]) -> None:
    worker = get_worker()
    here = program_of(worker)
    if here != program:
        raise OtherProgramError(worker.address, here)
    _compile()


@cache
def _compile() -> None:
    """Compile what plans run, unless it is there; of the workers of a machine one does."""
    from focus_planner.core import kernels
    from focus_planner.core.planning.precompile import missing_kernels, precompile
    from focus_planner.core.planning.work import PLANS
    from focus_planner.io.file_locks import locked_folder

    if not missing_kernels(PLANS):
        return
    folder = kernels.kept_in()
    with locked_folder(folder) if folder else nullcontext():
        precompile(PLANS)


def _nbytes(parcel: Parcel | Failed) -> int:
    import pickle

    return len(pickle.dumps(parcel))
