# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The log of nodes: every entry is one printable line of bounded length."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.impl import rcutils_logger
from rclpy.impl.rcutils_logger import RcutilsLogger

from focus_planner.core.text import printable

_STEADY = Clock(clock_type=ClockType.STEADY_TIME)

# Entries name who called the logger, and are throttled by that: not this file.
rcutils_logger._internal_callers.append(str(Path(__file__).resolve()))  # noqa: SLF001


class PrintableLogger(RcutilsLogger):
    """Logs what is printable of a message: names and reasons in it come from peers."""

    def log(self, message: object, severity: Any, **options: Any) -> bool:
        """Log a message, escaped and cut."""
        if "throttle_duration_sec" in options:
            # Other clocks may be set back, and then nothing would be logged for as long.
            options.setdefault("throttle_time_source_type", _STEADY)
        logged: bool = super().log(printable(str(message)), severity, **options)
        return logged

    def get_child(self, name: str) -> PrintableLogger:
        """Return a logger whose name is below this one's, as those of actions are."""
        child: PrintableLogger = super().get_child(name)
        child.__class__ = PrintableLogger
        return child


class PrintableLog:
    """Mix-in of nodes: their logger is a :class:`PrintableLogger`, also for rclpy's own entries."""

    @cached_property
    def _printable_logger(self) -> PrintableLogger:
        return PrintableLogger(super().get_logger().name)  # type: ignore[misc]

    def get_logger(self) -> PrintableLogger:
        """Return the node's logger."""
        return self._printable_logger
