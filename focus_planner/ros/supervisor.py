# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a node tells systemd: that it is ready, that it is alive, that it stops.

The protocol of ``sd_notify(3)``, for units of ``Type=notify`` with ``WatchdogSec``: a word in a
datagram to the socket that the environment names.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Mapping

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

# Signs of life within the time after which systemd takes the process for hung.
_SIGNS = 4
# Seconds: while a machine starts, everybody talks to systemd.
_PATIENCE = 10.0


def _call(function: Callable[[], None]) -> None:
    function()


class Supervisor:
    """The service manager that started this process; without one, nobody is told.

    Parameters
    ----------
    environment : mapping of str, optional
        That of the process by default.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        path = environment.get("NOTIFY_SOCKET", "")
        # An abstract socket's name begins with a zero byte, of which @ reminds.
        self._address = f"\0{path[1:]}" if path.startswith("@") else path
        self._between = _watchdog_seconds(environment) / _SIGNS

    def ready(self) -> None:
        """Tell that the start is over; systemd waits for that, so this may wait for systemd."""
        self._tell("READY=1", _PATIENCE)

    def stopping(self) -> None:
        """Tell that the process ends because it was asked to."""
        self._tell("STOPPING=1")

    def alive(self) -> None:
        """Tell that the thread that calls this is not hung."""
        self._tell("WATCHDOG=1")

    def watch(self, node: Node, through: Callable[[Callable[[], None]], object] = _call) -> None:
        """Have a node's executor tell that it is alive, if the service manager wants to know.

        Parameters
        ----------
        node : Node
        through : callable, optional
            Is given what tells it, and has that called by whatever else must be alive.
        """
        if self._between:
            clock = Clock(clock_type=ClockType.STEADY_TIME)
            node.create_timer(self._between, lambda: through(self.alive), clock=clock)

    def _tell(self, words: str, patience: float = 0.0) -> None:
        if not self._address.startswith(("/", "\0")):
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as out:
            # A manager that does not read must not hang what it supervises.
            out.settimeout(patience)
            try:
                out.sendto(words.encode(), self._address)
            except OSError:
                return  # it has gone, or misses this sign of life and gets the next


def _watchdog_seconds(environment: Mapping[str, str]) -> float:
    """Return after how many seconds without a sign this process is killed; 0 for never."""
    if environment.get("WATCHDOG_PID", str(os.getpid())) != str(os.getpid()):
        return 0.0  # another process is meant, whose environment this one has
    try:
        return max(int(environment.get("WATCHDOG_USEC", "0")), 0) / 1e6
    except ValueError:
        return 0.0
