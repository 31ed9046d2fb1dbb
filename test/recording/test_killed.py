# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Runs of a process that is killed while it records: nothing half is taken for whole."""

from __future__ import annotations

import os
import random
import signal
import time

import pytest
from rosbags.rosbag2 import Reader

from focus_planner.core.validation import InputError
from focus_planner.recording.folders import being_written
from focus_planner.recording.run_reading import read_run
from testing.forked import PIPE, ForkedProcess, freeze_when
from testing.made_up_runs import ending, input_messages, run_id, without_definitions

pytestmark = pytest.mark.processes

KILLS = 13  # of each kind
INPUTS = without_definitions(input_messages(points=2000))


class Writers:
    """Starts processes that record, and kills them."""

    def __init__(self):
        self._process = ForkedProcess("testing.killed_writer", stdin=PIPE, stdout=PIPE)
        self._expect("ready")

    def start(self, how, directory):
        """Start one; return its number, and what it said before."""
        self._process.stdin.write(f"{how} {directory}\n")
        self._process.stdin.flush()
        said = []
        while True:
            said.append(self._line())
            if said[-1][0] == "writing":
                return int(said.pop()[1]), said

    def wait_for_solving(self, said, number=1):
        """Wait until this run is solving."""
        while ["solving", str(number)] not in said:
            said.append(self._line())

    def kill(self, pid, said):
        """Kill one; return the numbers of the runs that had been solving."""
        os.kill(pid, signal.SIGKILL)
        while said[-1:] != [["killed"]]:
            said.append(self._line())
        assert {words[0] for words in said} <= {"solving", "killed"}, said
        return {int(words[1]) for words in said if words[0] == "solving"}

    def close(self):
        self._process.stdin.close()
        self._process.stdout.close()
        assert self._process.wait(240) == 0

    def _expect(self, word):
        assert self._line() == [word]

    def _line(self):
        line = self._process.stdout.readline()
        assert line, "the process ended"
        return line.split()


@pytest.fixture(scope="module")
def writers():
    writers = Writers()
    yield writers
    writers.close()


def seconds_of_a_run(writers, how, directory):
    """Measure how long one run takes, from the time at which it is solving to the next one's."""
    directory.mkdir()
    pid, said_before = writers.start(how, directory)
    writers.wait_for_solving(said_before, 2)
    began = time.monotonic()
    writers.wait_for_solving(said_before, 4)
    seconds = (time.monotonic() - began) / 2
    writers.kill(pid, said_before)
    return seconds


@pytest.mark.parametrize("how", ["recorder", "writer"])
def test_a_kill_at_any_moment_leaves_whole_runs_and_partial_ones(how, writers, tmp_path):
    drawn = random.Random(how)
    seconds = seconds_of_a_run(writers, how, tmp_path / "measured")
    partial = whole = 0
    for k in range(KILLS):
        directory = tmp_path / f"{how} {k}"
        directory.mkdir()
        pid, said_before = writers.start(how, directory)
        # In the first runs, whatever they do then, and in later ones, which have others before.
        if k:
            writers.wait_for_solving(said_before, drawn.randint(1, 6))
            time.sleep(drawn.uniform(0.0, seconds))
        if k == 1:
            freeze_when(lambda there=directory: any_partial(there), pid)
        solving = writers.kill(pid, said_before)
        hidden = [p for p in directory.iterdir() if p.name.startswith(".")]  # for the next run
        assert all(p.name.endswith(".partial") and not being_written(p) for p in hidden)
        found = {int(p.name[16:22]): p for p in directory.iterdir() if p not in hidden}
        assert {run_id(number) for number in found} == {
            p.name.removesuffix(".partial") for p in found.values()
        }
        assert solving <= found.keys()
        for number, path in found.items():
            assert not being_written(path)
            if path.name.endswith(".partial"):
                partial += 1
                check_partial(path, number, number in solving)
            else:
                whole += 1
                check_whole(path, number, how)
    assert partial > 0
    assert whole > 0


def any_partial(directory):
    return any(p.name[0] != "." and p.suffix == ".partial" for p in directory.iterdir())


def check_whole(path, number, how):
    run = read_run(path)
    assert run.fault == ""
    assert without_definitions(run.inputs) == INPUTS
    assert run.beginning.run_id == path.name
    if how == "writer":
        assert run.ending == ending(number)
        assert len(run.progress) == 5
    else:
        assert run.ending.message == "none"
        assert len(run.progress) == 7
    with Reader(path) as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count


def check_partial(path, number, solving):
    # It has metadata if it was killed in the moment before it got its name.
    assert {p.name for p in path.iterdir()} <= {f"{run_id(number)}_0.mcap", "metadata.yaml"}
    try:
        run = read_run(path)
    except InputError as error:
        run = error
    if isinstance(run, InputError):
        assert not solving, run
        assert "\n" not in str(run)
        return
    assert without_definitions(run.inputs) == INPUTS
    assert run.beginning.run_id == run_id(number)
    assert (run.ending is None) is (run.fault != "")


def test_a_partial_run_tells_whether_its_writer_lives(writers, tmp_path):
    pid, said_before = writers.start("recorder", tmp_path)
    try:
        writers.wait_for_solving(said_before)
        os.kill(pid, signal.SIGSTOP)
        found = list(tmp_path.iterdir())
        unfinished = [path for path in found if path.name.endswith(".partial")]
        assert unfinished
        assert [path for path in found if being_written(path)] == unfinished
    finally:
        writers.kill(pid, said_before)
    assert list(tmp_path.iterdir()) == found
    assert not any(being_written(path) for path in found)
