# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
