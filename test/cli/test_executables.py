# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The executables of ``ros2 run``, and commands, where something that they need is missing."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from focus_planner.cli import executables
from focus_planner.cli import main as cli

NODES = {"planner_node": "node", "lens_adapter": "lens_adapter", "simulated_lens": "simulated_lens"}
BUILD = "colcon build --base-paths src src/focus_planner/msg_defs"


def take_away(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(sys.modules):
        if name.startswith("focus_planner.ros") or name == "focus_planner.demo":
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)


def stand_in(monkeypatch: pytest.MonkeyPatch, module: str, **functions: Any) -> None:
    fake = ModuleType(module)
    vars(fake).update(functions)
    monkeypatch.setitem(sys.modules, module, fake)


def line_of(capsys: pytest.CaptureFixture[str]) -> str:
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err.rstrip("\n")


@pytest.mark.parametrize("program", NODES)
def test_without_the_interfaces_an_executable_names_the_line_to_type(program, monkeypatch, capsys):
    take_away("focus_planner_msgs", monkeypatch)
    assert getattr(executables, program)() == 2
    assert line_of(capsys) == (
        f"{program} needs ROS 2 (rclpy) and focus_planner_msgs: No module named"
        f" 'focus_planner_msgs': in a workspace type `{BUILD}` and `. install/setup.bash`, in a"
        " clone by itself `make setup`"
    )


@pytest.mark.parametrize("command", [*NODES.values(), "demo"])
def test_without_the_interfaces_a_command_names_the_line_to_type(command, monkeypatch, capsys):
    take_away("focus_planner_msgs", monkeypatch)
    assert cli.main([command]) == 2
    line = line_of(capsys)
    assert line.startswith(
        f"focus_planner: error: {command} needs ROS 2 (rclpy) and focus_planner_msgs: "
    )
    assert BUILD in line
    assert "make setup" in line


def test_without_rclpy_they_say_how_to_have_it(monkeypatch, capsys):
    take_away("rclpy", monkeypatch)
    assert executables.planner_node() == 2
    assert "No module named 'rclpy': source ROS 2 (. /opt/ros/jazzy/setup.bash)" in line_of(capsys)


def test_whoever_imports_a_client_is_told_too(monkeypatch):
    take_away("focus_planner_msgs", monkeypatch)
    with pytest.raises(ModuleNotFoundError, match=re.escape(BUILD)) as caught:
        importlib.import_module("focus_planner.ros.client")
    assert caught.value.name == "focus_planner_msgs"


def test_a_folder_of_that_name_is_no_package(monkeypatch, tmp_path):
    (tmp_path / "focus_planner_msgs").mkdir()
    take_away("focus_planner_msgs", monkeypatch)
    monkeypatch.delitem(sys.modules, "focus_planner_msgs")
    monkeypatch.setattr(sys, "path", [str(tmp_path), str(Path(__file__).parents[2])])
    monkeypatch.setattr(sys, "path_importer_cache", {})
    stand_in(monkeypatch, "rclpy")
    sys.modules["rclpy"].__spec__ = importlib.machinery.ModuleSpec("rclpy", None, origin="here")
    with pytest.raises(ModuleNotFoundError, match=re.escape(BUILD)):
        importlib.import_module("focus_planner.ros")


def test_interfaces_of_another_version_are_to_be_built_anew(monkeypatch, capsys):
    def main(arguments, signals):
        raise ImportError(
            "cannot import name 'Note' from 'focus_planner_msgs.msg'", name="focus_planner_msgs.msg"
        )

    stand_in(monkeypatch, "focus_planner.ros.node", main=main)
    assert executables.planner_node() == 2
    assert line_of(capsys) == (
        "planner_node needs ROS 2 (rclpy) and focus_planner_msgs: cannot import name 'Note' from"
        " 'focus_planner_msgs.msg'; build it anew"
    )


def test_another_package_that_is_missing_is_named():
    missing = ModuleNotFoundError("No module named 'numba'", name="numba")
    assert executables.what_is_missing("plan", missing) == (
        "plan needs the Python package numba: install it; in a workspace, all that are needed:"
        " rosdep install --from-paths src src/focus_planner/msg_defs --ignore-src"
    )
    broken = ImportError("libGL.so.1: cannot open shared object file")
    assert executables.what_is_missing("plan", broken) == (
        "plan cannot start: libGL.so.1: cannot open shared object file"
    )


def test_an_executable_ends_as_its_node_does(monkeypatch):
    def main(arguments, signals):
        signals.undo()
        return 1

    for program, module in NODES.items():
        stand_in(monkeypatch, f"focus_planner.ros.{module}", main=main)
        assert getattr(executables, program)() == 1
