# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which jobs are handed out next, so that subjects stay few, and on as few workers as possible."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence

from focus_planner.evaluation.running.work import Job

# One that is worked on, and one that waits for its worker.
_PER_WORKER = 2


class Window:
    """The jobs that are left, in groups that take the same subjects, and those handed out.

    A worker that has a subject does its jobs one after the other; groups are opened as workers
    have nothing to do, so at most some two for each worker are open. Only when no group is left to
    open do several workers share one.

    Parameters
    ----------
    jobs : sequence of Job
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        self._waiting: dict[tuple[str, ...], deque[Job]] = {}
        for job in jobs:
            self._waiting.setdefault(job.task.subjects, deque()).append(job)
        # How many jobs still need a subject, handed out or not.
        self._needed = Counter(name for job in jobs for name in job.task.subjects)
        self._handed_out: Counter[tuple[str, ...]] = Counter()

    @property
    def handed_out(self) -> int:
        """How many jobs are handed out."""
        return self._handed_out.total()

    @property
    def is_empty(self) -> bool:
        """Whether all is done."""
        return not self._waiting and not self.handed_out

    def next(self, workers: int) -> Job | None:
        """Hand out a job; None if these workers have enough to do."""
        if not self._waiting or self.handed_out >= _PER_WORKER * (workers + 1):
            return None
        group = self._best()
        job = self._waiting[group].popleft()
        if not self._waiting[group]:
            del self._waiting[group]
        self._handed_out[group] += 1
        return job

    def take_back(self, job: Job) -> list[str]:
        """Note that a job is done, and return the subjects that no other needs."""
        self._handed_out[job.task.subjects] -= 1
        self._handed_out += Counter()  # drops what has come to nothing
        self._needed.subtract(job.task.subjects)
        return [name for name in job.task.subjects if not self._needed[name]]

    def _best(self) -> tuple[str, ...]:
        """Return an open group with too little to do; else one to open; else the least busy."""
        busy = self._handed_out
        opened = [group for group in busy if group in self._waiting]
        least = min(opened, key=busy.__getitem__, default=None)
        if least is not None and busy[least] < _PER_WORKER:
            return least
        unopened = next((group for group in self._waiting if group not in busy), None)
        if unopened is not None:
            return unopened
        assert least is not None
        return least
