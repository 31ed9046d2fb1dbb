# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is at Dask's scheduler: subjects, jobs, and those that have come back.

A subject is sent to the scheduler once, as a task that unpacks it; the tasks that take it depend on
that. So it stays on the worker that unpacked it, others that have nothing to do fetch it from
there, and if all of them are lost it is unpacked again.
"""

from __future__ import annotations

import queue
import uuid
import warnings
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from distributed import Client, Future

from focus_planner.evaluation.running import on_worker
from focus_planner.evaluation.running.work import Assignment, Job, packed

_SECONDS_BETWEEN_SIGNS = 0.4


class Flow:
    """Hands jobs to a scheduler, with the subjects that they take, and gets them back.

    Parameters
    ----------
    client : Client
        Connected.
    the_program : dict
        Versions that a worker must have.
    assignment : Assignment
    """

    def __init__(self, client: Client, the_program: dict[str, str], assignment: Assignment) -> None:
        self._client = client
        self._program = the_program
        self._assignment = assignment
        self._name = f"{uuid.uuid4().hex[:8]}"
        self._serial = 0
        self._subjects: dict[str, Future[Any]] = {}
        self._jobs: dict[Future[Any], Job] = {}
        self._back: queue.SimpleQueue[Future[Any]] = queue.SimpleQueue()

    def submit(self, job: Job) -> None:
        """Hand out a job."""
        assignment, task = self._assignment, job.task
        subjects = [self._subject(name) for name in task.subjects]
        what = (assignment.measure, task.setting, assignment.conditions)
        future = self._submit(on_worker.measure, *what, *subjects)
        self._jobs[future] = job
        future.add_done_callback(self._back.put)

    def finished(self) -> list[tuple[Job, Future[Any]]]:
        """Wait a moment for jobs to come back, and return all that have."""
        back = []
        with suppress(queue.Empty):
            back.append(self._back.get(timeout=_SECONDS_BETWEEN_SIGNS))
            while True:
                back.append(self._back.get_nowait())
        return [(self._jobs.pop(future), future) for future in back]

    def release(self, subjects: Iterable[str]) -> None:
        """Let workers forget subjects."""
        for name in subjects:
            self._subjects.pop(name, None)

    def is_broken(self, name: str) -> bool:
        """Return whether unpacking a subject killed its worker, so that no task can have it."""
        return self._subjects[name].status == "error"

    def cancel(self) -> None:
        """Take back all that is handed out."""
        if self._jobs and self._client.status == "running":
            with suppress(Exception):  # of a scheduler that is gone
                self._client.cancel(list(self._jobs))
        self._jobs.clear()
        self._subjects.clear()

    def _subject(self, name: str) -> Future[Any]:
        future = self._subjects.get(name)
        if future is None:
            parcel = packed(self._assignment.sources[name])
            # Before measuring, or workers would wait for it.
            future = self._submit(on_worker.unpack, parcel, priority=1)
            self._subjects[name] = future
        return future

    def _submit(self, function: Any, *arguments: Any, priority: int = 0) -> Future[Any]:
        self._serial += 1
        key = f"{function.__name__}-{self._name}-{self._serial}"
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sending large graph")
            return self._client.submit(
                function, self._program, *arguments, key=key, pure=False, priority=priority
            )
