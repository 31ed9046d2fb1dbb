"""Applies plans to lenses: turns ``CameraFocus`` messages into parameters of driver nodes."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

from focus_planner_msgs.msg import CameraFocus, LensState
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future

from focus_planner.lenses.control import LensControl
from focus_planner.lenses.driver import (
    LensReport,
    Time,
    order_from_message,
    report_to_fields,
)
from focus_planner.lenses.profiles import Assignment, Value
from focus_planner.parameters.lenses import ADAPTER_DECLARATIONS, AdapterSettings
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.lens_frames import PolledFrames
from focus_planner.ros.log import LoggedNode
from focus_planner.ros.process import declare, run, spinning
from focus_planner.ros.qos import LATCHED
from focus_planner.ros.supervisor import Supervisor

# Every default callback is one more entity per camera for the executor to wait on.
_NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)


class DriverParameters:
    """The parameters of a driver node, for :class:`LensControl`.

    Calls are made in an asyncio loop, and responses arrive on the executor's thread. A cancelled
    call is forgotten at once.
    """

    def __init__(self, node: Node, name: str) -> None:
        self.name = name
        self._list = node.create_client(ListParameters, f"{name}/list_parameters")
        self._set = node.create_client(SetParametersAtomically, f"{name}/set_parameters_atomically")
        self._get = node.create_client(GetParameters, f"{name}/get_parameters")
        self._was_available = False

    def is_available(self) -> bool:
        """Return whether its parameter services are available."""
        # They are discovered one by one but disappear together, and every check takes time.
        clients = [self._set] if self._was_available else [self._set, self._get, self._list]
        self._was_available = all(client.service_is_ready() for client in clients)
        return self._was_available

    async def list_parameters(self, names: Collection[str]) -> Collection[str]:
        """Return which of these parameters it has."""
        answer = await _call(self._list, ListParameters.Request(prefixes=list(names)))
        return set(names).intersection(answer.result.names)

    async def set_parameters(self, values: Sequence[Assignment]) -> str | None:
        """Set all of these parameters or none; return None, or the reason why it was refused."""
        parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values]
        answer = await _call(self._set, SetParametersAtomically.Request(parameters=parameters))
        return None if answer.result.successful else str(answer.result.reason)

    async def get_parameters(self, names: Sequence[str]) -> Mapping[str, Value | None]:
        """Return parameters' values; None for one without a value, or that it does not have."""
        answer = await _call(self._get, GetParameters.Request(names=list(names)))
        values = [parameter_value_to_python(value) for value in answer.values]
        # A driver that lacks one of them answers with none.
        found = dict(zip(names, values, strict=False))
        return {name: found.get(name) for name in names}


class LensAdapter(LoggedNode):
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
    <driver node>/list_parameters, set_parameters_atomically, get_parameters

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
        self._states: dict[str, LensState] = {}
        self._publisher = self.create_publisher(
            LensState,
            f"{settings.planner}/lens_states",
            _states_qos(len(settings.lenses)),
            event_callbacks=PublisherEventCallbacks(
                matched=self._on_match, use_default_callbacks=False
            ),
        )
        names = {lens.node for lens in settings.lenses.values()}
        self._drivers = {name: DriverParameters(self, name) for name in sorted(names)}
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

    def _control(self, camera: str, settings: AdapterSettings) -> LensControl:
        lens = settings.lenses[camera]
        return LensControl(
            self._drivers[lens.node],
            lens.profile,
            partial(self._publish, camera),
            self._time,
            settings.timeouts,
            settings.tolerance,
            settings.tables.get(camera),
            self._frames,
        )

    def _subscribe(self, camera: str, topic: str) -> None:
        receive = partial(self._receive, camera)
        self.create_subscription(CameraFocus, topic, receive, LATCHED, event_callbacks=_NO_EVENTS)

    # What follows runs on the executor's thread.

    def _receive(self, camera: str, message: CameraFocus) -> None:
        order = order_from_message(message)
        self._loop.call_soon_threadsafe(self._controls[camera].apply, order)

    def _on_match(self, event: Any) -> None:
        # The latched history need not contain every camera's newest state.
        if event.current_count_change > 0:
            self._loop.call_soon_threadsafe(self._publish_all)

    # What follows runs in the loop.

    def _publish_all(self) -> None:
        for state in self._states.values():
            self._publisher.publish(state)

    def _publish(self, camera: str, report: LensReport) -> None:
        fields = report_to_fields(report, camera, self._time())
        self._states[camera] = message_to_ros(LensState, fields)
        self._publisher.publish(self._states[camera])
        self._log(camera, report)

    def _log(self, camera: str, report: LensReport) -> None:
        if report.message:
            self.get_logger().warning(f"{camera}: {report.message}")
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


async def _call(client: Client, request: Any) -> Any:
    loop = asyncio.get_running_loop()
    response: asyncio.Future[Any] = loop.create_future()
    call = client.call_async(request)
    call.add_done_callback(lambda done: loop.call_soon_threadsafe(_hand_over, done, response))
    try:
        return await response
    finally:
        client.remove_pending_request(call)


def _hand_over(call: Future, response: asyncio.Future[Any]) -> None:
    if not response.done():
        response.set_result(call.result())


def _states_qos(cameras: int) -> QoSProfile:
    # Every camera reports what was sent and what was read back, possibly all at once.
    return QoSProfile(
        depth=2 * cameras,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def main(args: list[str] | None = None) -> int:
    """Run the adapter until SIGINT or SIGTERM; return the exit status."""
    return run("lens_adapter", _serve, args)


def _serve(wait: Callable[[], None]) -> None:
    adapter, supervisor = LensAdapter(), Supervisor()
    with adapter.working():
        adapter.be_watched(supervisor)
        with spinning([adapter]):
            adapter.get_logger().info("ready")
            supervisor.ready()
            wait()
            supervisor.stopping()


if __name__ == "__main__":
    sys.exit(main())
