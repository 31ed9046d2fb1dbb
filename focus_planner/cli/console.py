# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
