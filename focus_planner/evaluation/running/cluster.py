# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Doing jobs on workers of Dask."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any

from distributed import Client, Future, KilledWorker
from distributed.client import ClosedClientError

from focus_planner.core.validation import InputError
from focus_planner.evaluation.running import on_worker
from focus_planner.evaluation.running.flow import Flow
from focus_planner.evaluation.running.on_worker import OneThread, OtherProgramError
from focus_planner.evaluation.running.program import program
from focus_planner.evaluation.running.running import Batch, WorkersLostError
from focus_planner.evaluation.running.window import Window
from focus_planner.evaluation.running.work import Assignment, Failed, Job, Succeeded

_SECONDS_BETWEEN_COUNTS = 1.0
_WORKER = "dask worker ADDRESS --nworkers auto --nthreads 1"
_KILLED = "the worker died whenever it was tried: a crash, or not enough memory"


class Cluster:
    """The workers of a scheduler, as ``connecting`` yields it.

    Parameters
    ----------
    client : Client
        Connected.
    """

    def __init__(self, client: Client) -> None:
        assert client.scheduler is not None  # connected
        self._client = client
        self._program = {**program(), "threads": "1"}
        self._address = client.scheduler.address
        self._count = 0
        self._counted = -_SECONDS_BETWEEN_COUNTS
        self._check_program()
        client.register_plugin(OneThread())

    @property
    def count(self) -> int:
        """How many workers are connected, as of a second ago."""
        if time.monotonic() - self._counted >= _SECONDS_BETWEEN_COUNTS:
            self._check_connection()
            with self._losing():
                self._count = len(self._client.nthreads())
            self._counted = time.monotonic()
        return self._count

    def work(self, assignment: Assignment) -> Iterator[Batch]:
        """Do jobs; yield those done, and nothing twice a second meanwhile.

        Raises
        ------
        InputError
            If a worker runs another program.
        WorkersLostError
            If the scheduler is lost.
        """
        window, suspects = Window(assignment.jobs), []
        flow = Flow(self._client, self._program, assignment)
        try:
            while not window.is_empty:
                while (job := window.next(self.count)) is not None:
                    flow.submit(job)
                done, killed = self._finished(flow)
                for job in (*(job for job, _ in done), *killed):
                    flow.release(window.take_back(job))
                suspects += killed
                yield done
            # Whatever else was on a worker when it died is suspected too.
            for job in suspects:
                flow.submit(job)
                yield from self._alone(flow, job)
        finally:
            flow.cancel()

    def _alone(self, flow: Flow, job: Job) -> Iterator[Batch]:
        while True:
            done, killed = self._finished(flow)
            yield [*done, *((job, Failed(_KILLED)) for job in killed)]
            if done or killed:
                flow.release(name for name in job.task.subjects if not flow.is_broken(name))
                return

    def _finished(self, flow: Flow) -> tuple[list[tuple[Job, Succeeded | Failed]], list[Job]]:
        """Return jobs that are done, and those whose worker was killed."""
        self._check_connection()
        done: list[tuple[Job, Succeeded | Failed]] = []
        back = flow.finished()
        found = self._gathered([future for _, future in back])
        for (job, future), what in zip(back, found, strict=True):
            result = self._failure(future) if what is None else what
            if result is not None:
                done.append((job, result))
        names = {job.key for job, _ in done}
        return done, [job for job, _ in back if job.key not in names]

    def _gathered(self, futures: list[Future[Any]]) -> list[Succeeded | None]:
        """Return results; None where there is none."""
        if any(future.status in ("cancelled", "lost") for future in futures):
            raise self._lost()
        with self._losing():
            found = self._client.gather(dict(enumerate(futures)), errors="skip")
        return [found[place] for place in range(len(futures))]

    def _failure(self, future: Future[Any]) -> Failed | None:
        """Return why a job failed; None if its worker was killed."""
        with self._losing():
            error = future.exception()
        if isinstance(error, KilledWorker):
            return None
        if isinstance(error, OtherProgramError):
            self._compare(*error.args)
        return Failed(" ".join(f"internal error: {type(error).__name__}: {error}".split()))

    def _check_program(self) -> None:
        answers = self._client.run(on_worker.program_of, on_error="return")
        for address, answer in answers.items():
            if isinstance(answer, BaseException):
                raise InputError(
                    f"worker {address}",
                    f"one with focus_planner {self._program['focus_planner']}",
                    f"{type(answer).__name__}: {answer}",
                    "start it in an environment with the same packages",
                )
            self._compare(address, answer)

    def _compare(self, address: str, theirs: dict[str, str]) -> None:
        ours = self._program
        names = [name for name in ours if theirs.get(name) != ours[name]]
        if names:
            raise InputError(
                f"worker {address}",
                ", ".join(f"{name} {ours[name]}" for name in names),
                ", ".join(f"{name} {theirs.get(name, 'missing')}" for name in names),
                f"start workers with the program that asks them, by {_WORKER}",
            )

    def _check_connection(self) -> None:
        if self._client.status != "running":
            raise self._lost()

    @contextmanager
    def _losing(self) -> Iterator[None]:
        """Tell in our own words of a scheduler that is lost meanwhile."""
        try:
            yield
        except (OSError, TimeoutError, CancelledError, ClosedClientError) as error:
            raise self._lost() from error

    def _lost(self) -> WorkersLostError:
        return WorkersLostError(
            f"the scheduler {self._address} is gone; what was done is kept: with a scheduler again,"
            " the same command does the rest"
        )
