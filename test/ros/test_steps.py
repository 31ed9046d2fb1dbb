# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an executor's step raises: told, survived, and in the end not survived."""

from __future__ import annotations

import pytest
from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.executors import SingleThreadedExecutor

from focus_planner.ros import steps as module
from focus_planner.ros.steps import Steps
from testing.ros.log import RecordingLogger


class Bench:
    """Steps on a clock that is set by hand."""

    def __init__(self):
        self.log, self.failures, self.now = RecordingLogger(), [], 0.0
        self.steps = Steps(lambda: self.log, self.failures.append)

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


@pytest.fixture
def bench(monkeypatch):
    bench = Bench()
    monkeypatch.setattr(module, "time", bench)
    return bench


def raises(error):
    def step():
        raise error

    return step


def works():
    pass


def test_what_a_peer_causes_is_told_in_a_line_and_never_ends_it(bench):
    for _ in range(1000):
        bench.steps.take(raises(UnicodeDecodeError("utf-8", b"\xff", 0, 1, "no\nstart")))
        bench.now += 1.0
    assert not bench.failures
    assert {level for level, _ in bench.log.records} == {"warning"}
    assert bench.log.records[0][1] == (
        "could not read what a peer sent, or not answer it: UnicodeDecodeError: 'utf-8' codec"
        " can't decode byte 0xff in position 0: no start"
    )


def test_what_was_destroyed_meanwhile_is_no_fault(bench):
    bench.steps.take(raises(InvalidHandle("gone")))
    assert not bench.log.records


def test_without_memory_it_ends_only_if_that_lasts(bench):
    for _ in range(100):
        bench.steps.take(raises(MemoryError()))
        bench.now += 1.0
        bench.steps.take(works)
    assert not bench.failures
    while not bench.failures:
        assert bench.now < 200.0
        bench.steps.take(raises(MemoryError()))
        bench.now += 1.0
    assert bench.failures == ["nothing works any more: MemoryError: "]
    assert bench.steps.have_failed
    bench.steps.take(raises(MemoryError()))
    assert len(bench.failures) == 1


def test_an_executor_that_cannot_wait_pauses_and_then_ends(bench, context, monkeypatch):
    executor = SingleThreadedExecutor(context=context)
    monkeypatch.setattr(
        "rclpy.executors._rclpy.WaitSet", lambda *_: raises(RuntimeError("no wait set"))()
    )
    turns = 0
    while not bench.failures:
        turns += 1
        bench.steps.take(executor.spin_once)
    assert 10 < turns < 1000
    assert bench.failures == ["nothing works any more: RuntimeError: no wait set"]
    monkeypatch.undo()
    executor.shutdown()
