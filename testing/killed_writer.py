# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Records runs of made-up messages, one after another, until it is killed.

Loads once what takes seconds to load. For every folder on its standard input it forks a process
that writes there; it says the process's number, and the process each time that a run is "solving".
"""

from __future__ import annotations

import os
import sys
import threading
from concurrent.futures import Future
from pathlib import Path

from focus_planner.core.progress import Progress
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording import recorder as recorder_module
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.run_writing import beginning_messages, ending_messages
from testing.made_up_runs import beginning, ending, input_messages, progress_messages, run_id

INPUTS = input_messages(points=2000)


def say(*words: object) -> None:
    os.write(1, (" ".join(map(str, words)) + "\n").encode())


class Log:
    def warning(self, message: str) -> None:
        say("warning", message)

    def error(self, message: str) -> None:
        say("error", message)


def with_the_recorder(directory: Path) -> None:
    recorder_module._SECONDS_BETWEEN_WRITES = 0.003
    recorder_module._LARGE = 0
    recorder = Recorder(Log())
    pause = threading.Event()
    number = 0
    while True:
        number += 1
        recorder.prepare(directory, INPUTS)
        run = recorder.begin(Recording(directory), INPUTS, beginning(number))
        on_progress = run.wrap_callback(lambda _: True)
        on_progress(Progress("visibility", 0, 0.0))
        on_progress(Progress("solving", 0, 0.0))
        say("solving", number)
        for k in range(5):
            on_progress(Progress("k_view", k, 100.0 - k))
            pause.wait(0.002)
        done: Future[None] = run.finish(False, "none")
        if number % 2:
            done.result()


def with_the_writer(directory: Path) -> None:
    number = 0
    while True:
        number += 1
        bag = BagWriter()
        for message in INPUTS:
            bag.add(message)
        bag.flush()
        bag.open(directory / run_id(number))
        for message in beginning_messages(beginning(number)):
            bag.add(message)
        bag.sync()
        say("solving", number)
        for message in progress_messages(number):
            bag.add(message)
            bag.flush()
        for message in ending_messages(beginning(number), ending(number), 2 * 10**18):
            bag.add(message)
        bag.close()


def main() -> None:
    say("ready")
    for line in sys.stdin:
        how, directory = line.rstrip("\n").split(" ", 1)
        pid = os.fork()
        if pid == 0:
            (with_the_recorder if how == "recorder" else with_the_writer)(Path(directory))
        say("writing", pid)
        os.waitpid(pid, 0)
        say("killed")


main()
