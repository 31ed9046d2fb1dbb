"""Compiling what a command runs, before it runs it, and ``focus_planner warm-up``."""

from __future__ import annotations

import argparse
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

from focus_planner.cli.progress import Tell, show_progress, shown
from focus_planner.cli.terminal import show_note

if TYPE_CHECKING:
    from focus_planner.core.planning.precompile import Compiled, Work

_NOT_KEPT = 1


def compile_first(tell: Tell, works: Collection[Work], place: str = "") -> Compiled:
    """Compile what kinds of work run, unless that has been done, and show it.

    Parameters
    ----------
    tell : callable
        As :func:`focus_planner.cli.progress.shown` yields it.
    works : collection of Work
    place : str
        To stand before what is shown.
    """
    from focus_planner.core.planning.precompile import precompile

    tell(f"{place}loading kernels")
    compiled = precompile(works, show_progress(tell, place))
    if compiled.kernels and compiled.folder is None:
        show_note(str(compiled))
    return compiled


# --- the command ---------------------------------------------------------------------------------


def add(commands: Any) -> None:
    """Add the command."""
    warm_up = commands.add_parser(
        "warm-up",
        help="compile everything now, so that no plan waits for it",
        description="Compile all kernels, and keep them for all processes of this machine, so that"
        " no plan waits for that: for installers and images. Exit status 0: all are compiled; 1:"
        " they cannot be kept.",
    )
    warm_up.set_defaults(command=run)
    warm_up.add_argument(
        "--for",
        dest="purpose",
        default="all",
        choices=("plans", "all"),
        help="plans: what the node runs; all: pictures too, which preview, masks and report show"
        " (default: %(default)s)",
    )
    warm_up.add_argument(
        "--modules", action="store_true", help="print how long the kernels of each module took"
    )
    warm_up.add_argument("--quiet", action="store_true", help="show no progress, print nothing")


def run(options: argparse.Namespace) -> int:
    """Compile; return the exit status."""
    from focus_planner.core.planning.precompile import ALL, PLANS

    with shown(options.quiet) as tell:
        compiled = compile_first(tell, PLANS if options.purpose == "plans" else ALL)
    is_lost = compiled.kernels > 0 and compiled.folder is None
    if not options.quiet and not is_lost:  # which has been said
        print(compiled)
    if not options.quiet and options.modules:
        for module, seconds in sorted(compiled.seconds.items()):
            print(f"{seconds:6.1f} s  {module}")
    return _NOT_KEPT if is_lost else 0
