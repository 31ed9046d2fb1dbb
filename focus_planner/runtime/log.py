# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Logs: the interface, a silent one, and one that a careless sender cannot flood."""

from __future__ import annotations

import sys
import traceback
from datetime import datetime
from typing import Protocol

_MAX_LINES = 100  # of a traceback


class Log(Protocol):
    """The interface of a logger."""

    def warning(self, message: str) -> object:
        """Report what the user should know."""

    def error(self, message: str) -> object:
        """Report what should not have happened."""


def log_exception(log: Log) -> None:
    """Report the exception that is being handled: with its traceback, which might tell a fault."""
    if isinstance(sys.exc_info()[1], MemoryError):
        log.error("out of memory")
    else:
        log_lines(log, traceback.format_exc())


def log_lines(log: Log, text: str) -> None:
    """Report a text of several lines, such as a traceback: each by itself, and marked.

    So that no line break in a name or reason begins an entry of another kind.
    """
    lines = text.rstrip("\n").split("\n")
    if len(lines) > _MAX_LINES:
        half = _MAX_LINES // 2
        lines[half:-half] = [f"… {len(lines) - 2 * half} lines …"]
    for entry in (f"| {line}" for line in lines):
        log.error(entry)


class SilentLog:
    """Discards everything, for callers that report problems themselves."""

    def warning(self, message: str) -> None:
        """Discard a warning."""

    def error(self, message: str) -> None:
        """Discard an error."""


class ThrottledLog:
    """Passes on a burst of warnings, then one per second, and counts those it suppresses.

    A sender of invalid messages tends to repeat them at full rate.

    Parameters
    ----------
    log : Log
    """

    _BURST = 10.0
    _PER_SECOND = 1.0
    _OLDEST = 600.0  # seconds that a message of a backlog may be older than the newest

    def __init__(self, log: Log) -> None:
        self._log = log
        self._credit = self._BURST
        self._newest: datetime | None = None
        self._suppressed = 0

    def warning(self, message: str, at: datetime) -> None:
        """Log a warning about what happened at a given time, unless there are too many."""
        elapsed = (at - (self._newest or at)).total_seconds()
        if elapsed < -self._OLDEST:  # the clock was set back
            elapsed = 0.0
        if elapsed >= 0:  # a backlog is read newest first
            self._credit = min(self._BURST, self._credit + elapsed * self._PER_SECOND)
            self._newest = at
        if self._credit < 1:
            self._suppressed += 1
            return
        more = f" ({self._suppressed} similar warnings suppressed)" if self._suppressed else ""
        self._credit, self._suppressed = self._credit - 1, 0
        self._log.warning(message + more)
