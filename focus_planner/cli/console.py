"""Tables and coloured lines for people."""

from __future__ import annotations

from typing import Any, TextIO

from rich.console import Console
from rich.text import Text

from focus_planner.core.text import printable


class PlainConsole(Console):
    """A console to which strings are text: no markup, no emoji codes, no control characters.

    Parameters
    ----------
    stream : file
    width : int, optional
        Characters; by default that of the terminal.
    """

    def __init__(self, stream: TextIO, width: int | None = None) -> None:
        super().__init__(file=stream, width=width, markup=False, emoji=False, highlight=False)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return what is printable of a string, of which rich makes all that it prints."""
        return super().render_str(printable(text), **options)
