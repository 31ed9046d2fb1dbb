"""The command line, as a user types it."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from pathlib import Path

from focus_planner.cli.main import main


def focus_planner(*words: str | Path) -> str:
    """Carry out a command, and return what it prints; end if it fails."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        status = main([*map(str, words)])
    if status != 0:
        raise SystemExit(f"figures: focus_planner {' '.join(map(str, words))}: status {status}")
    return printed.getvalue()
