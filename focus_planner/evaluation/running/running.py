# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Running an experiment: what is missing of its results is measured, here or on many machines."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from focus_planner.evaluation.experiment import Conditions, Experiment
from focus_planner.evaluation.results.results_file import ResultsFile
from focus_planner.evaluation.results.store import Store
from focus_planner.evaluation.running.work import (
    Assignment,
    Failed,
    Job,
    Source,
    Succeeded,
    jobs_of,
)

Batch = Sequence[tuple[Job, Succeeded | Failed]]


class Workers(Protocol):
    """Who does jobs."""

    @property
    def count(self) -> int:
        """How many jobs are done at once; 0 while nobody is there."""
        ...

    def work(self, assignment: Assignment) -> Iterator[Batch]:
        """Do jobs; yield those done, in whatever order, and nothing now and then meanwhile."""
        ...


class WorkersLostError(Exception):
    """The workers can do no more; what was done is kept. Its text says what to do."""


@dataclass(frozen=True)
class TasksDone:
    """How far an experiment is.

    Attributes
    ----------
    done : int
        Tasks whose results are kept, those of earlier runs among them.
    resumed : int
        How many of these are of earlier runs.
    failed, total : int
        Tasks.
    workers : int
        How many work; 0 while none is connected, and the experiment waits.
    seconds_left : float or None
        About; None before the first task is done.
    """

    done: int
    resumed: int
    failed: int
    total: int
    workers: int
    seconds_left: float | None


@dataclass(frozen=True)
class Outcome:
    """What came of an experiment.

    Attributes
    ----------
    file : ResultsFile
    done, resumed, total : int
        As in :class:`TasksDone`.
    failures : tuple of (str, str)
        Which tasks failed, and why.
    """

    file: ResultsFile
    done: int
    resumed: int
    total: int
    failures: tuple[tuple[str, str], ...]


def run(
    experiment: Experiment,
    sources: Sequence[Source],
    conditions: Conditions,
    store: Store,
    where: Workers,
    on_progress: Callable[[TasksDone], object] = lambda _: None,
) -> Outcome:
    """Measure what is missing of an experiment's results.

    Parameters
    ----------
    experiment : Experiment
    sources : sequence of Source
        Of the subjects that it takes.
    conditions : Conditions
    store : Store
        Where results are kept as they come.
    where : Workers
    on_progress : callable
        Called after every few tasks, and at least about twice a second where others work. What it
        raises ends the run; what was done is kept.

    Returns
    -------
    Outcome
        Tasks that failed are no exception; the next run tries them again.

    Raises
    ------
    InputError
        If results cannot be kept, or workers run another program.
    WorkersLostError
        If the workers are lost.
    """
    jobs = jobs_of(experiment, sources, conditions)
    file = store.results_of(experiment.name, jobs)
    run_ = _Run(file, len(jobs), where, on_progress)
    missing = [job for job in jobs if job.key not in file.done]
    by_name = {source.name: source for source in sources}
    try:
        if missing:
            run_.go(Assignment(experiment.measure, conditions, by_name, missing))
    finally:
        file.finish(run_.failed)
    return run_.outcome({job.key: job for job in jobs})


class _Run:
    """A run of an experiment: what it has done so far."""

    def __init__(
        self,
        file: ResultsFile,
        total: int,
        where: Workers,
        on_progress: Callable[[TasksDone], object],
    ) -> None:
        self.failed: dict[str, Failed] = {}
        self._file = file
        self._total = total
        self._resumed = self._done = len(file.done)
        self._where = where
        self._on_progress = on_progress
        self._began = time.monotonic()

    def go(self, assignment: Assignment) -> None:
        """Have jobs done, and keep what comes of them."""
        self._tell()
        for batch in self._where.work(assignment):
            found = [(job, what) for job, what in batch if isinstance(what, Succeeded)]
            self._file.add(found)
            self._done += len(found)
            self.failed.update((job.key, what) for job, what in batch if isinstance(what, Failed))
            self._tell()

    def outcome(self, jobs: Mapping[str, Job]) -> Outcome:
        """Return what came of it."""
        failures = tuple((_called(jobs[key]), why.reason) for key, why in self.failed.items())
        return Outcome(self._file, self._done, self._resumed, self._total, failures)

    def _tell(self) -> None:
        self._on_progress(
            TasksDone(
                self._done,
                self._resumed,
                len(self.failed),
                self._total,
                self._where.count,
                self._seconds_left(),
            )
        )

    def _seconds_left(self) -> float | None:
        tried = self._done - self._resumed + len(self.failed)
        if not tried:
            return None
        left = self._total - self._resumed - tried
        return left * (time.monotonic() - self._began) / tried


def _called(job: Job) -> str:
    """Return a job as users are told of it."""
    setting = ", ".join(f"{name} {value}" for name, value in job.task.setting.items())
    subjects = " + ".join(job.task.subjects)
    return f"{subjects} ({setting})" if setting else subjects
