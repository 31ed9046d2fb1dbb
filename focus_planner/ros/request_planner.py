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
from dataclasses import replace
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
from focus_planner.messages.writing import plan_to_fields
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.recorder import Recorder, RunRecorder
from focus_planner.recording.run import Beginning
from focus_planner.recording.run_inputs import input_messages
from focus_planner.recording.software import software
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.ros.shown_in_force import ShownInForce
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
)
from focus_planner.runtime.replanning import Surfaces
from focus_planner.runtime.requests import ENDED_MESSAGES, MESSAGES, Outcome, Request
from focus_planner.runtime.seldom import Seldom
from focus_planner.runtime.status import LastRun, Snapshot, plan_input_to_fields

_PREFIXES = {
    Reason.CANCELLED: "cancelled, the best plan found by then",
    Reason.PREEMPTED: "preempted by a newer goal, the best plan found by then, not published",
    Reason.TIME_LIMIT: "ended by parameter max_planning_time, the best plan found by then",
}
_GAVE_WAY = "ended as somebody asked for a plan, the best plan found by then, not published"
_REPLANNED = Note(
    "replanned",
    "made without being asked, for a new surface and from the plan before (parameter replan)",
)
_GIGA = 1e9
# Of plans that nobody asked for, of which there may be many a second.
_SECONDS_BETWEEN_ENTRIES = 10.0


class NoPlan(Exception):  # noqa: N818 - mostly the caller's doing
    """There is no plan; its text is fit for the caller."""

    def __init__(self, reason: Reason, why: str) -> None:
        super().__init__(why)
        self.reason = reason


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
    shown : ShownInForce
        The plan in force, as it is shown.
    surfaces : Surfaces
        Those that are to be planned for without being asked.
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
        self.surfaces = Surfaces()
        self._surface_waits = False
        self._seldom = Seldom()
        self._logged_notes: tuple[Note, ...] = ()
        self.shown = ShownInForce(self.planner, host)

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
        if not request.is_answered:
            self._answer(request)

    def replan(self, request: Request) -> Outcome | None:
        """Do the same for a request that nobody made, if a surface waits for a plan.

        Return how it ended, or None if there was none to plan for.
        """
        outcome = self._answer(request)
        if outcome is not None:
            outcome.on_sent()
        return outcome

    def _answer(self, request: Request) -> Outcome | None:
        run = None
        description: Future[orders.Description] = Future()
        try:
            self._digest(request.settings, partial(self._tell_reading, request))
            if not (self._is_due(request) and request.begin()):
                return None
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
        if not request.finish(outcome) and request.is_asked:
            outcome.on_sent()
        self._account_for(request, outcome)
        if outcome.plan is not None:
            self.shown.describe(outcome.plan, run, description, at_once=request.is_asked)
        return outcome

    def _is_due(self, request: Request) -> bool:
        """Return whether to plan: as somebody asks, or for a surface that waits, before a rig."""
        return request.is_asked or (self._surface_waits and self.planner.rig.in_force is not None)

    def _account_for(self, request: Request, outcome: Outcome) -> None:
        """Note that the surfaces in force were planned for, or why there is no plan."""
        surfaces = {each.number for each in self.planner.surface.all_in_force}
        if outcome.plan is not None and outcome.reason is not Reason.PREEMPTED:
            self.surfaces.end(surfaces)
        elif not request.is_asked and outcome.reason not in MESSAGES:
            self.surfaces.end(surfaces, outcome.message)

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
        surfaces = {each.number for each in self.planner.surface.all_in_force}
        self._surface_waits = self.surfaces.read(surfaces, self.planner.surface.refused)

    def _begin_digest(self) -> None:
        """Have the process read the next surface while this one's plan is published."""
        settings = self._host.settings()
        most, subjects = settings.serving.max_memory, settings.subjects
        self.planner.begin_digest(settings.optics, most, subjects)

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
        period = 0.0 if request.is_asked else settings.recording.replan_period
        if not self._seldom.take("record", period):
            return None
        beginning = Beginning(
            run_id=request.plan_id,
            planner=self._host.name,
            settings=settings,
            asked=request.asked,
            at=request.at,
            software=software(),
            warm_start=self._warm_start if request.starts_warm else None,
        )
        inputs = self._inputs(refused=request.is_asked)
        return self.recorder.begin(settings.recording, inputs, beginning)

    def _failure(
        self, request: Request, reason: Reason, message: str, run: RunRecorder | None
    ) -> Outcome:
        told = with_unheard(message, self._unheard())
        self._log(request, f"no plan: {told}")
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
        self._log(request, f"{request.plan_id}: {why}")
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
            self._warm_start if request.starts_warm else None,
            keep_warm=request.keeps_warm,
            is_recorded=run is not None,
            plan_id=request.plan_id,
            in_force=self.shown.plan_id,
            min_change=settings.min_change,
            was_asked_for=request.is_asked,
        )
        on_step = run.wrap_callback(go_on) if run else go_on
        result = self.planner.plan(order, on_step, teller.note, wish)
        planned = self._planned(result, settings)
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
        if not (request.is_asked or run or self._host.is_watched()):
            self._begin_digest()  # nothing else is to be told of this plan
        self._log_notes(plan.notes)
        if not request.is_asked:
            plan = replace(plan, notes=(*plan.notes, _REPLANNED))
        stamp = self._host.now()
        inputs = self._plan_inputs()
        fields = plan_to_fields(plan, self.planner.frame_id, stamp, request.plan_id, inputs)
        message = message_to_ros(FocusPlan, fields)
        published = reason is not Reason.PREEMPTED
        if run:
            run.keep_plan(serialize_message(message), published=published)
        if published:
            self._warm_start = planned.warm_start
            sparing = not request.is_asked and request.settings.min_change > 0
            (self._host.publish_changes if sparing else self._host.publish)(message)
            self.shown.put_in_force(request.plan_id, stamp)
        failure = f"not recorded: {run.failure}" if run and run.failure else ""
        prefix = _PREFIXES.get(reason, "") if request.is_asked or published else _GAVE_WAY
        parts = [self._origin(request), prefix, plan.summary()]
        parts += [planned.reminder if request.is_asked else "", failure]
        summary = with_unheard("; ".join(part for part in parts if part), self._unheard())
        self._log(request, f"{request.plan_id}: {summary}")
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

    def _origin(self, request: Request) -> str:
        """Return what a plan was made for that nobody asked for."""
        return (
            "" if request.is_asked else f"replanned on the surface {self.planner.surface.in_force}"
        )

    def _wish_of(self, request: Request, began: float) -> Wish:
        """Return what is wanted of the plan for a request."""
        wish = self._wish()
        if wish is not Wish.GO_ON:
            return wish
        if time.monotonic() - began > request.settings.serving.max_planning_time:
            request.stop(Reason.TIME_LIMIT)
        return Wish.STOP if request.stop_requested else Wish.GO_ON

    def _log(self, request: Request, text: str) -> None:
        """Log how a request ended; of those that nobody made, now and then."""
        if self._seldom.take("log", 0.0 if request.is_asked else _SECONDS_BETWEEN_ENTRIES):
            self._host.get_logger().info(text)

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

    def _inputs(self, *, refused: bool = True) -> list[BagMessage]:
        """Return the messages that an answer depends on, maybe with those that it tells of."""
        planner, name = self.planner, self._host.name
        in_force = (*planner.surface.all_in_force, planner.rig.in_force)
        arrivals = [each for each in planner.arrivals if refused or each in in_force]
        return [each for one in arrivals for each in input_messages(name, one)]


def _internal(error: Exception) -> str:
    return f"internal error: {error!r}; the planner's log has the details"
