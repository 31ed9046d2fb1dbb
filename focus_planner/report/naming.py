"""Where a report can be written."""

from __future__ import annotations

from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import check_writable

_SUFFIX = ".html"


def check_report(path: Path) -> None:
    """Raise unless a report can be written at ``path``; called before the work, not after it.

    Raises
    ------
    InputError
        If its name does not end in ``.html``, or it cannot be written.
    """
    if path.suffix.lower() != _SUFFIX:
        raise InputError(
            str(path), f"a name that ends in {_SUFFIX} for the report", path.suffix or "no ending"
        )
    check_writable(path)
