"""Starting and ending a process of nodes, and declaring their parameters."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args, try_shutdown

from focus_planner.core.validation import InputError
from focus_planner.parameters.declaration import Declaration
from focus_planner.ros.node_parameters import describe

_BAD_INPUT = 2
_BAD = (InputError, NameValidationException, ParameterException, RuntimeError)


def declare(node: Node, declarations: Sequence[Declaration]) -> dict[str, Any]:
    """Declare parameters, and return their values by name.

    Raises
    ------
    rclpy.exceptions.ParameterException
        If a value has the wrong type or is out of range.
    """
    return {
        d.name: node.declare_parameter(d.name, d.default, describe(d)).value for d in declarations
    }


def run(program: str, serve: Callable[[set[signal.Signals]], None], args: list[str] | None) -> int:
    """Run nodes until SIGINT or SIGTERM; return the exit status.

    Parameters
    ----------
    program : str
        Name for error messages.
    serve : callable
        Called with the signals, which are blocked; returns once one has arrived. Errors that it
        raises are printed in one line.
    args : list of str, optional
        ROS arguments; by default those of the process.
    """
    with _blocked(signal.SIGINT, signal.SIGTERM) as signals:
        try:
            _refuse_others(program, args)
            rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
            serve(signals)
        except _BAD as error:
            what = f"{type(error).__name__}: " if isinstance(error, RuntimeError) else ""
            line = " ".join(f"{program}: {what}{error}".split())
            print(line, file=sys.stderr)  # noqa: T201 - no logger yet
            return _BAD_INPUT
        finally:
            try_shutdown()
    return 0


@contextmanager
def spinning(nodes: Sequence[Node]) -> Iterator[None]:
    """Spin nodes on a thread of its own."""
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    thread = threading.Thread(target=executor.spin, name="executor")
    thread.start()
    try:
        yield
    finally:
        executor.shutdown()
        thread.join()


def _refuse_others(program: str, args: list[str] | None) -> None:
    """Refuse arguments that are not for ROS; they are probably meant as parameters."""
    given = list(sys.argv[1:] if args is None else args)
    others = remove_ros_args([program, *given])[1:]
    if others:
        raise InputError(
            "arguments",
            "none but those after --ros-args",
            " ".join(others),
            "give parameters as --ros-args -p name:=value",
        )


@contextmanager
def _blocked(*signals: signal.Signals) -> Iterator[set[signal.Signals]]:
    """Block signals in this thread and all that it starts, so that they can be waited for.

    A handler would run only once the main thread returns from the middleware, and rclpy's own
    handler would end the context before waiting callers are answered.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield set(signals)
    finally:
        # One that came while the nodes were ending asks for nothing new.
        while signal.sigtimedwait(signals, 0):
            pass
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
