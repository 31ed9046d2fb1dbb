# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planner node: creates topics, services and the planning thread, and connects them.

The node is up before the solvers are loaded, which takes seconds: meanwhile the last recorded plan
is in force again.
"""

from __future__ import annotations

import gc
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import datetime, timezone
from functools import partial

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.executors import SingleThreadedExecutor

from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.callers import CallerTellingExecutor
from focus_planner.ros.camera_topics import CameraTopics
from focus_planner.ros.diagnostics import DiagnosticsPublisher
from focus_planner.ros.gated_group import GatedCallbackGroup
from focus_planner.ros.lens_states import LensStates
from focus_planner.ros.lifecycle import ManagedNode
from focus_planner.ros.node_parameters import Parameters
from focus_planner.ros.plan_publisher import PlanPublisher
from focus_planner.ros.plan_server import PlanServer
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.ros.planning_thread import PlanningThread
from focus_planner.ros.process import run
from focus_planner.ros.replanner import Replanner
from focus_planner.ros.status import StatusPublisher
from focus_planner.ros.steps import Steps
from focus_planner.ros.subscriptions import Subscriptions
from focus_planner.ros.supervisor import Supervisor
from focus_planner.ros.visuals import VisualsPublisher
from focus_planner.runtime.diagnostics import Diagnosis, diagnose
from focus_planner.runtime.fork_server import ForkedProcess, ForkServer, ForkServerEnded
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.remote_planner import PlanningDied
from focus_planner.runtime.replanning import Replanned
from focus_planner.runtime.status import PlannerReport, Snapshot
from focus_planner.runtime.stop_signals import StopSignals

# Between checks for overdue requests and due reports, seconds.
_TICK = 0.1
# Less than launch and systemd wait before they kill a process.
_SECONDS_TO_FINISH = 3.0
# The exit status of a node that could not go on.
_FAILED = 1
# Once a coroutine has returned a response, the executor takes a few more steps to send it.
_SPINS_TO_SEND = 10
# Seconds for which the node stays after its last answer. Where a caller's middleware learns that
# the node has ended before it has read the answer, it drops that.
_SECONDS_TO_RECEIVE = 0.5


class PlannerNode(ManagedNode):
    """Plans the focus of all cameras of a rig for the newest surface.

    Subscribes
    ----------
    ~/mesh : shape_msgs/msg/Mesh
        The surface, in the frame of parameter ``frame_id``.
    ~/cloud : sensor_msgs/msg/PointCloud2
        The surface as points; ``normal_x/y/z`` are used when present, else estimated.
    ~/camera_poses : geometry_msgs/msg/PoseArray
        One optical-frame pose per camera ``cam_000``, ``cam_001``, ...; intrinsics and lens from
        the parameters.
    ~/rig : focus_planner_msgs/msg/CameraRig
        The same with names, intrinsics, lenses and a grid.
    /tf_static : tf2_msgs/msg/TFMessage
        How frames are related: for messages in another frame than ``frame_id``, and for the rig of
        parameter ``camera_frames``.
    CameraInfo : sensor_msgs/msg/CameraInfo
        Of ``camera_frames``, on the topics of parameter ``camera_info_topics``.
    ~/lens_states : focus_planner_msgs/msg/LensState
        How far each lens has applied the plan, from the node that drives it.

    Publishes
    ---------
    ~/focus_plan : focus_planner_msgs/msg/FocusPlan
    ~/cameras/<name>/focus : focus_planner_msgs/msg/CameraFocus
    ~/status : focus_planner_msgs/msg/PlannerStatus
    ~/markers : visualization_msgs/msg/MarkerArray
        The plan in 3D, computed only if somebody subscribes.
    ~/quality_cloud : sensor_msgs/msg/PointCloud2
        How well it images the surface, likewise.
    /diagnostics : diagnostic_msgs/msg/DiagnosticArray
        All topics but this one are reliable, transient local, and one message deep.

    Serves
    ------
    ~/plan_focus : focus_planner_msgs/srv/PlanFocus
    ~/plan : focus_planner_msgs/action/PlanFocus

    Parameters are those of :mod:`focus_planner.parameters.planner`.

    Notes
    -----
    A managed node. Configuring puts the last recorded plan in force, loads the solvers, and creates
    topics, service and action. Until the node is activated, messages wait unread, calls are
    answered that it is inactive, and goals are rejected. The plan in force stays latched while the
    node is inactive.

    Inputs are parsed and plans made in a process of its own, which one thread waits for: it can be
    ended whatever it is doing, and what ends it does not end the node. The executor has a single
    thread, which hands work over and stays free to answer. Transitions run on the executor's
    thread, except those of the start, which run on a thread of their own.

    Parameters
    ----------
    server : ForkServer
        Starts planning processes.

    Attributes
    ----------
    has_failed : bool
        Whether it ended because it could not go on.
    """

    def __init__(self, server: ForkServer) -> None:
        super().__init__("focus_planner")
        self.has_failed = False
        self._fork_server = server
        self._settings = Parameters(self)
        self._receiving = GatedCallbackGroup()
        self._answering = GatedCallbackGroup()
        self._diagnostics = DiagnosticsPublisher(self, self._diagnose)
        self._status = StatusPublisher(self)
        self._cameras = CameraTopics(self)
        self._plans = PlanPublisher(self, self._cameras, self._status.planned)
        self._visuals = VisualsPublisher(self, self._show)
        self._server = PlanServer(
            self, self._answering, self._current_settings, self._status.changed
        )
        self._planning: PlanningThread | None = None
        self._inputs: Subscriptions | None = None
        self._replanner: Replanner | None = None
        self._lens_states = LensStates(self, self._status, self._current_settings)
        self._publishers_checked = 0.0
        self._stopping = threading.Event()
        self._supervisor = Supervisor()
        self._supervisor.watch(self)
        # Not the node's own clock, which stands still while a simulation is paused.
        self.create_timer(_TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    # --- the process ---------------------------------------------------------------------------

    def autostart(self) -> None:
        """Configure and activate, if the parameter ``autostart`` says so."""
        if self._settings.current.serving.autostart and not self.start_up():
            self._fail("the node could not start by itself")
        # Calls made before this wait, instead of being answered that the node is inactive.
        self._answering.is_open = True
        self._wake_executor()
        if not self.has_failed:
            self._supervisor.ready()

    def spin(self, executor: SingleThreadedExecutor) -> None:
        """Serve until :meth:`stop`, and then until every caller has been answered."""
        steps = Steps(self.get_logger, self._fail)

        def can_go_on() -> bool:
            return self.context.ok() and not steps.have_failed

        while can_go_on() and (self._server.is_busy or not self._stopping.is_set()):
            steps.take(executor.spin_once)
        for _ in range(_SPINS_TO_SEND):
            if can_go_on():
                steps.take(partial(executor.spin_once, timeout_sec=0.0))
        end = self._server.answered + _SECONDS_TO_RECEIVE
        while can_go_on() and (left := end - time.monotonic()) > 0:
            steps.take(partial(executor.spin_once, timeout_sec=left))

    def stop(self) -> None:
        """Stop planning at the solver's next step, answer all callers, then end :meth:`spin`."""
        self._stopping.set()
        self._supervisor.stopping()
        if self._planning:
            self._planning.stop()
        if self.executor:
            self.executor.create_task(self._server.requests.abort_all, Reason.SHUTTING_DOWN)

    def finish(self, timeout: float) -> bool:
        """Shut down, after :meth:`stop`; return whether planning and recording have ended."""
        self.shut_down()
        self._server.close()
        return self._release(timeout)

    # --- transitions ---------------------------------------------------------------------------

    def configure(self) -> bool:
        """Put the last plan in force, load the solvers, create what is served."""
        with ExitStack() as on_failure:
            on_failure.callback(self.clean_up)
            self._plans.open()
            self._visuals.open()
            directory = self._settings.current.recording.directory
            if directory is not None:
                self._plans.restore(directory)
            if not self._load():
                return False
            self._open()
            on_failure.pop_all()
        return True

    def activate(self) -> None:
        """Read inputs, accept requests."""
        self._server.activate()
        self._receiving.is_open = True
        if self._planning:
            self._planning.resume()
        if self._replanner:
            self._replanner.plan_if_due()
        self._wake_executor()
        self.get_logger().info("ready")

    def deactivate(self) -> None:
        """Answer all callers, end what is being planned, and leave inputs unread."""
        self._receiving.is_open = False
        if self._planning:
            self._planning.pause()
        stopping = self._stopping.is_set()
        self._server.deactivate(Reason.SHUTTING_DOWN if stopping else Reason.INACTIVE)

    def clean_up(self) -> None:
        """Destroy what is served, forget the inputs and the plan."""
        self.deactivate()
        self._release(_SECONDS_TO_FINISH)
        self._plans.close()
        self._visuals.close()
        self._status.clear()

    def _fork(self) -> ForkedProcess:
        try:
            return self._fork_server.fork()
        except ForkServerEnded as error:
            self._fail(f"no more planning processes can be started: {error}")
            raise PlanningDied("the node is ending") from None

    def _fail(self, why: str) -> None:
        """End the process, unless it is ending: its supervisor is to act."""
        if not self._stopping.is_set():
            self.has_failed = True
            self.get_logger().fatal(f"{why}; ending")
            os.kill(os.getpid(), signal.SIGTERM)

    def _load(self) -> bool:
        """Load the solvers; return False if :meth:`stop` interrupted that."""
        self.get_logger().info("loading kernels")
        self._planning = PlanningThread(
            PlanningHost(
                name=self.get_fully_qualified_name(),
                get_logger=self.get_logger,
                settings=self._current_settings,
                now=lambda: self.get_clock().now().seconds_nanoseconds(),
                on_rig=lambda rig: self._plans.follow(rig.names),
                publish=self._plans.publish,
                publish_changes=self._plans.publish_changes,
                start=self._fork,
                give_up=self._fail,
                is_watched=lambda: self._visuals.is_watched,
                show=self._visuals.show,
                hide=self._visuals.hide,
            )
        )
        if self._stopping.is_set():
            self._planning.stop()
        return self._planning.load()

    def _open(self) -> None:
        """Create input topics, service and action."""
        assert self._planning is not None
        self._replanner = Replanner(self, self._planning, self._current_settings)
        self._inputs = Subscriptions(
            self,
            self._receiving,
            self._current_settings,
            self._cameras.longest_name,
            self._replanner.receive_surface,
            self._replanner.receive_rig,
            self._planning.note_unheard,
        )
        self._lens_states.open(self._receiving)
        self._server.open(self._planning, self._inputs)

    def _release(self, timeout: float) -> bool:
        """Destroy what is served, end the planning thread; return whether it ended in time."""
        planning, self._planning = self._planning, None
        if planning is None:
            return True
        if self._inputs:
            self._inputs.destroy()
        if self._replanner:
            self._replanner.destroy()
        self._replanner = None
        self._lens_states.close()
        self._inputs = None
        self._server.close_when_answered()
        planning.stop()
        self._server.finish_answered()
        return planning.finish(timeout)

    # --- callbacks -----------------------------------------------------------------------------

    def _tick(self) -> None:
        self._plans.repeat_if_due()
        self._visuals.welcome_if_due()
        self._server.close_if_answered()
        self._server.requests.reject_overdue()
        if self._inputs:
            self._inputs.look_if_due()
        if self._planning:
            self._planning.show_if_due()
        period = self._settings.current.serving.status_period
        self._check_publishers_if_due(period)
        self._status.publish_if_due(self._report(), period)
        self._diagnostics.publish_if_due(period)

    def _check_publishers_if_due(self, period: float) -> None:
        if self._inputs and time.monotonic() - self._publishers_checked >= period:
            self._publishers_checked = time.monotonic()
            self._inputs.check_publishers()
            self._lens_states.check_publishers()

    def _show(self) -> None:
        if self._planning:
            self._planning.show()

    def _current_settings(self) -> Settings:
        return self._settings.current

    def _report(self) -> PlannerReport:
        requests, planning = self._server.requests, self._planning
        planned = requests.planned
        return PlannerReport(
            state=self.state,
            planning=planned.plan_id if planned else planning.replanning if planning else "",
            waiting=requests.waiting,
            snapshot=planning.snapshot if planning else Snapshot(),
            recording_failure=planning.recording_failure if planning else "",
            runs_to_write=planning.runs_to_write if planning else 0,
            planning_pid=planning.pid if planning else None,
            skipped_runs=self._plans.skipped,
            compiling=planning.compiling if planning else "",
            replanned=planning.replanned if planning else Replanned(),
        )

    def _diagnose(self) -> Iterator[Diagnosis]:
        now = datetime.now(timezone.utc)
        return diagnose(self._report(), self._status.lens_summary, self._settings.current, now)


def run_node(server: ForkServer, signals: StopSignals, args: list[str] | None) -> tuple[int, bool]:
    """Run the node until SIGINT or SIGTERM, or until it fails.

    Parameters
    ----------
    server : ForkServer
        Starts planning processes.
    signals : StopSignals
    args : list of str, optional
        ROS arguments; by default those of the process.

    Returns
    -------
    status : int
        Of the process.
    finished : bool
        Whether all that was to be written has been.
    """
    finished, failed = True, False

    def serve(wait: Callable[[], None]) -> None:
        nonlocal finished, failed
        node = PlannerNode(server)
        finished = _serve(node, wait)
        failed = node.has_failed

    status = run("planner_node", serve, signals, args)
    return status or _FAILED * failed, finished


def _serve(node: PlannerNode, wait: Callable[[], None]) -> bool:
    """Serve until a signal arrives; return whether the planning thread ended in time."""
    executor = CallerTellingExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=node.spin, args=(executor,), name="executor")
    # Not on the executor's thread, which reports the state meanwhile.
    start = threading.Thread(target=node.autostart, name="autostart")
    thread.start()
    try:
        start.start()
        # What is there now is never garbage, and takes long to look through.
        gc.freeze()
        wait()
    finally:  # also if no other thread can be started
        node.stop()
        if start.ident is not None:
            start.join()
        thread.join()
        executor.shutdown()
    finished = node.finish(_SECONDS_TO_FINISH)
    node.destroy_node()
    return finished
