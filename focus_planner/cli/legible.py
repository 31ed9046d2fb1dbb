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
