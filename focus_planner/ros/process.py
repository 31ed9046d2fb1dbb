# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Starting and ending a process of nodes."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown

from focus_planner.core.text import printable
from focus_planner.core.validation import InputError
from focus_planner.parameters.file import check_parameter_files
from focus_planner.ros.steps import Steps
from focus_planner.runtime.stop_signals import StopSignals

_FAILED, _BAD_INPUT = 1, 2
_BAD = (InputError, NameValidationException, ParameterException, RuntimeError)


class ExecutorFailed(Exception):  # noqa: N818 - named for what happened
    """Nodes could not go on; its text says why."""


def run(
    program: str,
    serve: Callable[[Callable[[], None]], None],
    signals: StopSignals,
    args: list[str] | None,
) -> int:
    """Run nodes until SIGINT or SIGTERM, both of which are ignored then; return the exit status.

    Parameters
    ----------
    program : str
        Name for error messages.
    serve : callable
        Called with a function that waits for one of the signals; returns once one has arrived.
        Errors that it raises are printed in one line. It is not called if one has arrived already.
    signals : StopSignals
    args : list of str, optional
        ROS arguments; by default those of the process.
    """
    try:
        given = list(sys.argv[1:] if args is None else args)
        check_parameter_files(given)
        _refuse_others(program, given)
        if signals.have_arrived:
            return 0
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        serve(signals.wait)
    except _BAD as error:
        what = f"{type(error).__name__}: " if isinstance(error, RuntimeError) else ""
        return _say(f"{program}: {what}{error}", _BAD_INPUT)
    except MemoryError:
        return _say(f"{program}: out of memory", _FAILED)
    except ExecutorFailed as error:
        return _say(f"{program}: {error}", _FAILED)
    finally:
        signals.ignore()
        try_shutdown()
    return 0


@contextmanager
def spinning(nodes: Sequence[Node]) -> Iterator[None]:
    """Spin nodes on a thread of its own; what a callback raises is logged.

    Raises
    ------
    ExecutorFailed
        On leaving, if the nodes could not go on; the process was sent SIGTERM then.
    """
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    ended = threading.Event()
    failed: list[str] = []

    def fail(why: str) -> None:
        failed.append(why)
        os.kill(os.getpid(), signal.SIGTERM)

    def step() -> None:
        try:
            executor.spin_once()
        except Exception:
            if not ended.is_set():  # what is destroyed meanwhile is no fault
                raise

    def spin() -> None:
        steps = Steps(nodes[0].get_logger, fail)
        while not (ended.is_set() or steps.have_failed) and executor.context.ok():
            steps.take(step)

    thread = threading.Thread(target=spin, name="executor")
    thread.start()
    try:
        yield
    finally:
        ended.set()
        executor.shutdown()
        thread.join()
    if failed:
        raise ExecutorFailed(failed[0])


def _say(text: str, status: int) -> int:
    """Say why the process ends, where there may be no logger; return its status."""
    print(printable(" ".join(text.split())), file=sys.stderr)  # noqa: T201
    return status


def _refuse_others(program: str, given: list[str]) -> None:
    """Refuse arguments that are not for ROS; they are probably meant as parameters."""
    others = remove_ros_args([program, *given])[1:]
    if others:
        raise InputError(
            "arguments",
            "none but those after --ros-args",
            " ".join(others),
            "give parameters as --ros-args -p name:=value",
        )
