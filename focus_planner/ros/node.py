"""The node: topics and the service on one side, the planning thread on the other."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future as Job
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import rclpy
from focus_planner_msgs.msg import CameraRig, FocusPlan
from focus_planner_msgs.srv import PlanFocus
from geometry_msgs.msg import PoseArray
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.utilities import remove_ros_args, try_shutdown
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh

from focus_planner.core.checks import InputError
from focus_planner.core.solvers import Progress
from focus_planner.core.types import Rig, Surface
from focus_planner.core.warm_up import warm_up
from focus_planner.messages.inputs import Arrival, Input
from focus_planner.messages.parameters import Settings
from focus_planner.messages.planner import NotReady, Planner, internal_error
from focus_planner.messages.reading import (
    Optics,
    cloud_from_message,
    mesh_from_bytes,
    poses_from_message,
    request_from_message,
    rig_from_message,
)
from focus_planner.messages.typestore import deserialize, serialize
from focus_planner.messages.writing import plan_to_fields
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.recorder import Recorder, RunRecorder
from focus_planner.recording.run import CLOUD, POSES, RIG, Beginning, input_message, new_run_id
from focus_planner.recording.software import software
from focus_planner.ros.cameras import LATCHED, CameraTopics
from focus_planner.ros.conversions import (
    fields_from_ros,
    message_to_ros,
    type_name_of,
)
from focus_planner.ros.parameters import Parameters

# Some messages that come in one go are kept: if the newest is refused an older one may do.
_TOPICS = QoSProfile(depth=4, reliability=ReliabilityPolicy.RELIABLE)
# A sensor that publishes best effort, or a latched surface, is a matter of the node's parameters.
_OVERRIDES = QoSOverridingOptions([QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY])
# The default keeps the ten newest requests and silently drops what else came at once.
ALL_CALLS = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
_SHUTTING_DOWN = "the node is shutting down"
# Less than what launch and systemd wait before they kill.
_SECONDS_TO_FINISH = 3.0

Read = Callable[[bytes, Optics], Any]


@dataclass(frozen=True)
class _Call:
    """One service call, with the parameters as they were when it came.

    ``started`` is by :func:`time.perf_counter`, ``at`` is nanoseconds since the epoch.
    """

    request: PlanFocus.Request
    settings: Settings
    started: float
    at: int
    plan_id: str


def _nothing() -> None:
    """Do nothing."""


@dataclass(frozen=True)
class _Outcome:
    """What a caller is answered, and what is left to do once that is sent."""

    success: bool
    message: str
    plan: FocusPlan | None = None
    afterwards: Callable[[], object] = _nothing


@dataclass(frozen=True)
class _Taken:
    """A message, and when the middleware received it, nanoseconds."""

    at: int
    payload: bytes
    receive: Callable[[bytes], None]


@dataclass(frozen=True)
class _Listener:
    """A subscription, and what becomes of its messages."""

    subscription: Subscription
    receive: Callable[[bytes], None]

    def take(self) -> list[_Taken]:
        """Take a message if one has arrived."""
        with self.subscription.handle:
            taken = self.subscription.handle.take_message(self.subscription.msg_type, True)
        if taken is None:
            return []
        payload, info = taken
        return [_Taken(info["received_timestamp"], payload, self.receive)]


class PlannerNode(Node):
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

    Publishes (reliable, transient local, depth 1)
    ----------------------------------------------
    ~/focus_plan : focus_planner_msgs/msg/FocusPlan
    ~/cameras/<name>/focus : focus_planner_msgs/msg/CameraFocus

    Serves
    ------
    ~/plan_focus : focus_planner_msgs/srv/PlanFocus

    Parameters are those of :mod:`focus_planner.messages.parameters`.

    Notes
    -----
    One thread plans and reads what was received, in the order of arrival; it is the only one that
    enters kernels. The executor has a single thread, which hands work over and stays free to
    answer: a service call is a coroutine that waits for the planning thread, in a reentrant group
    so that calls can queue up. rclpy looks at waiting coroutines only when something wakes the
    executor, so waiting costs nothing.
    """

    def __init__(self) -> None:
        super().__init__("focus_planner")
        self._settings = Parameters(self)
        self._cameras = CameraTopics(self)
        self._planner = Planner(self.get_logger(), self._cameras.follow)
        self._recorder = Recorder(self.get_logger())
        self._planning = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planning")
        self._jobs: set[Job[None]] = set()
        self._stopping = threading.Event()
        self._calls: set[Future] = set()
        self._unfinished: deque[Callable[[], object]] = deque()
        self._focus_plan = self.create_publisher(FocusPlan, "~/focus_plan", LATCHED)
        self._do_next(self._warm_up)
        self._listeners = [
            self._listen(Mesh, "~/mesh", self._planner.surface, self._read_mesh),
            self._listen(PointCloud2, "~/cloud", self._planner.surface, self._read_cloud),
            self._listen(PoseArray, "~/camera_poses", self._planner.rig, self._read_poses),
            self._listen(CameraRig, "~/rig", self._planner.rig, self._read_rig),
        ]
        self.create_service(
            PlanFocus,
            "~/plan_focus",
            self._plan_focus,
            qos_profile=ALL_CALLS,
            callback_group=ReentrantCallbackGroup(),
        )

    def spin(self, executor: SingleThreadedExecutor) -> None:
        """Answer until :meth:`stop`, and then until every caller has an answer."""
        while self.context.ok() and (self._calls or not self._stopping.is_set()):
            self._guard(executor.spin_once)

    def stop(self) -> None:
        """Stop planning at the solver's next step; tell the callers, then end :meth:`spin`."""
        self._stopping.set()
        self._planning.shutdown(wait=False, cancel_futures=True)
        if self.executor:
            self.executor.create_task(self._give_up)

    def finish(self, timeout: float) -> bool:
        """Wait, after :meth:`stop`, for planning and recording; return whether both have ended."""
        until = time.monotonic() + timeout
        ended = not wait(self._jobs, timeout).not_done
        while self._unfinished:
            self._finish_one()
        recorded = self._recorder.close(max(until - time.monotonic(), 0.0))
        if not recorded:
            self.get_logger().error("not recorded: runs that took too long to write stay partial")
        return recorded and ended

    def _listen(
        self, message_type: type, topic: str, target: Input[Any, Any], read: Read
    ) -> _Listener:
        name, type_name = self.resolve_topic_name(topic), type_name_of(message_type)

        def receive(payload: bytes) -> None:
            target.receive(Arrival(name, type_name, payload, partial(read, payload)))
            self._do_next(self._digest)

        def take(payload: bytes, info: dict[str, int]) -> None:
            self._take_all([_Taken(info["received_timestamp"], payload, receive)])

        with_info: Callable[..., None] = take  # rclpy's type knows only callbacks without
        subscription = self.create_subscription(
            message_type, topic, with_info, _TOPICS, raw=True, qos_overriding_options=_OVERRIDES
        )
        return _Listener(subscription, receive)

    def _take_all(self, taken: list[_Taken]) -> None:
        """Receive what was taken and all else that has arrived, in the order of arrival.

        The executor goes by topic, not by time, and takes messages before calls only by chance.
        """
        while more := [one for listener in self._listeners for one in listener.take()]:
            taken += more
        for one in sorted(taken, key=lambda one: one.at):
            one.receive(one.payload)

    # By the functions that a replay reads with, so that what is refused is refused alike.

    def _read_mesh(self, payload: bytes, _: Optics) -> Surface:
        return mesh_from_bytes(payload)

    def _read_cloud(self, payload: bytes, _: Optics) -> Surface:
        return cloud_from_message(deserialize(CLOUD, payload), self._frame_id)

    def _read_poses(self, payload: bytes, optics: Optics) -> Rig:
        message = deserialize(POSES, payload)
        return self._cameras.check(poses_from_message(message, optics, self._frame_id))

    def _read_rig(self, payload: bytes, optics: Optics) -> Rig:
        message = deserialize(RIG, payload)
        return self._cameras.check(rig_from_message(message, optics, self._frame_id))

    @property
    def _frame_id(self) -> str:
        return self._settings.current.frame_id

    async def _plan_focus(
        self, request: PlanFocus.Request, response: PlanFocus.Response
    ) -> PlanFocus.Response:
        """Hand a call to the planning thread and wait for its answer."""
        self._take_all([])
        answer = Future()
        self._calls.add(answer)
        call = _Call(
            request, self._settings.current, time.perf_counter(), time.time_ns(), new_run_id()
        )
        if not self._do_next(partial(self._answer, call, answer)):
            self._give_up()
        try:
            outcome: _Outcome = await answer
        finally:
            self._calls.remove(answer)
        response.success, response.message = outcome.success, outcome.message
        if outcome.plan is not None:
            response.plan = outcome.plan
        self._unfinished.append(outcome.afterwards)
        if self.executor:
            # It comes to this when the response is sent, and not before.
            self.executor.create_task(self._finish_one)
        return response

    def _finish_one(self) -> None:
        if self._unfinished:
            self._unfinished.popleft()()

    def _give_up(self) -> None:
        for answer in self._calls:
            answer.set_result(_Outcome(False, _SHUTTING_DOWN))

    def _do_next(self, job: Callable[[], None]) -> bool:
        """Queue a job for the planning thread; return whether there still is one."""
        try:
            future = self._planning.submit(self._guard, job)
        except RuntimeError:
            return False
        self._jobs.add(future)
        future.add_done_callback(self._jobs.discard)
        return True

    def _guard(self, job: Callable[[], None]) -> None:
        try:
            job()
        except Exception:  # noqa: BLE001 - one bad message or caller must not end the node
            self.get_logger().error(traceback.format_exc())

    # What follows runs on the planning thread.

    def _warm_up(self) -> None:
        # They take some time, once.
        software()
        serialize(RIG, {})
        self.get_logger().info("loading kernels; the first time, compiling takes half a minute")
        warm_up(lambda: not self._stopping.is_set())
        if not self._stopping.is_set():
            self.get_logger().info("ready")

    def _digest(self) -> None:
        settings = self._settings.current
        self._planner.digest(settings.optics)
        if settings.recording.directory is not None:
            self._recorder.prepare(settings.recording.directory, self._inputs())

    def _inputs(self) -> list[BagMessage]:
        return [input_message(arrival) for arrival in self._planner.arrivals()]

    def _answer(self, call: _Call, answer: Future) -> None:
        record = None
        try:
            self._planner.digest(call.settings.optics)
            record = self._record(call)
            outcome = self._plan(call, record)
        except (InputError, NotReady) as error:
            self.get_logger().info(f"no plan: {error}")
            outcome = self._no_plan(str(error), record)
        except Exception as error:  # noqa: BLE001 - the caller is told, the log has the rest
            self.get_logger().error(traceback.format_exc())
            outcome = self._no_plan(internal_error(error), record)
        if answer.done():
            outcome.afterwards()
        else:
            answer.set_result(outcome)
            self._wake_executor()

    def _record(self, call: _Call) -> RunRecorder | None:
        """Begin to record a call, if calls are recorded."""
        settings = call.settings
        if settings.recording.directory is None:
            return None
        beginning = Beginning(
            run_id=call.plan_id,
            planner=self.get_fully_qualified_name(),
            settings=settings,
            asked=fields_from_ros(call.request),
            at=call.at,
            software=software(),
            warmth=self._planner.warmth if settings.warm_start else None,
        )
        return self._recorder.begin(settings.recording, self._inputs(), beginning)

    @staticmethod
    def _no_plan(message: str, record: RunRecorder | None) -> _Outcome:
        if record is None:
            return _Outcome(False, message)
        return _Outcome(False, message, afterwards=partial(record.finish, False, message))

    def _plan(self, call: _Call, record: RunRecorder | None) -> _Outcome:
        settings = call.settings
        request = request_from_message(call.request, settings.request)
        self.get_logger().debug(f"planning: {request}")
        plan, rig, reminder = self._planner.plan(
            request,
            settings.optics,
            settings.model,
            record.watch(self._go_on) if record else self._go_on,
            warm_start=settings.warm_start,
        )
        if self._stopping.is_set():
            return _Outcome(False, _SHUTTING_DOWN)
        plan = replace(plan, total_seconds=time.perf_counter() - call.started)
        stamp = self.get_clock().now().seconds_nanoseconds()
        fields = plan_to_fields(plan, rig.frame_id, stamp, call.plan_id)
        message = message_to_ros(FocusPlan, fields)
        self._focus_plan.publish(message)
        self._cameras.publish(message)
        lost = f"not recorded: {record.failure}" if record and record.failure else ""
        parts = [plan.summary(), reminder, lost]
        summary = "; ".join(part for part in parts if part)
        self.get_logger().info(f"{call.plan_id}: {summary}")
        finish = partial(record.finish, True, summary, plan, rig, stamp) if record else _nothing
        return _Outcome(True, summary, message, finish)

    def _go_on(self, _: Progress) -> bool:
        return not self._stopping.is_set()


def main(args: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit status."""
    with _blocked(signal.SIGINT, signal.SIGTERM) as signals:
        try:
            _refuse_others(args)
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            node = PlannerNode()
        except (InputError, ParameterException, RuntimeError) as error:
            what = f"{type(error).__name__}: " if isinstance(error, RuntimeError) else ""
            print(f"planner_node: {what}{error}", file=sys.stderr)  # noqa: T201 - no logger yet
            try_shutdown()
            return 2
        finished = _run(node, signals)
        rclpy.shutdown()
    if not finished:
        # Nothing can interrupt a kernel, and Python would wait for it. There is nothing to lose:
        # callers are answered, and the middleware is shut down.
        sys.stderr.flush()
        os._exit(0)
    return 0


def _refuse_others(args: list[str] | None) -> None:
    """Raise if there are arguments that are not for ROS: a parameter was probably meant."""
    given = list(sys.argv[1:] if args is None else args)
    others = remove_ros_args(["planner_node", *given])[1:]
    if others:
        raise InputError(
            "arguments",
            "none but those after --ros-args",
            " ".join(others),
            "parameters are given as --ros-args -p samples:=1000",
        )


def _run(node: PlannerNode, signals: set[signal.Signals]) -> bool:
    """Serve until a signal comes; return whether the planning thread ended in time."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=node.spin, args=(executor,), name="executor")
    thread.start()
    signal.sigwait(signals)
    node.stop()
    thread.join()
    executor.shutdown()
    finished = node.finish(_SECONDS_TO_FINISH)
    node.destroy_node()
    return finished


@contextmanager
def _blocked(*signals: signal.Signals) -> Iterator[set[signal.Signals]]:
    """Keep signals from every thread that is started, to be waited for.

    A handler could only run once the main thread is back from the middleware, and rclpy's own
    would end the context before the callers are answered.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield set(signals)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


if __name__ == "__main__":
    sys.exit(main())
