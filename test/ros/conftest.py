# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import itertools

import pytest

pytest.importorskip("focus_planner_msgs")

from rclpy.context import Context
from rclpy.node import Node

from focus_planner import cylinder_rig
from focus_planner.io.bodies import body as body_path
from focus_planner.io.surfaces import load_surface
from focus_planner.ros.client import PlannerClient
from focus_planner.runtime.stop_signals import StopSignals
from testing.ros.calls import WAITING
from testing.ros.one_process import end_deliveries_within_it
from testing.ros.patient_clients import have_clients_wait
from testing.ros.planner_process import PlannerProcess, ends_of_logs

_count = itertools.count()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    """Show with a failure what nodes have logged."""
    report = yield
    if report.failed:
        report.sections += ends_of_logs()
    return report


@pytest.fixture(scope="session", autouse=True)
def several_contexts():
    """Have this process bear several contexts at once."""
    end_deliveries_within_it()


@pytest.fixture(scope="session", autouse=True)
def patience():
    """Have clients wait as long as a busy machine may need."""
    have_clients_wait()


@pytest.fixture
def signals():
    """Those of a program that runs in this process, which goes on afterwards."""
    signals = StopSignals()
    yield signals
    signals.undo()


@pytest.fixture(scope="session")
def body():
    return load_surface(body_path("arms_down"))


@pytest.fixture(scope="session")
def rig():
    return cylinder_rig(rows=4, columns=8, radius=1.2)


@pytest.fixture(scope="module")
def start_planner():
    """Start nodes; they are stopped, and must have ended well, at the end of the module."""
    started = []

    def start(*arguments, debug=False, **how):
        name = f"planner_{next(_count)}"
        level = ["--log-level", f"{name}:=debug"] if debug else []
        started.append(PlannerProcess(name, *WAITING, *arguments, *level, **how))
        return started[-1]

    yield start
    assert [process.stop() for process in started] == [0] * len(started)


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner()


@pytest.fixture(scope="module")
def client(planner):
    with PlannerClient(planner.name) as client:
        yield client


@pytest.fixture
def context():
    context = Context()
    context.init(args=[])
    yield context
    context.try_shutdown()


@pytest.fixture
def named(context):
    """Make nodes with full names in this process, without parameter services."""
    nodes = []

    def named(name):
        namespace, _, name = name.rpartition("/")
        settings = {"use_global_arguments": False, "start_parameter_services": False}
        nodes.append(Node(name, namespace=namespace, context=context, **settings))
        return nodes[-1]

    yield named
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def make_node(context):
    """Make nodes in this process, for what needs no executor."""
    nodes = []

    def make(**settings):
        nodes.append(Node("here", context=context, use_global_arguments=False, **settings))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
