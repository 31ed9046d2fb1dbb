"""The node: topics, the service, the action and the life cycle, before the planning thread.

It is up before what solves is loaded, which takes seconds: until then the last plan of the records
is in force again.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import datetime, timezone
from functools import partial
from typing import TYPE_CHECKING, Any

from focus_planner_msgs.msg import FocusPlan, LensState, PlannerStatus
from focus_planner_msgs.srv import PlanFocus
from rclpy._rclpy_pybind11 import InvalidHandle, RCLError
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.task import Future

from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import LENS_STATE, deserialize, fields_of
from focus_planner.messages.writing import Fields
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.naming import new_run_id
from focus_planner.ros.action import PlanAction, write_outcome
from focus_planner.ros.camera_topics import CameraTopics
from focus_planner.ros.conversions import fields_from_ros, message_to_ros
from focus_planner.ros.diagnostics import Diagnostics
from focus_planner.ros.node_parameters import Parameters
from focus_planner.ros.process import run
from focus_planner.ros.qos import ALL_CALLS, LATCHED
from focus_planner.ros.status import StatusBoard
from focus_planner.ros.subscriptions import GatedCallbackGroup, Subscriptions
from focus_planner.runtime.diagnostics import (
    Diagnosis,
    diagnose_cameras,
    diagnose_input,
    diagnose_last_run,
    diagnose_memory,
    diagnose_planner,
    diagnose_recorder,
)
from focus_planner.runtime.inputs import InputState
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.requests import Outcome, Request, Requests

if TYPE_CHECKING:
    from focus_planner.ros.planning_thread import Planning

# All lenses of a large rig may report at once.
_LENSES = QoSProfile(
    depth=10_000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# How often it is looked at what is late, and what is to be told.
_TICK = 0.1
# Less than what launch and systemd wait before they kill.
_SECONDS_TO_FINISH = 3.0
# Whoever is told in the midst of discovery may miss it, and waits for the middleware to ask again,
# which Fast DDS does every three seconds: the plan of the records is published when most have met,
# and again so many seconds later.
_SECONDS_TO_MEET = 0.3
_SECONDS_TO_REPEAT = (0.3, 0.7, 1.5)
# For a response, once a coroutine has returned it.
_SPINS_TO_SEND = 10
_FIRST_STATE, _LAST_STATE = "unconfigured", "finalized"


class PlannerNode(LifecycleNode):
    """Plans the focus of all cameras of a rig for the newest surface.

    Subscribes
    ----------
    ~/mesh : shape_msgs/msg/Mesh
        The surface, in the frame of parameter ``frame_id``.
    ~/cloud : sensor_msgs/msg/PointCloud2
        The surface as points; ``normal_x/y/z`` are used when present, else estimated.
    ~/camera_poses : geometry_msgs/msg/PoseArray
        One optical-frame pose per camera ``cam_000``, ``cam_001``, ...; image and lens from the
        parameters.
    ~/rig : focus_planner_msgs/msg/CameraRig
        The same with names, images, lenses and a grid.
    ~/lens_states : focus_planner_msgs/msg/LensState
        What became of the plan at each lens, from whoever drives it.

    Publishes (reliable, transient local, depth 1)
    ----------------------------------------------
    ~/focus_plan : focus_planner_msgs/msg/FocusPlan
    ~/cameras/<name>/focus : focus_planner_msgs/msg/CameraFocus
    ~/status : focus_planner_msgs/msg/PlannerStatus

    Publishes
    ---------
    /diagnostics : diagnostic_msgs/msg/DiagnosticArray

    Serves
    ------
    ~/plan_focus : focus_planner_msgs/srv/PlanFocus
    ~/plan : focus_planner_msgs/action/PlanFocus

    Parameters are those of :mod:`focus_planner.messages.parameters`.

    Notes
    -----
    Managed, as the ROS 2 design of managed nodes has it. Configuring brings the last recorded plan
    into force, loads all that plans, and opens topics, service and action; until the node is
    activated messages wait unread, calls are answered that it is inactive, and goals rejected. The
    plan in force stays latched while the node is inactive.

    One thread plans and reads what was received, in the order of arrival; it is the only one that
    enters kernels. The executor has a single thread, which hands work over and stays free to
    answer: a request is a coroutine that waits for the planning thread, in a reentrant group so
    that requests can queue up. rclpy looks at waiting coroutines only when something wakes the
    executor, so waiting costs nothing.
    """

    def __init__(self) -> None:
        super().__init__("focus_planner")
        self._settings = Parameters(self)
        self._requests = Requests()
        self._status = StatusBoard()
        self._cameras = CameraTopics(self)
        self._diagnostics = Diagnostics(self, self._diagnose)
        self._status_topic = self.create_publisher(PlannerStatus, "~/status", LATCHED)
        self._reading = GatedCallbackGroup()
        self._answering = GatedCallbackGroup()
        self._planning: Planning | None = None
        self._focus_plan: Publisher | None = None
        self._lenses: Subscription | None = None
        self._service: Service | None = None
        self._action: PlanAction | None = None
        self._inputs: Subscriptions | None = None
        self._stopping = threading.Event()
        self._calls: set[Future] = set()
        self._unfinished: deque[Callable[[], object]] = deque()
        self._repeats: deque[tuple[float, FocusPlan]] = deque()
        self._publishing = threading.Lock()
        self._changing = threading.Lock()
        self._guard_transitions()
        # The node's own clock may be one of a simulation, and stand.
        self.create_timer(_TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    # --- life ----------------------------------------------------------------------------------

    def autostart(self) -> None:
        """Configure and activate, if the parameter ``autostart`` says so."""
        if self._settings.current.serving.autostart:
            self._start()
        # Who calls meanwhile waits, and is not told that it is inactive.
        self._answering.is_open = True
        self._wake_executor()

    def spin(self, executor: SingleThreadedExecutor) -> None:
        """Answer until :meth:`stop`, and then until every caller has an answer."""
        while self.context.ok() and (self._is_owing or not self._stopping.is_set()):
            self._guard(executor.spin_once)
        for _ in range(_SPINS_TO_SEND):
            if self.context.ok():
                self._guard(partial(executor.spin_once, timeout_sec=0.0))

    def stop(self) -> None:
        """Stop planning at the solver's next step; tell the callers, then end :meth:`spin`."""
        self._stopping.set()
        if self._planning:
            self._planning.stop()
        if self.executor:
            self.executor.create_task(self._requests.drop, Reason.SHUTTING_DOWN)

    def finish(self, timeout: float) -> bool:
        """Shut down, after :meth:`stop`; return whether planning and recording have ended."""
        with self._changing:
            if self._state != _LAST_STATE:
                self.trigger_shutdown()
        return self._release(timeout)

    def _start(self) -> None:
        with self._changing:
            # Whoever manages it may have been faster.
            if self._state != _FIRST_STATE:
                return
            if self.trigger_configure() is TransitionCallbackReturn.SUCCESS:
                self.trigger_activate()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Bring the last plan into force, load what plans, open what is served."""
        return self._transition(self._configure, state, super().on_configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read, plan, answer."""
        return self._transition(self._activate, state, super().on_activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Tell all callers, and plan no more."""
        return self._transition(self._deactivate, state, super().on_deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close what is served, forget inputs and plan."""
        return self._transition(self._clean_up, state, super().on_cleanup)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close what is served."""
        return self._transition(self._deactivate, state, super().on_shutdown)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to the beginning."""
        return self._transition(self._clean_up, state, super().on_error)

    def _transition(
        self,
        do: Callable[[], bool],
        state: LifecycleState,
        others: Callable[[LifecycleState], TransitionCallbackReturn],
    ) -> TransitionCallbackReturn:
        """Do what a transition takes; say why, if it fails: rclpy keeps that to itself."""
        self._status.changed()
        try:
            return others(state) if do() else TransitionCallbackReturn.FAILURE
        except (InputError, OSError) as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        except Exception:  # noqa: BLE001 - it goes to the state that is there for it
            self.get_logger().error(traceback.format_exc())
            return TransitionCallbackReturn.ERROR

    def _configure(self) -> bool:
        with ExitStack() as failed:
            failed.callback(self._clean_up)
            self._focus_plan = self.create_publisher(FocusPlan, "~/focus_plan", LATCHED)
            self._restore_last_plan()
            if not self._load():
                return False
            self._open()
            failed.pop_all()
        return True

    def _load(self) -> bool:
        """Load all that plans; return whether it came to its end."""
        self.get_logger().info("loading kernels; the first time, compiling takes half a minute")
        # It takes seconds, and comes after the last plan.
        from focus_planner.ros.planning_thread import Planning, PlanningHost  # noqa: PLC0415

        self._planning = Planning(
            PlanningHost(
                planner=self.get_fully_qualified_name(),
                reporter=self.get_logger(),
                settings=lambda: self._settings.current,
                now=lambda: self.get_clock().now().seconds_nanoseconds(),
                on_rig=self._follow,
                publish=self._publish,
            )
        )
        if self._stopping.is_set():
            self._planning.stop()
        return self._planning.load()

    def _activate(self) -> bool:
        self._reading.is_open = True
        self._wake_executor()
        self.get_logger().info("ready")
        return True

    def _deactivate(self) -> bool:
        self._reading.is_open = False
        reason = Reason.SHUTTING_DOWN if self._stopping.is_set() else Reason.INACTIVE
        self._requests.drop(reason)
        return True

    def _clean_up(self) -> bool:
        self._deactivate()
        self._release(_SECONDS_TO_FINISH)
        with self._publishing:
            self._repeats.clear()
        self._cameras.clear()
        if self._focus_plan:
            self.destroy_publisher(self._focus_plan)
        self._status = StatusBoard()
        return True

    def _release(self, timeout: float) -> bool:
        """Close what is served and end the planning thread; return whether it ended in time."""
        planning, self._planning = self._planning, None
        if planning is None:
            return True
        if self._inputs:
            self._inputs.destroy()
        self._inputs = None
        if self._lenses:
            self.destroy_subscription(self._lenses)
        if self._service:
            self.destroy_service(self._service)
        if self._action:
            self._action.destroy()
        self._action = None
        planning.stop()
        while self._unfinished:
            self._finish_one()
        return planning.finish(timeout)

    def _guard_transitions(self) -> None:
        """Have a transition that does not fit the state refused: rclpy would not even answer."""
        change = self._service_change_state.callback

        def guarded(request: Any, response: Any) -> Any:
            response.success = False
            if not self._changing.acquire(blocking=False):
                self.get_logger().warning("refused a transition: another one is under way")
                return response
            try:
                return change(request, response)
            except RCLError:
                what = request.transition.label or f"number {request.transition.id}"
                self.get_logger().warning(
                    f"refused the transition {what}: the node is {self._state}, which has no such"
                )
                return response
            finally:
                self._changing.release()

        self._service_change_state.callback = guarded

    @property
    def _state(self) -> str:
        label: str = self._state_machine.current_state[1]
        return label

    @property
    def _is_active(self) -> bool:
        return self._reading.is_open and self._planning is not None

    @property
    def _is_owing(self) -> bool:
        return bool(self._calls) or (self._action is not None and self._action.busy)

    # --- what is served --------------------------------------------------------------------------

    def _open(self) -> None:
        """Open topics, service and action."""
        assert self._planning is not None
        self._inputs = Subscriptions(
            self,
            self._reading,
            lambda: self._settings.current,
            self._cameras.check,
            self._planning.receive_surface,
            self._planning.receive_rig,
        )
        self._lenses = self.create_subscription(
            LensState,
            "~/lens_states",
            self._receive_lens_state,
            _LENSES,
            callback_group=self._reading,
            raw=True,
        )
        self._service = self.create_service(
            PlanFocus,
            "~/plan_focus",
            self._plan_focus,
            qos_profile=ALL_CALLS,
            callback_group=self._answering,
        )
        self._action = PlanAction(self, self._answering, self)

    def _receive_lens_state(self, payload: bytes) -> None:
        try:
            self._status.reported(deserialize(LENS_STATE, payload))
        except (InputError, AssertionError, ValueError, UnicodeError) as error:
            self.get_logger().warning(f"refused a lens state: {error}", throttle_duration_sec=1.0)

    # --- requests ------------------------------------------------------------------------------

    @property
    def _inactive(self) -> Outcome:
        if self._state == _LAST_STATE:
            return Outcome(Reason.INACTIVE, "the planner is shut down; start it again")
        what = f"ros2 lifecycle set {self.get_fully_qualified_name()} activate"
        return Outcome(Reason.INACTIVE, f"the planner is inactive; activate it, as with: {what}")

    async def _plan_focus(
        self, request: PlanFocus.Request, response: PlanFocus.Response
    ) -> PlanFocus.Response:
        """Have a call planned when its turn comes, and wait for its answer."""
        outcome = self._inactive
        if self._is_active:
            answer = Future()
            self._calls.add(answer)
            try:
                wait = self._settings.current.serving.service_max_wait
                until = time.perf_counter() + wait
                self._submit(fields_from_ros(request), answer.set_result, waits_until=until)
                outcome = await answer
            finally:
                self._calls.remove(answer)
        write_outcome(response, outcome)
        self.answered(outcome)
        return response

    def admits_goal(self) -> bool:
        """Return whether a goal may come; those that it takes the place of are ended."""
        if not self._is_active:
            self.get_logger().info("rejected a goal: the planner is not active")
            return False
        serving = self._settings.current.serving
        if not self._requests.admit_goal(serving):
            why = f"{len(self._requests.open)} requests are planned or wait"
            self.get_logger().info(f"rejected a goal: {why}, and overlap is {serving.overlap}")
            return False
        return True

    def submit_goal(
        self, asked: Fields, answer: Callable[[Outcome], None], tell: Callable[[Fields], None]
    ) -> Request:
        """Have a goal planned when its turn comes."""
        return self._submit(asked, answer, tell=tell)

    def answered(self, outcome: Outcome) -> None:
        """Do what is left to do once an answer is sent."""
        self._unfinished.append(outcome.afterwards)
        self._status.changed()
        if self.executor:
            # It comes to this when the response is sent, and not before.
            self.executor.create_task(self._finish_one)

    def _submit(self, asked: Fields, answer: Callable[[Outcome], None], **how: Any) -> Request:
        if self._inputs:
            self._inputs.take_all()

        def answer_and_wake(outcome: Outcome) -> None:
            answer(outcome)
            self._wake_executor()

        request = Request(asked, self._settings.current, new_run_id(), answer_and_wake, **how)
        self._status.changed()
        if self._requests.add(request) and self._planning:
            self._planning.plan(request)
        return request

    def _finish_one(self) -> None:
        if self._unfinished:
            self._unfinished.popleft()()

    # --- plans and reports ---------------------------------------------------------------------

    def _restore_last_plan(self) -> None:
        directory = self._settings.current.recording.directory
        try:
            last = directory and last_plan(directory, self.get_fully_qualified_name())
        except OSError as error:
            self.get_logger().error(f"the last plan cannot be looked for: {error}")
            return
        if not last:
            return
        plan = message_to_ros(FocusPlan, fields_of(last.message))
        self._cameras.follow([camera.name for camera in plan.cameras])
        time.sleep(_SECONDS_TO_MEET)
        self._publish(plan, from_record=True)
        now = time.monotonic()
        self._repeats = deque((now + seconds, plan) for seconds in _SECONDS_TO_REPEAT)
        self.get_logger().info(
            f"the last plan, {plan.plan_id}, is in force again, from its record {last.run}"
        )

    def _publish(self, plan: FocusPlan, *, from_record: bool = False) -> None:
        with self._publishing:
            self._repeats.clear()
            # Before anybody can report what became of it.
            self._status.planned(plan, from_record=from_record)
            self._send(plan)

    def _follow(self, rig: Rig) -> None:
        with self._publishing:
            self._repeats.clear()
            self._cameras.follow([camera.name for camera in rig.cameras])

    def _send(self, plan: FocusPlan) -> None:
        if self._focus_plan:
            self._focus_plan.publish(plan)
        self._cameras.publish(plan)

    def _repeat(self) -> None:
        """Publish the plan of the records again, when it is time and none has come since."""
        with self._publishing:
            if self._repeats and self._repeats[0][0] <= time.monotonic():
                self._send(self._repeats.popleft()[1])

    def _tick(self) -> None:
        self._repeat()
        self._requests.turn_away_late()
        period = self._settings.current.serving.status_period
        if self._status.due(period):
            self._publish_status()
        self._diagnostics.publish_if_due(period)

    def _publish_status(self) -> None:
        planned = self._requests.planned
        with self._status.telling(
            self._state,
            planned.plan_id if planned else "",
            self._requests.waiting,
            self._input_states,
            self.get_clock().now().to_msg(),
            datetime.now(timezone.utc),
        ) as message:
            self._status_topic.publish(message)

    @property
    def _input_states(self) -> tuple[InputState, InputState]:
        if self._planning is None:
            return InputState("surface"), InputState("rig")
        snapshot = self._planning.snapshot
        return snapshot.surface, snapshot.rig

    def _diagnose(self) -> Iterator[Diagnosis]:
        settings = self._settings.current
        planned, now = self._requests.planned, datetime.now(timezone.utc)
        yield diagnose_planner(
            self._state, planned.plan_id if planned else "", self._requests.waiting
        )
        for state in self._input_states:
            yield diagnose_input(state, now, settings.serving.max_input_age)
        run = self._planning.snapshot.last_run if self._planning else None
        yield diagnose_last_run(run)
        yield diagnose_cameras(run, self._status.counts)
        yield diagnose_recorder(
            settings.recording.directory,
            self._planning.recording_failure if self._planning else "",
            self._planning.runs_to_write if self._planning else 0,
        )
        yield diagnose_memory()

    def _guard(self, job: Callable[[], None]) -> None:
        try:
            job()
        except InvalidHandle:
            pass  # another thread destroyed what was being waited for
        except RCLError as error:  # whoever was to be answered has gone
            self.get_logger().warning(f"not sent: {error}", throttle_duration_sec=1.0)
        except Exception:  # noqa: BLE001 - one bad message or caller must not end the node
            self.get_logger().error(traceback.format_exc())


def main(args: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit status."""
    finished = True

    def serve(signals: set[signal.Signals]) -> None:
        nonlocal finished
        finished = _serve(PlannerNode(), signals)

    status = run("planner_node", serve, args)
    if not finished:
        # Nothing can interrupt a kernel, and Python would wait for it. There is nothing to lose:
        # callers are answered, and the middleware is shut down.
        sys.stderr.flush()
        os._exit(status)
    return status


def _serve(node: PlannerNode, signals: set[signal.Signals]) -> bool:
    """Serve until a signal comes; return whether the planning thread ended in time."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=node.spin, args=(executor,), name="executor")
    # Not on the executor's: it tells the state meanwhile.
    start = threading.Thread(target=node.autostart, name="autostart")
    thread.start()
    start.start()
    signal.sigwait(signals)
    node.stop()
    start.join()
    thread.join()
    executor.shutdown()
    finished = node.finish(_SECONDS_TO_FINISH)
    node.destroy_node()
    return finished


if __name__ == "__main__":
    sys.exit(main())
