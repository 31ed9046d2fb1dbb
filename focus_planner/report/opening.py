"""Showing a report to whoever asked for it."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path

# Where one of these is set, nobody sits before the screen that a browser would open on.
_ELSEWHERE = ("CI", "SSH_CONNECTION", "SSH_TTY")
_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def open_report(path: Path) -> bool:
    """Open a report in the browser, if the program runs on a terminal beside a screen.

    Returns
    -------
    bool
        Whether a browser was told to open it.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    if any(map(os.environ.get, _ELSEWHERE)) or not any(map(os.environ.get, _SCREENS)):
        return False
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return False
    if type(browser) is webbrowser.GenericBrowser:  # it would take the terminal over
        return False
    return browser.open(path.resolve().as_uri())
