# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The lens adapter's program."""

from __future__ import annotations

import sys

from focus_planner.runtime.stop_signals import StopSignals


def main(args: list[str] | None = None, signals: StopSignals | None = None) -> int:
    """Run the adapter until SIGINT or SIGTERM; return the status the process is to end with."""
    signals = signals or StopSignals()
    from focus_planner.ros.lens_adapter_node import run_node  # noqa: PLC0415 - takes a second

    return run_node(signals, args)


if __name__ == "__main__":
    sys.exit(main())
