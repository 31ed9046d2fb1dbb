"""The planning thread: reads what was received, plans, records, in the order of arrival.

Importing this loads what solves, which takes seconds: the node does so when it is configured.
"""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future as Job
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from functools import partial
from types import SimpleNamespace
from typing import Any

from focus_planner_msgs.msg import FocusPlan
from rclpy.serialization import serialize_message

from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.planning.precompile import warm_up
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Progress, ProgressCallback
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError
from focus_planner.messages.requests import request_from_message
from focus_planner.messages.typestore import RIG, serialize
from focus_planner.messages.writing import Stamp, plan_to_fields
from focus_planner.parameters.planner import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.recorder import Recorder, RunRecorder
from focus_planner.recording.run import Beginning, input_message
from focus_planner.recording.software import software
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.feedback import Feedback
from focus_planner.runtime.inputs import Arrival, InputState, Log
from focus_planner.runtime.planner import NotReady, Planner, internal_error
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import MESSAGES, Outcome, Request
from focus_planner.runtime.status import LastRun, plan_input_to_fields, without_problem

_PREFIXES = {
    Reason.CANCELLED: "cancelled, the best plan until then",
    Reason.PREEMPTED: "a newer goal took its place, the best plan until then, not published",
}


def _nothing() -> None:
    """Do nothing."""


@dataclass(frozen=True)
class PlanningHost:
    """What planning needs of the node.

    Attributes
    ----------
    planner : str
        The node's full name.
    reporter : Log
        The node's logger.
    settings : callable
        Returns the parameters as they are now.
    now : callable
        Returns the node's time: seconds and nanoseconds.
    on_rig : callable
        Told of every rig that comes into force.
    publish : callable
        Publishes a plan.
    """

    planner: str
    reporter: Any
    settings: Callable[[], Settings]
    now: Callable[[], Stamp]
    on_rig: Callable[[Rig], None]
    publish: Callable[[FocusPlan], None]


@dataclass(frozen=True)
class Snapshot:
    """What there is to be told of the inputs and of the last run."""

    surface: InputState
    rig: InputState
    last_run: LastRun | None = None


class Planning:
    """One thread that plans and reads; the only one that enters kernels.

    Parameters
    ----------
    node : PlanningHost
    """

    def __init__(self, node: PlanningHost) -> None:
        self._node = node
        self._log: Log = node.reporter
        self._planner = Planner(node.reporter, node.on_rig)
        self._recorder = Recorder(node.reporter)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planning")
        self._jobs: set[Job[None]] = set()
        self._stopping = threading.Event()
        self._record: RunRecorder | None = None
        self.snapshot = Snapshot(self._planner.surface.state, self._planner.rig.state)

    def load(self) -> bool:
        """Compile, or load, all that plans; return whether it came to its end."""
        self._do_next(self._warm_up)
        wait(self._jobs.copy())
        return self._warm

    def receive_surface(self, arrival: Arrival[Surface]) -> None:
        """Keep a surface, and read it soon."""
        self._planner.surface.receive(arrival)
        self._do_next(self._digest)

    def receive_rig(self, arrival: Arrival[Rig]) -> None:
        """Keep a rig, and read it soon."""
        self._planner.rig.receive(arrival)
        self._do_next(self._digest)

    def plan(self, request: Request) -> None:
        """Plan when its turn comes."""
        if not self._do_next(partial(self._answer, request)):
            request.drop(Reason.SHUTTING_DOWN)

    def stop(self) -> None:
        """Begin to end: no more jobs, and what is being planned stops at its next step."""
        self._stopping.set()
        self._thread.shutdown(wait=False, cancel_futures=True)

    def finish(self, timeout: float) -> bool:
        """Wait, after :meth:`stop`, for planning and recording; return whether both have ended."""
        until = time.monotonic() + timeout
        ended = not wait(self._jobs.copy(), timeout).not_done
        recorded = self._recorder.close(max(until - time.monotonic(), 0.0))
        if not recorded:
            self._log.error("not recorded: runs that took too long to write stay partial")
        return recorded and ended

    @property
    def recording_failure(self) -> str:
        """Why the last run is not recorded; empty if it is, or is not to be."""
        return self._record.failure if self._record else ""

    @property
    def runs_to_write(self) -> int:
        """How many jobs the recorder has."""
        return self._recorder.jobs

    def _do_next(self, job: Callable[[], None]) -> bool:
        """Queue a job; return whether the thread still takes any."""
        try:
            future = self._thread.submit(self._guard, job)
        except RuntimeError:
            return False
        self._jobs.add(future)
        future.add_done_callback(self._jobs.discard)
        return True

    def _guard(self, job: Callable[[], None]) -> None:
        try:
            job()
        except Exception:  # noqa: BLE001 - one bad message must not end the node
            self._log.error(traceback.format_exc())

    # What follows runs on the planning thread.

    _warm = False

    def _warm_up(self) -> None:
        # They take some time, once.
        software()
        serialize(RIG, {})
        warm_up(lambda: not self._stopping.is_set())
        self._warm = not self._stopping.is_set()

    def _digest(self) -> None:
        settings = self._node.settings()
        self._planner.digest(settings.optics)
        self._take_snapshot()
        if settings.recording.directory is not None:
            self._recorder.prepare(settings.recording.directory, self._inputs())

    def _take_snapshot(self, last_run: LastRun | None = None) -> None:
        surface, rig = self._planner.surface.state, self._planner.rig.state
        self.snapshot = Snapshot(surface, rig, last_run or self.snapshot.last_run)

    def _inputs(self) -> list[BagMessage]:
        return [input_message(arrival) for arrival in self._planner.arrivals()]

    def _answer(self, request: Request) -> None:
        if not request.begin():
            return
        record = None
        try:
            self._planner.digest(request.settings.optics)
            record = self._record = self._begin_record(request)
            outcome = self._plan(request, record)
        except NotReady as error:
            outcome = self._no_plan(request, Reason.NOT_READY, str(error), record)
        except InputError as error:
            outcome = self._no_plan(request, Reason.BAD_REQUEST, str(error), record)
        except Exception as error:  # noqa: BLE001 - the caller is told, the log has the rest
            self._log.error(traceback.format_exc())
            outcome = self._no_plan(request, Reason.INTERNAL, internal_error(error), record)
        if not request.finish(outcome):
            outcome.afterwards()

    def _begin_record(self, request: Request) -> RunRecorder | None:
        """Begin to record a run, if runs are recorded."""
        settings = request.settings
        if settings.recording.directory is None:
            return None
        beginning = Beginning(
            run_id=request.plan_id,
            planner=self._node.planner,
            settings=settings,
            asked=request.asked,
            at=request.at,
            software=software(),
            warm_start=self._planner.warm_start if settings.warm_start else None,
        )
        return self._recorder.begin(settings.recording, self._inputs(), beginning)

    def _no_plan(
        self, request: Request, reason: Reason, message: str, record: RunRecorder | None
    ) -> Outcome:
        self._node.reporter.info(f"no plan: {message}")
        self._tell(request, message)
        if record is None:
            return Outcome(reason, message)
        return Outcome(reason, message, afterwards=partial(record.finish, False, message))

    def _plan(self, request: Request, record: RunRecorder | None) -> Outcome:
        settings = request.settings
        wanted = request_from_message(SimpleNamespace(**request.asked), settings.request)
        self._node.reporter.debug(f"planning: {wanted}")
        on_progress = self._watch(request, wanted)
        plan, rig, reminder = self._planner.plan(
            wanted,
            settings.optics,
            settings.model,
            record.on_progress(on_progress) if record else on_progress,
            warm_start=settings.warm_start,
        )
        reason = request.settle()
        if self._stopping.is_set():
            # Who ends the request may be later than what ended the solver.
            reason = Reason.SHUTTING_DOWN
        if reason in {Reason.SHUTTING_DOWN, Reason.INACTIVE}:
            give_up = record.give_up if record else _nothing
            return Outcome(reason, MESSAGES[reason], afterwards=give_up)
        plan = replace(plan, total_seconds=time.perf_counter() - request.started)
        return self._outcome(request, reason, plan, rig, record, reminder)

    def _outcome(
        self,
        request: Request,
        reason: Reason,
        plan: SolvedPlan,
        rig: Rig,
        record: RunRecorder | None,
        reminder: str,
    ) -> Outcome:
        """Publish a plan, and return it as its caller is answered."""
        stamp = self._node.now()
        fields = plan_to_fields(plan, rig.frame_id, stamp, request.plan_id, self._used(request))
        message = message_to_ros(FocusPlan, fields)
        published = reason is not Reason.PREEMPTED
        if record:
            record.keep_plan(serialize_message(message), published=published)
        if published:
            self._node.publish(message)
        lost = f"not recorded: {record.failure}" if record and record.failure else ""
        parts = [_PREFIXES.get(reason, ""), plan.summary(), reminder, lost]
        summary = "; ".join(part for part in parts if part)
        self._node.reporter.info(f"{request.plan_id}: {summary}")
        self._tell(request, summary, plan)
        if record is None:
            return Outcome(reason, summary, message)
        finish = partial(record.finish, True, summary, plan, rig, stamp)
        return Outcome(reason, summary, message, finish)

    def _used(self, request: Request) -> dict[str, Any]:
        asked = datetime.fromtimestamp(request.at / 1e9, timezone.utc)
        surface, rig = self._planner.surface.in_force, self._planner.rig.in_force
        assert surface is not None
        assert rig is not None
        return {
            "surface": plan_input_to_fields(surface.arrival, asked),
            "rig": plan_input_to_fields(rig.arrival, asked),
        }

    def _tell(self, request: Request, message: str, plan: SolvedPlan | None = None) -> None:
        seconds = time.perf_counter() - request.started
        told = None if plan is None else without_problem(plan)
        self._take_snapshot(LastRun(request.plan_id, message, told, seconds))

    def _watch(self, request: Request, wanted: PlanRequest) -> ProgressCallback:
        feedback = Feedback(wanted.time_budget)

        def on_progress(progress: Progress) -> bool:
            fields = feedback.fields(progress)
            if fields is not None:
                request.tell(fields)
            return request.goes_on and not self._stopping.is_set()

        return on_progress
