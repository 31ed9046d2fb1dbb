"""A planner node in a process of its own, as in a capture."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import threading

PATIENCE = 90


class PlannerProcess:
    """Runs the node; what it logs can be waited for.

    Parameters
    ----------
    name : str
        Of the node: two of them share a graph without meeting.
    arguments : str
        ROS arguments.
    """

    def __init__(self, name, *arguments):
        self.name = f"/{name}"
        command = [sys.executable, "-m", "focus_planner.ros.node", "--ros-args"]
        self._process = subprocess.Popen(
            [*command, "--remap", f"__node:={name}", *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._lines = []
        self._news = threading.Condition()
        self._ended = False
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

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

    def stop(self):
        if self._process.poll() is None:
            self.signal(signal.SIGINT)
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
