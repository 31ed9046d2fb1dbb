# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import asyncio
import itertools
import math
from dataclasses import replace

import pytest

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.lenses.calls import StrangeError, Timeouts
from focus_planner.lenses.control import LensControl
from focus_planner.lenses.driver import LensStatus, Tolerance
from focus_planner.lenses.orders import FocusOrder
from focus_planner.lenses.profiles import DIOPTRES, PROFILES, DriverProfile
from testing.virtual_time import run_in_virtual_time

_, SENT, VERIFIED, DIFFERS, FAILED, ACCEPTED = LensStatus
QUICK = Timeouts(
    timeout=0.05,
    retries=1,
    verify_timeout=0.06,
    poll_period=0.01,
    watch_period=0.0,
    presence_period=0.01,
    shortest_pause=0.01,
    longest_pause=0.04,
)
ORDER = FocusOrder("plan 1", 0.5)
# Its parameter is the lens's position, so that it can be verified by it.
MEASURING = DriverProfile("LensPosition", DIOPTRES, False, (("AfMode", 0),), measures=True)


FOCUS = ("LensPosition", "focus_absolute")


class FakeDriver:
    """Parameters in this process, with faults."""

    name = "/cam/camera"

    def __init__(self, **values):
        self.values = {"LensPosition": 0.0, "AfMode": 2} | values
        self.there = True
        self.silent = False
        self.refuses = {}
        self.calls = []
        self.reads = 0
        self.reading = lambda value: value
        self.cancelled = 0

    def is_available(self):
        return self.there

    async def _answer(self):
        try:
            while self.silent:  # noqa: ASYNC110 - a test turns it on and off
                await asyncio.sleep(0.005)
        except asyncio.CancelledError:
            self.cancelled += 1
            raise

    async def connect(self):
        pass

    def strangeness(self):
        return ""

    async def list_parameters(self, names):
        await self._answer()
        return [name for name in self.values if name in names]

    @property
    def set(self):
        return [each for call in self.calls for each in call]

    async def set_parameters(self, values):
        await self._answer()
        for name, _ in values:
            if name in self.refuses:
                return self.refuses[name]
        self.calls.append(list(values))
        self.values.update(values)
        return None

    async def get_parameters(self, names):
        await self._answer()
        self.reads += 1
        values = {name: self.values.get(name) for name in names}
        return {n: self.reading(v) if n in FOCUS else v for n, v in values.items()}


def control(driver, profile=MEASURING, timeouts=QUICK, **settings):
    """Return a control, and the list that its reports go to."""
    reports, clock = [], itertools.count(1)
    made = LensControl(
        driver, profile, reports.append, lambda: (next(clock), 0), timeouts, **settings
    )
    return made, reports


async def until(condition):
    deadline = asyncio.get_running_loop().time() + 5.0
    while not condition():
        assert asyncio.get_running_loop().time() < deadline, "it never came"
        await asyncio.sleep(0.002)


def applied(driver, *orders, settled=(VERIFIED, ACCEPTED, DIFFERS, FAILED), **settings):
    """Return the reports of orders, each given once the last one has a verdict."""

    async def run():
        lens, reports = control(driver, **settings)
        for order in orders:
            lens.apply(order)
            await until(
                lambda order=order: any(
                    r.plan_id == order.plan_id and r.status in settled for r in reports
                )
            )
        lens.stop()
        return reports

    return run_in_virtual_time(run())


def test_sent_and_verified():
    driver = FakeDriver()
    sent, verified = applied(driver, ORDER)
    assert driver.calls == [[("AfMode", 0), ("LensPosition", 2.0)]]
    assert (sent.plan_id, sent.status, sent.planned_distance) == ("plan 1", SENT, 0.5)
    assert (sent.unit, sent.sent_value, sent.sent_at) == ("dioptres", 2.0, (1, 0))
    assert math.isnan(sent.read_value)
    assert verified == replace(
        sent, status=VERIFIED, read_value=2.0, read_at=(3, 0), read_distance=0.5
    )
    assert verified.message == ""


def test_autofocus_is_left_alone_where_there_is_none():
    driver = FakeDriver()
    del driver.values["AfMode"]
    assert applied(driver, ORDER)[-1].status is VERIFIED
    assert driver.set == [("LensPosition", 2.0)]


def test_whole_values_by_a_table():
    driver = FakeDriver(focus_absolute=0, focus_auto=True)
    table = LensTable("steps", distances=(0.25, 1.0), values=(200.0, 50.0))
    reports = applied(driver, ORDER, profile=PROFILES["v4l2_camera"], table=table)
    assert driver.calls == [[("focus_auto", False), ("focus_absolute", 100)]]
    assert type(driver.set[1][1]) is int
    assert (reports[-1].status, reports[-1].unit) == (ACCEPTED, "steps")
    assert (reports[-1].read_value, reports[-1].read_distance) == (100.0, pytest.approx(0.5))


def test_a_slow_lens_is_waited_for():
    driver = FakeDriver()
    positions = iter([0.5, 1.0, 1.5])
    driver.reading = lambda value: next(positions, value)
    assert [report.status for report in applied(driver, ORDER)] == [SENT, VERIFIED]
    assert driver.reads == 4


def test_it_is_first_read_after_the_settle_time():
    driver = FakeDriver()
    timeouts = replace(QUICK, settle_time=0.05, verify_timeout=0.0)
    reading, asleep = [], []

    async def run():
        lens, reports = control(driver, timeouts=timeouts)
        lens.apply(ORDER)
        await until(lambda: reports)
        asleep.append(asyncio.get_running_loop().time())
        await until(lambda: driver.reads)
        reading.append(asyncio.get_running_loop().time())
        lens.stop()

    run_in_virtual_time(run())
    assert reading[0] - asleep[0] == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize("wrong", [1.9, math.nan])
def test_a_lens_elsewhere_differs(wrong):
    driver = FakeDriver()
    driver.reading = lambda _: wrong
    *_, again, report = applied(driver, ORDER)
    assert again.status is SENT
    assert again.message == f"sent again: {report.message}"
    assert driver.calls == 2 * [[("AfMode", 0), ("LensPosition", 2.0)]]
    assert report.status is DIFFERS
    assert report.read_value == pytest.approx(wrong, nan_ok=True)
    assert report.message.startswith(
        f"/cam/camera: expected LensPosition = 2, read {wrong:g}; the lens is slow"
    )
    assert applied(FakeDriver(), ORDER, tolerance=Tolerance(0.2))[-1].status is VERIFIED


def test_nothing_to_read_differs():
    driver = FakeDriver()
    driver.reading = lambda _: None
    report = applied(driver, ORDER)[-1]
    assert report.status is DIFFERS
    assert math.isnan(report.read_value)
    assert "expected to read back a number for LensPosition, got none" in report.message


@pytest.mark.parametrize(
    ("reason", "text"), [("out of range", "out of range"), ("", "no reason given")]
)
def test_a_refused_value_fails_and_is_told(reason, text):
    driver = FakeDriver()
    driver.refuses["LensPosition"] = reason
    (report,) = applied(driver, ORDER)
    assert (report.status, report.sent_value, report.sent_at) == (FAILED, 2.0, (1, 0))
    assert report.message == f"/cam/camera refused AfMode = 0, LensPosition = 2.0: {text}"
    assert math.isnan(report.read_value)


def test_autofocus_that_cannot_be_ended_fails():
    driver = FakeDriver()
    driver.refuses["AfMode"] = "read-only"
    (report,) = applied(driver, ORDER)
    assert report.message == "/cam/camera refused AfMode = 0, LensPosition = 2.0: read-only"
    assert driver.set == []


def test_a_driver_without_the_parameter_fails():
    driver = FakeDriver()
    (report,) = applied(
        driver,
        ORDER,
        profile=PROFILES["v4l2_camera"],
        table=LensTable("steps", distances=(0.25, 1.0), values=(200.0, 50.0)),
    )
    assert report.status is FAILED
    assert (
        "expected a driver with the parameter focus_absolute, got one without it" in report.message
    )


def test_not_a_plan_fails_and_nothing_is_sent():
    driver = FakeDriver()
    (report,) = applied(driver, FocusOrder("plan 1", 0.0, planned=False))
    assert report.status is FAILED
    assert "not from a plan" in report.message
    assert driver.set == []


def test_a_missing_driver_fails_once_and_is_told_when_it_comes():
    driver = FakeDriver()
    driver.there = False

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await until(lambda: reports)
        await asyncio.sleep(0.2)
        driver.there = True
        await until(lambda: reports[-1].status is VERIFIED)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [FAILED, SENT, VERIFIED]
    assert reports[0].message == (
        "/cam/camera: expected a running driver, found none; start it, and the value will be sent"
    )


def test_a_driver_that_is_found_late_is_no_failure():
    driver = FakeDriver()
    driver.there = False

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await asyncio.sleep(0.01)
        driver.there = True
        await until(lambda: len(reports) == 2)
        lens.stop()
        return reports

    assert [report.status for report in run_in_virtual_time(run())] == [SENT, VERIFIED]


def test_a_silent_driver_fails_and_is_tried_again():
    driver = FakeDriver()
    driver.silent = True

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await until(lambda: reports)
        await asyncio.sleep(0)  # the second is cancelled just now
        assert driver.cancelled == 2  # one retry
        await until(lambda: driver.cancelled >= 4)
        assert len(reports) == 1
        driver.silent = False
        await until(lambda: reports[-1].status is VERIFIED)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert reports[0].status is FAILED
    assert "expected a response from get_parameters or list_parameters within" in reports[0].message


def test_a_driver_that_dies_under_way_keeps_what_it_was_told():
    driver = FakeDriver()

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, settle_time=0.02))
        lens.apply(ORDER)
        await until(lambda: reports)
        driver.there, driver.silent = False, True
        await until(lambda: reports[-1].status is FAILED)
        driver.there, driver.silent = True, False
        driver.values["LensPosition"] = 0.0
        await until(lambda: reports[-1].status is VERIFIED)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, FAILED, SENT, VERIFIED]
    assert reports[1].sent_value == 2.0


@pytest.mark.parametrize("refused", [False, True])
def test_a_driver_that_restarts_is_told_again(refused):
    driver = FakeDriver()
    if refused:
        driver.refuses["LensPosition"] = "not now"

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await until(lambda: reports and reports[-1].status in (VERIFIED, FAILED))
        driver.there = False
        await asyncio.sleep(0.03)
        driver.values["LensPosition"], driver.there, driver.refuses = 0.0, True, {}
        await until(lambda: driver.values["LensPosition"] == 2.0)
        lens.stop()

    run_in_virtual_time(run())


def test_a_newer_plan_replaces_one_under_way():
    driver = FakeDriver()
    driver.reading = lambda value: value if value == 4.0 else 0.0  # never gets to the first one
    newer = FocusOrder("plan 2", 0.25)

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, verify_timeout=60.0))
        lens.apply(ORDER)
        await until(lambda: reports)
        lens.apply(newer)
        await until(lambda: reports[-1].status is VERIFIED)
        await asyncio.sleep(0.05)
        lens.stop()
        return reports

    told = [(report.plan_id, report.status) for report in run_in_virtual_time(run())]
    assert told == [("plan 1", SENT), ("plan 2", SENT), ("plan 2", VERIFIED)]


def test_the_same_order_again_is_read_and_not_sent():
    driver = FakeDriver()

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await until(lambda: len(reports) == 2)
        lens.apply(ORDER)
        await until(lambda: len(reports) == 3)
        sent = list(driver.set)
        driver.values["LensPosition"] = 1.0
        lens.apply(ORDER)
        await until(lambda: len(reports) == 6)
        lens.stop()
        return sent, reports

    sent, reports = run_in_virtual_time(run())
    assert sent == [("AfMode", 0), ("LensPosition", 2.0)]
    told = [report.status for report in reports]
    assert told == [SENT, VERIFIED, VERIFIED, DIFFERS, SENT, VERIFIED]
    assert reports[2].read_at > reports[1].read_at
    assert reports[2].sent_at == reports[1].sent_at


def test_the_same_order_again_does_not_disturb_one_under_way():
    driver = FakeDriver()
    driver.silent = True

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, timeout=5.0))
        lens.apply(ORDER)
        await asyncio.sleep(0.01)
        lens.apply(ORDER)
        await asyncio.sleep(0.01)
        assert driver.cancelled == 0
        driver.silent = False
        await until(lambda: len(reports) == 2)
        lens.stop()
        return reports

    assert [report.status for report in run_in_virtual_time(run())] == [SENT, VERIFIED]


def test_a_verified_lens_that_moves_is_told_again():
    driver = FakeDriver()

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, watch_period=0.03))
        lens.apply(ORDER)
        await until(lambda: len(reports) == 2)
        await until(lambda: driver.reads > 3)
        assert len(reports) == 2  # looking is not news
        driver.values["LensPosition"] = 1.0
        await until(lambda: len(reports) == 5)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, VERIFIED, DIFFERS, SENT, VERIFIED]
    assert reports[2].read_value == 1.0


def test_a_lens_that_moves_and_stays_away_is_told_once_and_then_left_alone():
    driver = FakeDriver()

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, watch_period=0.03))
        lens.apply(ORDER)
        await until(lambda: len(reports) == 2)
        driver.reading = lambda _: 1.0
        await until(lambda: len(reports) == 5)
        reads = driver.reads
        await until(lambda: driver.reads > reads + 3)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, VERIFIED, DIFFERS, SENT, DIFFERS]
    assert len(driver.calls) == 2


def test_a_lens_that_differs_is_told_of_where_it_goes():
    driver = FakeDriver()
    driver.reading = lambda _: 1.0

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, watch_period=0.03))
        lens.apply(ORDER)
        await until(lambda: len(reports) == 3)
        driver.reading = lambda _: 1.5
        await until(lambda: len(reports) == 4)
        reads = driver.reads
        await until(lambda: driver.reads > reads + 3)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, SENT, DIFFERS, DIFFERS]
    assert [report.read_value for report in reports[2:]] == [1.0, 1.5]
    assert len(driver.calls) == 2


@pytest.mark.parametrize("measures", [True, False])
def test_autofocus_that_is_switched_on_again_is_told_and_ended(measures):
    driver = FakeDriver()
    settled = VERIFIED if measures else ACCEPTED

    async def run():
        timeouts = replace(QUICK, watch_period=0.03)
        lens, reports = control(driver, replace(MEASURING, measures=measures), timeouts)
        lens.apply(ORDER)
        await until(lambda: reports and reports[-1].status is settled)
        driver.values["AfMode"] = 2
        await until(lambda: len(reports) == 5)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, settled, DIFFERS, SENT, settled]
    assert reports[2].message == (
        "/cam/camera: expected AfMode = 0, read 2; another node has set it"
    )
    assert driver.values["AfMode"] == 0


def test_a_lens_whose_driver_is_gone_is_no_longer_verified():
    driver = FakeDriver()

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await until(lambda: len(reports) == 2)
        driver.there = False
        await until(lambda: len(reports) == 3)
        driver.there = True
        await until(lambda: len(reports) == 5)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, VERIFIED, FAILED, SENT, VERIFIED]
    assert reports[2].message == (
        "/cam/camera: expected a running driver, found none; start it, and the value will be sent"
    )


def test_a_lens_whose_driver_falls_silent_is_no_longer_verified():
    driver = FakeDriver()

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, watch_period=0.03))
        lens.apply(ORDER)
        await until(lambda: len(reports) == 2)
        driver.silent = True
        await until(lambda: len(reports) == 3)
        driver.silent = False
        await until(lambda: len(reports) == 5)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, VERIFIED, FAILED, SENT, VERIFIED]
    assert "expected a response from get_parameters" in reports[2].message


def test_a_parameter_that_reads_back_as_set_is_accepted_and_not_verified():
    driver = FakeDriver()
    (sent, accepted) = applied(driver, ORDER, profile=replace(MEASURING, measures=False))
    assert accepted == replace(
        sent, status=ACCEPTED, read_value=2.0, read_at=(3, 0), read_distance=0.5
    )


def test_a_parameter_that_the_driver_rounds_differs():
    driver = FakeDriver()
    driver.reading = lambda value: round(value, -1)
    table = LensTable("steps", distances=(0.25, 1.0), values=(200.0, 55.0))
    driver.values["focus_absolute"] = 0
    report = applied(driver, ORDER, profile=PROFILES["v4l2_camera"], table=table)[-1]
    assert report.status is DIFFERS
    assert report.message == (
        "/cam/camera: expected focus_absolute = 103, read 100; the driver limits or rounds it, or"
        " another node has set it"
    )


def test_what_must_be_set_one_by_one_is():
    driver = FakeDriver(**{"left.r_focus": 1, "left.r_set_man_focus": False})
    table = LensTable("steps", distances=(0.25, 1.0), values=(200.0, 50.0))
    profile = PROFILES["depthai"].of("cam", "left")
    assert applied(driver, ORDER, profile=profile, table=table)[-1].status is ACCEPTED
    assert driver.calls == [[("left.r_set_man_focus", True)], [("left.r_focus", 100)]]


def test_a_lens_that_was_too_late_is_verified_when_it_is_there():
    driver = FakeDriver()
    driver.reading = lambda _: 1.0

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, watch_period=0.03))
        lens.apply(ORDER)
        await until(lambda: reports and reports[-1].status is DIFFERS)
        driver.reading = lambda value: value
        await until(lambda: reports[-1].status is VERIFIED)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert [report.status for report in reports] == [SENT, SENT, DIFFERS, VERIFIED]
    assert reports[-1].message == ""
    assert len(driver.calls) == 2


def test_a_bug_is_told_and_the_next_order_is_applied():
    driver = FakeDriver()

    def broken(_):
        raise KeyError("bug")

    driver.reading = broken

    async def run():
        lens, reports = control(driver)
        lens.apply(ORDER)
        await until(lambda: reports and reports[-1].status is FAILED)
        driver.reading = lambda value: value
        lens.apply(FocusOrder("plan 2", 0.25))
        await until(lambda: reports[-1].status is VERIFIED)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    assert reports[1].message == "internal error: KeyError: 'bug'"


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (FocusOrder("bad", -1.0), "focus_distance: expected a distance above 0 m, got -1"),
        (FocusOrder("bad", math.nan), "focus_distance: expected a distance above 0 m, got nan"),
        (FocusOrder("bad", 0.5, planned=False), "status: expected a planned status"),
        (FocusOrder("bad", 5.0), "focus distance: expected 0.25 to 1 m"),
        (
            FocusOrder("bad", 0.5, device_value=150.0, device_unit="steps"),
            (
                "device_value: expected 100 steps for 0.5 m, as in the adapter's lens tables, got"
                " 150; give the planner and the adapter the same lens tables"
            ),
        ),
        (
            FocusOrder("bad", 0.4, planned_at=(1, 0)),
            "header.stamp: expected a plan made after 'plan 1', which is in force here",
        ),
    ],
)
def test_what_is_no_order_costs_nothing_of_the_one_in_force(bad, words):
    driver = FakeDriver(focus_absolute=0, focus_auto=True)
    table = LensTable("steps", distances=(0.25, 1.0), values=(200.0, 50.0))

    async def run():
        lens, reports = control(
            driver, PROFILES["v4l2_camera"], replace(QUICK, watch_period=0.03), table=table
        )
        assert lens.plan_id is None
        lens.apply(replace(ORDER, planned_at=(2, 0)))
        await until(lambda: len(reports) == 2)
        for _ in range(2):
            lens.apply(bad)
        assert lens.plan_id == "plan 1"
        driver.values["focus_absolute"] = 60
        await until(lambda: len(reports) == 6)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    told = [report.status for report in reports]
    assert told == [SENT, ACCEPTED, FAILED, DIFFERS, SENT, ACCEPTED]
    assert [report.refused for report in reports] == [False, False, True, False, False, False]
    assert reports[2].plan_id == "bad"
    assert reports[2].message.startswith(words)
    assert math.isnan(reports[2].sent_value)
    assert [value for name, value in driver.set if name == "focus_absolute"] == [100, 100]


def test_an_answer_that_is_none_fails_and_is_left_alone_until_the_driver_restarts():
    driver = FakeDriver()

    def strange(_):
        raise StrangeError("/cam/camera: expected a number of values, got another")

    async def run():
        lens, reports = control(driver, timeouts=replace(QUICK, watch_period=0.03))
        driver.reading = strange
        lens.apply(ORDER)
        await until(lambda: len(reports) == 2)
        reads = driver.reads
        await asyncio.sleep(1.0)
        assert (len(reports), driver.reads) == (2, reads)
        driver.there = False
        await until(lambda: len(reports) == 3)
        driver.there, driver.reading = True, lambda value: value
        await until(lambda: reports[-1].status is VERIFIED)
        driver.reading = strange
        await until(lambda: reports[-1].status is FAILED)
        lens.stop()
        return reports

    reports = run_in_virtual_time(run())
    told = [report.status for report in reports]
    assert told == [SENT, FAILED, FAILED, SENT, VERIFIED, FAILED]
    for failed in (reports[1], reports[-1]):
        assert failed.message == "/cam/camera: expected a number of values, got another"
        assert failed.sent_value == 2.0


def test_what_is_there_in_place_of_a_driver_is_told():
    driver = FakeDriver()
    driver.there = False
    driver.strangeness = lambda: "a node without get_parameters"
    report = applied(driver, ORDER)[-1]
    assert report.message == (
        "/cam/camera: expected a driver with parameter services, found a node without"
        " get_parameters; check the adapter's parameters driver and driver_node"
    )


@pytest.mark.parametrize(
    ("read", "words"),
    [(True, "true"), ("far", "the text 'far'"), ([1.0], "a list")],
)
def test_what_is_no_number_is_told(read, words):
    driver = FakeDriver()
    driver.reading = lambda _: read
    report = applied(driver, ORDER)[-1]
    assert report.status is DIFFERS
    assert report.message == (
        f"/cam/camera: expected to read back a number for LensPosition, got {words}; this parameter"
        " moves no lens: check the adapter's parameters driver and parameter"
    )
