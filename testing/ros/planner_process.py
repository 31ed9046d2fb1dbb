# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Nodes in processes of their own, as in a capture."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import weakref
from functools import partial
from signal import SIGINT
from tempfile import gettempdir

from testing.forked import DEVNULL, PIPE, ForkedProcess

# Seconds. Tells what hangs from what works on a busy machine, and nothing else.
PATIENCE = 240


# Whose logs tell why a test failed.
_NODES = weakref.WeakSet()
_LINES = 30


def ends_of_logs():
    """Return a title and the end of the log of every node that some test still holds."""
    return [(f"log of {node.title}", "\n".join(node.log.splitlines()[-_LINES:])) for node in _NODES]


class NodeProcess:
    """A node that runs; what it logs can be waited for."""

    def _start(self, module, arguments, *, forked=True, folder=None, under=()):
        self._lines = []
        self._news = threading.Condition()
        self._ended = False
        self.module = module
        start = ForkedProcess if forked else partial(_python, under=under)
        self._process = start(module, *arguments, stderr=PIPE, folder=folder)
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        _NODES.add(self)

    @property
    def title(self):
        state = "ended" if self._ended else "runs"
        return f"{getattr(self, 'name', self.module)}, {self.pid}, {state}"

    @property
    def pid(self):
        return self._process.pid

    @property
    def log(self):
        with self._news:
            return "".join(self._lines)

    def wait_for_log(self, pattern):
        with self._news:
            found = self._news.wait_for(
                lambda: self._ended or re.search(pattern, "".join(self._lines)), PATIENCE
            )
        assert found, f"the node never logged {pattern!r} but {self.log}"
        assert re.search(pattern, self.log), f"the node ended: {self.log}"

    def signal(self, number):
        self._process.send_signal(number)

    def wait(self):
        """Return the exit status."""
        status = self._process.wait(PATIENCE)
        self._reader.join()
        return status

    def has_ended(self):
        return self._process.poll() is not None

    def kill(self):
        self._process.kill()
        self.wait()

    def stop(self, number=SIGINT):
        """End it, unless it has ended; return the exit status."""
        self.signal(number)
        try:
            return self.wait()
        finally:
            self._process.kill()

    def _read(self):
        with self._process.stderr:
            for line in self._process.stderr:
                with self._news:
                    self._lines.append(line)
                    self._news.notify_all()
        with self._news:
            self._ended = True
            self._news.notify_all()


class PlannerProcess(NodeProcess):
    """A planner node.

    Parameters
    ----------
    name : str
        Of the node: two of them share a graph without meeting.
    arguments : str
        ROS arguments.
    forked : bool
        Whether what it imports may have been imported before.
    module : str
        What it runs.
    folder : str, optional
        Where it is started, by default here.
    under : sequence of str
        A command that it is the argument of, such as one that limits it; not forked.
    """

    def __init__(
        self,
        name,
        *arguments,
        forked=True,
        module="focus_planner.ros.node",
        folder=None,
        under=(),
    ):
        self.name = f"/{name}"
        remapped = ["--ros-args", "--remap", f"__node:={name}"]
        # For what tests set later.
        folders = ["-p", f"data_directories:={gettempdir()}:/proc"]
        self._start(
            module, [*remapped, *folders, *arguments], forked=forked, folder=folder, under=under
        )


def _python(module, *arguments, stderr, folder, under):
    command = [*under, sys.executable, "-m", module, *arguments]
    return subprocess.Popen(
        command, stdout=DEVNULL, stderr=stderr, text=True, errors="backslashreplace", cwd=folder
    )
