"""The command line, which shows every step, however soon the next one follows.

rich shows what there is some ten times a second, and leaves out what is between.
"""

from __future__ import annotations

import sys

from rich.status import Status

from focus_planner.cli.main import main

_update = Status.update


def update_and_show(status, *arguments, **changes):
    _update(status, *arguments, **changes)
    status._live.refresh()


Status.update = update_and_show

sys.exit(main())
