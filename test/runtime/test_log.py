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

from datetime import datetime, timedelta, timezone

from focus_planner.runtime.log import SilentLog, ThrottledLog, log_exception
from testing.messages import Log

START = datetime(2025, 1, 1, tzinfo=timezone.utc)


def at(seconds):
    return START + timedelta(seconds=seconds)


def test_a_burst_is_logged_and_then_one_per_second():
    log = Log()
    throttled = ThrottledLog(log)
    for k in range(50):
        throttled.warning(f"{k}", at(k / 10))
    # Ten at once, and those that 4.9 s allow.
    assert [text.split(" ")[0] for text in log.warnings][:10] == [f"{k}" for k in range(10)]
    assert len(log.warnings) == 14


def test_it_says_how_many_it_suppressed():
    log = Log()
    throttled = ThrottledLog(log)
    for _ in range(13):
        throttled.warning("bad", at(0))
    throttled.warning("bad", at(5))
    throttled.warning("bad", at(6))
    assert log.warnings == [
        *["bad"] * 10,
        "bad (3 similar warnings suppressed)",
        "bad",
    ]


def test_a_backlog_read_newest_first_earns_no_credit_twice():
    log = Log()
    throttled = ThrottledLog(log)
    for _ in range(10):
        throttled.warning("bad", at(9))
    for _ in range(10):
        throttled.warning("old", at(0))
    throttled.warning("bad", at(9.5))
    assert log.warnings == ["bad"] * 10


def test_a_clock_that_was_set_back_silences_nothing():
    log = Log()
    throttled = ThrottledLog(log)
    for _ in range(20):
        throttled.warning("bad", at(86_400))
    for second in range(5):
        throttled.warning("later", at(second))
    assert [text.split(" ")[0] for text in log.warnings[10:]] == ["later"] * 4


def test_a_silent_log_discards_everything(capsys):
    SilentLog().warning("a warning")
    SilentLog().error("an error")
    assert capsys.readouterr() == ("", "")


def raise_and_log(error):
    log = Log()
    try:
        raise error
    except type(error):
        log_exception(log)
    return log.errors


def test_every_line_of_a_traceback_is_marked_as_one():
    entries = raise_and_log(ValueError("bad\n[INFO] [0.1] [focus_planner]: ready"))
    assert entries[0] == "| Traceback (most recent call last):"
    assert entries[-2:] == ["| ValueError: bad", "| [INFO] [0.1] [focus_planner]: ready"]
    assert all(entry.startswith("| ") and "\n" not in entry for entry in entries)


def test_a_long_traceback_is_cut():
    entries = raise_and_log(ValueError("bad\n" * 100_000))
    assert len(entries) == 101
    assert sum(" lines …" in entry for entry in entries) == 1


def test_that_memory_is_out_is_told_in_a_line():
    log = Log()
    try:
        bytearray(2**62)
    except MemoryError:
        log_exception(log)
    assert log.errors == ["out of memory"]
