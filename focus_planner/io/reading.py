"""How far the reading of a file has come, told from where the time is spent.

That is where its bytes are read and where text becomes numbers, which every reader leaves to the
same functions. So the one who waits is named by the context, not by an argument of every reader.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

# Of text, the share of the time that it takes to read its bytes; the rest makes numbers of them.
_OF_TEXT = 0.1
# What is then still to do, such as checking the surface.
_REST = 0.1


class _Reading:
    """A file that is being read, and whom to tell."""

    def __init__(self, on_progress: Callable[[float], object]) -> None:
        self._on_progress = on_progress
        self._size = 0
        self._is_text = False
        self._numbers = 0
        self._told = 0.0

    def bytes_came(self, count: int, size: int, is_text: bool) -> None:
        self._size, self._is_text = size, is_text
        self._tell(count / size * (_OF_TEXT if is_text else 1.0))

    def became_numbers(self, count: int) -> None:
        if self._is_text:
            self._numbers += count
            self._tell(_OF_TEXT + (1 - _OF_TEXT) * self._numbers / self._size)

    def _tell(self, share: float) -> None:
        # Some text is read twice, and a surface may be in several files.
        self._told = max(self._told, min(share, 1.0) * (1 - _REST))
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


def became_numbers(count: int) -> None:
    """Tell whom it concerns that so many more bytes of a text have become numbers."""
    reading = _reading.get()
    if reading is not None:
        reading.became_numbers(count)
