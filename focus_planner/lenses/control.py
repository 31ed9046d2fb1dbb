"""Bringing a lens to what the newest plan says, over a driver that may be slow, silent or gone."""

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
    """A driver node's parameters. No call has a time limit of its own; each can be cancelled."""

    @property
    def name(self) -> str:
        """Full name of the node."""

    def is_there(self) -> bool:
        """Return whether its parameter services are."""

    async def list_parameters(self, names: Collection[str]) -> Collection[str]:
        """Return which of these parameters it has."""

    async def set_parameter(self, name: str, value: Value) -> str | None:
        """Set a parameter; return None, or the reason why it was refused."""

    async def get_parameter(self, name: str) -> Value | None:
        """Return a parameter's value, None where it has no number."""


@dataclass(frozen=True)
class Timeouts:
    """How long to wait for what, seconds.

    Attributes
    ----------
    timeout : float
        For the answer to a call, and for a driver that is not there yet.
    retries : int
        Times that a call without an answer is made again.
    settle_time : float
        From sending to the first reading back.
    verify_timeout : float
        From then to the last.
    poll_period : float
        Between two readings.
    watch_period : float
        Between two looks at a lens that has settled, whether it is still there; 0 for none.
    presence_period : float
        Between two looks whether the driver of such a lens is still there.
    shortest_pause, longest_pause : float
        Between two tries to reach a driver that failed; doubled from the one to the other.
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
    """Obeys the newest order for one lens.

    Runs in the running asyncio loop, in one task, which an order of another plan replaces. It
    never gives up: a driver that is not there, does not answer or restarts is told when it is
    there again, and so is a lens that was verified and has moved since. What a driver refuses, and
    a lens that never came where it was to be, is reported and left alone until the next order, or
    the driver's next start.

    Parameters
    ----------
    driver : Driver
    profile : DriverProfile
    report : callable
        Gets a :class:`LensReport` whenever something else is to be said.
    now : callable
        The time for the reports.
    patience : Timeouts
    tolerance : Tolerance
    table : LensTable, optional
    """

    def __init__(
        self,
        driver: Driver,
        profile: DriverProfile,
        report: Callable[[LensReport], None],
        now: Callable[[], Time],
        patience: Timeouts | None = None,
        tolerance: Tolerance | None = None,
        table: LensTable | None = None,
    ) -> None:
        self._driver = driver
        self._profile = profile
        self._tell = report
        self._now = now
        self._patience = patience or Timeouts()
        self._tolerance = tolerance or Tolerance()
        self._table = table
        self._order: FocusOrder | None = None
        self._task: asyncio.Task[None] | None = None
        self._last: LensReport | None = None

    def obey(self, order: FocusOrder) -> None:
        """Begin to carry out an order.

        The same order again, as a latched topic delivers it, disturbs nothing that is under way.
        When the lens had been verified it is read once more, and told again only if it moved.
        """
        repeated = order == self._order
        verified = self._last is not None and self._last.status is LensStatus.VERIFIED
        if repeated and not verified:
            return
        self.stop()
        self._order = order
        self._task = asyncio.get_running_loop().create_task(self._carry_out(order, repeated))
        self._task.add_done_callback(partial(self._tell_bug, order))

    def stop(self) -> None:
        """Leave the lens as it is."""
        if self._task is not None:
            self._task.cancel()

    def _tell_bug(self, order: FocusOrder, task: asyncio.Task[None]) -> None:
        """Never leave an order without a verdict, whatever happened."""
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
        """Try until there is a verdict, in growing intervals while the driver does not answer."""
        pause = self._patience.shortest_pause
        while True:
            try:
                return await self._apply(order, command)
            except _UnreachableError as error:
                self._report(_failed(order, str(error), self._last))
            await self._until_there(pause)
            pause = min(2 * pause, self._patience.longest_pause)

    async def _until_there(self, pause: float) -> None:
        await asyncio.sleep(pause)
        # rclpy tells nobody when a service comes or goes.
        while not self._driver.is_there():  # noqa: ASYNC110
            await asyncio.sleep(self._patience.shortest_pause)

    async def _until_moved(self, command: LensCommand) -> None:
        """Wait until the lens has to be told again: it moved, or its driver was started again."""
        next_look = _next_multiple(self._patience.watch_period)
        while self._driver.is_there():
            # All lenses at the same time: answers that come together wake the executor once.
            await asyncio.sleep(_next_multiple(self._patience.presence_period) - _monotonic())
            if _monotonic() >= next_look:
                if await self._has_moved(command):
                    return
                next_look = _next_multiple(self._patience.watch_period)
        await self._until_there(0.0)

    async def _has_moved(self, command: LensCommand) -> bool:
        """Read a lens that was read before; tell when one that was late has arrived."""
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

    async def _apply(self, order: FocusOrder, command: LensCommand) -> None:
        told = LensReport(order.plan_id, LensStatus.FAILED, order.focus_distance)
        try:
            await self._prepare()
            told = replace(
                told, unit=command.unit, sent_value=float(command.value), sent_at=self._now()
            )
            await self._set(self._profile.parameter, command.value)
        except _RefusedError as error:
            self._report(replace(told, message=str(error)))
            return
        sent = replace(told, status=LensStatus.SENT)
        self._report(sent)
        await asyncio.sleep(self._patience.settle_time)
        await self._verify(command, sent)

    async def _prepare(self) -> None:
        """Find the driver and end its autofocus."""
        await self._wait_for_driver()
        parameter, manual = self._profile.parameter, self._profile.manual
        names = [parameter, *(name for name, _ in manual)]
        has = await self._call(lambda: self._driver.list_parameters(names), "list_parameters")
        if parameter not in has:
            raise _RefusedError(
                f"{self._driver.name}: expected a driver with parameter {parameter}, got one"
                " without; choose the parameter driver of the adapter, or check that this camera's"
                " lens can be moved"
            )
        for name, value in manual:
            if name in has:
                await self._set(name, value)

    async def _wait_for_driver(self) -> None:
        """Give discovery some time: an order may be there before the driver is seen."""
        deadline = _monotonic() + self._patience.timeout
        while not self._driver.is_there():
            if _monotonic() >= deadline:
                raise _UnreachableError(
                    f"{self._driver.name}: expected a running driver, found none; start it, it is"
                    " told as soon as it is there"
                )
            await asyncio.sleep(min(self._patience.timeout, self._patience.shortest_pause) / 4)

    async def _set(self, name: str, value: Value) -> None:
        reason = await self._call(lambda: self._driver.set_parameter(name, value), "set_parameters")
        if reason is not None:
            raise _RefusedError(
                f"{self._driver.name} refuses {name} = {value}: {reason or 'it gives no reason'}"
            )

    async def _verify(self, command: LensCommand, sent: LensReport) -> None:
        """Read until the value is there; report it, or where the lens is instead."""
        deadline = _monotonic() + self._patience.verify_timeout
        while True:
            read = await self._read(command, sent)
            if read.status is LensStatus.VERIFIED or _monotonic() >= deadline:
                self._report(read)
                return
            await asyncio.sleep(self._patience.poll_period)

    async def _confirm(self, command: LensCommand) -> bool:
        """Read a lens that was verified; return whether it is still where it was."""
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
                message=f"{self._driver.name}: expected a number for {parameter} read back, got"
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
            " tolerance, or drive it from one side",
        )

    async def _call(self, call: Callable[[], Coroutine[Any, Any, Answer]], what: str) -> Answer:
        for _ in range(self._patience.retries + 1):
            task = asyncio.ensure_future(call())
            try:
                # Not wait_for: before Python 3.12 it can swallow that it is cancelled.
                done, _pending = await asyncio.wait({task}, timeout=self._patience.timeout)
            finally:
                task.cancel()
            if done:
                return task.result()
            if not self._driver.is_there():
                break
        raise _UnreachableError(
            f"{self._driver.name}: expected an answer from {what} within"
            f" {self._patience.timeout:g} s, got none; check the driver, it is told again when it"
            " answers"
        )

    def _report(self, report: LensReport) -> None:
        if not _same(report, self._last):
            self._last = report
            self._tell(report)


class _UnreachableError(Exception):
    """The driver is not there or does not answer: to be tried again."""


class _RefusedError(Exception):
    """The driver does not take it: trying again changes nothing."""


def _failed(order: FocusOrder, message: str, last: LensReport | None = None) -> LensReport:
    """Return the report of a failure; what this plan's driver was told before stays in it."""
    if last is not None and _of(last) == (order.plan_id, order.focus_distance):
        return replace(last, status=LensStatus.FAILED, message=message)
    return LensReport(order.plan_id, LensStatus.FAILED, order.focus_distance, message=message)


def _same(report: LensReport, last: LensReport | None) -> bool:
    """Return whether a failure is only told again."""
    return (
        last is not None
        and report.status is last.status is LensStatus.FAILED
        and (report.message, _of(report)) == (last.message, _of(last))
    )


def _of(report: LensReport) -> tuple[str, float]:
    return report.plan_id, report.planned_distance


def _next_multiple(period: float) -> float:
    """Return the next time that is a multiple of a period; never, of 0."""
    return (_monotonic() // period + 1.0) * period if period else math.inf


def _monotonic() -> float:
    return asyncio.get_running_loop().time()
