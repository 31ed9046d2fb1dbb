"""Runs of a process that is killed while it records: nothing half is taken for whole."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader

from focus_planner.core.validation import InputError
from focus_planner.recording.bag import being_written
from focus_planner.recording.run import read_run
from testing.made_up_runs import ending, input_messages, run_id, without_definitions

KILLS = 13  # of each kind
LONGEST = 0.4  # seconds
INPUTS = without_definitions(input_messages(points=2000))
ROOT = Path(__file__).parents[2]


class Writers:
    """Starts processes that record, and kills them."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "testing.killed_writer"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        self._expect("ready")

    def start(self, how, directory):
        """Start one; return its number, and what it without_definitions before."""
        self._process.stdin.write(f"{how} {directory}\n")
        self._process.stdin.flush()
        without_definitions = []
        while True:
            without_definitions.append(self._line())
            if without_definitions[-1][0] == "writing":
                return int(without_definitions.pop()[1]), without_definitions

    def wait_for_solving(self, without_definitions):
        while not any(words[0] == "solving" for words in without_definitions):
            without_definitions.append(self._line())

    def kill(self, pid, without_definitions):
        """Kill one; return the numbers of the runs that had been solving."""
        os.kill(pid, signal.SIGKILL)
        while without_definitions[-1:] != [["killed"]]:
            without_definitions.append(self._line())
        assert {words[0] for words in without_definitions} <= {"solving", "killed"}, (
            without_definitions
        )
        return {int(words[1]) for words in without_definitions if words[0] == "solving"}

    def close(self):
        self._process.stdin.close()
        self._process.stdout.close()
        assert self._process.wait(10) == 0

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


@pytest.mark.parametrize("how", ["recorder", "writer"])
def test_a_kill_at_any_moment_leaves_whole_runs_and_partial_ones(how, writers, tmp_path):
    drawn = random.Random(how)
    partial = whole = 0
    for k in range(KILLS):
        directory = tmp_path / f"{how} {k}"
        directory.mkdir()
        pid, said_before = writers.start(how, directory)
        time.sleep(drawn.uniform(0.0, LONGEST))
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
