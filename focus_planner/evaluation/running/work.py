# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is done for a task, wherever that is: unpack its subjects, measure them."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Protocol

from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import Conditions, Experiment, Measured, Row, Task
from focus_planner.evaluation.results.cells import text_of
from focus_planner.evaluation.running.program import version

if TYPE_CHECKING:
    from focus_planner.evaluation.subject import Subject

Measure = Callable[[Sequence["Subject"], Row, Conditions], Measured]


class Parcel(Protocol):
    """A subject as it travels: all that it takes, without the files that it came from."""

    def unpack(self) -> Subject:
        """Return the subject."""
        ...


class Source(Protocol):
    """Where a subject comes from."""

    @property
    def name(self) -> str:
        """Its name, which no other subject of the evaluation has."""
        ...

    @property
    def digest(self) -> str:
        """Of the content, and of all that decides which subject it becomes."""
        ...

    def pack(self) -> Parcel:
        """Return it for another machine."""
        ...


@dataclass(frozen=True)
class Job:
    """A task of an experiment.

    Attributes
    ----------
    task : Task
    key : str
        The same for the same experiment, setting, conditions, subjects and version of the program.
    """

    task: Task
    key: str


@dataclass(frozen=True)
class Assignment:
    """The jobs of an experiment that are still to be done.

    Attributes
    ----------
    measure : callable
    conditions : Conditions
    sources : mapping of str to Source
        By the subjects' names.
    jobs : sequence of Job
    """

    measure: Measure
    conditions: Conditions
    sources: Mapping[str, Source]
    jobs: Sequence[Job]


@dataclass(frozen=True)
class Succeeded:
    """What a job has found, and how many seconds it took in all."""

    measured: Measured
    seconds: float


@dataclass(frozen=True)
class Failed:
    """Why a job, or the unpacking of a subject, has failed: in a line."""

    reason: str


def jobs_of(experiment: Experiment, sources: Sequence[Source], conditions: Conditions) -> list[Job]:
    """Return the jobs of an experiment, in the order of its tasks."""
    digests = {source.name: source.digest for source in sources}
    jobs = []
    for task in experiment.tasks(list(digests), conditions):
        told = (
            experiment.name,
            {name: text_of(value) for name, value in task.setting.items()},
            asdict(conditions),
            [(name, digests[name]) for name in task.subjects],
            version(),
        )
        key = hashlib.sha256(json.dumps(told).encode()).hexdigest()[:16]
        jobs.append(Job(task, key))
    return jobs


def packed(source: Source) -> Parcel | Failed:
    """Return a subject as it travels; or why it cannot."""
    try:
        return source.pack()
    except Exception as error:  # noqa: BLE001 - whatever it is, the other tasks go on
        return Failed(_reason(error))


def unpacked(parcel: Parcel | Failed) -> Subject | Failed:
    """Return a subject, prepared for casting rays; or why there is none."""
    if isinstance(parcel, Failed):
        return parcel
    try:
        subject = parcel.unpack()
        _ = subject.scene
    except Exception as error:  # noqa: BLE001
        return Failed(_reason(error))
    return subject


def measured(
    measure: Measure, setting: Row, conditions: Conditions, subjects: Sequence[Subject | Failed]
) -> Succeeded | Failed:
    """Return what a task has found; or why it has failed."""
    given: list[Subject] = []
    for subject in subjects:
        if isinstance(subject, Failed):
            return subject
        _ = subject.scene  # which does not travel, and is no part of the task
        given.append(subject)
    began = time.perf_counter()
    try:
        found = measure(given, setting, conditions)
    except Exception as error:  # noqa: BLE001
        return Failed(_reason(error))
    return Succeeded(found, time.perf_counter() - began)


def _reason(error: Exception) -> str:
    if isinstance(error, InputError):
        return str(error)
    return " ".join(f"internal error: {type(error).__name__}: {error}".split())
