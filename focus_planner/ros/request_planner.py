"""Answers requests on the planning thread: plans, publishes and records.

Importing this module loads the solvers, which takes seconds.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from functools import partial
from types import SimpleNamespace
from typing import Any

from focus_planner_msgs.msg import FocusPlan
from rclpy.serialization import serialize_message

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.progress import Progress, ProgressCallback
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.messages.requests import request_from_message
from focus_planner.messages.writing import Stamp, plan_to_fields
from focus_planner.parameters.planner import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.recorder import Recorder, RunRecorder
from focus_planner.recording.run import Beginning, input_message
from focus_planner.recording.software import software
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.feedback import Feedback
from focus_planner.runtime.inputs import with_unheard
from focus_planner.runtime.planner import NotReady, Planner, internal_error
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import MESSAGES, Outcome, Request
from focus_planner.runtime.status import LastRun, Snapshot, plan_input_to_fields, without_problem

_PREFIXES = {
    Reason.CANCELLED: "cancelled, the best plan found by then",
    Reason.PREEMPTED: "preempted by a newer goal, the best plan found by then, not published",
}


@dataclass(frozen=True)
class PlanningHost:
    """What planning needs of its node.

    Attributes
    ----------
    name : str
        The node's full name.
    get_logger : callable
        Returns the node's logger.
    settings : callable
        Returns the current parameters.
    now : callable
        Returns the node's time, seconds and nanoseconds.
    on_rig : callable
        Called with every rig that comes into force.
    publish : callable
        Puts a plan in force.
    """

    name: str
    get_logger: Callable[[], Any]
    settings: Callable[[], Settings]
    now: Callable[[], Stamp]
    on_rig: Callable[[Rig], None]
    publish: Callable[[FocusPlan], None]


class RequestPlanner:
    """Plans for one request at a time, and keeps what the next one builds on.

    Apart from receiving inputs and reading attributes, it is for the planning thread only.

    Parameters
    ----------
    host : PlanningHost
    is_stopping : callable
        Returns whether the current plan is to stop at the solver's next step, and be discarded.

    Attributes
    ----------
    planner : Planner
    recorder : Recorder
    snapshot : Snapshot
        Replaced as a whole whenever something changes, so any thread may read it.
    """

    def __init__(self, host: PlanningHost, is_stopping: Callable[[], bool]) -> None:
        self.planner = Planner(host.get_logger(), host.on_rig)
        self.recorder = Recorder(host.get_logger())
        self.snapshot = Snapshot(self.planner.surface.state, self.planner.rig.state)
        self._host = host
        self._is_stopping = is_stopping
        self._logged_notes: tuple[Note, ...] = ()

    @property
    def recording_failure(self) -> str:
        """Why the last run is not recorded; empty if it is, or need not be."""
        return self.recorder.failure

    def digest(self) -> None:
        """Process the inputs received, and prepare to record a run on them."""
        settings = self._host.settings()
        self.planner.digest(settings.optics)
        self.take_snapshot()
        recording = settings.recording
        if recording.directory is not None:
            self.recorder.prepare(recording.directory, self._inputs(), recording.access)

    def answer(self, request: Request) -> None:
        """Plan, publish and record as a request asks, unless it has been answered already."""
        if not request.begin():
            return
        recorder = None
        try:
            self.planner.digest(request.settings.optics)
            recorder = self._begin_recording(request)
            outcome = self._plan(request, recorder)
        except NotReady as error:
            outcome = self._failure(request, Reason.NOT_READY, str(error), recorder)
        except InputError as error:
            outcome = self._failure(request, Reason.BAD_REQUEST, str(error), recorder)
        except Exception as error:  # noqa: BLE001 - answered; the log has the details
            self._host.get_logger().error(traceback.format_exc())
            outcome = self._failure(request, Reason.INTERNAL, internal_error(error), recorder)
        if not request.finish(outcome):
            outcome.on_sent()

    def _begin_recording(self, request: Request) -> RunRecorder | None:
        """Begin to record a run, if runs are to be recorded."""
        settings = request.settings
        if settings.recording.directory is None:
            return None
        beginning = Beginning(
            run_id=request.plan_id,
            planner=self._host.name,
            settings=settings,
            asked=request.asked,
            at=request.at,
            software=software(),
            warm_start=self.planner.warm_start if settings.warm_start else None,
        )
        return self.recorder.begin(settings.recording, self._inputs(), beginning)

    def _failure(
        self, request: Request, reason: Reason, message: str, recorder: RunRecorder | None
    ) -> Outcome:
        told = with_unheard(message, self._unheard())
        self._host.get_logger().info(f"no plan: {told}")
        self._note_last_run(request, told)
        if recorder is None:
            return Outcome(reason, told)
        # A replay hears no publishers.
        return Outcome(reason, told, on_sent=partial(recorder.finish, False, message))

    def _plan(self, request: Request, recorder: RunRecorder | None) -> Outcome:
        settings = request.settings
        plan_request = request_from_message(SimpleNamespace(**request.asked), settings.request)
        self._host.get_logger().debug(f"planning: {plan_request}")
        on_progress = self._progress_callback(request, plan_request)
        plan, rig, reminder = self.planner.plan(
            plan_request,
            settings.optics,
            settings.model,
            recorder.wrap_callback(on_progress) if recorder else on_progress,
            warm_start=settings.warm_start,
        )
        reason = request.commit()
        if self._is_stopping():
            # The solver may have been stopped before the request has been aborted.
            reason = Reason.SHUTTING_DOWN
        if reason in {Reason.SHUTTING_DOWN, Reason.INACTIVE}:
            return _without_plan(reason, recorder)
        plan = replace(plan, total_seconds=time.perf_counter() - request.arrived)
        return self._outcome(request, reason, plan, rig, recorder, reminder)

    def _outcome(
        self,
        request: Request,
        reason: Reason,
        plan: SolvedPlan,
        rig: Rig,
        recorder: RunRecorder | None,
        reminder: str,
    ) -> Outcome:
        """Publish a plan, and return the answer to its caller."""
        stamp = self._host.now()
        inputs = self._plan_inputs(request)
        fields = plan_to_fields(plan, rig.frame_id, stamp, request.plan_id, inputs)
        message = message_to_ros(FocusPlan, fields)
        published = reason is not Reason.PREEMPTED
        if recorder:
            recorder.keep_plan(serialize_message(message), published=published)
        if published:
            self._host.publish(message)
        failure = f"not recorded: {recorder.failure}" if recorder and recorder.failure else ""
        parts = [_PREFIXES.get(reason, ""), plan.summary(), reminder, failure]
        summary = with_unheard("; ".join(part for part in parts if part), self._unheard())
        self._host.get_logger().info(f"{request.plan_id}: {summary}")
        self._log_notes(plan.notes)
        self._note_last_run(request, summary, plan)
        if recorder is None:
            return Outcome(reason, summary, message)
        finish = partial(recorder.finish, True, summary, plan, rig, stamp)
        return Outcome(reason, summary, message, finish)

    def _unheard(self) -> str:
        slots = self.planner.surface, self.planner.rig
        return "; ".join(filter(None, (slot.warning() for slot in slots)))

    def _log_notes(self, notes: tuple[Note, ...]) -> None:
        """Log the notes that the last plan did not have."""
        for note in notes:
            if note not in self._logged_notes:
                self._host.get_logger().warning(f"note ({note.code}): {note.text}")
        self._logged_notes = notes

    def _plan_inputs(self, request: Request) -> dict[str, Any]:
        requested = datetime.fromtimestamp(request.at / 1e9, timezone.utc)
        surface, rig = self.planner.surface.in_force, self.planner.rig.in_force
        assert surface is not None
        assert rig is not None
        return {
            "surface": plan_input_to_fields(surface.arrival, requested),
            "rig": plan_input_to_fields(rig.arrival, requested),
        }

    def _note_last_run(
        self, request: Request, message: str, plan: SolvedPlan | None = None
    ) -> None:
        seconds = time.perf_counter() - request.arrived
        kept = None if plan is None else without_problem(plan)
        self.take_snapshot(LastRun(request.plan_id, message, kept, seconds))

    def _progress_callback(self, request: Request, plan_request: PlanRequest) -> ProgressCallback:
        feedback = Feedback(plan_request.time_budget)

        def on_progress(progress: Progress) -> bool:
            fields = feedback.fields(progress)
            if fields is not None:
                request.send_feedback(fields)
            return not (request.stop_requested or self._is_stopping())

        return on_progress

    def take_snapshot(self, last_run: LastRun | None = None) -> None:
        """Replace the snapshot by one of the inputs as they are now."""
        surface, rig = self.planner.surface.state, self.planner.rig.state
        self.snapshot = Snapshot(surface, rig, last_run or self.snapshot.last_run)

    def _inputs(self) -> list[BagMessage]:
        return [input_message(arrival) for arrival in self.planner.arrivals()]


def _without_plan(reason: Reason, recorder: RunRecorder | None) -> Outcome:
    """Return the answer to a caller whose plan is discarded; its record stays partial."""
    if recorder is None:
        return Outcome(reason, MESSAGES[reason])
    return Outcome(reason, MESSAGES[reason], on_sent=recorder.give_up)
