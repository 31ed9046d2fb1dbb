# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Programs in processes of their own that need not import for seconds what all of them import."""

from __future__ import annotations

import atexit
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from threading import Lock
from typing import IO

ROOT = Path(__file__).parents[1]
PIPE, DEVNULL = subprocess.PIPE, subprocess.DEVNULL
# A tests' marker is checked by it.
EVENT = "testing.forked"


class ForkedProcess:
    """Runs a module as ``python -m`` does; what :class:`subprocess.Popen` has is named alike.

    It is forked from a process that has imported most of what a planner imports; all else is as
    in a process of its own, its end included.

    Parameters
    ----------
    module : str
    arguments : str
    stdin, stdout, stderr : int
        A file descriptor, ``PIPE`` or ``DEVNULL``; stderr by default that of the tests.
    env : dict, optional
        Its environment, by default that of the tests.
    folder : str, optional
        Where it is started, by default where the tests are.
    """

    def __init__(
        self,
        module: str,
        *arguments: str,
        stdin: int = DEVNULL,
        stdout: int = DEVNULL,
        stderr: int = 2,
        env: Mapping[str, str] | None = None,
        folder: str | None = None,
    ) -> None:
        sys.audit(EVENT, module, arguments)
        self.args = [module, *arguments]
        self.returncode: int | None = None
        self.stdin, his_stdin = _ends(stdin, writing=True)
        self.stdout, his_stdout = _ends(stdout)
        self.stderr, his_stderr = _ends(stderr)
        self._status, his_status = os.pipe()
        request = {
            "module": module,
            "arguments": [str(argument) for argument in arguments],
            "environment": dict(os.environ if env is None else env),
            "directory": folder or str(Path.cwd()),
        }
        files = [his_stdin, his_stdout, his_stderr, his_status]
        self.pid = _fork(json.dumps(request).encode(), files)
        for file, given in zip(files, (stdin, stdout, stderr, PIPE), strict=True):
            if given in {PIPE, DEVNULL}:
                os.close(file)

    def fileno(self) -> int:
        """Return a file descriptor that can be read once it has ended, and until that is known."""
        return self._status

    def poll(self) -> int | None:
        """Return the exit status, None while it runs."""
        return self.returncode if self._has_ended(0.0) else None

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit status once it has ended."""
        if not self._has_ended(timeout):
            assert timeout is not None
            raise subprocess.TimeoutExpired(self.args, timeout)
        assert self.returncode is not None
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send it a signal unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)

    def _has_ended(self, timeout: float | None) -> bool:
        if self.returncode is None and select.select([self._status], [], [], timeout)[0]:
            self.returncode = int(os.read(self._status, 64))
            os.close(self._status)
        return self.returncode is not None


def run_forked(
    module: str, *arguments: str, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a module to its end; return what it wrote."""
    process = ForkedProcess(module, *arguments, stdout=PIPE, stderr=PIPE, env=env)
    assert process.stdout
    assert process.stderr
    with process.stdout, process.stderr, ThreadPoolExecutor(1) as reading:
        errors = reading.submit(process.stderr.read)
        said = process.stdout.read()
    return subprocess.CompletedProcess(process.args, process.wait(), said, errors.result())


def freeze_when(condition: Callable[[], object], pid: int) -> None:
    """Stop a process, with SIGSTOP, at a moment at which a condition holds."""
    while True:
        os.kill(pid, signal.SIGSTOP)
        while _state_of(pid) != "T":
            time.sleep(0.001)
        if condition():
            return
        os.kill(pid, signal.SIGCONT)
        time.sleep(0.001)


def _state_of(pid: int) -> str:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


def _ends(wanted: int, *, writing: bool = False) -> tuple[IO[str] | None, int]:
    """Return the end of a stream that is kept, if any, and the one that is given away."""
    if wanted == DEVNULL:
        return None, os.open(os.devnull, os.O_RDWR)
    if wanted != PIPE:
        return None, wanted
    read, write = os.pipe()
    return (os.fdopen(write, "w"), read) if writing else (os.fdopen(read), write)


def _fork(request: bytes, files: list[int]) -> int:
    with _one_at_a_time:  # or threads would start two servers, and get each other's processes
        server = _server()
        socket.send_fds(server, [request], files)
        return int(server.recv(64))


@cache
def _server() -> socket.socket:
    """Start the process that forks the others; it ends with this one."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        command = [sys.executable, "-m", "testing.fork_server", str(theirs.fileno())]
        process = subprocess.Popen(command, cwd=ROOT, pass_fds=[theirs.fileno()])
    atexit.register(process.wait)
    atexit.register(ours.close)  # the other way round: it ends once nobody can ask it any more
    return ours


_one_at_a_time = Lock()
