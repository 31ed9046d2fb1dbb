# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Forks processes that have imported what takes seconds to import; see :mod:`testing.forked`.

A child returns from the loop and runs its program as ``python -m`` does, in the main thread and up
to the end of the interpreter. Nothing of ROS is imported before: rclpy starts a thread then, which
no fork would have.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import runpy
import select
import signal
import socket
import sys
import warnings
from contextlib import suppress
from typing import Any

import numba

IMPORTED_BEFORE = (
    "focus_planner.cli.main",
    "focus_planner.core.planning.precompile",
    "focus_planner.io.picture",
    "focus_planner.io.surfaces",
    "focus_planner.recording.recorder",
    "focus_planner.recording.replay",
    "matplotlib.pyplot",
    "rich.console",
    "rich.progress",
    "rich.table",
)


def serve(connection: socket.socket) -> dict[str, Any]:
    """Fork a process for every request; return the request, in the process."""
    bell, ringer = os.pipe()
    for end in (bell, ringer):
        os.set_blocking(end, False)
    signal.set_wakeup_fd(ringer)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it is the children's and the tests'
    waiting: dict[int, int] = {}
    while True:
        ready, _, _ = select.select([connection, bell], [], [])
        if bell in ready:
            os.read(bell, 4096)
            tell_the_ended(waiting)
        if connection not in ready:
            continue
        data, files, _, _ = socket.recv_fds(connection, 1 << 20, 4)
        if not data:
            os._exit(0)
        pid = os.fork()
        if pid == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            signal.signal(signal.SIGINT, signal.default_int_handler)
            connection.close()
            for end in (bell, ringer, *waiting.values()):
                os.close(end)
            return json.loads(data) | {"files": files}
        waiting[pid] = files.pop()
        for file in files:
            os.close(file)
        connection.send(str(pid).encode())


def tell_the_ended(waiting: dict[int, int]) -> None:
    """Write the status of every child that has ended to who waits for it."""
    while waiting:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if pid == 0:
            return
        teller = waiting.pop(pid)
        with suppress(BrokenPipeError):  # nobody waits
            os.write(teller, str(os.waitstatus_to_exitcode(status)).encode())
        os.close(teller)


def become(request: dict[str, Any]) -> None:
    """Be the process that was asked for, and run its program."""
    *streams, status = request["files"]
    os.close(status)
    for number, file in enumerate(streams):
        os.dup2(file, number)
        os.close(file)
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["directory"])
    sys.stdin = sys.__stdin__ = os.fdopen(0, closefd=False)
    sys.stdout = sys.__stdout__ = os.fdopen(1, "w", closefd=False)
    sys.stderr = sys.__stderr__ = os.fdopen(2, "w", 1, errors="backslashreplace", closefd=False)
    sys.argv = [request["module"], *request["arguments"]]
    with warnings.catch_warnings():
        # The program's own module may have been imported by others.
        warnings.filterwarnings("ignore", "'.*' found in sys.modules", RuntimeWarning)
        runpy.run_module(request["module"], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    for name in IMPORTED_BEFORE:
        importlib.import_module(name)
    numba.njit(lambda: 1)()  # it imports even more when it first compiles
    warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
    gc.freeze()
    asked = serve(socket.socket(fileno=int(sys.argv[1])))
    become(asked)
