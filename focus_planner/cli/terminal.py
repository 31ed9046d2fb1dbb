"""Lines on stderr; stdout is for results.

What is in them may come from files and peers: each is one line, printable and cut.
"""

from __future__ import annotations

import sys

from focus_planner.core.text import printable


def show_note(text: str) -> None:
    """Print a note."""
    print("focus_planner: note:", printable(text), file=sys.stderr)


def show_error(text: str) -> None:
    """Print an error."""
    print("focus_planner: error:", printable(" ".join(text.split())), file=sys.stderr)
