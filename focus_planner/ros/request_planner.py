# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Answers requests on the planning thread: has them planned, publishes and records."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

from focus_planner_msgs.msg import FocusPlan
from rclpy.serialization import serialize_message

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import FocusPlan as Plan
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.progress import Progress, Standing
from focus_planner.core.validation import InputError
from focus_planner.messages.requests import request_from_message
from focus_planner.messages.writing import Stamp, plan_to_fields
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.recorder import Recorder, RunRecorder
from focus_planner.recording.run import Beginning
from focus_planner.recording.run_inputs import input_messages
from focus_planner.recording.software import software
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.feedback import Teller, feedback_fields
from focus_planner.runtime.inputs import with_unheard
from focus_planner.runtime.log import log_exception, log_lines
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.remote_planner import (
    PlanningDied,
    PlanningEnded,
    RemotePlanner,
    Wish,
    Worker,
)
from focus_planner.runtime.requests import ENDED_MESSAGES, MESSAGES, Outcome, Request
from focus_planner.runtime.status import LastRun, Snapshot, plan_input_to_fields

_PREFIXES = {
    Reason.CANCELLED: "cancelled, the best plan found by then",
    Reason.PREEMPTED: "preempted by a newer goal, the best plan found by then, not published",
    Reason.TIME_LIMIT: "ended by parameter max_planning_time, the best plan found by then",
}
_GIGA = 1e9


class NoPlan(Exception):  # noqa: N818 - mostly the caller's doing
    """There is no plan; its text is fit for the caller."""

    def __init__(self, reason: Reason, why: str) -> None:
        super().__init__(why)
        self.reason = reason


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
    start : callable
        Starts a planning process.
    give_up : callable
        Called, with the reason, when none can be started any more.
    is_watched : callable
        Returns whether somebody wants to see the plan in force.
    show : callable
        Shows the plan in force.
    hide : callable
        Shows no plan any more; called with the frame and the stamp of the one in force.
    """

    name: str
    get_logger: Callable[[], Any]
    settings: Callable[[], Settings]
    now: Callable[[], Stamp]
    on_rig: Callable[[orders.RigInForce], None]
    publish: Callable[[FocusPlan], None]
    start: Callable[[], Worker]
    give_up: Callable[[str], None] = lambda _: None
    is_watched: Callable[[], bool] = lambda: False
    show: Callable[[orders.Visuals], None] = lambda _: None
    hide: Callable[[str, Stamp], None] = lambda *_: None


@dataclass(frozen=True)
class _InForce:
    """The plan in force, unless it was restored from a record.

    Attributes
    ----------
    plan_id : str
    stamp : tuple of int
    is_shown : bool
    """

    plan_id: str = ""
    stamp: Stamp = (0, 0)
    is_shown: bool = False


class RequestPlanner:
    """Has one request at a time planned, and keeps what the next one builds on.

    Inputs are taken once for a request, when its turn has come: the plan, its record, the ages that
    it tells and the status are about these, whatever arrives meanwhile.

    Apart from receiving inputs and reading attributes, it is for the planning thread only.

    Parameters
    ----------
    host : PlanningHost
    wish : callable
        Returns what the node wants of whatever is being done.

    Attributes
    ----------
    planner : RemotePlanner
    recorder : Recorder
    snapshot : Snapshot
        Replaced as a whole whenever something changes, so any thread may read it.
    """

    def __init__(self, host: PlanningHost, wish: Callable[[], Wish]) -> None:
        self.planner = RemotePlanner(host.start, host.get_logger(), host.on_rig, host.give_up)
        self.planner.surface.keep(host.settings().subjects)
        self.recorder = Recorder(host.get_logger())
        self.snapshot = Snapshot(self.planner.surface.state, self.planner.rig.state)
        self._host = host
        self._wish = wish
        self._warm_start: WarmStart | None = None
        self._logged_notes: tuple[Note, ...] = ()
        self._in_force = _InForce()

    @property
    def recording_failure(self) -> str:
        """Why the last run is not recorded; empty if it is, or need not be."""
        return self.recorder.failure

    def digest(self, waiting: Callable[[], Sequence[Request]] = tuple) -> None:
        """Process the inputs received, and prepare to record a run on them.

        Parameters
        ----------
        waiting : callable, optional
            Returns the requests that wait for it, to be told how far it is.
        """
        settings = self._host.settings()

        def tell(standing: Standing) -> None:
            for request in waiting():
                self._tell_reading(request, standing)

        try:
            self._digest(settings, tell)
        except PlanningEnded:
            return  # what was received is kept
        except PlanningDied as error:
            self._host.get_logger().error(f"the inputs could not be read: {error}")
            return
        recording = settings.recording
        if recording.directory is not None:
            self.recorder.prepare(recording.directory, self._inputs(), recording.access)

    def answer(self, request: Request) -> None:
        """Plan, publish and record as a request asks, unless it has been answered already."""
        if request.is_answered:
            return
        run = None
        description: Future[orders.Description] = Future()
        try:
            self._digest(request.settings, partial(self._tell_reading, request))
            if not request.begin():
                return
            run = self._begin_recording(request)
            outcome = self._plan(request, run, description)
        except NoPlan as error:
            outcome = self._failure(request, error.reason, str(error), run)
        except InputError as error:
            outcome = self._failure(request, Reason.BAD_REQUEST, str(error), run)
        except PlanningEnded:
            outcome = self._ended(request, run)
        except PlanningDied as error:
            why = f"the planning process has gone, and is started anew: {error}"
            outcome = self._failure(request, Reason.INTERNAL, why, run)
        except Exception as error:  # noqa: BLE001 - answered; the log has the details
            log_exception(self._host.get_logger())
            outcome = self._failure(request, Reason.INTERNAL, _internal(error), run)
        if not request.finish(outcome):
            outcome.on_sent()
        if outcome.plan is not None:
            self._describe(outcome.plan, run, description)

    def show(self) -> None:
        """Show the plan in force to who has begun to watch, unless it is shown."""
        plan = self._in_force
        if not plan.plan_id or plan.is_shown or not self._host.is_watched():
            return
        visuals, why = None, "the planning process that made it has gone"
        if self.planner.pid is not None:
            order = orders.Describe(plan.plan_id, False, plan.stamp)
            try:
                visuals = self.planner.describe(order).visuals
            except PlanningDied as error:
                why = str(error)
        if visuals is None:
            text = f"{plan.plan_id} is not shown in 3D: {why}; the next plan will be"
            self._host.get_logger().warning(text)
        self._show(visuals)

    def _show(self, visuals: orders.Visuals | None) -> None:
        """Show the plan in force, or nothing rather than the plan before it."""
        self._in_force = replace(self._in_force, is_shown=visuals is not None)
        if visuals is None:
            self._host.hide(self.planner.frame_id, self._in_force.stamp)
        else:
            self._host.show(visuals)

    def _digest(
        self, settings: Settings, tell: Callable[[Standing], object] = lambda _: None
    ) -> None:
        teller = Teller(self._host.get_logger().info, "inputs", tell)

        def wish() -> Wish:
            teller.look()
            return self._wish()

        try:
            self.planner.digest(
                settings.optics,
                settings.serving.max_memory,
                wish,
                teller.note,
                settings.subjects,
            )
        finally:
            self.take_snapshot()

    @staticmethod
    def _tell_reading(request: Request, standing: Standing) -> None:
        """Tell the caller that inputs are being read; planning has not begun."""
        message = SimpleNamespace(**request.asked)
        with suppress(InputError):  # which is told when planning begins
            budget = request_from_message(message, request.settings.request).time_budget
            waiting = replace(standing, elapsed=0.0, time_budget=budget)
            request.send_feedback(feedback_fields(waiting))

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
            warm_start=self._warm_start if settings.warm_start else None,
        )
        return self.recorder.begin(settings.recording, self._inputs(), beginning)

    def _failure(
        self, request: Request, reason: Reason, message: str, run: RunRecorder | None
    ) -> Outcome:
        told = with_unheard(message, self._unheard())
        self._host.get_logger().info(f"no plan: {told}")
        self._note_last_run(request, told)
        if run is None:
            return Outcome(reason, told)
        # A replay hears no publishers.
        return Outcome(reason, told, on_sent=partial(run.finish, False, message))

    def _ended(self, request: Request, run: RunRecorder | None) -> Outcome:
        """Return the answer to a caller whose plan was ended before there was any."""
        reason = request.commit()
        if reason is Reason.NONE:
            reason = Reason.SHUTTING_DOWN if self._wish() is Wish.END else Reason.INACTIVE
        return self._without_plan(request, reason, ENDED_MESSAGES[reason], run)

    def _without_plan(
        self, request: Request, reason: Reason, why: str, run: RunRecorder | None
    ) -> Outcome:
        """Return the answer to a caller who gets no plan; its record stays partial."""
        self._host.get_logger().info(f"{request.plan_id}: {why}")
        self._note_last_run(request, why)
        if run is None:
            return Outcome(reason, why)
        return Outcome(reason, why, on_sent=run.give_up)

    def _plan(
        self,
        request: Request,
        run: RunRecorder | None,
        description: Future[orders.Description],
    ) -> Outcome:
        settings = request.settings
        plan_request = request_from_message(SimpleNamespace(**request.asked), settings.request)
        self._host.get_logger().debug(f"planning: {plan_request}")
        teller = Teller(
            self._host.get_logger().info,
            request.plan_id,
            lambda standing: request.send_feedback(feedback_fields(standing)),
        )
        began = time.monotonic()

        def wish() -> Wish:
            teller.look()
            return self._wish_of(request, began)

        def go_on(_: Progress) -> bool:
            return wish() is Wish.GO_ON

        order = orders.Plan(
            plan_request,
            settings.model,
            settings.resources,
            self._warm_start if settings.warm_start else None,
            keep_warm=settings.warm_start,
            is_recorded=run is not None,
            plan_id=request.plan_id,
            in_force=self._in_force.plan_id,
        )
        on_step = run.wrap_callback(go_on) if run else go_on
        result = self.planner.plan(order, on_step, teller.note, wish)
        planned = self._planned(result, settings)
        self._warm_start = planned.warm_start
        reason = request.commit()
        if self._wish() is Wish.END:
            # It may have been stopped before the request has been aborted.
            reason = Reason.SHUTTING_DOWN
        if reason in {Reason.SHUTTING_DOWN, Reason.INACTIVE}:
            return self._without_plan(request, reason, MESSAGES[reason], run)
        plan = replace(planned.plan, total_seconds=time.perf_counter() - request.arrived)
        return self._outcome(request, reason, replace(planned, plan=plan), run, description)

    def _planned(self, result: orders.Result, settings: Settings) -> orders.Planned:
        """Return the result if it is a plan; raise what it is instead."""
        match result:
            case orders.Planned():
                return result
            case orders.NotReadyYet(why):
                raise NoPlan(Reason.NOT_READY, why)
            case orders.Refused(why):
                raise NoPlan(Reason.BAD_REQUEST, why)
            case orders.OutOfMemory():
                most = settings.serving.max_memory / _GIGA
                error = InputError(
                    "samples",
                    f"a request that fits in {most:.3g} GB of memory (parameter max_memory)",
                    "one that does not",
                    "take fewer samples or shots, or raise the parameter",
                )
                raise NoPlan(Reason.BAD_REQUEST, str(error))
            case orders.Failed(why, details):
                log_lines(self._host.get_logger(), details)
                raise NoPlan(Reason.INTERNAL, why)
        raise AssertionError(result)

    def _outcome(
        self,
        request: Request,
        reason: Reason,
        planned: orders.Planned,
        run: RunRecorder | None,
        description: Future[orders.Description],
    ) -> Outcome:
        """Publish a plan, and return the answer to its caller."""
        plan = planned.plan
        stamp = self._host.now()
        inputs = self._plan_inputs()
        fields = plan_to_fields(plan, self.planner.frame_id, stamp, request.plan_id, inputs)
        message = message_to_ros(FocusPlan, fields)
        published = reason is not Reason.PREEMPTED
        if run:
            run.keep_plan(serialize_message(message), published=published)
        if published:
            self._host.publish(message)
            self._in_force = _InForce(request.plan_id, stamp)
            if not self._host.is_watched():
                self._show(None)
        failure = f"not recorded: {run.failure}" if run and run.failure else ""
        parts = [_PREFIXES.get(reason, ""), plan.summary(), planned.reminder, failure]
        summary = with_unheard("; ".join(part for part in parts if part), self._unheard())
        self._host.get_logger().info(f"{request.plan_id}: {summary}")
        self._log_notes(plan.notes)
        self._note_last_run(request, summary, plan)
        if run is None:
            return Outcome(reason, summary, message)
        finish = partial(
            run.finish_planned,
            summary,
            plan,
            planned.stop_log,
            description.result,
            time.time_ns(),
            stamp,
        )
        return Outcome(reason, summary, message, finish)

    def _describe(
        self, plan: FocusPlan, run: RunRecorder | None, description: Future[orders.Description]
    ) -> None:
        """Have a plan described for its record and for who watches, after it has been returned."""
        watched = plan.plan_id == self._in_force.plan_id and self._host.is_watched()
        if run is None and not watched:
            return
        visual = watched or (run is not None and run.with_visuals)
        stamp = (plan.header.stamp.sec, plan.header.stamp.nanosec) if visual else None
        order = orders.Describe(plan.plan_id, run is not None, stamp)
        described = None
        try:
            described = self.planner.describe(order)
            description.set_result(described)
        except PlanningDied as error:
            description.set_exception(error)
        if watched:
            self._show(described.visuals if described else None)

    def _wish_of(self, request: Request, began: float) -> Wish:
        """Return what is wanted of the plan for a request."""
        wish = self._wish()
        if wish is not Wish.GO_ON:
            return wish
        if time.monotonic() - began > request.settings.serving.max_planning_time:
            request.stop(Reason.TIME_LIMIT)
        return Wish.STOP if request.stop_requested else Wish.GO_ON

    def _unheard(self) -> str:
        inboxes = self.planner.surface, self.planner.rig
        return "; ".join(filter(None, (inbox.state.unheard for inbox in inboxes)))

    def _log_notes(self, notes: tuple[Note, ...]) -> None:
        """Log the notes that the last plan did not have."""
        for note in notes:
            if note not in self._logged_notes:
                self._host.get_logger().warning(f"note ({note.code}): {note.text}")
        self._logged_notes = notes

    def _plan_inputs(self) -> dict[str, Any]:
        surface, rig = self.planner.surface.in_force, self.planner.rig.in_force
        assert surface is not None
        assert rig is not None
        taken, subjects = self.planner.taken, self.planner.surface.all_in_force
        return {
            "surface": plan_input_to_fields(surface, taken),
            "rig": plan_input_to_fields(rig, taken),
            "subjects": [plan_input_to_fields(each, taken) for each in subjects],
        }

    def _note_last_run(self, request: Request, message: str, plan: Plan | None = None) -> None:
        seconds = time.perf_counter() - request.arrived
        self.take_snapshot(LastRun(request.plan_id, message, plan, seconds))

    def take_snapshot(self, last_run: LastRun | None = None) -> None:
        """Replace the snapshot by one of the inputs as they are now."""
        surface, rig = self.planner.surface.state, self.planner.rig.state
        surfaces = self.planner.surface.states
        self.snapshot = Snapshot(surface, rig, last_run or self.snapshot.last_run, surfaces)

    def _inputs(self) -> list[BagMessage]:
        name = self._host.name
        return [each for one in self.planner.arrivals for each in input_messages(name, one)]


def _internal(error: Exception) -> str:
    return f"internal error: {error!r}; the planner's log has the details"
