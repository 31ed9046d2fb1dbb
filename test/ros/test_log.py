# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What nodes write to their log, and to /rosout."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.impl import rcutils_logger
from rclpy.node import Node

from focus_planner.core.text import MAX_LINE
from focus_planner.ros import log as log_module
from focus_planner.ros.base_node import BaseNode
from focus_planner.ros.lifecycle import ManagedNode
from testing.ros.lens_processes import LensProcess, Orchestrator
from testing.ros.planner_process import PATIENCE
from testing.ros.spinning import spun

ROS = Path(log_module.__file__).parent
HOSTILE = "cam\x1b[2J\u202e\n[INFO] [0.1] [focus_planner]: ready\x9b\x7f\udc80"
TOLD = r"cam\x1b[2J\u202e [INFO] [0.1] [focus_planner]: ready\x9b\x7f\udc80"


@pytest.fixture(params=[BaseNode, ManagedNode])
def node(request):
    context = Context()
    rclpy.init(args=[], context=context)
    node = request.param("logging", context=context, use_global_arguments=False)
    yield node
    node.destroy_node()
    context.try_shutdown()


@pytest.fixture
def logged(monkeypatch):
    """Keep what is handed to ROS: the name, the text, and who logged it."""
    entries = []

    class Instead:
        def __getattr__(self, name):
            return getattr(genuine, name)

        @staticmethod
        def rclpy_logging_rcutils_log(severity, name, message, function, file, line):
            entries.append((name, message, function, Path(file).name))

    genuine = rcutils_logger._rclpy
    monkeypatch.setattr(rcutils_logger, "_rclpy", Instead())
    return entries


@pytest.mark.parametrize("level", ["info", "warning", "error", "fatal"])
def test_what_peers_send_is_logged_escaped(node, logged, level):
    getattr(node.get_logger(), level)(f"refused {HOSTILE}")
    ((name, text, function, file),) = logged
    assert text == f"refused {TOLD}"
    assert name == "logging"
    # Throttling tells callers apart by this.
    assert (function, file) == (test_what_peers_send_is_logged_escaped.__name__, "test_log.py")


def test_what_is_long_is_cut(node, logged):
    node.get_logger().info("x" * 5_000_000)
    assert len(logged[0][1]) <= MAX_LINE


def test_so_is_what_rclpy_logs_of_actions(node, logged):
    node.get_logger().get_child("action_server").error(f"error in a callback: {HOSTILE}")
    assert logged[0][:2] == ("logging.action_server", f"error in a callback: {TOLD}")


def test_callers_are_throttled_one_by_one(node, logged):
    for _ in range(3):
        node.get_logger().info("one", throttle_duration_sec=20.0)
        node.get_logger().info("two", throttle_duration_sec=20.0)
    assert [text for _, text, *_ in logged] == ["one", "two"]


def test_a_clock_that_was_set_back_silences_nothing(node, monkeypatch):
    options = []
    monkeypatch.setattr(
        rcutils_logger.RcutilsLogger, "log", lambda *_, **given: options.append(given)
    )
    node.get_logger().info("one", throttle_duration_sec=1.0)
    node.get_logger().info("two")
    assert options[0]["throttle_time_source_type"].clock_type is ClockType.STEADY_TIME
    assert options[1] == {}


def names(path):
    return {
        node.id
        for each in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        for node in (
            [*each.bases]
            if isinstance(each, ast.ClassDef)
            else [each.func]
            if isinstance(each, ast.Call)
            else []
        )
        if isinstance(node, ast.Name)
    }


@pytest.mark.parametrize("path", sorted(ROS.glob("*.py")), ids=lambda path: path.stem)
def test_no_node_has_another_log(path):
    if path.name not in {"log.py", "base_node.py", "lifecycle.py"}:
        assert not names(path) & {"Node", "LifecycleNode", "get_logger"}


# --- from a driver to the adapter's log, over DDS ------------------------------------------------


@pytest.fixture
def driver():
    """A driver whose reason to refuse is made to deceive whoever reads the log."""

    def refuse(_):
        return SetParametersResult(successful=False, reason=HOSTILE[:-1] + "x" * 1_000_000)

    context = Context()
    rclpy.init(args=[], context=context)
    node = Node("deceiver", context=context, use_global_arguments=False)
    node.declare_parameter("ring", 1.0)
    node.add_on_set_parameters_callback(refuse)
    orchestrator = Orchestrator(context)
    with spun(node):
        yield orchestrator
    orchestrator.close()
    node.destroy_node()
    context.try_shutdown()


@pytest.mark.processes
def test_a_drivers_reason_is_logged_escaped_and_cut(driver):
    settings = {"driver": "custom", "driver_node": "/deceiver", "parameter": "ring", "unit": "m"}
    settings |= {"cameras": ["deceived"], "retries": 0, "timeout": float(PATIENCE)}
    adapter = LensProcess("lens_adapter", **settings)
    adapter.wait_for_log("ready")
    driver.plan("deceived", "a")
    adapter.wait_for_log("refused ring")
    assert adapter.stop() == 0
    lines = adapter.log.splitlines()
    assert any(TOLD.removesuffix(r"\udc80") in line for line in lines)
    assert all(line.isprintable() and len(line) < MAX_LINE + 100 for line in lines)
    assert not any(line.endswith("[focus_planner]: ready") for line in lines)
