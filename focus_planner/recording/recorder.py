# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recording runs in background threads while the planner works.

Planning is hardly delayed. Inputs are compressed, and large ones written, when they arrive rather
than when they are planned with. The beginning of a run is written while rays are cast; its
progress is buffered and written once a second; its end is written after the caller has the
response. A failed recording never fails a plan: the error is logged and reported with the plan.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event, Lock

from focus_planner.core.planning.plan import FocusPlan, SolvedPlan
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.progress import Progress, ProgressCallback
from focus_planner.core.rig.rig import Rig
from focus_planner.messages.writing import Stamp
from focus_planner.parameters.planner import ACCESSES
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.retention import delete_leftovers, prune
from focus_planner.recording.run import Beginning, Ending
from focus_planner.recording.run_writing import (
    beginning_messages,
    ending_messages,
    plan_message,
    progress_message,
    stamp_of,
    visuals_messages,
)
from focus_planner.runtime.log import Log
from focus_planner.runtime.planning_orders import Description

_SECONDS_BETWEEN_WRITES = 1.0
# Leaves the processor to the caller, probably on this machine, while it reads its response.
_SECONDS_TO_DELIVER = 0.03
_MAX_PENDING_JOBS = 16
# Bytes that take longer to write than a caller should have to wait.
_LARGE = 1_000_000
# Longest wait until a plan is in the disk's cache.
_SECONDS_TO_KEEP = 0.1
# Longest wait for a disk.
_SECONDS_TO_WAIT = 20.0


@dataclass(frozen=True)
class _PreparedBag:
    """A bag that contains the inputs of the next run, in a directory or in memory."""

    directory: Path | None
    inputs: tuple[BagMessage, ...]
    bag: BagWriter

    def fits(self, directory: Path, inputs: tuple[BagMessage, ...]) -> bool:
        """Return whether a run with these inputs can be continued in this bag."""
        there = self.directory is None or (self.directory == directory and self.bag.exists)
        return there and self.inputs == inputs


class Recorder:
    """Writes runs in two threads: one for jobs that the planner waits for, one for all others.

    Parameters
    ----------
    log : Log
        Receives an error for every run that could not be recorded.
    """

    def __init__(self, log: Log) -> None:
        self._log = log
        self._urgent_thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="recording")
        self._background_thread = ThreadPoolExecutor(
            max_workers=1, thread_name_prefix="recording, later"
        )
        self._jobs: set[Future[None]] = set()
        self._prepared: _PreparedBag | None = None
        self._prepared_lock = Lock()
        # Of runs that failed later than their plans were published, for the background thread.
        self._kept_for_plans: list[BagWriter] = []
        #: Why the newest run that ended is not recorded; empty if it is.
        self.failure = ""

    def prepare(
        self, directory: Path, inputs: Sequence[BagMessage], access: str = ACCESSES[0]
    ) -> None:
        """Compress the inputs that the next run will probably have.

        Large inputs are also written, into a hidden folder that becomes the run's.
        """
        self.do_later(lambda: self._prepare(directory, tuple(inputs), access), lambda _: None)

    def begin(
        self, options: Recording, inputs: Sequence[BagMessage], beginning: Beginning
    ) -> RunRecorder:
        """Begin to write a run in ``options.directory``.

        Blocks while too many earlier runs are still to be finished.
        """
        until = time.monotonic() + _SECONDS_TO_WAIT
        while len(self._jobs) > _MAX_PENDING_JOBS and time.monotonic() < until:
            wait(self._jobs.copy(), 0.05, FIRST_COMPLETED)
        return RunRecorder(self, self._log, options, tuple(inputs), beginning)

    def close(self, timeout: float | None = None) -> bool:
        """Finish all writing; return whether that succeeded within ``timeout`` seconds."""
        self.do_later(self._discard, lambda _: None)
        self._urgent_thread.shutdown(wait=False)
        self._background_thread.shutdown(wait=False)
        return not wait(self._jobs.copy(), timeout).not_done

    @property
    def jobs(self) -> int:
        """The number of jobs that are pending or running."""
        return len(self._jobs)

    @property
    def busy(self) -> bool:
        """Whether there are other jobs than the one that asks."""
        return len(self._jobs) > 1

    def do_now(self, job: Callable[[], None], failed: Callable[[Exception], None]) -> Future[None]:
        """Run a job that the planner waits for; call ``failed`` with any exception."""
        return self._do(self._urgent_thread, job, failed)

    def do_later(
        self, job: Callable[[], None], failed: Callable[[Exception], None]
    ) -> Future[None]:
        """Run a job after all others submitted here; call ``failed`` with any exception."""
        return self._do(self._background_thread, job, failed)

    def _do(
        self,
        thread: ThreadPoolExecutor,
        job: Callable[[], None],
        failed: Callable[[Exception], None],
    ) -> Future[None]:

        def guarded() -> None:
            try:
                job()
            except Exception as error:  # noqa: BLE001 - a lost recording must not cost a plan
                failed(error)

        try:
            future = thread.submit(guarded)
        except RuntimeError:  # after close
            failed(InterruptedError(errno.EINTR, "the planner is shutting down"))
            return _completed()
        self._jobs.add(future)
        future.add_done_callback(self._jobs.discard)
        return future

    def take_prepared(self, directory: Path, inputs: tuple[BagMessage, ...]) -> BagWriter:
        """Return a bag with these inputs, the prepared one if it fits."""
        ready = self._take()
        if ready is not None and ready.fits(directory, inputs):
            return ready.bag
        if ready is not None:
            ready.bag.discard()
        return _compressed_bag(inputs)

    def _prepare(self, directory: Path, inputs: tuple[BagMessage, ...], access: str) -> None:
        ready = self._prepared
        if ready is not None and ready.fits(directory, inputs):
            return
        self._discard()
        bag = _compressed_bag(inputs)
        if bag.size < _LARGE:
            self._prepared = _PreparedBag(None, inputs, bag)
            return
        delete_leftovers(directory)
        try:
            bag.open(directory / f".{new_run_id()}", access)
            bag.sync()
        except OSError:
            bag.discard()
            raise
        self._prepared = _PreparedBag(directory, inputs, bag)

    def lay_aside(self, bag: BagWriter, *, for_its_plan: bool) -> None:
        """Delete the bag of a run that failed; only once a newer plan is recorded, if so asked.

        For the background thread.
        """
        if for_its_plan:
            self._kept_for_plans.append(bag)
        else:
            bag.discard()

    def recorded(self, *, a_plan: bool) -> None:
        """Note that a run is whole on the disk, and whether it holds a published plan.

        For the background thread.
        """
        self.failure = ""
        if a_plan:
            superseded, self._kept_for_plans = self._kept_for_plans, []
            for bag in superseded:
                with suppress(OSError):
                    bag.discard()

    def _discard(self) -> None:
        ready = self._take()
        if ready is not None:
            ready.bag.discard()

    def _take(self) -> _PreparedBag | None:
        """Take the prepared bag, which the caller then owns."""
        with self._prepared_lock:
            ready, self._prepared = self._prepared, None
        return ready


class RunRecorder:
    """Writes a single run.

    Attributes
    ----------
    failure : str
        Why the run could not be recorded; empty so far.
    path : Path or None
        The run's folder, once all of the run is on the disk itself.
    publishes : bool
        Whether a plan that is not kept before the end of the run is recorded as one in force.
    """

    def __init__(
        self,
        recorder: Recorder,
        log: Log,
        options: Recording,
        inputs: tuple[BagMessage, ...],
        beginning: Beginning,
    ) -> None:
        assert options.directory is not None
        self.failure = ""
        self.path: Path | None = None
        self.publishes = True
        self._recorder = recorder
        self._log = log
        self._options = options
        self._directory = options.directory
        self._inputs = inputs
        self._beginning = beginning
        self._began = self._written = time.perf_counter()
        self._steps: list[tuple[float, Progress]] = []
        self._bag: BagWriter | None = None
        self._plan_written: Future[None] | None = None
        self._plan_published = False
        self._write_lock = Lock()
        self._begun = Event()
        self._on_disk = recorder.do_now(self._begin, self._fail)

    def wrap_callback(self, on_progress: ProgressCallback) -> ProgressCallback:
        """Return a callback that records every step; solving waits until inputs are on disk."""

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
        """Write the plan before anyone receives it, so that a planner killed later can restore it.

        Parameters
        ----------
        payload : bytes
            The serialized plan.
        published : bool
            Whether the plan is in force from now on, or only returned to the caller.
        """
        message = plan_message(self._beginning, payload, published=published)
        self._plan_written = self._recorder.do_now(
            lambda: self._keep(message, published), self._fail
        )
        wait([self._plan_written], _SECONDS_TO_KEEP)

    def finish(
        self,
        success: bool,
        message: str,
        plan: SolvedPlan | None = None,
        rig: Rig | None = None,
        stamp: Stamp | None = None,
    ) -> Future[None]:
        """Write the run's end in the background.

        Parameters
        ----------
        success : bool
        message : str
            The response's message.
        plan, rig : optional
            The plan, if there is one, and the rig that it is for.
        stamp : tuple of int, optional
            The plan's stamp, seconds and nanoseconds; now by default.
        """
        at = time.time_ns()
        if plan is None or rig is None:
            ending = Ending(success, message, stamp=stamp or stamp_of(at))
            return self._do(lambda: self._finish(ending, at))

        def describe() -> Description:
            # What plans loads it anyway; a node, which has that done elsewhere, does not.
            from focus_planner.runtime.description import describe_plan  # noqa: PLC0415

            return describe_plan(plan, rig, (stamp or stamp_of(at)) if self.with_visuals else None)

        return self.finish_planned(message, plan, plan.stop_log, describe, at, stamp)

    @property
    def with_visuals(self) -> bool:
        """Whether the run is to hold what shows its plan."""
        return self._options.markers

    def finish_planned(
        self,
        message: str,
        plan: FocusPlan,
        stop_log: StopLog,
        describe: Callable[[], Description],
        at: int,
        stamp: Stamp | None = None,
    ) -> Future[None]:
        """Write the end of a run with a plan, in the background.

        Parameters
        ----------
        message : str
            The response's message.
        plan : FocusPlan
        stop_log : StopLog
        describe : callable
            Returns the plan's description; may wait for it, and raises if there is none.
        at : int
            When it was planned, nanoseconds since the epoch.
        stamp : tuple of int, optional
            The plan's stamp, seconds and nanoseconds; ``at`` by default.
        """
        ending = Ending(True, message, plan, stop_log, stamp=stamp or stamp_of(at))
        return self._do(lambda: self._finish(ending, at, describe))

    def give_up(self) -> None:
        """Leave the run partial, without an end."""
        self._do(self._abandon)

    def _abandon(self) -> None:
        assert self._bag is not None
        self._write_steps()
        self._bag.abandon()

    def _wait_for_disk(self, on_progress: ProgressCallback, progress: Progress) -> None:
        """Wait until the beginning is on disk, or the planner is to stop.

        After a while a hanging disk fails the recording, not the plan.
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
        self._recorder.failure = self.failure
        self._log.error(f"not recorded: {self.failure}")
        if self._bag is not None:
            self._bag.abandon()
        if isinstance(error, InterruptedError):
            return  # what ends too late for the planner stays, as if that had been killed
        # Not on this thread, which may be the planner's: the disk may hang. After close() this is
        # the last that works on the bag.
        self._recorder.do_later(self._lay_aside_in_turn, lambda _: self._lay_aside())

    def _lay_aside_in_turn(self) -> None:
        self._begun.wait()
        if self._plan_written is not None:
            self._plan_written.result()
        self._lay_aside()

    def _lay_aside(self) -> None:
        if self._bag is not None:
            self._recorder.lay_aside(self._bag, for_its_plan=self._plan_published)

    def _begin(self) -> None:
        try:
            self._bag = bag = self._recorder.take_prepared(self._directory, self._inputs)
            bag.open(self._directory / self._beginning.run_id, self._options.access)
            for message in beginning_messages(self._beginning):
                bag.add(message)
            bag.sync()
        finally:
            self._begun.set()

    def _write_steps(self) -> None:
        assert self._bag is not None
        with self._write_lock:
            steps, self._steps = self._steps, []
            for elapsed, progress in steps:
                self._bag.add(progress_message(self._beginning, elapsed, progress))
            self._bag.flush()

    def _keep(self, message: BagMessage, published: bool) -> None:
        self._on_disk.result()
        if self._bag is None or self.failure:
            return
        with self._write_lock:
            self._bag.add(message)
            self._bag.flush()
        self._plan_published = published

    def _finish(
        self, ending: Ending, at: int, describe: Callable[[], Description] | None = None
    ) -> None:
        if not self._recorder.busy:
            time.sleep(_SECONDS_TO_DELIVER)
        if self._plan_written is not None:
            self._plan_written.result()  # keep_plan() waited for at most _SECONDS_TO_KEEP
        if self.failure:
            return
        self._write_steps()
        assert self._bag is not None
        if describe is not None:
            description = describe()
            if self.with_visuals and description.visuals is not None:
                for shown in visuals_messages(self._beginning, description.visuals, at):
                    self._bag.add(shown)
            ending = replace(ending, fingerprints=description.fingerprints)
        if self._plan_written is not None:
            ending = replace(ending, plan=None)
        for message in ending_messages(self._beginning, ending, at, self.publishes):
            self._bag.add(message)
        self._bag.flush()
        self.path = self._bag.close()
        self._recorder.recorded(a_plan=self._plan_published)
        self._keep_to_limits()
        # Probably the next run's as well.
        self._recorder.prepare(self._directory, self._inputs, self._options.access)

    def _keep_to_limits(self) -> None:
        delete_leftovers(self._directory)
        try:
            prune(self._directory, self._options.max_runs, self._options.max_bytes)
        except Exception as error:  # noqa: BLE001 - the run is recorded all the same
            self._log.error(f"old runs in {self._directory} cannot be deleted: {error}")


def _compressed_bag(inputs: tuple[BagMessage, ...]) -> BagWriter:
    """Return a compressed bag in memory."""
    bag = BagWriter()
    for message in inputs:
        bag.add(message)
    bag.flush()
    return bag


def _completed() -> Future[None]:
    done: Future[None] = Future()
    done.set_result(None)
    return done
