# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Forks processes from one that has imported what takes seconds to import, and has no threads.

A process with threads must not fork: locks that other threads hold stay locked in the child for
ever. So a program forks this server before it starts any, and asks it for processes later on. They
begin with everything imported, share its memory until they change it, and can be killed without
harm to the program.
"""

from __future__ import annotations

import gc
import json
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NoReturn

from focus_planner.core.text import MAX_REASON, printable

_MAX_MESSAGE = 4096
# Killed processes are reaped at once, unless the machine hardly runs.
_SECONDS_TO_REAP = 10.0
_SECONDS_TO_CLOSE = 10.0


class ForkServerEnded(Exception):  # noqa: N818 - not always an error: nodes end too
    """The fork server has ended: there are no more processes to be had. Its text says why."""


class ForkedProcess:
    """A process that was forked for us.

    Attributes
    ----------
    pid : int
    connection : Connection
        To what it serves; ends with it.
    """

    def __init__(self, server: ForkServer, pid: int, handle: int, connection: Connection) -> None:
        self.pid = pid
        self.connection = connection
        self._server = server
        self._handle = handle  # a number of a process may be given to another, this may not

    def kill(self) -> None:
        """End it at once, with all that it holds in memory, and wait until it has ended."""
        self.connection.close()
        if self._handle < 0:
            return
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, signal.SIGKILL)
        self.wait(_SECONDS_TO_REAP)
        os.close(self._handle)
        self._handle = -1

    def wait(self, timeout: float) -> bool:
        """Return whether it ended within so many seconds."""
        return self._handle < 0 or bool(select.select([self._handle], [], [], timeout)[0])

    def how_it_ended(self) -> str:
        """Return how it ended, in words, once it has."""
        status = self._server.status_of(self.pid)
        if status is None:
            return "it ended"
        if status >= 0:
            return f"it ended with status {status}"
        hint = ", as Linux does when memory runs out" if -status == signal.SIGKILL else ""
        return f"it was ended by {signal.Signals(-status).name}{hint}"

    def cpu_seconds(self) -> float:
        """Return how long all of its threads have run on a processor; 0 once it has ended."""
        try:
            # The name, which may contain anything, is in parentheses.
            fields = Path(f"/proc/{self.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2]
        except OSError:
            return 0.0
        user, system = fields.split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


class ForkServer:
    """Our end of the server: forks a process on request."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._ended: dict[int, int] = {}
        self._why = ""

    def fork(self) -> ForkedProcess:
        """Return a new process.

        Raises
        ------
        ForkServerEnded
        """
        ours, theirs = socket.socketpair()
        try:
            socket.send_fds(self._channel, [b"fork"], [theirs.fileno()])
            told, handles = self._next()
            while "pid" not in told:
                told, handles = self._next()
        except OSError as error:
            self._hear_out()
            raise ForkServerEnded(self._why or "their server has ended") from error
        finally:
            theirs.close()
        return ForkedProcess(self, told["pid"], handles[0], Connection(ours.detach()))

    def status_of(self, pid: int) -> int | None:
        """Return the status of a process that has ended, negative for a signal; None if unknown."""
        until = time.monotonic() + _SECONDS_TO_REAP
        while pid not in self._ended:
            left = until - time.monotonic()
            try:
                if left <= 0 or not select.select([self._channel], [], [], left)[0]:
                    return None
                self._next()
            except OSError:
                return None
        return self._ended.pop(pid)

    def close(self) -> None:
        """End the server and all that it has forked."""
        self._channel.close()

    def _hear_out(self) -> None:
        """Read what the server said before it ended."""
        with suppress(OSError):
            while select.select([self._channel], [], [], 0.0)[0]:
                self._next()

    def _next(self) -> tuple[dict[str, Any], list[int]]:
        data, handles, _, _ = socket.recv_fds(self._channel, _MAX_MESSAGE, 1)
        if not data:
            raise ConnectionResetError
        told: dict[str, Any] = json.loads(data)
        if "failed" in told:
            self._why = told["failed"]
            raise ConnectionResetError
        if "ended" in told:
            self._ended[told["ended"]] = told["status"]
        return told, handles


@contextmanager
def fork_server(
    name: str, prepare: Callable[[], Callable[[Connection], None]]
) -> Iterator[ForkServer]:
    """Fork the server; end it, and all that it has forked, on leaving.

    To be entered before this process has threads.

    Parameters
    ----------
    name : str
        Of the processes, as ``ps`` and ``top`` show it; 15 characters count.
    prepare : callable
        Called in the server: imports what takes long, and returns what a process is to do with
        its connection.
    """
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid == 0:
        ours.close()
        _be_the_server(theirs, name, prepare)
    theirs.close()
    server = ForkServer(ours)
    try:
        yield server
    finally:
        server.close()
        _reap(pid)


def _reap(pid: int) -> None:
    """Wait until the server has ended; kill it if it hangs in an import."""
    handle = os.pidfd_open(pid)
    try:
        if not select.select([handle], [], [], _SECONDS_TO_CLOSE)[0]:
            os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    finally:
        os.close(handle)


# --- in the server -------------------------------------------------------------------------------


def _be_the_server(
    channel: socket.socket, name: str, prepare: Callable[[], Callable[[Connection], None]]
) -> NoReturn:
    status, connection = 1, None
    try:
        # Terminals and supervisors signal the whole group: the program ends this when it is ready.
        signal.set_wakeup_fd(-1)  # the program's, who would take them for its own
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        with suppress(OSError):
            Path("/proc/self/comm").write_text(name, encoding="utf-8")
        work = prepare()
        # What is there now is never garbage; collecting it would copy the shared memory.
        gc.freeze()
        connection = _serve(channel)
        if connection is not None:
            work(connection)
        status = 0
    except KeyboardInterrupt:
        pass
    except MemoryError as error:
        _tell_failure(channel, name, error)
    except Exception as error:  # noqa: BLE001 - there is nobody else to tell
        if connection is None:
            _tell_failure(channel, name, error)
        else:
            sys.excepthook(*sys.exc_info())
    finally:
        sys.stderr.flush()
        os._exit(status)


def _tell_failure(channel: socket.socket, name: str, error: Exception) -> None:
    """Tell the program why there will be no more processes; in a process, whoever reads the log."""
    why = printable(f"{type(error).__name__}: {error}", MAX_REASON)
    try:
        channel.send(json.dumps({"failed": why}).encode())
    except OSError:
        sys.stderr.write(f"{name}: {why}\n")


def _serve(channel: socket.socket) -> Connection | None:
    """Fork for every request; return the connection, in a process, or None at the end."""
    bell, ringer = os.pipe()
    for end in (bell, ringer):
        os.set_blocking(end, False)
    signal.set_wakeup_fd(ringer)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    running: set[int] = set()
    while True:
        ready, _, _ = select.select([channel.fileno(), bell], [], [])
        if bell in ready:
            os.read(bell, _MAX_MESSAGE)
            _tell_the_ended(channel, running)
        if channel.fileno() not in ready:
            continue
        data, files = _next_request(channel)
        if not data:
            for pid in running:
                os.kill(pid, signal.SIGKILL)
            return None
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for end in (bell, ringer):
                os.close(end)
            channel.close()
            return Connection(files[0])
        os.close(files[0])
        running.add(pid)
        handle = os.pidfd_open(pid)
        with suppress(BrokenPipeError, ConnectionResetError):  # seen at the next turn
            socket.send_fds(channel, [json.dumps({"pid": pid}).encode()], [handle])
        os.close(handle)


def _next_request(channel: socket.socket) -> tuple[bytes, list[int]]:
    """Return a request, which is empty once there are no more."""
    try:
        data, files, _, _ = socket.recv_fds(channel, _MAX_MESSAGE, 1)
    except ConnectionResetError:  # what it was told was not read
        return b"", []
    return data, files


def _tell_the_ended(channel: socket.socket, running: set[int]) -> None:
    """Reap every process that has ended, and tell its status."""
    while running:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if pid == 0:
            return
        running.discard(pid)
        told = {"ended": pid, "status": os.waitstatus_to_exitcode(status)}
        with suppress(OSError):
            channel.send(json.dumps(told).encode())
