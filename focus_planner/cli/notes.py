"""Notes on the terminal."""

from __future__ import annotations

import sys


def show_note(text: str) -> None:
    """Print a note on stderr; stdout is for results."""
    print("focus_planner: note:", text, file=sys.stderr)
