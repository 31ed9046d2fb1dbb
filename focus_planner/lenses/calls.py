# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calls to a driver node that may be slow, unresponsive or absent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Coroutine, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from focus_planner.lenses.profiles import Assignment

Answer = TypeVar("Answer")
# The values of what a driver has tell that it has it.
_NAMING = "get_parameters or list_parameters"


class UnreachableError(Exception):
    """The driver is absent or does not respond: worth another attempt."""


class RefusedError(Exception):
    """The driver refuses the value: another attempt would not help."""


class StrangeError(RefusedError):
    """The driver answers with what is no answer."""


class Driver(Protocol):
    """A driver node's parameters. Calls have no timeout of their own, and can be cancelled.

    Where it reads answers it raises :class:`StrangeError` if they are none.
    """

    @property
    def name(self) -> str:
        """Full name of the node."""

    async def connect(self) -> None:
        """Get ready to call it; only then it can be discovered."""

    def is_available(self) -> bool:
        """Return whether its parameter services are available."""

    def strangeness(self) -> str:
        """Return what is there in place of its parameter services; "" if nothing is."""

    async def list_parameters(self, names: Collection[str]) -> Collection[str]:
        """Return which of these parameters it has."""

    async def set_parameters(self, values: Sequence[Assignment]) -> str | None:
        """Set all of these parameters or none; return None, or the reason why it was refused."""

    async def get_parameters(self, names: Sequence[str]) -> Mapping[str, object]:
        """Return parameters' values; None for one without a value, or that it does not have."""


@dataclass(frozen=True)
class Timeouts:
    """Timeouts and periods, seconds.

    Attributes
    ----------
    timeout : float
        For the response to a call, for an absent driver to be discovered, and for the next frame of
        a lens that has settled.
    retries : int
        How often a call without a response is repeated.
    settle_time : float
        From sending a value to reading it back for the first time.
    verify_timeout : float
        From then to reading it back for the last time.
    poll_period : float
        Between two readings.
    watch_period : float
        Between two checks that a settled lens has not moved; 0 for none.
    presence_period : float
        Between two checks that the driver of a settled lens is still running.
    shortest_pause, longest_pause : float
        Between two attempts to reach a driver: doubled each time, from the first to the second.
    """

    timeout: float = 2.0
    retries: int = 2
    settle_time: float = 0.0
    verify_timeout: float = 5.0
    poll_period: float = 0.1
    watch_period: float = 5.0
    presence_period: float = 1.0
    shortest_pause: float = 0.25
    longest_pause: float = 4.0


class DriverCalls:
    """Calls to a driver, with the patience that timeouts give them.

    All raise :class:`UnreachableError` if it does not answer.

    Parameters
    ----------
    driver : Driver
    timeouts : Timeouts
    """

    def __init__(self, driver: Driver, timeouts: Timeouts) -> None:
        self._driver = driver
        self._timeouts = timeouts

    @property
    def name(self) -> str:
        """Full name of the node."""
        return self._driver.name

    def is_available(self) -> bool:
        """Return whether its parameter services are available."""
        return self._driver.is_available()

    def absent(self) -> UnreachableError:
        """Return the error that it is not running, or is something else."""
        strange = self._driver.strangeness()
        if strange:
            return UnreachableError(
                f"{self.name}: expected a driver with parameter services, found {strange}; check"
                " the adapter's parameters driver and driver_node"
            )
        return UnreachableError(
            f"{self.name}: expected a running driver, found none; start it, and the value will be"
            " sent"
        )

    async def wait(self) -> None:
        """Wait for discovery: an order may arrive before the driver is discovered."""
        await self._driver.connect()
        now = asyncio.get_running_loop().time
        deadline = now() + self._timeouts.timeout
        while not self._driver.is_available():
            if now() >= deadline:
                raise self.absent()
            await asyncio.sleep(min(self._timeouts.timeout, self._timeouts.shortest_pause) / 4)

    async def having(self, names: Collection[str]) -> Collection[str]:
        """Return which of these parameters it has."""
        return await self._call(lambda: self._driver.list_parameters(names), _NAMING)

    async def set(self, values: Sequence[Assignment]) -> None:
        """Set all of these parameters or none.

        Raises
        ------
        RefusedError
            With the driver's reason.
        """
        reason = await self._call(
            lambda: self._driver.set_parameters(values), "set_parameters_atomically"
        )
        if reason is not None:
            refused = ", ".join(f"{name} = {value}" for name, value in values)
            raise RefusedError(f"{self.name} refused {refused}: {reason or 'no reason given'}")

    async def get(self, names: Sequence[str]) -> Mapping[str, object]:
        """Return parameters' values."""
        return await self._call(lambda: self._driver.get_parameters(names), "get_parameters")

    async def _call(self, call: Callable[[], Coroutine[Any, Any, Answer]], what: str) -> Answer:
        for _ in range(self._timeouts.retries + 1):
            task = asyncio.ensure_future(call())
            try:
                # Not wait_for: before Python 3.12 it may swallow a cancellation.
                done, _pending = await asyncio.wait({task}, timeout=self._timeouts.timeout)
            finally:
                task.cancel()
            if done:
                return task.result()
            if not self._driver.is_available():
                break
        raise UnreachableError(
            f"{self.name}: expected a response from {what} within"
            f" {self._timeouts.timeout:g} s, got none; check the driver: the value is sent again"
            " once it responds"
        )
