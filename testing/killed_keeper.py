# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Keeps a plan while there is much else to write, and is killed at once; prints its log."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from focus_planner.core.progress import Progress
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording import recorder as recorder_module
from focus_planner.recording.recorder import Recorder
from testing.made_up_runs import beginning, input_messages, plan_payload


class Log:
    def warning(self, message: str) -> None:
        os.write(1, message.encode())

    error = warning


# However slow the disk is: what is tested is that what is kept is found.
recorder_module._SECONDS_TO_KEEP = 240.0


def main() -> None:
    directory, published = Path(sys.argv[1]), sys.argv[2] == "1"
    recorder = Recorder(Log())
    inputs = input_messages(points=2000)
    run = recorder.begin(Recording(directory), inputs, beginning(2))
    on_progress = run.wrap_callback(lambda _: True)
    for k in range(100):
        on_progress(Progress("solving" if k == 0 else "em", k, 100.0 - k))
    recorder.prepare(directory, inputs[:1])
    run.keep_plan(plan_payload(2), published=published)
    os.kill(os.getpid(), signal.SIGKILL)


main()
