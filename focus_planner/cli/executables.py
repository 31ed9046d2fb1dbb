# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The executables of ``ros2 run``: they say in one line what they miss, and end with status 2."""

from __future__ import annotations

import sys
from importlib import import_module

from focus_planner.core.text import printable
from focus_planner.runtime.stop_signals import StopSignals

_BAD_INPUT = 2
_ROS = ("rclpy", "focus_planner_msgs")


def planner_node() -> int:
    """Run the planner's node; return the exit status."""
    return _run("planner_node", "node")


def lens_adapter() -> int:
    """Run the node that sends planned focus to lens drivers; return the exit status."""
    return _run("lens_adapter", "lens_adapter")


def simulated_lens() -> int:
    """Run driver nodes with simulated lenses; return the exit status."""
    return _run("simulated_lens", "simulated_lens")


def what_is_missing(program: str, error: ImportError) -> str:
    """Say in one line what a program needs, and what to type to have it.

    Parameters
    ----------
    program : str
    error : ImportError
        What importing the program ended with.
    """
    package = (error.name or "").partition(".")[0]
    if package in _ROS:
        anew = "" if isinstance(error, ModuleNotFoundError) else "; build it anew"
        return f"{program} needs ROS 2 (rclpy) and focus_planner_msgs: {error}{anew}"
    if isinstance(error, ModuleNotFoundError) and package:
        return (
            f"{program} needs the Python package {package}: install it; in a workspace, all that"
            " are needed: rosdep install --from-paths src src/focus_planner/msg_defs --ignore-src"
        )
    return f"{program} cannot start: {error}"


def run_program(module: str, arguments: list[str] | None = None) -> int:
    """Run a program of ``focus_planner.ros``, which is stopped by signals from here on.

    Parameters
    ----------
    module : str
        Its name there.
    arguments : list of str, optional
        By default those of the process.

    Raises
    ------
    ImportError
        If something that it needs is missing.
    """
    signals = StopSignals()
    try:
        status: int | None = import_module(f"focus_planner.ros.{module}").main(arguments, signals)
    except ImportError:
        signals.undo()
        raise
    return status or 0


def _run(program: str, module: str) -> int:
    try:
        return run_program(module)
    except ImportError as error:
        line = " ".join(what_is_missing(program, error).split())
        print(printable(line), file=sys.stderr)
        return _BAD_INPUT
