# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Nodes that are spun in a thread of their own."""

from __future__ import annotations

import threading
from contextlib import contextmanager

from rclpy.executors import SingleThreadedExecutor


class Spinning:
    """Spins a node until it is closed.

    An executor that is shut down while it handles something may raise in its own thread, so it is
    left to end a step first.
    """

    def __init__(self, node):
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self):
        while not self._closing.is_set():
            self._executor.spin_once()

    def close(self):
        self._closing.set()
        self._executor.create_task(lambda: None)  # wakes it
        self._thread.join()
        self._executor.shutdown()


@contextmanager
def spun(node):
    """Spin a node meanwhile."""
    spinning = Spinning(node)
    try:
        yield
    finally:
        spinning.close()
