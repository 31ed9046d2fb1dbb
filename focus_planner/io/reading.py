# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far the reading of a file has come, told from where the time is spent.

That is where its bytes are read and where text becomes numbers, which every reader leaves to the
same functions. So the one who waits is named by the context, not by an argument of every reader.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# Shares of the time, as measured: text is read, divided into words, and made numbers; other content
# is read. Then the surface is still to be checked.
_READ, _DIVIDED, _NUMBERS = 0.1, 0.4, 0.85
_READ_OTHER = 0.9


class _Reading:
    """A file that is being read, and whom to tell."""

    def __init__(self, on_progress: Callable[[float], object]) -> None:
        self._on_progress = on_progress
        self._size = 0
        self._is_text = False
        self._divided = self._numbers = 0
        self._told = 0.0

    def bytes_came(self, count: int, size: int, is_text: bool) -> None:
        self._size, self._is_text = size, is_text
        self._tell(0.0, _READ if is_text else _READ_OTHER, count)

    def became_words(self, count: int) -> None:
        if self._is_text:
            self._divided += count
            self._tell(_READ, _DIVIDED, self._divided)

    def became_numbers(self, count: int) -> None:
        if self._is_text:
            self._numbers += count
            self._tell(_DIVIDED, _NUMBERS, self._numbers)

    def _tell(self, low: float, high: float, count: int) -> None:
        share = low + (high - low) * min(count / self._size, 1.0)
        # Some text is divided twice, and a surface may be in several files.
        self._told = max(self._told, share)
        self._on_progress(self._told)


_reading: ContextVar[_Reading | None] = ContextVar("reading", default=None)


@contextmanager
def telling(on_progress: Callable[[float], object]) -> Iterator[None]:
    """Call ``on_progress`` with the share that is read of the file that the block reads.

    It is from 0 to 1, and grows; it may raise, to end the reading.
    """
    token = _reading.set(_Reading(on_progress))
    try:
        yield
    finally:
        _reading.reset(token)


def bytes_came(count: int, size: int, *, is_text: bool) -> None:
    """Tell whom it concerns that so many bytes of a file are read."""
    reading = _reading.get()
    if reading is not None and size > 0:
        reading.bytes_came(count, size, is_text)


def became_words(count: int) -> None:
    """Tell whom it concerns that so many more bytes of a text are divided into words."""
    reading = _reading.get()
    if reading is not None:
        reading.became_words(count)


def became_numbers(count: int) -> None:
    """Tell whom it concerns that so many more bytes of a text have become numbers."""
    reading = _reading.get()
    if reading is not None:
        reading.became_numbers(count)
