# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planner's program: a server to fork planning processes from, and the node."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection

from focus_planner.runtime.cores import share_cores
from focus_planner.runtime.fork_server import fork_server
from focus_planner.runtime.stop_signals import StopSignals


def main(args: list[str] | None = None, signals: StopSignals | None = None) -> int:
    """Run the node until SIGINT or SIGTERM, or until it fails; return the exit status."""
    share_cores()
    signals = signals or StopSignals()
    # Before ROS is imported: that starts a thread.
    with fork_server("planning", _import_planning) as server:
        from focus_planner.ros.planner_node import run_node  # noqa: PLC0415 - see above

        status, finished = run_node(server, signals, args)
    if not finished:
        # Nothing can interrupt a disk that does not answer, and Python would wait for it. Nothing
        # is lost: callers have been answered, and the middleware has been shut down.
        sys.stderr.flush()
        os._exit(status)
    return status


def _import_planning() -> Callable[[Connection], None]:
    from focus_planner.runtime.planning_process import serve  # noqa: PLC0415 - takes seconds

    return serve


if __name__ == "__main__":
    sys.exit(main())
