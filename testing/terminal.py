# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The program on a terminal, and Ctrl-C at a chosen moment."""

import os
import pty
import signal
import subprocess
import sys
import threading

from testing.forked import ForkedProcess

PATIENCE = 300
PROGRAM = "import sys; from focus_planner.cli.main import main; sys.exit(main())"

# Ctrl-C as the terminal sends it, when the planner has done its first step.
CTRL_C_AT_A_STEP = f"""
import os, signal
from focus_planner.cli import progress

show_progress = progress.show_progress

def interrupted(*how):
    on_progress = show_progress(*how)
    def step(done):
        on_progress(done)
        os.kill(os.getpid(), signal.SIGINT)
        return on_progress(done)
    return step

progress.show_progress = interrupted
{PROGRAM}
"""

# The same so many times while the planner loads or compiles a kernel, in a callback of a C library.
CTRL_C_AT_A_KERNEL = f"""
import ctypes, os, signal, sys
from numba.core import event

def planning():
    frame = sys._getframe()
    while frame and frame.f_code.co_name != "precompile":
        frame = frame.f_back
    return frame

class Typing(event.Listener):
    left = {{times}}
    def on_start(self, _):
        while self.left and planning():
            self.left -= 1
            ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGINT))()
    def on_end(self, _):
        pass

event.register("numba:compiler_lock", Typing())
{PROGRAM}
"""


def on_a_terminal(words, program=None, stdout=None):
    """Run the program with its stderr, and stdout unless given, on a terminal.

    ``program`` is the source of another one. Returns the exit status and what the terminal got.
    """
    ours, theirs = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "120"}
    environment.pop("NO_COLOR", None)
    process = _start(words, program, theirs if stdout is None else stdout, theirs, environment)
    os.close(theirs)
    timer = threading.Timer(PATIENCE, process.kill)
    timer.start()
    shown = b""
    try:
        while part := os.read(ours, 65536):
            shown += part
    except OSError:  # what Linux says when the other end has gone
        pass
    os.close(ours)
    status = process.wait()
    timer.cancel()
    return status, shown.decode()


def _start(words, program, stdout, stderr, environment):
    if program is None:
        return ForkedProcess(
            "testing.program_on_a_terminal", *words, stdout=stdout, stderr=stderr, env=environment
        )
    return subprocess.Popen(
        [sys.executable, "-c", program, *words],
        stdout=stdout,
        stderr=stderr,
        env=environment,
        # A shell lets what it runs in the background ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # noqa: PLW1509
    )
