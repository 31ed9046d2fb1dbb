# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Stands in for systemd: hears what a service tells it."""

from __future__ import annotations

import socket
import threading
from pathlib import Path

PATIENCE = 240


class ServiceManager:
    """A datagram socket, as ``NOTIFY_SOCKET`` names it.

    Parameters
    ----------
    address : str
        A path, or ``@`` and a name.
    """

    def __init__(self, address):
        self.address = address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(f"\0{address[1:]}" if address.startswith("@") else address)
        self._told = []
        self._news = threading.Condition()
        self._thread = threading.Thread(target=self._hear)
        self._thread.start()

    def environment(self, watchdog=0.0):
        """The environment of a service of which a sign is expected every so many seconds."""
        return {"NOTIFY_SOCKET": self.address, "WATCHDOG_USEC": str(round(1e6 * watchdog))}

    @property
    def told(self):
        with self._news:
            return list(self._told)

    def wait_for(self, words, times=1):
        """Wait until something was told so often; return all that was told until now."""
        with self._news:
            heard = self._news.wait_for(lambda: self._told.count(words) >= times, PATIENCE)
            assert heard, f"never told {words} {times} times but {self._told}"
            return list(self._told)

    def hears_within(self, seconds):
        """Return whether anything more is told within these seconds."""
        # What was on its way is heard before this.
        self._send(b"listen")
        before = len(self.wait_for("listen"))
        with self._news:
            heard = self._news.wait_for(lambda: len(self._told) > before, seconds)
            self._told.remove("listen")
        return heard

    def close(self):
        self._send(b"")
        self._thread.join()
        self._socket.close()
        if not self.address.startswith("@"):
            Path(self.address).unlink()

    def _send(self, words):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
            out.sendto(words, self._socket.getsockname())

    def _hear(self):
        while datagram := self._socket.recv(65536):
            with self._news:
                self._told.append(datagram.decode())
                self._news.notify_all()
