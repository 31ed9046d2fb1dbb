# PYTHON_ARGCOMPLETE_OK
# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command line: ``focus_planner rig | plan | replay | report | preview | demo``, and more.

Results go to stdout, everything else to stderr. Bad input ends in exit status 2 and one line that
says what was wrong with it.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
from collections.abc import Callable, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any, NoReturn

from focus_planner.cli.executables import run_program, what_is_missing
from focus_planner.cli.interrupts import INTERRUPTED, ctrl_c
from focus_planner.cli.progress import shown
from focus_planner.runtime.cores import share_cores

# Modules of focus_planner.ros: what they do, and their executables.
_NODES = {
    "node": ("run the planner's ROS 2 node", "planner_node"),
    "lens_adapter": ("run the ROS 2 node that sends planned focus to lens drivers", "lens_adapter"),
    "simulated_lens": ("run ROS 2 driver nodes with simulated lenses", "simulated_lens"),
}
# What forks processes and blocks signals as Windows, or anything but Linux, does not.
_ON_LINUX = [[command] for command in (*_NODES, "demo")]
_EPILOG = """\
"focus_planner COMMAND --help" explains a command. For completion in bash and zsh:
  eval "$(register-python-argcomplete focus_planner)"
"""
_BAD_INPUT, _PIPE_CLOSED = 2, 141


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process by default.

    Returns
    -------
    int
        0: done; 1: a replay differs, or a plan was not recorded; 2: bad input, reported in one
        line on stderr; 130: interrupted; 141: the reader of stdout has gone.
    """
    from focus_planner.cli.legible import make_legible

    if argv is None:
        share_cores()
    for stream in (sys.stdout, sys.stderr):
        make_legible(stream)
    given = list(sys.argv[1:] if argv is None else argv)
    if given and given[0] in _NODES and given[1:] not in (["-h"], ["--help"]):
        if sys.platform != "linux":
            return _only_on_linux(given[0])
        return _node(*given)  # which has signals of its own, from here to its end
    try:
        with ctrl_c.deferred():
            return _guarded(given)
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        if argv is None:
            # All that is left is Python's own shutdown, which would print an exception.
            ctrl_c.stop_handling()
            # It would look for garbage among all objects of all libraries, which takes longer than
            # a plan, in memory that the system is about to take back.
            gc.freeze()


def _guarded(argv: list[str]) -> int:
    """Run the command line; report what was wrong with the input."""
    from focus_planner.core.validation import InputError

    try:
        status = _run(argv)
        sys.stdout.flush()
    except InputError as error:
        return _fail(str(error))
    except ImportError as error:
        return _fail(what_is_missing(argv[0] if argv else "focus_planner", error))
    except MemoryError as error:
        return _fail(f"not enough memory; plan on fewer samples ({error})")
    except SystemExit as exit_:  # argparse's, which has reported why
        return exit_.code if isinstance(exit_.code, int) else 0
    except BrokenPipeError:
        # Python flushes stdout once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _PIPE_CLOSED
    return status


def _run(argv: list[str]) -> int:
    asks = argv[1:] in (["-h"], ["--help"])
    if sys.platform != "linux" and argv[:1] in _ON_LINUX and not asks:
        return _only_on_linux(argv[0])
    parser = _parser()
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete

        argcomplete.autocomplete(parser)
    options = parser.parse_args(argv)
    command: Callable[[argparse.Namespace], int] = options.command
    return command(options)


def _fail(message: str) -> int:
    from focus_planner.cli.terminal import show_error

    show_error(message)
    return _BAD_INPUT


# --- commands ----------------------------------------------------------------------------------


def _only_on_linux(command: str) -> int:
    return _fail(
        f"{command} runs on Linux, with ROS 2; this is {sys.platform}, where all commands run that"
        " need no ROS (see focus_planner --help)"
    )


def _node(command: str, *arguments: str) -> int:
    try:
        return run_program(command, list(arguments))
    except ImportError as error:
        return _fail(what_is_missing(command, error))


def _demo(options: argparse.Namespace) -> int:
    with shown(quiet=False) as tell:
        tell("loading the demonstration")
        from focus_planner.cli.compiling import compile_first
        from focus_planner.core.planning.work import ALL
        from focus_planner.demo import run

        compile_first(tell, ALL)  # or its node would, for longer than it is waited for
    with ctrl_c.immediate():
        return run(options.output, ctrl_c.deferred, show=options.open) or 0


# --- options -----------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Reports in one line what is wrong; without a command it prints its help."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)
        self.set_defaults(command=self._print_help, parser=self)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; of what is left the parser of the command complains, and names its own help."""
        options, left = self.parse_known_args(args, namespace)
        if left:
            options.parser.error(f"unrecognized arguments: {' '.join(left)}")
        return options

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; an option that resembles another is told before what is missing without it."""
        if args is not None and "_ARGCOMPLETE" not in os.environ:
            self._check_spelling(args)
        return super().parse_known_args(args, namespace)

    def _check_spelling(self, words: Sequence[str]) -> None:
        from focus_planner.core.text import did_you_mean

        def own(word: str) -> bool:
            # What follows a command is the command's.
            return word != "--" and (self._subparsers is None or word.startswith("-"))

        known = [option for option in self._option_string_actions if option.startswith("--")]
        for word in takewhile(own, words):
            name = word.partition("=")[0]
            if name.startswith("--") and name not in known:
                remedy = did_you_mean(name, known)
                if remedy:
                    self.error(f"unrecognized arguments: {name}; {remedy}")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        from focus_planner.core.text import did_you_mean

        if action.choices is None or value in action.choices:
            return
        names = [str(choice) for choice in action.choices]
        remedy = did_you_mean(str(value), names)
        text = f"invalid choice: {value!r} (choose from {', '.join(names)})"
        raise argparse.ArgumentError(action, f"{text}; {remedy}" if remedy else text)

    def error(self, message: str) -> NoReturn:
        self.exit(_fail(f"{message} (see {self.prog} --help)"))

    def _print_help(self, _: argparse.Namespace) -> int:
        self.print_help()
        return 0


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print("focus_planner", version("focus_planner"))
        except PackageNotFoundError:
            print("focus_planner (not installed)")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    from focus_planner.cli import (
        compiling,
        evaluate,
        masks,
        parameters,
        plan,
        preview,
        publish,
        replay,
        report,
        rig,
        status,
    )

    parser = _Parser(
        prog="focus_planner",
        description="Plan the focus distance of every camera of a multi-view capture rig.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    rig.add(commands)
    plan.add(commands)
    replay.add(commands)
    report.add(commands)
    preview.add(commands)
    masks.add(commands)
    evaluate.add(commands)
    compiling.add(commands)
    _add_nodes(commands)
    publish.add(commands)
    status.add(commands)
    parameters.add(commands)
    _add_demo(commands)
    return parser


def _add_nodes(commands: Any) -> None:
    for command, (what, executable) in _NODES.items():
        commands.add_parser(
            command,
            help=what,
            usage="%(prog)s [--ros-args ...]",
            description=f"{what[0].upper()}{what[1:]}: the same as the executable {executable}."
            " All arguments are passed on to it.",
        )


def _add_demo(commands: Any) -> None:
    demo = commands.add_parser(
        "demo",
        help="plan for a human body through ROS 2, and compare the plan with the baselines",
        description="Start the node, publish a human body and a rig, call the service with every"
        " method, and compare the plans.",
    )
    demo.set_defaults(command=_demo)
    demo.add_argument(
        *("-o", "--output"),
        type=Path,
        default=Path("demo_output"),
        metavar="DIR",
        help="folder for pictures and plans (default: %(default)s)",
    )
    demo.add_argument(
        "--open",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="open the report in the browser, on a terminal beside a screen",
    )
