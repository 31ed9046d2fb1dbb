# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What systemd is told, and when it is not."""

from __future__ import annotations

import asyncio
import itertools
import os
import socket
import threading
from contextlib import contextmanager

import pytest
import rclpy
from rclpy.context import Context

from focus_planner.ros.base_node import BaseNode
from focus_planner.ros.supervisor import Supervisor
from testing.ros.lens_processes import LensProcess
from testing.ros.spinning import spun
from testing.service_manager import ServiceManager

READY, ALIVE, STOPPING = "READY=1", "WATCHDOG=1", "STOPPING=1"
# Seconds between signs in these tests are a quarter of it.
WATCHDOG = 0.2
_count = itertools.count()


@pytest.fixture
def abstract():
    manager = ServiceManager(f"@focus_planner_{os.getpid()}_{next(_count)}")
    yield manager
    manager.close()


@pytest.fixture
def named(tmp_path):
    manager = ServiceManager(str(tmp_path / "notify"))
    yield manager
    manager.close()


@pytest.fixture(params=["named", "abstract"])
def manager(request):
    return request.getfixturevalue(request.param)


def test_systemd_is_told_how_it_goes(manager):
    supervisor = Supervisor(manager.environment())
    supervisor.ready()
    supervisor.alive()
    supervisor.stopping()
    assert manager.wait_for(STOPPING) == [READY, ALIVE, STOPPING]


@pytest.mark.parametrize("address", ["", "vsock:2:1234", "relative"])
def test_without_systemd_nobody_is_told(address, monkeypatch):
    def refuse(*_):
        raise AssertionError("a socket")

    monkeypatch.setattr(socket, "socket", refuse)
    for environment in ({}, {"NOTIFY_SOCKET": address}):
        supervisor = Supervisor(environment)
        supervisor.ready()
        supervisor.alive()
        supervisor.stopping()


def test_a_manager_that_has_gone_is_not_missed(tmp_path):
    supervisor = Supervisor({"NOTIFY_SOCKET": str(tmp_path / "gone")})
    supervisor.ready()
    supervisor.alive()


@pytest.mark.timeout(60)  # it takes none: a sign that waited would wait for ever
def test_a_manager_that_does_not_read_hangs_nobody(tmp_path):
    path = str(tmp_path / "full")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as deaf:
        deaf.bind(path)
        supervisor = Supervisor({"NOTIFY_SOCKET": path})
        for _ in range(10_000):
            supervisor.alive()
        supervisor.stopping()


class Timers:
    """Stands in for a node."""

    def __init__(self):
        self.periods = []

    def create_timer(self, period, callback, clock):
        self.periods.append(period)


@pytest.mark.parametrize(
    ("environment", "periods"),
    [
        ({"WATCHDOG_USEC": "60000000"}, [15.0]),
        ({"WATCHDOG_USEC": "60000000", "WATCHDOG_PID": str(os.getpid())}, [15.0]),
        ({"WATCHDOG_USEC": "60000000", "WATCHDOG_PID": str(os.getppid())}, []),
        ({"WATCHDOG_USEC": "soon"}, []),
        ({"WATCHDOG_USEC": "-1"}, []),
        ({"WATCHDOG_USEC": "0"}, []),
        ({}, []),
    ],
)
def test_signs_of_life_are_given_in_time_to_whoever_wants_them(environment, periods):
    timers = Timers()
    Supervisor(environment).watch(timers)
    assert timers.periods == periods


@contextmanager
def watched_node():
    context = Context()
    rclpy.init(args=[], context=context)
    node = BaseNode("watched", context=context, use_global_arguments=False)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def hang():
    """Return what hangs whoever calls it, whether somebody does, and what ends that."""
    hung, end = threading.Event(), threading.Event()

    def wait():
        hung.set()
        end.wait()

    return wait, hung, end


def test_an_executor_that_hangs_gives_no_sign(abstract):
    with watched_node() as node:
        Supervisor(abstract.environment(WATCHDOG)).watch(node)
        with spun(node):
            abstract.wait_for(ALIVE, 3)
            wait, hung, end = hang()
            node.executor.create_task(wait)
            assert hung.wait(60)
            assert not abstract.hears_within(2 * WATCHDOG)
            end.set()
            abstract.wait_for(ALIVE, len(abstract.told) + 1)


def test_nor_does_one_whose_other_thread_hangs(abstract):
    loop = asyncio.new_event_loop()
    other = threading.Thread(target=loop.run_forever)
    other.start()
    with watched_node() as node:
        Supervisor(abstract.environment(WATCHDOG)).watch(node, loop.call_soon_threadsafe)
        with spun(node):
            abstract.wait_for(ALIVE, 3)
            wait, hung, end = hang()
            loop.call_soon_threadsafe(wait)
            assert hung.wait(60)
            assert not abstract.hears_within(2 * WATCHDOG)
            end.set()
            abstract.wait_for(ALIVE, len(abstract.told) + 1)
    loop.call_soon_threadsafe(loop.stop)
    other.join()
    loop.close()


# --- the nodes, in processes of their own --------------------------------------------------------


@pytest.fixture
def supervised(named, monkeypatch):
    for name, value in named.environment(WATCHDOG).items():
        monkeypatch.setenv(name, value)
    return named


def told(manager):
    """Return what was told, but how often it was alive."""
    return [words for words, _ in itertools.groupby(manager.told)]


@pytest.mark.processes
def test_the_planner_is_ready_once_it_is_active(supervised, start_planner):
    planner = start_planner()
    supervised.wait_for(READY)
    planner.wait_for_log("ready")
    supervised.wait_for(ALIVE, supervised.told.count(ALIVE) + 3)
    assert planner.stop() == 0
    supervised.wait_for(STOPPING)
    assert [words for words in told(supervised) if words != ALIVE] == [READY, STOPPING]


@pytest.mark.processes
def test_without_an_autostart_it_is_ready_for_transitions(supervised, start_planner):
    planner = start_planner("-p", "autostart:=false")
    supervised.wait_for(READY)
    assert planner.stop() == 0


@pytest.mark.processes
def test_what_ends_at_its_start_is_never_ready(supervised, start_planner, tmp_path):
    planner = LensProcess("node", samples=-1)
    assert planner.wait() == 2
    assert not {READY, ALIVE} & set(supervised.told)


@pytest.mark.processes
def test_the_lens_adapter_tells_it_too(supervised):
    adapter = LensProcess("lens_adapter", cameras=["cam_000"])
    supervised.wait_for(READY)
    supervised.wait_for(ALIVE, 3)
    assert adapter.stop() == 0
    supervised.wait_for(STOPPING)
    assert [words for words in told(supervised) if words != ALIVE] == [READY, STOPPING]
