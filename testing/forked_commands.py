# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command ``focus_planner`` in shells of tests, without what it would import for seconds.

What a shell finds in its path only hands its arguments, environment, folder and streams over to the
tests. They run the program as :class:`testing.forked.ForkedProcess`, and send back how it ended.
"""

from __future__ import annotations

import json
import os
import select
import signal
import socket
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import final

from testing.forked import ForkedProcess

# It needs nothing but the standard library, so it starts at once.
_COMMAND = """#!{python} -IS
import json, os, signal, socket, sys
tests = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
tests.connect({address!r})
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda number, _: tests.send(str(number).encode()))
asked = [sys.argv[1:], dict(os.environ), os.getcwd()]
socket.send_fds(tests, [json.dumps(asked).encode()], [0, 1, 2])
for file in (0, 1, 2):
    os.close(file)
status = int(tests.recv(64) or 1)
if status < 0:
    signal.signal(-status, signal.SIG_DFL)
    os.kill(os.getpid(), -status)
os._exit(status)
"""


@final
class ForkedCommands:
    """A context manager that makes the command, and runs what it is asked for.

    Parameters
    ----------
    folder : Path
        Created; to be put into ``PATH``.
    """

    def __init__(self, folder: Path) -> None:
        self._address = f"\0focus_planner/tests/commands/{os.getpid()}/{id(self)}"
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._server.bind(self._address)
        self._server.listen()
        self.folder = folder
        folder.mkdir(parents=True)
        command = folder / "focus_planner"
        command.write_text(_COMMAND.format(python=sys.executable, address=self._address))
        command.chmod(0o755)
        self._threads = [threading.Thread(target=self._accept)]

    def __enter__(self) -> ForkedCommands:
        self._threads[0].start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join()
        self._server.close()

    def _accept(self) -> None:
        with suppress(OSError):  # it has been shut down
            while True:
                connection, _ = self._server.accept()
                self._threads.append(threading.Thread(target=self._run, args=(connection,)))
                self._threads[-1].start()

    @staticmethod
    def _run(connection: socket.socket) -> None:
        """Run what a command asks for, send it the signals that the command gets."""
        with connection:
            asked, files, _, _ = socket.recv_fds(connection, 1 << 20, 3)
            arguments, environment, folder = json.loads(asked)
            process = ForkedProcess(
                "testing.program",
                *arguments,
                stdin=files[0],
                stdout=files[1],
                stderr=files[2],
                env=environment,
                folder=folder,
            )
            for file in files:
                os.close(file)
            while process not in select.select([connection, process], [], [])[0]:
                number = connection.recv(64)
                process.send_signal(int(number or signal.SIGKILL))  # none: the command is gone
            with suppress(BrokenPipeError):
                connection.send(str(process.wait()).encode())
