# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The parameters of driver nodes, over their services."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Future as ThreadFuture
from typing import Any

from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.client import Client
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future
from rclpy.validate_full_topic_name import validate_full_topic_name

from focus_planner.lenses.calls import StrangeError
from focus_planner.lenses.profiles import Assignment

# How long the executor may be busy with making clients before it looks at messages again, seconds.
_TURN = 0.1
_PAUSE = 0.01
# Between two looks at which services there are, seconds.
_LOOK = 0.05
_TYPES = {
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}


class DriverParameters:
    """The parameters of a driver node, for :class:`focus_planner.lenses.control.LensControl`.

    Calls are made in an asyncio loop, and responses arrive on the executor's thread. A cancelled
    call is forgotten at once.

    Parameters
    ----------
    node : Node
    name : str
        Full name of the driver node.
    wanted : deque of DriverParameters
        Where it queues for its clients.
    served : callable
        Returns the full names of all services, as of just now.

    Raises
    ------
    rclpy.exceptions.InvalidServiceNameException
        If the name cannot be that of a node.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        wanted: deque[DriverParameters],
        served: Callable[[], Collection[str]],
    ) -> None:
        # Not when its clients are made, where nobody would hear of it.
        validate_full_topic_name(f"{name}/get_parameters", is_service=True)
        self.name = name
        self._node = node
        self._wanted = wanted
        self._served = served
        self._connected: ThreadFuture[None] = ThreadFuture()
        # One response that cannot be read must not hold up those of others.
        self._group = ReentrantCallbackGroup()
        self._clients: dict[str, Client] = {}
        self._was_available = False

    # What follows runs on the executor's thread.

    def make_clients(self) -> None:
        """Make the clients, if there are none yet."""
        if not self._connected.done():
            self._client("set_parameters_atomically", SetParametersAtomically)
            self._client("get_parameters", GetParameters)
            self._connected.set_result(None)

    # What follows runs in the loop.

    async def connect(self) -> None:
        """Wait for the clients, before those of drivers that nobody waits for."""
        if not self._connected.done():
            self._wanted.append(self)
            await asyncio.shield(asyncio.wrap_future(self._connected))

    def is_available(self) -> bool:
        """Return whether its parameter services are available."""
        # A look at all services takes no longer than at one, and many drivers may be missing.
        if not self._was_available and f"{self.name}/get_parameters" not in self._served():
            return False
        # They are discovered one by one but disappear together, and every check takes time.
        clients = list(self._clients.values())[: 1 if self._was_available else 2]
        self._was_available = self._connected.done() and all(
            client.service_is_ready() for client in clients
        )
        return self._was_available

    def strangeness(self) -> str:
        """Return what is there in place of its parameter services; "" if nothing is."""
        namespace, _, name = self.name.rpartition("/")
        try:
            served = self._node.get_service_names_and_types_by_node(name, namespace or "/")
        except NodeNameNonExistentError:
            return ""
        types = dict(served)
        for service, expected in _TYPES.items():
            found = types.get(f"{self.name}/{service}", [expected])
            if expected not in found:
                return f"{service} of the type {', '.join(found)}"
        missing = [each for each in _TYPES if f"{self.name}/{each}" not in types]
        return f"a node without {', '.join(missing)}" if missing else ""

    async def list_parameters(self, names: Collection[str]) -> Collection[str]:
        """Return which of these parameters it has."""
        # For most drivers their values tell, and every client costs: see DriverClients.
        values = await self.get_parameters(list(names))
        if None not in values.values():
            return names
        client = self._client("list_parameters", ListParameters)
        while not client.service_is_ready():  # noqa: ASYNC110 - rclpy has no event for it
            await asyncio.sleep(_PAUSE)
        answer = await _call(client, ListParameters.Request(prefixes=list(names)))
        return set(names).intersection(answer.result.names)

    async def set_parameters(self, values: Sequence[Assignment]) -> str | None:
        """Set all of these parameters or none; return None, or the reason why it was refused."""
        parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values]
        request = SetParametersAtomically.Request(parameters=parameters)
        answer = await _call(self._clients["set_parameters_atomically"], request)
        return None if answer.result.successful else str(answer.result.reason)

    async def get_parameters(self, names: Sequence[str]) -> Mapping[str, object]:
        """Return parameters' values; None for one without a value, or that it does not have.

        Raises
        ------
        StrangeError
            If it answers with more or fewer values, or with some of unknown types.
        """
        request = GetParameters.Request(names=list(names))
        values = (await _call(self._clients["get_parameters"], request)).values
        # A driver that lacks one of them answers with none.
        if values and len(values) != len(names):
            raise StrangeError(
                f"{self.name}: expected get_parameters to answer with {len(names)} values or none,"
                f" got {len(values)}; the driver is broken"
            )
        found = dict(zip(names, values, strict=False))
        return {name: self._python(name, found.get(name)) for name in names}

    def _python(self, name: str, value: ParameterValue | None) -> object:
        if value is None:
            return None
        if value.type > ParameterType.PARAMETER_STRING_ARRAY:
            raise StrangeError(
                f"{self.name}: expected a value of a type that ParameterType.msg names for {name},"
                f" got type {value.type}; the driver is broken"
            )
        return parameter_value_to_python(value)

    def _client(self, service: str, service_type: type) -> Client:
        if service not in self._clients:
            self._clients[service] = self._node.create_client(
                service_type, f"{self.name}/{service}", callback_group=self._group
            )
        return self._clients[service]


class DriverClients:
    """The drivers by name, whose clients are made once the node spins.

    The middleware compares every client with all endpoints of its process: 1,000 drivers take
    seconds, which the node's start does not wait for. Those with an order are served first.

    Parameters
    ----------
    node : Node
    names : iterable of str
        Full names of the driver nodes.
    """

    def __init__(self, node: Node, names: Iterable[str]) -> None:
        self._node = node
        self._wanted: deque[DriverParameters] = deque()
        self._services: frozenset[str] = frozenset()
        self._looked = -math.inf
        self.drivers = {
            name: DriverParameters(node, name, self._wanted, self._served) for name in names
        }
        self._others = deque(self.drivers.values())
        # Not the node's own clock, which stands still while a simulation is paused.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(_PAUSE, self._make_some, clock=steady)

    def destroy(self) -> None:
        """Destroy all clients."""
        # Before all else and in this order: whether anything else is of an endpoint's type the
        # middleware finds out by going through all of them until it meets the first.
        for client in list(self._node.clients):
            self._node.destroy_client(client)

    def _served(self) -> frozenset[str]:
        if time.monotonic() - self._looked >= _LOOK:
            found = self._node.get_service_names_and_types()
            self._services = frozenset(name for name, _ in found)
            self._looked = time.monotonic()
        return self._services

    def _make_some(self) -> None:
        began = time.monotonic()
        while self._others and time.monotonic() - began < _TURN:
            (self._wanted or self._others).popleft().make_clients()
        if not self._others:
            self._timer.cancel()


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
