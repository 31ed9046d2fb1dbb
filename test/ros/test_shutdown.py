# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How the node starts and ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.process import run
from focus_planner.runtime.stop_signals import StopSignals
from testing.forked import PIPE, ForkedProcess, run_forked
from testing.ros.calls import WAITING, until
from testing.ros.goals import LONG
from testing.ros.planner_process import PlannerProcess

pytestmark = pytest.mark.processes


def test_arguments_that_are_not_for_ros_end_it_with_one_line():
    command = [sys.executable, "-m", "focus_planner.ros.node", "--frame-id", "x", "--ros-args"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr == (
        "planner_node: arguments: expected none but those after --ros-args, got --frame-id x;"
        " give parameters as --ros-args -p name:=value\n"
    )


def test_why_it_ends_is_told_escaped():
    command = [sys.executable, "-m", "focus_planner.ros.node", "\x1b]0;owned\x07\u202e\r\nready"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    (line,) = ended.stderr.split("\n")[:-1]
    assert r"got \x1b]0;owned\x07\u202e ready" in line
    assert line.isprintable()


def test_so_is_any_other_error_of_its_start(signals, capsys):
    def serve(wait):
        raise RuntimeError("\x1b[2J" + "x" * 5_000_000)

    assert run("planner_node", serve, signals, []) == 2
    line = capsys.readouterr().err
    assert line.startswith(r"planner_node: RuntimeError: \x1b[2Jx")
    assert len(line) < 5000


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_idle_it_ends_cleanly(start_planner, number):
    planner = start_planner(forked=False)
    planner.wait_for_log("ready")
    planner.signal(number)
    assert planner.wait() == 0
    assert "Traceback" not in planner.log


# Runs a module's program, which is sent signals at a moment of its life.
SIGNALLED = """
import atexit, os, runpy, signal, sys, threading
moment, numbers, module, *sys.argv[1:] = sys.argv[1], sys.argv[2].split(), *sys.argv[3:]
NUMBERS = [getattr(signal, name) for name in numbers]

def tell(*_):
    for number in NUMBERS:
        os.kill(os.getpid(), number)

class Importing:
    def find_spec(self, name, path=None, target=None):
        if name == "rclpy":
            sys.meta_path.remove(self)
            tell()

class AtLast:
    __del__ = tell

if moment == "while it imports":
    sys.meta_path.insert(0, Importing())
elif moment == "at its end":
    threading._register_atexit(tell)
    atexit.register(tell)
    sys.modules["at_last"] = AtLast()
runpy.run_module(module, run_name="__main__", alter_sys=True)
"""
ONE_LENS = ("--ros-args", "-p", "cameras:=[a]")
NODES = {
    "node": ("--ros-args", "-r", "__node:=signalled"),
    "lens_adapter": ONE_LENS,
    "simulated_lens": ONE_LENS,
}


def start_signalled(moment, numbers, node, *, command=False):
    program = ["focus_planner", node] if command else [f"focus_planner.ros.{node}"]
    words = [sys.executable, "-c", SIGNALLED, moment, numbers, *program, *NODES[node]]
    return subprocess.Popen(words, stderr=subprocess.PIPE, text=True)


def read_until_ready(process):
    while "ready" not in (line := process.stderr.readline()):
        assert line, "it ended before it was ready"


@pytest.mark.parametrize("node", NODES)
def test_one_that_is_stopping_ignores_further_signals(node):
    """As ``launch`` sends them, and impatient people, until it has ended."""
    process = start_signalled("never", "", node)
    with process.stderr:
        read_until_ready(process)
        process.send_signal(signal.SIGINT)
        number = signal.SIGINT
        while process.poll() is None:
            number = signal.SIGTERM if number == signal.SIGINT else signal.SIGINT
            process.send_signal(number)
            time.sleep(0.002)  # not for anything to happen: the machine has others
        assert "Traceback" not in process.stderr.read()
    assert process.returncode == 0


def test_up_to_its_very_end():
    process = start_signalled("at its end", "SIGINT SIGTERM SIGINT", "lens_adapter")
    with process.stderr:
        read_until_ready(process)
        process.send_signal(signal.SIGTERM)
        assert "Traceback" not in process.stderr.read()
        assert process.wait() == 0


@pytest.mark.parametrize("node", NODES)
def test_while_it_is_still_imported_it_is_stopped_without_a_word(node):
    process = start_signalled("while it imports", "SIGINT SIGTERM SIGINT", node, command=True)
    with process.stderr:
        assert process.stderr.read() == ""
        assert process.wait() == 0


def test_a_signal_does_not_change_what_is_said_of_bad_arguments():
    numbers, module = "SIGINT SIGTERM", "focus_planner.ros.node"
    words = [sys.executable, "-c", SIGNALLED, "at its end", numbers, module]
    ended = subprocess.run([*words, "--frame-id"], capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.timeout(60)  # it takes none: lost, it would be waited for for ever
def test_a_signal_before_it_is_waited_for_is_not_lost():
    """Nor where a thread gets it that a library started before; the main thread must not."""
    done = threading.Event()
    thread = threading.Thread(target=done.wait)
    thread.start()
    signals = StopSignals()
    ended = []

    def serve(wait):
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
        wait()
        ended.append("told")

    try:
        assert run("here", serve, signals, []) == 0
    finally:
        signals.undo()
        done.set()
        thread.join()
    assert ended == ["told"]


def test_nothing_is_started_once_it_was_told_to_stop(signals):
    os.kill(os.getpid(), signal.SIGTERM)
    until(lambda: signals.have_arrived)  # by way of another thread of the tests
    assert run("here", lambda _: pytest.fail("it was started"), signals, []) == 0


def test_a_process_that_goes_on_has_its_signals_back():
    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    signals = StopSignals()
    os.kill(os.getpid(), signal.SIGTERM)
    signals.wait()
    assert {signal.getsignal(each) for each in before} == {signal.SIG_IGN}
    signals.undo()
    assert {each: signal.getsignal(each) for each in before} == before
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == blocked


def test_while_it_starts_it_ends_cleanly(start_planner):
    planner = start_planner(forked=False)
    planner.wait_for_log("loading kernels")
    planner.signal(signal.SIGINT)
    assert planner.wait() == 0
    assert "Traceback" not in planner.log


def test_while_it_plans_it_ends_cleanly_and_the_callers_are_told(start_planner, body):
    planner = start_planner(debug=True)
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(cylinder_rig())
        planned = client.plan_async(**LONG)
        queued = client.plan_async(method="em")
        planner.wait_for_log(f"planning: .*{LONG['samples']}")
        planner.signal(signal.SIGINT)
        client.wait_for(planned)
        client.wait_for(queued)
        for answer in (planned.result(), queued.result()):
            assert not answer.success
            assert answer.message == "the node is shutting down"
    assert planner.wait() == 0
    assert "Traceback" not in planner.log


def test_who_was_held_up_while_it_ended_is_told_too(body):
    """Who learns that a node has left before it has read an answer of the node's never reads it."""
    planner = PlannerProcess("lingering", *WAITING, module="testing.ros.lingering_node")
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(cylinder_rig())
        held = ForkedProcess("testing.ros.held_clients", planner.name, stdout=PIPE)
        try:
            assert held.stdout.readline() == "asked\n"
            until(lambda: client.status().waiting == 3)
            os.kill(held.pid, signal.SIGSTOP)
            planner.signal(signal.SIGINT)
            planner.wait_for_log("the node is shutting down")
            time.sleep(1.0)  # in which a node that does not stay ends
            os.kill(held.pid, signal.SIGCONT)
            answers = [held.stdout.readline() for _ in range(4)]
        finally:
            held.kill()
            held.wait()
            held.stdout.close()
            planner.kill()
    assert answers == 4 * ["the node is shutting down\n"]


def test_a_call_before_it_is_ready_waits(start_planner, body, rig):
    planner = start_planner()
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(rig)
        response = client.plan(method="em", samples=100)
    assert response.success, response.message
    planner.wait_for_log("ready")


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["-p", "method:=guess"], "planner_node: method: expected one of closest"),
        (["-p", "k:=7"], "planner_node: Invalid parameter value (7)"),
        (["--unheard-of"], "planner_node: UnknownROSArgsError: ['--unheard-of']"),
    ],
)
def test_bad_arguments_end_it_with_one_line(arguments, error):
    ended = run_forked("focus_planner.ros.node", "--ros-args", *arguments)
    assert ended.returncode == 2
    assert error in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


HANGING = """
import ctypes, os, signal, sys
from focus_planner.ros import process
from focus_planner.runtime import stop_signals

def serve(wait):
    os.kill(os.getpid(), signal.SIGTERM)
    wait()
    # As Fast DDS has been seen to: without an end, and with Python's lock.
    ctypes.PyDLL(None).sleep(600)

stop_signals._SECONDS_TO_END = 0.5
sys.exit(process.run("hanging", serve, stop_signals.StopSignals(), []))
"""


def test_a_middleware_that_hangs_does_not_keep_a_process_from_ending():
    ended = subprocess.run([sys.executable, "-c", HANGING], capture_output=True, check=False)
    assert (ended.returncode, ended.stderr) == (1, b"")
