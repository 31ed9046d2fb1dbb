# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compiling what a command runs, before it runs it, and ``focus_planner warm-up``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

from focus_planner.cli.progress import Tell, show_progress, shown
from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import check_whole

if TYPE_CHECKING:
    from focus_planner.core.planning.precompile import Compiled
    from focus_planner.core.planning.work import Work

_NOT_KEPT = 1
# Of a log, for who wonders whether an installation still goes on.
_SECONDS_BETWEEN_LINES = 10.0


def compile_first(
    tell: Tell, works: Collection[Work], place: str = "", processes: int = 1
) -> Compiled:
    """Compile what kinds of work run, unless that has been done, and show it.

    Parameters
    ----------
    tell : callable
        As :func:`focus_planner.cli.progress.shown` yields it.
    works : collection of Work
    place : str
        To stand before what is shown.
    processes : int
        How many compile at once.
    """
    from focus_planner.core.planning.precompile_processes import precompile_in_processes

    tell(f"{place}loading kernels")
    compiled = precompile_in_processes(works, show_progress(tell, place), processes)
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
    warm_up.add_argument(
        "--jobs",
        type=int,
        metavar="N",
        help="how many processes compile at once, each with about 1 GB of memory (default: one per"
        " core, but no more than 4)",
    )
    warm_up.add_argument("--quiet", action="store_true", help="show no progress, print nothing")


def run(options: argparse.Namespace) -> int:
    """Compile; return the exit status."""
    from focus_planner.core.planning.precompile_processes import useful_processes
    from focus_planner.core.planning.work import ALL, PLANS

    jobs = useful_processes()
    if options.jobs is not None:
        jobs = check_whole("--jobs", options.jobs, 1)
    with shown(options.quiet) as tell:
        is_log = not options.quiet and not sys.stderr.isatty()
        works = PLANS if options.purpose == "plans" else ALL
        compiled = compile_first(_now_and_then(tell) if is_log else tell, works, processes=jobs)
    is_lost = compiled.kernels > 0 and compiled.folder is None
    if not options.quiet and not is_lost:  # which has been said
        print(compiled)
    if not options.quiet and options.modules:
        for module, seconds in sorted(compiled.seconds.items()):
            print(f"{seconds:6.1f} s  {module}")
    return _NOT_KEPT if is_lost else 0


def _now_and_then(tell: Tell) -> Tell:
    """Return a callback that also prints what it is told, unless it has just done so."""
    due = time.monotonic()

    def say(text: str) -> None:
        nonlocal due
        tell(text)
        if time.monotonic() >= due:
            due = time.monotonic() + _SECONDS_BETWEEN_LINES
            print("focus_planner:", text, file=sys.stderr, flush=True)

    return say
