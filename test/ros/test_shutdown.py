"""How the node starts and ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import pytest

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.process import run
from testing.forked import run_forked
from testing.ros.goals import LONG

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


def test_so_is_any_other_error_of_its_start(capsys):
    def serve(wait):
        raise RuntimeError("\x1b[2J" + "x" * 5_000_000)

    assert run("planner_node", serve, []) == 2
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


def test_told_twice_it_ends_cleanly_too(start_planner):
    planner = start_planner(forked=False)
    planner.wait_for_log("ready")
    planner.signal(signal.SIGINT)
    planner.signal(signal.SIGTERM)
    planner.signal(signal.SIGINT)
    assert planner.wait() == 0
    assert "Traceback" not in planner.log


@pytest.mark.timeout(60)  # it takes none: lost, it would be waited for for ever
def test_a_signal_before_it_is_waited_for_is_not_lost():
    """Nor where a thread gets it that a library started before; the main thread must not."""
    done = threading.Event()
    thread = threading.Thread(target=done.wait)
    thread.start()
    ended = []

    def serve(wait):
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGINT)
        wait()
        ended.append("told")

    try:
        assert run("here", serve, []) == 0
    finally:
        done.set()
        thread.join()
    assert ended == ["told"]


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

def serve(wait):
    os.kill(os.getpid(), signal.SIGTERM)
    wait()
    # As Fast DDS has been seen to: without an end, and with Python's lock.
    ctypes.PyDLL(None).sleep(600)

process._SECONDS_TO_END = 0.5
sys.exit(process.run("hanging", serve, []))
"""


def test_a_middleware_that_hangs_does_not_keep_a_process_from_ending():
    ended = subprocess.run([sys.executable, "-c", HANGING], capture_output=True, check=False)
    assert (ended.returncode, ended.stderr) == (1, b"")
