# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
