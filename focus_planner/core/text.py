# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Text from elsewhere, made fit for a line of a log or of a terminal."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice

#: Characters of a line, unless its reader says otherwise.
MAX_LINE = 4000
#: Characters of a name or reason within a line.
MAX_REASON = 400

_GAP = " … "
# Looking for the likeliest of more names takes too long for an answer.
_MAX_SIMILAR = 10_000
_LINE_BREAK = re.compile(r"\s*[\r\n]\s*")


def printable(text: str, limit: int = MAX_LINE) -> str:
    r"""Return a text as one line that shows what is in it, and does nothing else.

    Names and reasons come from files, messages and drivers. Written as they are, they could move a
    terminal's cursor, forge lines of a log, or turn the order of what follows.

    Parameters
    ----------
    text : str
    limit : int, optional
        Longest result, characters. A longer text keeps its beginning and its end.

    Returns
    -------
    str
        Line breaks are spaces. Whatever else does not print is escaped as in Python: control
        characters (``\x1b``), marks of direction and other invisible ones (``\u202e``), what is no
        character at all (``\udc80``, an undecodable byte of a file's name).
    """
    line = _LINE_BREAK.sub(" ", _cut(text, limit))
    if not line.isprintable():
        line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)
    return _cut(line, limit)


def how_many(cameras: int, of: int) -> str:
    """Return how many of a rig's cameras something holds for: ``"3 of 24 cameras"``."""
    return "the only camera" if cameras == of == 1 else f"{cameras} of {of} cameras"


def sentence(text: str) -> str:
    """Return a phrase as a sentence, with a capital and a full stop; "" stays so."""
    return f"{text[0].upper()}{text[1:]}." if text else ""


def did_you_mean(name: str, known: Iterable[str], most: int = 1) -> str:
    """Return "did you mean X?" for a name that resembles a known one, else "".

    Parameters
    ----------
    name : str
        Neither case, nor whether words are joined by hyphens or underscores, makes a difference.
    known : iterable of str
    most : int, optional
        Names to suggest at most: "did you mean X or Y?"
    """
    folded = {_folded(each): each for each in islice(known, _MAX_SIMILAR)}
    close = get_close_matches(_folded(name), folded, n=most)
    return f"did you mean {' or '.join(folded[each] for each in close)}?" if close else ""


def _folded(name: str) -> str:
    return name.casefold().removeprefix("--").replace("-", "_")


def _cut(text: str, limit: int) -> str:
    """Return the text, without its middle if it is too long."""
    if len(text) <= limit:
        return text
    half = (limit - len(_GAP)) // 2
    return f"{text[:half]}{_GAP}{text[-half:]}"
