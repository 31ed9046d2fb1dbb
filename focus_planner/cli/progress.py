# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Showing what a command is doing, and stopping it on Ctrl-C."""

from __future__ import annotations

import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from focus_planner.cli.interrupts import ctrl_c

if TYPE_CHECKING:
    from focus_planner.core.progress import Progress, ProgressCallback, Standing

#: Called with a short phrase before each part of a command.
Tell = Callable[[str], None]

#: What is shown once Ctrl-C was typed, where it ends the command.
STOPPING = "stopping; Ctrl-C again to stop now"

_SHOW_CURSOR = b"\x1b[?25h"
_LARGE_FILE = 10_000_000  # bytes; reading a smaller one takes less than a second


class Shows(ABC):
    """A :data:`Tell` that can show more than a phrase."""

    @abstractmethod
    def __call__(self, text: str) -> None:
        """Show a phrase."""

    @abstractmethod
    def show_share(self, what: str, share: float, *figures: str) -> None:
        """Show which share of something is done, from 0 to 1, and figures beside it."""

    @abstractmethod
    def show_standing(self, standing: Standing, prefix: str = "") -> None:
        """Show how far a plan is."""

    @abstractmethod
    def when_stopping(self, text: str = STOPPING) -> None:
        """Set what to show once Ctrl-C was typed."""

    @abstractmethod
    def go_on(self) -> None:
        """Show what is being done again, after Ctrl-C was acted on."""


@contextmanager
def shown(quiet: bool) -> Iterator[Tell]:
    """Show on a terminal what is being done; yield the function to call before each part.

    That function, and the end of the block, raise ``KeyboardInterrupt`` once Ctrl-C was typed.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _: ctrl_c.check()
        ctrl_c.check()
        return
    from focus_planner.cli.progress_line import ProgressLine

    def notify() -> None:
        # The next Ctrl-C ends the process before it can.
        os.write(sys.stderr.fileno(), _SHOW_CURSOR)
        line.stopping()

    with ProgressLine(sys.stderr, before_change=ctrl_c.check) as line, ctrl_c.notifying(notify):
        yield line
        ctrl_c.check()


def show_progress(
    tell: Tell, prefix: str = "", time_budget: float | None = None
) -> ProgressCallback:
    """Return a callback that shows every step, and stops the planner once Ctrl-C was typed.

    Parameters
    ----------
    tell : callable
        As :func:`shown` yields it.
    prefix : str
        To stand before what the planner is doing.
    time_budget : float, optional
        Of the plan, which begins now, seconds.
    """
    from focus_planner.core.progress import Tracker

    tracker = Tracker() if time_budget is None else Tracker(time_budget)

    def on_progress(progress: Progress) -> bool:
        if ctrl_c.typed:
            if not progress.is_part_of_a_plan:
                ctrl_c.check()  # there is no plan yet that could be returned
            return False
        standing = tracker.note(progress)
        if isinstance(tell, Shows):
            tell.show_standing(standing, prefix)
        else:
            tell(f"{prefix}{standing}")
        return True

    return on_progress


def show_share(tell: Tell, what: str) -> Callable[[float], None]:
    """Return a callback that shows which share of something is done, from 0 to 1, in percent."""
    from focus_planner.core.progress import percent

    if isinstance(tell, Shows):
        return partial(tell.show_share, what)
    return lambda share: tell(f"{what}: {percent(share)}")


def show_reading(tell: Tell, path: Path) -> Callable[[float], None]:
    """Say that a file is being read, and return a callback that shows which share of it is."""
    what = f"reading {path}"
    tell(what)
    try:
        size = path.stat().st_size
    except (OSError, ValueError):  # told by who reads it
        size = 0
    return show_share(tell, what if size < _LARGE_FILE else f"{what}, {size / 1e6:,.0f} MB")
