"""Opening files that anyone may have put into a folder of runs."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from focus_planner.core.validation import InputError

_WITHOUT_WAITING = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC


@contextmanager
def open_regular(path: Path, max_bytes: int) -> Iterator[BinaryIO]:
    """Open a regular file to read.

    Raises
    ------
    InputError
        If there is none, it cannot be read, it is of another kind (opening a FIFO would wait for a
        writer for ever), or it has more than so many bytes.
    """
    try:
        descriptor = os.open(path, _WITHOUT_WAITING)
    except OSError as error:
        raise _unreadable(path, error) from None
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        os.close(descriptor)
        raise InputError(str(path), "a regular file", "something else")
    with os.fdopen(descriptor, "rb") as file:
        if status.st_size > max_bytes:
            raise InputError(
                str(path), f"at most {max_bytes:,} bytes", f"a file of {status.st_size:,}"
            )
        try:
            yield file
        except OSError as error:
            raise _unreadable(path, error) from None


def _unreadable(path: Path, error: OSError) -> InputError:
    return InputError(str(path), "a file that can be read", error.strerror or str(error))
