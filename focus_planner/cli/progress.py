"""Showing what a command is doing, and stopping it on Ctrl-C."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from focus_planner.cli.interrupts import ctrl_c

if TYPE_CHECKING:
    from focus_planner.core.progress import Progress, ProgressCallback

#: Called with a short phrase before each part of a command.
Tell = Callable[[str], None]

_SHOW_CURSOR = b"\x1b[?25h"


@contextmanager
def shown(quiet: bool) -> Iterator[Tell]:
    """Show on a terminal what is being done; yield the function to call before each part.

    That function, and the end of the block, raise ``KeyboardInterrupt`` once Ctrl-C was typed.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _: ctrl_c.check()
        ctrl_c.check()
        return
    from rich.text import Text

    from focus_planner.cli.console import PlainConsole
    from focus_planner.core.text import printable

    def tell(text: str) -> None:
        ctrl_c.check()
        status.update(Text(printable(text)))

    def notify() -> None:
        # The next Ctrl-C ends the process before it can.
        os.write(sys.stderr.fileno(), _SHOW_CURSOR)
        status.update("stopping; Ctrl-C again to stop at once")

    with PlainConsole(sys.stderr).status("") as status, ctrl_c.notifying(notify):
        yield tell
        ctrl_c.check()


def show_progress(tell: Tell, prefix: str = "") -> ProgressCallback:
    """Return a callback that shows every step, and stops the planner once Ctrl-C was typed."""

    def on_progress(progress: Progress) -> bool:
        if ctrl_c.typed:
            return False
        cost = "" if math.isnan(progress.cost) else f", cost {progress.cost:.2f}"
        tell(f"{prefix}{progress.stage}: step {progress.iteration}{cost}")
        return True

    return on_progress


def show_share(tell: Tell, what: str) -> Callable[[float], None]:
    """Return a callback that shows which share of something is done, from 0 to 1, in percent."""
    return lambda share: tell(f"{what}: {share:.0%}")
