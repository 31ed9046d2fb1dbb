"""Showing what is being done, and ending it when the user says so."""

from __future__ import annotations

import math
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from focus_planner.core.solvers import Progress

Tell = Callable[[str], None]


@contextmanager
def shown(quiet: bool) -> Iterator[Tell]:
    """Show a person what is being done; yield what to tell it with."""
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status("") as status:
        yield status.update


class Interruptible:
    """A watch that tells of every step, and ends the planner when the user types Ctrl-C.

    Parameters
    ----------
    tell : callable
    before : str
        What to say before every step.
    """

    def __init__(self, tell: Tell, before: str = "") -> None:
        self._tell = tell
        self._before = before
        self._interrupted = False
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, self._interrupt)

    def __call__(self, progress: Progress) -> bool:
        """Tell of a step; return whether to go on."""
        step = f"{progress.stage}: step {progress.iteration}"
        cost = "" if math.isnan(progress.cost) else f", cost {progress.cost:.2f}"
        self._tell(f"{self._before}{step}{cost}")
        return not self._interrupted

    def check(self) -> None:
        """Raise ``KeyboardInterrupt`` if there was one: a library may have swallowed it."""
        if self._interrupted:
            raise KeyboardInterrupt

    def _interrupt(self, signum: int, frame: Any) -> None:
        self._interrupted = True
        signal.default_int_handler(signum, frame)
