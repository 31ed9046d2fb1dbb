"""Text of any origin as part of an HTML page."""

from __future__ import annotations

from html import escape

from focus_planner.core.text import printable


def text(value: object) -> str:
    """Return what a value says, printable and escaped: in an element or a quoted attribute."""
    return escape(printable(str(value)))


def definitions(entries: tuple[tuple[str, object], ...], of: str) -> str:
    """Return names and texts as a list of the class ``of``; nothing for none."""
    if not entries:
        return ""
    lines = (f"<div><dt>{text(name)}</dt><dd>{text(what)}</dd></div>" for name, what in entries)
    return f'<dl class="{of}">' + "".join(lines) + "</dl>"
