# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Applies plans to lenses: turns ``CameraFocus`` messages into parameters of driver nodes."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from focus_planner_msgs.msg import CameraFocus, LensState
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from focus_planner.core.text import MAX_REASON, printable
from focus_planner.core.validation import InputError
from focus_planner.lenses.control import LensControl
from focus_planner.lenses.driver import LensReport, report_to_fields
from focus_planner.lenses.orders import MAX_ORDER_BYTES, Time, order_from_message
from focus_planner.messages.limits import check_bytes
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import ORDER, deserialize
from focus_planner.parameters.lenses import ADAPTER_DECLARATIONS, AdapterSettings
from focus_planner.ros.base_node import BaseNode
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.driver_parameters import DriverClients
from focus_planner.ros.lens_frames import PolledFrames
from focus_planner.ros.node_parameters import declare
from focus_planner.ros.process import run, spinning
from focus_planner.ros.qos import LATCHED
from focus_planner.ros.supervisor import Supervisor
from focus_planner.runtime.stop_signals import StopSignals

# Every default callback is one more entity per camera for the executor to wait on.
_NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)
# Between two lines on messages that are no orders, seconds.
_SELDOM = 1.0


class LensAdapter(BaseNode):
    """Sets lenses to their planned focus, and reports how that went.

    Subscribes (reliable, transient local, depth 1)
    -----------------------------------------------
    <planner>/cameras/<name>/focus : focus_planner_msgs/msg/CameraFocus

    Subscribes (best effort), with drivers that publish the metadata of frames there
    --------------------------------------------------------------------------------
    /diagnostics : diagnostic_msgs/msg/DiagnosticArray

    Publishes (reliable, transient local)
    -------------------------------------
    <planner>/lens_states : focus_planner_msgs/msg/LensState
        Whenever a lens's state changes, and of all cameras when somebody subscribes.

    Calls
    -----
    <driver node>/set_parameters_atomically, get_parameters
    <driver node>/list_parameters, of drivers whose values do not tell what they have

    Parameters are those of :mod:`focus_planner.parameters.lenses`.

    Notes
    -----
    The executor's thread only hands messages and responses over to an asyncio loop, which runs on a
    thread of its own and has a :class:`LensControl` for each camera.
    """

    def __init__(self) -> None:
        super().__init__("lens_adapter")
        values = declare(self, ADAPTER_DECLARATIONS)
        settings = AdapterSettings.from_values(values, self.get_namespace())
        self._loop: asyncio.AbstractEventLoop
        # The newest of each camera's order in force, and of one refused since.
        self._states: dict[tuple[str, bool], LensState] = {}
        self._publisher = self.create_publisher(
            LensState,
            f"{settings.planner}/lens_states",
            _states_qos(len(settings.lenses)),
            event_callbacks=PublisherEventCallbacks(
                matched=self._on_match, use_default_callbacks=False
            ),
        )
        names = {lens.node for lens in settings.lenses.values()}
        self._driver_clients = DriverClients(self, sorted(names))
        has_frames = any(lens.profile.frames for lens in settings.lenses.values())
        self._frames = PolledFrames(self, len(names), [settings.planner]) if has_frames else None
        self._controls = {camera: self._control(camera, settings) for camera in settings.lenses}
        for camera in settings.lenses:
            self._subscribe(camera, f"{settings.planner}/cameras/{camera}/focus")

    @contextmanager
    def working(self) -> Iterator[None]:
        """Carry out orders on a thread of its own; on exit leave the lenses as they are."""
        self._loop = asyncio.new_event_loop()
        thread = threading.Thread(target=self._loop.run_forever, name="lenses")
        thread.start()
        try:
            yield
        finally:
            asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result()
            self._loop.call_soon_threadsafe(self._loop.stop)
            thread.join()
            self._loop.close()

    def be_watched(self, supervisor: Supervisor) -> None:
        """Have both threads, while they work, tell that they are alive."""
        supervisor.watch(self, self._loop.call_soon_threadsafe)

    def close(self) -> None:
        """Destroy the node, once nothing spins it any more."""
        self._driver_clients.destroy()
        self.destroy_node()

    def _control(self, camera: str, settings: AdapterSettings) -> LensControl:
        lens = settings.lenses[camera]
        return LensControl(
            self._driver_clients.drivers[lens.node],
            lens.profile,
            partial(self._publish, camera),
            self._time,
            settings.timeouts,
            settings.tolerance,
            settings.tables.get(camera),
            self._frames,
        )

    def _subscribe(self, camera: str, topic: str) -> None:
        # In bytes: the executor ends at a message that it cannot read.
        self.create_subscription(
            CameraFocus,
            topic,
            partial(self._receive, camera),
            LATCHED,
            event_callbacks=_NO_EVENTS,
            raw=True,
        )

    # What follows runs on the executor's thread.

    def _receive(self, camera: str, payload: bytes) -> None:
        try:
            check_bytes("CameraFocus message", payload, MAX_ORDER_BYTES)
            message = deserialize(ORDER, payload)
        except InputError as error:
            self.get_logger().warning(
                f"{camera}: refused an order: {error}", throttle_duration_sec=_SELDOM
            )
            return
        self._loop.call_soon_threadsafe(self._obey, camera, message)

    def _on_match(self, event: Any) -> None:
        # The latched history need not contain every camera's newest state.
        if event.current_count_change > 0:
            self._loop.call_soon_threadsafe(self._publish_all)

    # What follows runs in the loop.

    def _obey(self, camera: str, message: Message) -> None:
        control = self._controls[camera]
        try:
            order = order_from_message(message, camera)
        except InputError as error:
            control.refuse(printable(message.plan_id, MAX_REASON), message.focus_distance, error)
        else:
            control.apply(order)

    def _publish_all(self) -> None:
        for state in self._states.values():
            self._publisher.publish(state)

    def _publish(self, camera: str, report: LensReport) -> None:
        self._log(camera, report)
        if report.refused and report.plan_id == self._controls[camera].plan_id:
            return  # no word of the lens, which that plan's own order has set
        state = message_to_ros(LensState, report_to_fields(report, camera, self._time()))
        self._states.pop((camera, True), None)
        self._states[camera, report.refused] = state
        self._publisher.publish(state)

    def _log(self, camera: str, report: LensReport) -> None:
        if report.refused:
            self.get_logger().warning(
                f"{camera}: refused an order: {printable(report.message, MAX_REASON)}",
                throttle_duration_sec=_SELDOM,
            )
        elif report.message:
            self.get_logger().warning(f"{camera}: {printable(report.message, MAX_REASON)}")
        else:
            self.get_logger().debug(f"{camera}: {report.status.name.lower()} {report.sent_value:g}")

    def _time(self) -> Time:
        seconds, nanoseconds = self.get_clock().now().seconds_nanoseconds()
        return seconds, nanoseconds

    async def _stop(self) -> None:
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _states_qos(cameras: int) -> QoSProfile:
    # Every camera reports what was sent and what was read back, possibly all at once.
    return QoSProfile(
        depth=2 * cameras,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def run_node(signals: StopSignals, args: list[str] | None) -> int:
    """Run the adapter until SIGINT or SIGTERM; return the exit status.

    Parameters
    ----------
    signals : StopSignals
    args : list of str, optional
        ROS arguments; by default those of the process.
    """
    return run("lens_adapter", _serve, signals, args)


def _serve(wait: Callable[[], None]) -> None:
    adapter, supervisor = LensAdapter(), Supervisor()
    with adapter.working():
        adapter.be_watched(supervisor)
        with spinning([adapter]):
            adapter.get_logger().info("ready")
            supervisor.ready()
            wait()
            supervisor.stopping()
    adapter.close()
