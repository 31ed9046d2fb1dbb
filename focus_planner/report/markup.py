# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Text of any origin as part of an HTML page."""

from __future__ import annotations

import re
from html import escape

from focus_planner.core.text import printable

# The space in "47 %", "0.45 m", "303.0 ± 3.5".
_UNIT = re.compile(r"(?<=\d) (?=(?:%|°|±|[mc]?m²?|pixels?|s|hours?)(?![\w/]))|(?<=±) (?=\d)")


def text(value: object) -> str:
    """Return what a value says, printable and escaped: in an element or a quoted attribute."""
    return escape(printable(str(value)))


def prose(value: object) -> str:
    """Return the same for sentences: no line ends between a number and its unit."""
    return _UNIT.sub("\N{NO-BREAK SPACE}", text(value))


def definitions(entries: tuple[tuple[str, object], ...], of: str) -> str:
    """Return names and texts as a list of the class ``of``; nothing for none."""
    if not entries:
        return ""
    lines = (f"<div><dt>{text(name)}</dt><dd>{prose(what)}</dd></div>" for name, what in entries)
    return f'<dl class="{of}">' + "".join(lines) + "</dl>"
