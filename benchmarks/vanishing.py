# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``python -m benchmarks.vanishing PLANNER call|goal TIMES``: clients that ask, and are killed.

They are forks of a process that has ROS imported, which takes longer than all else.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable

from focus_planner.ros.client import PlannerClient

_PATIENCE = 60.0


def main() -> int:
    """Kill clients while they wait for a response."""
    planner, what, times = sys.argv[1:]
    return max(_vanish(planner, _ASKING[what]) for _ in range(int(times)))


def _vanish(planner: str, ask: Callable[[PlannerClient], None]) -> int:
    """Return 0 if the client had sent its request before it was killed."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _ask_and_wait(planner, ask, writing)
    asked = select.select([reading], [], [], _PATIENCE)[0] and os.read(reading, 1) == b"1"
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(reading)
    os.close(writing)
    return int(not asked)


def _ask_and_wait(planner: str, ask: Callable[[PlannerClient], None], writing: int) -> None:
    try:
        ask(PlannerClient(planner))
        os.write(writing, b"1")
    finally:
        os.write(writing, b"0")
        threading.Event().wait()


def _call(client: PlannerClient) -> None:
    client.plan_async(method="k_view", samples=2000)
    # It is on its way, or planned, or answered, when the client is killed.
    time.sleep(0.001 * (os.getpid() % 50))


def _send_goal(client: PlannerClient) -> None:
    goal = client.send_goal(method="optimal", samples=20_000, gap=1e-9, time_budget=1.0)
    assert goal.accepted


_ASKING = {"call": _call, "goal": _send_goal}

if __name__ == "__main__":
    sys.exit(main())
