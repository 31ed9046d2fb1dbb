# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""One line of a terminal that shows what is being done, and how far it is."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TextIO, final

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from focus_planner.cli.console import PlainConsole
from focus_planner.cli.progress import STOPPING, Shows
from focus_planner.core.progress import Standing, percent, time_spent
from focus_planner.core.text import printable

_PER_SECOND = 10
_BAR, _LEAST_BAR, _SPINNER, _GAP = 24, 8, 2, 2  # cells
# Of the terminal's last cells: it echoes ^C there, and some wrap at the very last. What has wrapped
# is not removed.
_CTRL_C = 3
_LEAST_TEXT = 20  # cells of what is being done, before figures are left out
# Shorter work shows no time.
_LEAST_SECONDS = 1.0


@dataclass(frozen=True)
class _Doing:
    """What is being done.

    Attributes
    ----------
    text : str
    began : float
        When, by the clock.
    figures : tuple of str
        How far it is: share or step, cost, gap.
    share : float or None
        From 0 to 1.
    time_budget : float
        Seconds from ``began``.
    """

    text: str
    began: float
    figures: tuple[str, ...] = ()
    share: float | None = None
    time_budget: float = math.inf


@final
class ProgressLine(Shows):
    """Shows a line while work is done, and removes it afterwards; a context manager.

    Calling it with a phrase shows that; it is a :data:`~focus_planner.cli.progress.Tell`.

    Parameters
    ----------
    stream : file
    before_change : callable, optional
        Called before every change of the line; may raise to end the work.
    clock : callable, optional
        Returns seconds; monotonic.
    width : int, optional
        Characters; by default that of the terminal.
    """

    def __init__(
        self,
        stream: TextIO,
        before_change: Callable[[], object] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
        width: int | None = None,
    ) -> None:
        self._before_change = before_change
        self._clock = clock
        self._doing = _Doing("", clock())
        self._is_stopping = False
        self._when_stopping = STOPPING
        console = PlainConsole(stream, width)
        # Elsewhere, what has no character takes several cells, and the line gets too long.
        self._is_ascii = console.options.ascii_only
        self._spinner = Spinner("line" if self._is_ascii else "dots", style="cyan")
        self._live = Live(self, console=console, refresh_per_second=_PER_SECOND, transient=True)

    def __enter__(self) -> ProgressLine:
        self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._live.stop()

    def __call__(self, text: str) -> None:
        """Show a phrase."""
        self._before_change()
        self._begin(text)

    def show_share(self, what: str, share: float, *figures: str) -> None:
        """Show which share of something is done, from 0 to 1, and figures beside it."""
        self._before_change()
        if what != self._doing.text:
            self._begin(what)
        shown = (_aligned(percent(share)), *figures)
        self._doing = _Doing(what, self._doing.began, shown, min(max(share, 0.0), 1.0))

    def show_standing(self, standing: Standing, prefix: str = "") -> None:
        """Show how far a plan is."""
        self._before_change()
        self._doing = _Doing(
            prefix + standing.doing,
            self._clock() - standing.elapsed,
            tuple(map(_aligned, standing.figures())),
            standing.share,
            standing.time_budget,
        )

    def stopping(self) -> None:
        """Show that the work is about to end; for a handler of signals: it takes no lock."""
        self._is_stopping = True

    def when_stopping(self, text: str = STOPPING) -> None:
        """Set what to show once Ctrl-C was typed."""
        self._when_stopping = text

    def go_on(self) -> None:
        """Show what is being done again, after Ctrl-C was acted on."""
        self._is_stopping = False

    def _begin(self, text: str) -> None:
        self._doing = _Doing(text, self._clock())
        # What is over before the next refresh is seen too.
        self._live.refresh()

    def __rich_console__(self, _: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the line: spinner, what is being done, a bar where there is room, figures, time."""
        doing = _Doing(self._when_stopping, self._clock()) if self._is_stopping else self._doing
        width = options.max_width - _SPINNER - _CTRL_C
        time_ = self._time(doing)
        figures = _fitting(doing, width - _length(time_))
        text = Text(printable(doing.text))
        room = max(width - _length(figures + time_), 1)
        text.truncate(room, overflow="crop" if self._is_ascii else "ellipsis")
        bar = [] if doing.share is None else _bar(doing.share, room - text.cell_len)
        parts: list[tuple[int, RenderableType]] = [
            (_SPINNER, self._spinner),
            (text.cell_len, text),
            *bar,
            *((len(figure) + _GAP, Text(f"{'':{_GAP}}{figure}")) for figure in figures),
            *((len(figure) + _GAP, Text(f"{'':{_GAP}}{figure}", "dim")) for figure in time_),
        ]
        row = Table.grid(padding=0)
        for cells, _part in parts:
            row.add_column(width=cells, no_wrap=True)
        row.add_row(*(part for _cells, part in parts))
        yield row

    def _time(self, doing: _Doing) -> list[str]:
        elapsed = self._clock() - doing.began
        if not doing.text or (elapsed < _LEAST_SECONDS and math.isinf(doing.time_budget)):
            return []
        return [time_spent(elapsed, doing.time_budget)]


def _fitting(doing: _Doing, width: int) -> list[str]:
    """Return the figures that leave room for what they are about: first the step has to go."""
    figures, least = list(doing.figures), min(len(doing.text), _LEAST_TEXT, width // 2)
    while figures and width - _length(figures) < least:
        figures.pop(0 if doing.share is None else -1)
    return figures


def _bar(share: float, room: int) -> list[tuple[int, RenderableType]]:
    """Return a bar and the gap before it, if there is room."""
    cells = min(room - _GAP, _BAR)
    if cells < _LEAST_BAR:
        return []
    return [(_GAP, Text("")), (cells, ProgressBar(total=1.0, completed=share, width=cells))]


def _aligned(figure: str) -> str:
    """Return percent in a width of its own, so that what is beside it stays where it is."""
    return f"{figure:>4}"


def _length(figures: list[str]) -> int:
    return sum(len(figure) + _GAP for figure in figures)
