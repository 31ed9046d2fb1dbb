"""Recording runs beside the planning, in threads of its own.

What it costs the planner: inputs are compressed, and large ones written, when they come, not when
they are planned with; a run's beginning is written, and waited for, while rays are cast; its steps
are noted, and written once a second; its end is written after the caller has the answer. Nothing
that goes wrong here reaches the planner: it is logged, and told with the plan.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock

from focus_planner.core.planning.fingerprint import fingerprints
from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Progress, ProgressCallback
from focus_planner.messages.writing import Stamp
from focus_planner.parameters.planner import Recording
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.retention import delete_leftovers, prune
from focus_planner.recording.run import (
    Beginning,
    Ending,
    answered_plan,
    beginning_messages,
    ending_messages,
    markers_message,
    progress_message,
    stamp_of,
)
from focus_planner.runtime.log import Log

_SECONDS_BETWEEN_WRITES = 1.0
# The caller, probably on this machine, is reading its answer meanwhile.
_SECONDS_TO_DELIVER = 0.03
_MOST_JOBS = 16
# Bytes that take longer to write than a caller should wait.
_LARGE = 1_000_000
# For the disk's cache, which a busy disk may make wait.
_SECONDS_TO_KEEP = 0.1
# For a disk, at most.
_SECONDS_TO_WAIT = 20.0


@dataclass(frozen=True)
class _Ready:
    """A bag with inputs, for the next run; below a directory, or in memory."""

    directory: Path | None
    inputs: tuple[BagMessage, ...]
    bag: BagWriter

    def serves(self, directory: Path, inputs: tuple[BagMessage, ...]) -> bool:
        """Return whether the next run, if it has these inputs, can go on in it."""
        there = self.directory is None or (self.directory == directory and self.bag.is_there)
        return there and self.inputs == inputs


class Recorder:
    """Writes runs, in two threads: one for what a planner waits for, one for all else.

    Parameters
    ----------
    log : Log
        Told of every run that could not be recorded.
    """

    def __init__(self, log: Log) -> None:
        self._log = log
        self._now = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recording")
        self._later = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recording, later")
        self._jobs: set[Future[None]] = set()
        self._ready: _Ready | None = None
        self._taking = Lock()

    def prepare(self, directory: Path, inputs: Sequence[BagMessage]) -> None:
        """Compress what the next run will probably begin with.

        What is large is written too, into a hidden folder that becomes the run's.
        """
        self.do_later(lambda: self._prepare(directory, tuple(inputs)), lambda _: None)

    def begin(
        self, how: Recording, inputs: Sequence[BagMessage], beginning: Beginning
    ) -> RunRecorder:
        """Begin to write a run, in ``how.directory``.

        Where runs come faster than they can be written this waits until few are left to finish.
        """
        until = time.monotonic() + _SECONDS_TO_WAIT
        while len(self._jobs) > _MOST_JOBS and time.monotonic() < until:
            wait(self._jobs.copy(), 0.05, FIRST_COMPLETED)
        return RunRecorder(self, self._log, how, tuple(inputs), beginning)

    def close(self, timeout: float | None = None) -> bool:
        """Write what is still to be written; return whether all of it was, in time."""
        self.do_later(self._discard, lambda _: None)
        self._now.shutdown(wait=False)
        self._later.shutdown(wait=False)
        return not wait(self._jobs.copy(), timeout).not_done

    @property
    def jobs(self) -> int:
        """How many jobs wait or are done just now."""
        return len(self._jobs)

    @property
    def busy(self) -> bool:
        """Whether other jobs wait than the one that asks."""
        return len(self._jobs) > 1

    def do_now(self, job: Callable[[], None], failed: Callable[[Exception], None]) -> Future[None]:
        """Do a job that a planner waits for; call ``failed`` if it raises."""
        return self._do(self._now, job, failed)

    def do_later(
        self, job: Callable[[], None], failed: Callable[[Exception], None]
    ) -> Future[None]:
        """Do a job after all others of the kind; call ``failed`` if it raises."""
        return self._do(self._later, job, failed)

    def _do(
        self,
        thread: ThreadPoolExecutor,
        job: Callable[[], None],
        failed: Callable[[Exception], None],
    ) -> Future[None]:

        def guarded() -> None:
            try:
                job()
            except Exception as error:  # noqa: BLE001 - a run lost must not cost a plan
                failed(error)

        try:
            future = thread.submit(guarded)
        except RuntimeError:  # after close
            failed(InterruptedError(errno.EINTR, "the planner is shutting down"))
            return _done()
        self._jobs.add(future)
        future.add_done_callback(self._jobs.discard)
        return future

    def take_prepared(self, directory: Path, inputs: tuple[BagMessage, ...]) -> BagWriter:
        """Return a bag with these inputs, in memory or below the directory."""
        ready = self._take()
        if ready is not None and ready.serves(directory, inputs):
            return ready.bag
        if ready is not None:
            ready.bag.discard()
        return _bag_of(inputs)

    def _prepare(self, directory: Path, inputs: tuple[BagMessage, ...]) -> None:
        ready = self._ready
        if ready is not None and ready.serves(directory, inputs):
            return
        self._discard()
        bag = _bag_of(inputs)
        if bag.size < _LARGE:
            self._ready = _Ready(None, inputs, bag)
            return
        directory.mkdir(parents=True, exist_ok=True)
        delete_leftovers(directory)
        try:
            bag.open(directory / f".{new_run_id()}")
            bag.sync()
        except OSError:
            bag.discard()
            raise
        self._ready = _Ready(directory, inputs, bag)

    def _discard(self) -> None:
        ready = self._take()
        if ready is not None:
            ready.bag.discard()

    def _take(self) -> _Ready | None:
        """Take what is ready, so that nobody else has it."""
        with self._taking:
            ready, self._ready = self._ready, None
        return ready


class RunRecorder:
    """Writes one run.

    Attributes
    ----------
    failure : str
        Why it is not recorded; empty as long as it is.
    path : Path or None
        Its folder, once it is whole.
    """

    def __init__(
        self,
        recorder: Recorder,
        log: Log,
        how: Recording,
        inputs: tuple[BagMessage, ...],
        beginning: Beginning,
    ) -> None:
        assert how.directory is not None
        self.failure = ""
        self.path: Path | None = None
        self._recorder = recorder
        self._log = log
        self._how = how
        self._directory = how.directory
        self._inputs = inputs
        self._beginning = beginning
        self._began = self._written = time.perf_counter()
        self._steps: list[tuple[float, Progress]] = []
        self._bag: BagWriter | None = None
        self._kept: Future[None] | None = None
        self._writing = Lock()
        self._on_disk = recorder.do_now(self._begin, self._fail)

    def wrap_callback(self, on_progress: ProgressCallback) -> ProgressCallback:
        """Return a callback that also records every step, with all inputs on disk by solving."""

        def recorded(progress: Progress) -> bool:
            now = time.perf_counter()
            self._steps.append((now - self._began, progress))
            if progress.stage == "solving":
                self._wait_for_disk(on_progress, progress)
            elif now - self._written > _SECONDS_BETWEEN_WRITES:
                self._written = now
                self._do(self._write_steps)
            return on_progress(progress)

        return recorded

    def keep_plan(self, payload: bytes, *, published: bool = True) -> None:
        """Have a plan in the file before anybody else has it: a planner killed then finds it there.

        Parameters
        ----------
        payload : bytes
            The message of it.
        published : bool
            Whether it is the one in force from now on, or only answered.
        """
        message = answered_plan(self._beginning, payload, published=published)
        self._kept = self._recorder.do_now(lambda: self._keep(message), self._fail)
        wait([self._kept], _SECONDS_TO_KEEP)

    def finish(
        self,
        success: bool,
        message: str,
        plan: SolvedPlan | None = None,
        rig: Rig | None = None,
        stamp: Stamp | None = None,
    ) -> Future[None]:
        """Write the run's end, in the background.

        Parameters
        ----------
        success : bool
        message : str
            What the caller is told.
        plan, rig : optional
            If there is a plan: it, and what it is for.
        stamp : tuple of int, optional
            The plan's, seconds and nanoseconds; now, if it is not given.
        """
        at = time.time_ns()
        ending = Ending(success, message, plan, stamp=stamp or stamp_of(at))
        return self._do(lambda: self._finish(ending, plan, rig, at))

    def give_up(self) -> None:
        """Leave the run as it is, partial: there will be no end of it."""
        self._do(self._abandon)

    def _abandon(self) -> None:
        assert self._bag is not None
        self._write_steps()
        self._bag.abandon()

    def _wait_for_disk(self, on_progress: ProgressCallback, progress: Progress) -> None:
        """Wait until the beginning is on disk, or the planner is told to stop.

        A disk that hangs costs the recording, not the plan.
        """
        until = time.monotonic() + _SECONDS_TO_WAIT
        while not wait([self._on_disk], 0.05).done and on_progress(progress):
            if time.monotonic() > until:
                self._fail(TimeoutError(errno.ETIMEDOUT, "the disk does not answer"))
                return

    def _do(self, job: Callable[[], None]) -> Future[None]:
        def after_the_beginning() -> None:
            self._on_disk.result()
            if not self.failure:
                job()

        return self._recorder.do_later(after_the_beginning, self._fail)

    def _fail(self, error: Exception) -> None:
        if self.failure:
            return
        reason = error.strerror if isinstance(error, OSError) and error.strerror else repr(error)
        self.failure = f"run {self._beginning.run_id} in {self._directory}: {reason}"
        self._log.error(f"not recorded: {self.failure}")
        if self._bag is not None:
            self._bag.abandon()

    def _begin(self) -> None:
        self._bag = bag = self._recorder.take_prepared(self._directory, self._inputs)
        bag.open(self._directory / self._beginning.run_id)
        for message in beginning_messages(self._beginning):
            bag.add(message)
        bag.sync()

    def _write_steps(self) -> None:
        assert self._bag is not None
        with self._writing:
            steps, self._steps = self._steps, []
            for elapsed, progress in steps:
                self._bag.add(progress_message(self._beginning, elapsed, progress))
            self._bag.flush()

    def _keep(self, message: BagMessage) -> None:
        self._on_disk.result()
        if self._bag is None or self.failure:
            return
        with self._writing:
            self._bag.add(message)
            self._bag.flush()

    def _finish(self, ending: Ending, plan: SolvedPlan | None, rig: Rig | None, at: int) -> None:
        if not self._recorder.busy:
            time.sleep(_SECONDS_TO_DELIVER)
        if self._kept is not None:
            self._kept.result()  # nobody waited longer than _SECONDS_TO_KEEP
        if self.failure:
            return
        self._write_steps()
        assert self._bag is not None
        if plan is not None:
            if rig is not None and self._how.markers:
                self._bag.add(markers_message(self._beginning, plan, rig, at))
            ending = replace(ending, stop_log=plan.stop_log, fingerprints=fingerprints(plan))
        if self._kept is not None:
            ending = replace(ending, plan=None)
        for message in ending_messages(self._beginning, ending, at):
            self._bag.add(message)
        self._bag.flush()
        self.path = self._bag.close()
        self._keep_to_limits()
        self._recorder.prepare(self._directory, self._inputs)  # the next run may well have the same

    def _keep_to_limits(self) -> None:
        try:
            prune(self._directory, self._how.max_runs, self._how.max_bytes)
        except OSError as error:
            self._log.error(f"old runs in {self._directory} cannot be deleted: {error}")


def _bag_of(inputs: tuple[BagMessage, ...]) -> BagWriter:
    """Return a bag in memory, compressed."""
    bag = BagWriter()
    for message in inputs:
        bag.add(message)
    bag.flush()
    return bag


def _done() -> Future[None]:
    done: Future[None] = Future()
    done.set_result(None)
    return done
