# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planning processes that are threads of the tests: they can be made to hang, and to die."""

from __future__ import annotations

import threading
from contextlib import suppress
from multiprocessing.connection import Pipe

from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.planning_process import PlanningProcess


class ThreadedWorker:
    """Does what a planning process does, in a thread; being killed, it only loses its connection.

    Parameters
    ----------
    intercept : callable
        Called, on the worker's thread, with every order before that is carried out.
    """

    pid = 0

    def __init__(self, intercept=lambda order: None):
        self.connection, self.theirs = Pipe()
        self.killed = False
        process = _Process(self.theirs, intercept)
        self._thread = threading.Thread(target=self._serve, args=(process,), daemon=True)
        self._thread.start()

    def _serve(self, process):
        with self.theirs, suppress(OSError, SystemExit, TypeError):
            process.serve()

    def kill(self):
        self.killed = True
        self.connection.close()

    def how_it_ended(self):
        return "it was ended by SIGKILL"

    def cpu_seconds(self):
        return 1e9 if self.killed else 0.0


class _Process(PlanningProcess):
    def __init__(self, connection, intercept):
        super().__init__(connection)
        self._intercept = intercept

    def _carry_out(self, order):
        if isinstance(order, orders.Load):
            return orders.Done()
        self._intercept(order)
        return super()._carry_out(order)

    def _limit_memory(self, _):
        """Do not limit the tests' own memory."""
