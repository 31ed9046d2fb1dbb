# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Sets a lens to its planned focus, through a driver that may be slow, unresponsive or absent."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError
from focus_planner.lenses.calls import (
    Driver,
    DriverCalls,
    RefusedError,
    Timeouts,
    UnreachableError,
)
from focus_planner.lenses.driver import (
    LensCommand,
    LensReport,
    LensStatus,
    Tolerance,
    command_for,
    distance_of,
)
from focus_planner.lenses.observation import DriverLens, Frames
from focus_planner.lenses.orders import NO_TIME, FocusOrder, Time
from focus_planner.lenses.profiles import DriverProfile

_AS_SENT = (LensStatus.VERIFIED, LensStatus.ACCEPTED)
# A value that a driver took and that did not arrive is sent once more.
_ATTEMPTS = 2


class LensControl:
    """Applies the newest order to one lens, and keeps it applied.

    Runs in the running asyncio loop, in one task, which the next order replaces. It never gives
    up: the value is sent again to a driver that was absent, did not respond or has restarted. To a
    lens that is not where it was sent it is sent once more, after ``verify_timeout`` or when a lens
    that was there has moved since. What a driver refuses or answers strangely, and a lens that
    still differs, is reported and left alone until the next order, or until the driver restarts.

    Parameters
    ----------
    driver : Driver
    profile : DriverProfile
        With the names of this lens's parameters.
    on_report : callable
        Called with a :class:`LensReport` whenever there is something new to report.
    now : callable
        Returns the time for the reports, by the clock that stamps frames.
    timeouts : Timeouts
    tolerance : Tolerance
    table : LensTable, optional
    frames : Frames, optional
        What the driver says of the lens, if its profile has frames.
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
        frames: Frames | None = None,
    ) -> None:
        self._timeouts = timeouts or Timeouts()
        self._calls = DriverCalls(driver, self._timeouts)
        self._lens = DriverLens(self._calls, profile, tolerance or Tolerance(), frames)
        self._profile = profile
        self._on_report = on_report
        self._now = now
        self._table = table
        self._order: FocusOrder | None = None
        self._task: asyncio.Task[None] | None = None
        self._last: LensReport | None = None
        self._refusal: LensReport | None = None

    @property
    def plan_id(self) -> str | None:
        """Of the order in force; None if there is none."""
        return None if self._order is None else self._order.plan_id

    def apply(self, order: FocusOrder) -> None:
        """Begin to carry out an order.

        The same order again, as a latched topic delivers it, does not disturb what is in progress.
        A lens that was as sent is looked at once more, and set again only if it has moved. An order
        that cannot be carried out, or is of an older plan, is refused.
        """
        try:
            if self._order is not None:
                order.check_newer(self._order, self._now)
            command = command_for(order, self._profile, self._table)
        except InputError as error:
            self.refuse(order.plan_id, order.focus_distance, error)
            return
        repeated = order == self._order
        if repeated and (self._last is None or self._last.status not in _AS_SENT):
            return
        self.stop()
        self._order, self._refusal = order, None
        self._task = asyncio.get_running_loop().create_task(
            self._carry_out(order, command, repeated)
        )
        self._task.add_done_callback(partial(self._report_crash, order))

    def refuse(self, plan_id: str, focus_distance: float, reason: InputError) -> None:
        """Report that an order is none; the one in force is carried out further."""
        refusal = LensReport(
            plan_id, LensStatus.FAILED, focus_distance, message=str(reason), refused=True
        )
        if not _same(refusal, self._refusal):
            self._refusal = refusal
            self._on_report(refusal)

    def stop(self) -> None:
        """Stop carrying out the order; the lens stays as it is."""
        if self._task is not None:
            self._task.cancel()

    def _report_crash(self, order: FocusOrder, task: asyncio.Task[None]) -> None:
        """Report an order as failed if carrying it out raised."""
        if not task.cancelled() and (error := task.exception()):
            self._report(_failed(order, f"internal error: {type(error).__name__}: {error}"))

    async def _carry_out(self, order: FocusOrder, command: LensCommand, repeated: bool) -> None:
        attempts = _ATTEMPTS
        if repeated:
            attempts = await self._confirm(order, command)
        while True:
            await self._until_settled(order, command, attempts)
            attempts = await self._until_due(order, command)

    async def _until_settled(self, order: FocusOrder, command: LensCommand, attempts: int) -> None:
        """Send until the lens has settled or failed; back off while its driver is unreachable."""
        pause = self._timeouts.shortest_pause
        while True:
            try:
                return await self._send(order, command, attempts)
            except UnreachableError as error:
                self._report(_failed(order, str(error), self._last))
            await self._until_available(pause)
            pause = min(2 * pause, self._timeouts.longest_pause)

    async def _until_available(self, pause: float) -> None:
        await asyncio.sleep(pause)
        # rclpy has no event for services that appear or disappear.
        while not self._calls.is_available():  # noqa: ASYNC110
            await asyncio.sleep(self._timeouts.shortest_pause)

    async def _until_due(self, order: FocusOrder, command: LensCommand) -> int:
        """Wait until the lens must be set again; return how often to try.

        That is once if it has moved, and as often as at first if its driver was gone.
        """
        next_check = _next_multiple(self._timeouts.watch_period)
        while self._calls.is_available():
            # All lenses at the same times: responses that arrive together wake the executor once.
            await asyncio.sleep(_next_multiple(self._timeouts.presence_period) - _monotonic())
            if _monotonic() >= next_check:
                try:
                    if await self._has_moved(command):
                        return 1
                except UnreachableError as error:
                    self._report(_failed(order, str(error), self._last))
                    break
                next_check = _next_multiple(self._timeouts.watch_period)
        else:
            # Nobody can tell where a lens is whose driver is gone.
            self._report(_failed(order, str(self._calls.absent()), self._last))
        await self._until_available(0.0)
        return _ATTEMPTS

    async def _has_moved(self, command: LensCommand, told: bool = False) -> bool:
        """Look at a settled lens again; report what is new of it, or everything if ``told``."""
        last = self._last
        if last is None or last.status not in (*_AS_SENT, LensStatus.DIFFERS):
            return False
        try:
            read = await self._look(command, last, self._now(), self._timeouts.timeout)
        except RefusedError as error:
            self._report(replace(last, status=LensStatus.FAILED, message=str(error)))
            return False
        elsewhere = read.status is LensStatus.DIFFERS and not _equal(read, last)
        if told or elsewhere or read.status is not last.status:
            self._report(read)
        return read.status is LensStatus.DIFFERS is not last.status

    async def _send(self, order: FocusOrder, command: LensCommand, attempts: int) -> None:
        report = LensReport(order.plan_id, LensStatus.FAILED, order.focus_distance)
        message = ""
        for _ in range(attempts):
            try:
                await self._lens.prepare()
                report = replace(
                    report, unit=command.unit, sent_value=float(command.value), sent_at=self._now()
                )
                await self._lens.set(command.value)
            except RefusedError as error:
                self._report(replace(report, message=str(error)))
                return
            taken_at = self._now()
            sent = replace(report, status=LensStatus.SENT, message=message)
            self._report(sent)
            await asyncio.sleep(self._timeouts.settle_time)
            timeout = self._timeouts.verify_timeout
            try:
                read = await self._look(command, sent, taken_at, timeout, arriving=True)
            except RefusedError as error:
                self._report(replace(sent, status=LensStatus.FAILED, message=str(error)))
                return
            if read.status is not LensStatus.DIFFERS:
                break
            message = f"sent again: {read.message}"
        self._report(read)

    async def _confirm(self, order: FocusOrder, command: LensCommand) -> int:
        """Look at a lens that was as sent, and then as always."""
        try:
            if await self._has_moved(command, told=True):
                return 1
        except UnreachableError as error:
            self._report(_failed(order, str(error), self._last))
            await self._until_available(self._timeouts.shortest_pause)
            return _ATTEMPTS
        return await self._until_due(order, command)

    async def _look(
        self,
        command: LensCommand,
        sent: LensReport,
        after: Time,
        patience: float,
        arriving: bool = False,
    ) -> LensReport:
        """Return where the lens is.

        Parameters
        ----------
        command : LensCommand
        sent : LensReport
            The report of what was sent.
        after : Time
            What the driver said of the lens before does not count.
        patience : float
            How long to wait for its word of the lens, seconds.
        arriving : bool
            Whether to wait as long for the lens to arrive.
        """
        deadline = _monotonic() + patience
        while True:
            seen = await self._lens.observe(command.value, after)
            under_way = arriving and seen.status is LensStatus.DIFFERS
            if not (seen.waiting or under_way) or _monotonic() >= deadline:
                break
            await asyncio.sleep(self._timeouts.poll_period)
            after = min(after, self._now())  # which may have been set back since
        unknown = math.isnan(seen.value)
        return replace(
            sent,
            status=seen.status,
            read_value=seen.value,
            read_at=NO_TIME if unknown else seen.at or self._now(),
            read_distance=math.nan if unknown else distance_of(command, seen.value, self._table),
            message=seen.message,
        )

    def _report(self, report: LensReport) -> None:
        if not _same(report, self._last):
            self._last = report
            self._on_report(report)


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


def _equal(report: LensReport, last: LensReport) -> bool:
    """Return whether the same value was read."""
    unknown = math.isnan(report.read_value) and math.isnan(last.read_value)
    return unknown or report.read_value == last.read_value


def _of(report: LensReport) -> tuple[str, float]:
    return report.plan_id, report.planned_distance


def _next_multiple(period: float) -> float:
    """Return the next multiple of a period; inf for a period of 0."""
    return (_monotonic() // period + 1.0) * period if period else math.inf


def _monotonic() -> float:
    return asyncio.get_running_loop().time()
