# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Text for terminals and pipes that lack some characters, such as those of Windows."""

from __future__ import annotations

import codecs
import io
from typing import TextIO

_HANDLER = "focus_planner.legible"
_NEAREST = {
    "−": "-", "–": "-", "±": "+-", "×": "x", "·": "*", "°": " deg", "²": "2", "³": "3",
    "½": "1/2", "µ": "u", "≤": "<=", "≥": ">=", "→": "->", "∞": "inf", "…": "...",
}  # fmt: skip


def make_legible(stream: TextIO) -> None:
    """Let a stream write the nearest of what it has for a character that it lacks.

    Without this, such a character would end the program. Signs and units become words of ASCII,
    all else is escaped as in Python.
    """
    if isinstance(stream, io.TextIOWrapper) and codecs.lookup(stream.encoding).name != "utf-8":
        codecs.register_error(_HANDLER, _nearest)
        stream.reconfigure(errors=_HANDLER)


def _nearest(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(_NEAREST.get(c, ascii(c)[1:-1]) for c in lacking), error.end
