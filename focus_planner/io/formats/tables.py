# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Numbers of text: whole files of them, and tables with as many in every line."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.io.files import BrokenFileError
from focus_planner.io.quoting import word as quoted
from focus_planner.io.reading import became_numbers, became_words

_OLD_NAN = re.compile(rb"[-+]?1\.#(?:QNAN|SNAN|IND|INF)\w*")
_SPACE = re.compile(rb"\s")
_BLOCK = 1 << 24  # bytes at a time: it takes several times as much memory
_LINES = 1 << 18  # at a time


def numbers_of_text(text: bytes) -> FloatArray:
    """Return all the numbers of a text, which are separated by white space.

    Raises
    ------
    BrokenFileError
        If there is anything else in it; names it.
    """
    parts, at = [], 0
    while at < len(text):
        space = _SPACE.search(text, at + _BLOCK)
        end = space.end() if space else len(text)
        parts.append(_numbers_of_text(text if end - at == len(text) else text[at:end]))
        became_numbers(end - at)
        at = end
    return np.concatenate(parts) if parts else np.empty(0)


def _numbers_of_text(text: bytes) -> FloatArray:
    text = with_usual_nan(text)
    if not text.strip():
        return np.empty(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy warns and goes on with a part
            return np.fromstring(text.decode("latin-1"), sep=" ")
    except (ValueError, DeprecationWarning):
        raise BrokenFileError(f"{_first_that_is_no_number(text)} in place of a number") from None


def with_usual_nan(text: bytes) -> bytes:
    """Return a text with ``nan`` for what Microsoft's C library used to print instead."""
    return _OLD_NAN.sub(b"nan", text) if b"#" in text else text


def _first_that_is_no_number(text: bytes) -> str:
    words = (word for word in text.split() if not is_number(word))
    return quoted(next(words, b"").decode("utf-8", "replace"))


def is_number(word: bytes) -> bool:
    """Return whether a word is a number, with a point before its decimals."""
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word  # which only Python allows


def words_per_line(text: bytes) -> NDArray[np.int64]:
    """Return how many words separated by white space each line of a text has."""
    parts, at = [], 0
    while at < len(text):
        end = text.find(b"\n", at + _BLOCK)
        end = len(text) if end < 0 else end + 1
        parts.append(_words_per_line(np.frombuffer(text, np.uint8, end - at, at)))
        became_words(end - at)
        at = end
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)


def _words_per_line(text: NDArray[np.uint8]) -> NDArray[Any]:
    blank = text <= ord(" ")
    starts = ~blank
    starts[1:] &= blank[:-1]
    breaks = np.flatnonzero(text == ord("\n"))
    if not len(breaks) or breaks[-1] != len(text) - 1:
        breaks = np.append(breaks, len(text))
    return np.diff(np.searchsorted(np.flatnonzero(starts), breaks), prepend=0)


def columns_of_lines(lines: Sequence[str], columns: Sequence[int]) -> FloatArray:
    """Return some columns of lines of words, in which only these must be numbers.

    Raises
    ------
    BrokenFileError
        If a line lacks one of them, or has something else there; names it.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of empty input, which is refused as a surface
        try:
            starts = range(0, max(len(lines), 1), _LINES)
            return np.concatenate([_columns(lines[i : i + _LINES], columns) for i in starts])
        except (ValueError, OverflowError):
            raise BrokenFileError(_first_that_is_wrong(lines, columns)) from None


def _columns(lines: Sequence[str], columns: Sequence[int]) -> FloatArray:
    numbers: FloatArray = np.loadtxt(lines, usecols=columns, ndmin=2, comments=None)
    became_numbers(sum(map(len, lines)))
    return numbers


def _first_that_is_wrong(lines: Sequence[str], columns: Sequence[int]) -> str:
    """Return what is wrong with the first line that lacks a number in one of the columns."""
    for row, line in enumerate(lines, 1):
        words = line.split()
        if words and len(words) <= max(columns):
            return f"{len(words)} words in row {row}, of which {max(columns) + 1} are needed"
        for column in columns if words else ():
            if not is_number(words[column].encode()):
                place = f"in place of a number in row {row}, column {column + 1}"
                return f"{quoted(words[column])} {place}"
    return "something else in place of a number"
