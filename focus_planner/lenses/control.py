"""Sets a lens to its planned focus, through a driver that may be slow, unresponsive or absent."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Collection, Coroutine
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol, TypeVar

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError
from focus_planner.lenses.driver import (
    DriverProfile,
    FocusOrder,
    LensCommand,
    LensReport,
    LensStatus,
    Time,
    Tolerance,
    Value,
    command_for,
    distance_of,
)

Answer = TypeVar("Answer")


class Driver(Protocol):
    """A driver node's parameters. Calls have no timeout of their own, and can be cancelled."""

    @property
    def name(self) -> str:
        """Full name of the node."""

    def is_available(self) -> bool:
        """Return whether its parameter services are available."""

    async def list_parameters(self, names: Collection[str]) -> Collection[str]:
        """Return which of these parameters it has."""

    async def set_parameter(self, name: str, value: Value) -> str | None:
        """Set a parameter; return None, or the reason why it was refused."""

    async def get_parameter(self, name: str) -> Value | None:
        """Return a parameter's value, None if it is not a number."""


@dataclass(frozen=True)
class Timeouts:
    """Timeouts and periods, seconds.

    Attributes
    ----------
    timeout : float
        For the response to a call, and for an absent driver to be discovered.
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


class LensControl:
    """Applies the newest order to one lens, and keeps it applied.

    Runs in the running asyncio loop, in one task, which the next order replaces. It never gives
    up: the value is sent again to a driver that was absent, did not respond or has restarted, and
    to a verified lens that has moved since. What a driver refuses, and a lens that does not reach
    its position, is reported and left alone until the next order, or until the driver restarts.

    Parameters
    ----------
    driver : Driver
    profile : DriverProfile
    on_report : callable
        Called with a :class:`LensReport` whenever there is something new to report.
    now : callable
        Returns the time for the reports.
    timeouts : Timeouts
    tolerance : Tolerance
    table : LensTable, optional
    """

    def __init__(
        self,
        driver: Driver,
        profile: DriverProfile,
        on_report: Callable[[LensReport], None],
        now: Callable[[], Time],
        timeouts: Timeouts | None = None,
        tolerance: Tolerance | None = None,
        table: LensTable | None = None,
    ) -> None:
        self._driver = driver
        self._profile = profile
        self._on_report = on_report
        self._now = now
        self._timeouts = timeouts or Timeouts()
        self._tolerance = tolerance or Tolerance()
        self._table = table
        self._order: FocusOrder | None = None
        self._task: asyncio.Task[None] | None = None
        self._last: LensReport | None = None

    def apply(self, order: FocusOrder) -> None:
        """Begin to carry out an order.

        The same order again, as a latched topic delivers it, does not disturb what is in progress.
        If the lens had been verified it is read once more, and set again only if it has moved.
        """
        repeated = order == self._order
        verified = self._last is not None and self._last.status is LensStatus.VERIFIED
        if repeated and not verified:
            return
        self.stop()
        self._order = order
        self._task = asyncio.get_running_loop().create_task(self._carry_out(order, repeated))
        self._task.add_done_callback(partial(self._report_crash, order))

    def stop(self) -> None:
        """Stop carrying out the order; the lens stays as it is."""
        if self._task is not None:
            self._task.cancel()

    def _report_crash(self, order: FocusOrder, task: asyncio.Task[None]) -> None:
        """Report an order as failed if carrying it out raised."""
        if not task.cancelled() and (error := task.exception()):
            self._report(_failed(order, f"internal error: {type(error).__name__}: {error}"))

    async def _carry_out(self, order: FocusOrder, repeated: bool) -> None:
        try:
            command = command_for(order, self._profile, self._table)
        except InputError as error:
            self._report(_failed(order, str(error)))
            return
        if repeated and await self._confirm(command):
            await self._until_moved(command)
        while True:
            await self._until_settled(order, command)
            await self._until_moved(command)

    async def _until_settled(self, order: FocusOrder, command: LensCommand) -> None:
        """Send until the lens has settled or failed; back off while its driver is unreachable."""
        pause = self._timeouts.shortest_pause
        while True:
            try:
                return await self._send(order, command)
            except _UnreachableError as error:
                self._report(_failed(order, str(error), self._last))
            await self._until_available(pause)
            pause = min(2 * pause, self._timeouts.longest_pause)

    async def _until_available(self, pause: float) -> None:
        await asyncio.sleep(pause)
        # rclpy has no event for services that appear or disappear.
        while not self._driver.is_available():  # noqa: ASYNC110
            await asyncio.sleep(self._timeouts.shortest_pause)

    async def _until_moved(self, command: LensCommand) -> None:
        """Wait until the lens must be set again: it has moved, or its driver has restarted."""
        next_check = _next_multiple(self._timeouts.watch_period)
        while self._driver.is_available():
            # All lenses at the same times: responses that arrive together wake the executor once.
            await asyncio.sleep(_next_multiple(self._timeouts.presence_period) - _monotonic())
            if _monotonic() >= next_check:
                if await self._has_moved(command):
                    return
                next_check = _next_multiple(self._timeouts.watch_period)
        await self._until_available(0.0)

    async def _has_moved(self, command: LensCommand) -> bool:
        """Read a settled lens again; report one that was late and has arrived."""
        last = self._last
        if last is None or last.status not in (LensStatus.VERIFIED, LensStatus.DIFFERS):
            return False
        try:
            read = await self._read(command, last)
        except _UnreachableError:
            return True
        if read.status is LensStatus.VERIFIED and last.status is not LensStatus.VERIFIED:
            self._report(read)
        return last.status is LensStatus.VERIFIED is not read.status

    async def _send(self, order: FocusOrder, command: LensCommand) -> None:
        report = LensReport(order.plan_id, LensStatus.FAILED, order.focus_distance)
        try:
            await self._prepare()
            report = replace(
                report, unit=command.unit, sent_value=float(command.value), sent_at=self._now()
            )
            await self._set(self._profile.parameter, command.value)
        except _RefusedError as error:
            self._report(replace(report, message=str(error)))
            return
        sent = replace(report, status=LensStatus.SENT)
        self._report(sent)
        await asyncio.sleep(self._timeouts.settle_time)
        await self._verify(command, sent)

    async def _prepare(self) -> None:
        """Find the driver and switch its autofocus off."""
        await self._wait_for_driver()
        parameter, manual = self._profile.parameter, self._profile.manual
        names = [parameter, *(name for name, _ in manual)]
        has = await self._call(lambda: self._driver.list_parameters(names), "list_parameters")
        if parameter not in has:
            raise _RefusedError(
                f"{self._driver.name}: expected a driver with the parameter {parameter}, got one"
                " without it; set the adapter's parameter driver, or check that this camera has a"
                " focus motor"
            )
        for name, value in manual:
            if name in has:
                await self._set(name, value)

    async def _wait_for_driver(self) -> None:
        """Wait for discovery: an order may arrive before the driver is discovered."""
        deadline = _monotonic() + self._timeouts.timeout
        while not self._driver.is_available():
            if _monotonic() >= deadline:
                raise _UnreachableError(
                    f"{self._driver.name}: expected a running driver, found none; start it, and"
                    " the value will be sent"
                )
            await asyncio.sleep(min(self._timeouts.timeout, self._timeouts.shortest_pause) / 4)

    async def _set(self, name: str, value: Value) -> None:
        reason = await self._call(lambda: self._driver.set_parameter(name, value), "set_parameters")
        if reason is not None:
            raise _RefusedError(
                f"{self._driver.name} refused {name} = {value}: {reason or 'no reason given'}"
            )

    async def _verify(self, command: LensCommand, sent: LensReport) -> None:
        """Read until the lens has arrived or time is up; report where it is."""
        deadline = _monotonic() + self._timeouts.verify_timeout
        while True:
            read = await self._read(command, sent)
            if read.status is LensStatus.VERIFIED or _monotonic() >= deadline:
                self._report(read)
                return
            await asyncio.sleep(self._timeouts.poll_period)

    async def _confirm(self, command: LensCommand) -> bool:
        """Read a verified lens; return whether it is still where it was."""
        moved = self._last is None or await self._has_moved(command)
        if self._last is not None and not moved:
            self._report(replace(self._last, read_at=self._now()))
        return not moved

    async def _read(self, command: LensCommand, sent: LensReport) -> LensReport:
        parameter = self._profile.parameter
        value = await self._call(lambda: self._driver.get_parameter(parameter), "get_parameters")
        if value is None:
            return replace(
                sent,
                status=LensStatus.DIFFERS,
                message=f"{self._driver.name}: expected to read back a number for {parameter}, got"
                " none; restart the driver",
            )
        read = replace(
            sent,
            read_value=float(value),
            read_at=self._now(),
            read_distance=distance_of(command, float(value), self._table),
        )
        if self._tolerance.accepts(float(command.value), float(value)):
            return replace(read, status=LensStatus.VERIFIED, message="")
        return replace(
            read,
            status=LensStatus.DIFFERS,
            message=f"{self._driver.name}: expected {parameter} = {command.value:g}, read"
            f" {value:g}; the lens is slow, at a limit or has backlash: raise verify_timeout or"
            " tolerance, or always approach from one side",
        )

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
        raise _UnreachableError(
            f"{self._driver.name}: expected a response from {what} within"
            f" {self._timeouts.timeout:g} s, got none; check the driver: the value is sent again"
            " once it responds"
        )

    def _report(self, report: LensReport) -> None:
        if not _same(report, self._last):
            self._last = report
            self._on_report(report)


class _UnreachableError(Exception):
    """The driver is absent or does not respond: worth another attempt."""


class _RefusedError(Exception):
    """The driver refuses the value: another attempt would not help."""


def _failed(order: FocusOrder, message: str, last: LensReport | None = None) -> LensReport:
    """Return the report of a failure, with what was sent for the same plan before."""
    if last is not None and _of(last) == (order.plan_id, order.focus_distance):
        return replace(last, status=LensStatus.FAILED, message=message)
    return LensReport(order.plan_id, LensStatus.FAILED, order.focus_distance, message=message)


def _same(report: LensReport, last: LensReport | None) -> bool:
    """Return whether a report only repeats the last failure."""
    return (
        last is not None
        and report.status is last.status is LensStatus.FAILED
        and (report.message, _of(report)) == (last.message, _of(last))
    )


def _of(report: LensReport) -> tuple[str, float]:
    return report.plan_id, report.planned_distance


def _next_multiple(period: float) -> float:
    """Return the next multiple of a period; inf for a period of 0."""
    return (_monotonic() // period + 1.0) * period if period else math.inf


def _monotonic() -> float:
    return asyncio.get_running_loop().time()
