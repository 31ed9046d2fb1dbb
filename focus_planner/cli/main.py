"""The command line: ``focus_planner rig | plan | replay | parameters | demo``, and nodes.

Results go to stdout, everything else to stderr. Exit status 2 and one line say what was wrong
with the input.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from focus_planner.cli import parameters, plan, replay, rig
from focus_planner.core.validation import InputError

# Modules of focus_planner.ros: what they do, and their executables.
_NODES = {
    "node": ("run the ROS 2 node", "planner_node"),
    "lens_adapter": ("run the node that tells lens drivers what is planned", "lens_adapter"),
    "simulated_lens": ("run driver nodes whose lenses are simulated", "simulated_lens"),
}
_BAD_INPUT, _INTERRUPTED, _PIPE_CLOSED = 2, 130, 141


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        0: done; 1: a replay differs, or a plan was not recorded; 2: bad input, told in one line
        on stderr; 130: interrupted; 141: the reader of stdout has gone.
    """
    try:
        status = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except InputError as error:
        return _fail(str(error))
    except MemoryError as error:
        return _fail(f"not enough memory; plan on fewer samples ({error})")
    except SystemExit as exit_:  # argparse's, which has told why
        return exit_.code if isinstance(exit_.code, int) else 0
    except KeyboardInterrupt:
        return _INTERRUPTED
    except BrokenPipeError:
        # Python flushes stdout once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _PIPE_CLOSED
    return status


def _run(argv: list[str]) -> int:
    if argv and argv[0] in _NODES and argv[1:] not in (["-h"], ["--help"]):
        return _node(*argv)
    options = _parser().parse_args(argv)
    command: Callable[[argparse.Namespace], int] = options.command
    return command(options)


def _fail(message: str) -> int:
    print("focus_planner: error:", " ".join(message.split()), file=sys.stderr)
    return _BAD_INPUT


# --- commands ----------------------------------------------------------------------------------


def _node(command: str, *arguments: str) -> int:
    try:
        module = import_module(f"focus_planner.ros.{command}")
    except ImportError as error:
        return _fail(f"the {command} needs ROS 2 (rclpy) and focus_planner_msgs: {error}")
    return module.main(list(arguments)) or 0


def _demo(options: argparse.Namespace) -> int:
    try:
        from focus_planner.demo import run
    except ImportError as error:
        return _fail(f"the demo needs ROS 2 (rclpy) and focus_planner_msgs: {error}")
    return run(options.output) or 0


# --- options -----------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Says in one line what is wrong."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        self.exit(_fail(f"{message} (see {self.prog} --help)"))


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print("focus_planner", version("focus_planner"))
        except PackageNotFoundError:
            print("focus_planner, not installed")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="focus_planner",
        description="Plan the focus distance of every camera of a multi-view capture rig.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    rig.add(commands)
    plan.add(commands)
    replay.add(commands)
    _add_nodes(commands)
    parameters.add(commands)
    _add_demo(commands)
    return parser


def _add_nodes(commands: Any) -> None:
    for command, (what, executable) in _NODES.items():
        commands.add_parser(
            command,
            help=f"{what}; --ros-args and all that follows go to it",
            usage="%(prog)s [--ros-args ...]",
            description=f"{what[0].upper()}{what[1:]}, the same as {executable}."
            " What follows goes to it.",
        )


def _add_demo(commands: Any) -> None:
    demo = commands.add_parser(
        "demo",
        help="plan for a human body through ROS and show the plan beside the baselines",
        description="Start the node, publish a body and a rig, call the service, and compare the"
        " plan with the baselines.",
    )
    demo.set_defaults(command=_demo)
    demo.add_argument(
        "--output",
        type=Path,
        default=Path("demo_output"),
        metavar="DIR",
        help="where pictures and plans go (demo_output)",
    )
