# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Doing jobs on workers of Dask: those of this machine, or of a scheduler somewhere.

A subject is sent to the scheduler once, as a task that unpacks it; the tasks that take it depend on
that. So it stays on the worker that unpacked it, others that have nothing to do fetch it from
there, and if all of them are lost it is unpacked again.
"""

from __future__ import annotations

import asyncio
import logging
import os
import queue
import signal
import sys
import time
import uuid
import warnings
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import Any

import dask
from dask.system import CPU_COUNT
from distributed import Client, Future, KilledWorker, LocalCluster
from distributed.client import ClosedClientError
from distributed.comm.addressing import parse_address, parse_host_port
from distributed.utils import LoopRunner
from distributed.versions import VersionMismatchWarning

from focus_planner.core.validation import InputError, check_whole
from focus_planner.evaluation.running import on_worker
from focus_planner.evaluation.running.on_worker import OneThread, OtherProgramError
from focus_planner.evaluation.running.program import program
from focus_planner.evaluation.running.running import Batch, WorkersLostError
from focus_planner.evaluation.running.window import Window
from focus_planner.evaluation.running.work import Assignment, Failed, Job, Succeeded, packed

_SECONDS_TO_CONNECT = 10.0
_SECONDS_BETWEEN_SIGNS = 0.4
_SECONDS_BETWEEN_COUNTS = 1.0
_SCHEMES = ("tcp", "tls")
_WORKER = "dask worker ADDRESS --nworkers auto --nthreads 1"
_KILLED = "the worker died whenever it was tried: a crash, or not enough memory"
_SECONDS_TO_END = 0.2
_SECONDS_TO_CLOSE = 5.0
_LAST_PORT = 65_535
_QUIET = logging.CRITICAL + 1
_THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
# Arrays come from memory that the process has: what Dask sets would page each of them in anew.
_MEMORY = {
    "MALLOC_ARENA_MAX": 1,
    "MALLOC_MMAP_THRESHOLD_": 2**25,
    "MALLOC_TRIM_THRESHOLD_": 2**29,
}
_SETTINGS: dict[str, Any] = {
    # A task whose worker died is tried again by itself, so that none is blamed for another.
    "distributed.scheduler.allowed-failures": 0,
    # A kernel that is compiled lets no sign of life through.
    "distributed.scheduler.worker-ttl": None,
    # It takes subjects away from workers between two of their tasks.
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {**dict.fromkeys(_THREADS, 1), **_MEMORY},
    # One that is killed is started again; on a busy machine that may take its time.
    "distributed.deploy.lost-worker-timeout": "1h",
}


class Cluster:
    """The workers of a scheduler, as :func:`local_cluster` and :func:`connected` yield it.

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
        flow = _Flow(self._client, self._program, assignment)
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

    def _alone(self, flow: _Flow, job: Job) -> Iterator[Batch]:
        while True:
            done, killed = self._finished(flow)
            yield [*done, *((job, Failed(_KILLED)) for job in killed)]
            if done or killed:
                flow.release(name for name in job.task.subjects if not flow.is_broken(name))
                return

    def _finished(self, flow: _Flow) -> tuple[list[tuple[Job, Succeeded | Failed]], list[Job]]:
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


class _Flow:
    """What is at the scheduler: subjects, jobs, and those that have come back."""

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


# --- where they are -------------------------------------------------------------------------------


@contextmanager
def local_cluster(workers: int | None = None) -> Iterator[Cluster]:
    """Start workers on this machine, on the loopback interface only; they end with the block.

    Parameters
    ----------
    workers : int, optional
        How many, each a process with one thread; by default as many as there are cores for this
        process.

    Raises
    ------
    InputError
        If the number is not at least 1.
    """
    count = check_whole("workers", CPU_COUNT if workers is None else workers, at_least=1)
    _be_quiet()
    with _own_environment(), dask.config.set(_SETTINGS), _loop() as loop:
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            memory_limit=None,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # or 8787 is taken in any case
            silence_logs=_QUIET,
            loop=loop,
        )
        try:
            with _client(cluster, loop) as client:
                yield Cluster(client)
        finally:
            _end(cluster)


@contextmanager
def connected(address: str) -> Iterator[Cluster]:
    """Use the workers of a scheduler, which goes on without this process.

    Parameters
    ----------
    address : str
        ``host:port``, or with the protocol before it, ``tcp://`` or ``tls://``.

    Raises
    ------
    InputError
        If that is no address, no scheduler answers there, or its workers run another program.
    """
    _check_address(address)
    _be_quiet()
    with _loop() as loop, _client(address, loop) as client:
        yield Cluster(client)


@contextmanager
def _client(where: LocalCluster | str, loop: Any) -> Iterator[Client]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VersionMismatchWarning)  # all versions are compared
            client = Client(where, loop=loop, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ImportError, ValueError) as error:
        raise InputError(
            "--scheduler",
            "the address of a Dask scheduler that answers",
            f"{where}, where none does ({type(error).__name__})",
            "start one by: dask scheduler",
        ) from None
    try:
        yield client
    finally:
        with suppress(TimeoutError, OSError):  # of a scheduler that is gone
            client.close(timeout=_SECONDS_TO_CLOSE)


def _check_address(address: str) -> None:
    try:
        scheme, place = parse_address(address)
        host, port = parse_host_port(place)
        is_one = scheme in _SCHEMES and bool(host) and 0 < int(port or 0) <= _LAST_PORT
    except ValueError:
        is_one = False
    if not is_one:
        raise InputError("--scheduler", "an address such as tcp://192.0.2.1:8786", repr(address))


def _be_quiet() -> None:
    """Keep what Dask logs off the terminal of a command."""
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(_QUIET)
    for name in list(logging.Logger.manager.loggerDict):
        if name.startswith(("distributed.", "tornado.")):
            logging.getLogger(name).setLevel(_QUIET)


@contextmanager
def _loop() -> Iterator[Any]:
    """Run an event loop in a thread.

    Workers inherit that Ctrl-C is blocked there: it is typed for all processes of a terminal, but
    only the one that waits for them is to act on it.
    """
    runner = LoopRunner()
    with _blocked_interrupts():
        runner.start()
    try:
        yield runner.loop
    finally:
        runner.stop()


@contextmanager
def _blocked_interrupts() -> Iterator[None]:
    if sys.platform == "win32":
        yield
    else:
        before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _own_environment() -> Iterator[None]:
    """Undo what Dask sets in the environment of this process for those that it starts."""
    before = dict(os.environ)
    os.environ["DASK_LOGGING__DISTRIBUTED"] = "critical"
    try:
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


def _end(cluster: LocalCluster) -> None:
    """End workers without waiting for what they do."""

    async def kill() -> None:
        await asyncio.gather(
            *(each.close(timeout=_SECONDS_TO_END) for each in cluster.workers.values())
        )

    with suppress(TimeoutError, OSError):
        cluster.sync(kill)
    cluster.close(timeout=_SECONDS_TO_CLOSE)
