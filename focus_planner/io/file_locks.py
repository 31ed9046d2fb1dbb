# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Locks of files and folders, which tell other processes what is being written.

A lock ends with the process that holds it, however that ends. It binds only those who ask for it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt

    # What is locked there nobody else can read: a byte that no file has.
    _BYTE = 1 << 40

    def _lock(descriptor: int, wait: bool) -> None:
        before = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, _BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
        finally:
            os.lseek(descriptor, before, os.SEEK_SET)

else:
    import fcntl

    def _lock(descriptor: int, wait: bool) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)


def lock_file(file: BinaryIO, *, wait: bool = True) -> None:
    """Lock an open file until it is closed.

    Parameters
    ----------
    file : binary file
    wait : bool
        Whether to wait while another holds the lock: on Windows for ten seconds.

    Raises
    ------
    OSError
        If it cannot be locked: another holds the lock, or its file system has none.
    """
    _lock(file.fileno(), wait)


@contextmanager
def locked_folder(folder: Path, *, wait: bool = True) -> Iterator[bool]:
    """Hold the lock of a folder; yield whether it could be locked.

    Where folders have no locks, as on Windows and some file systems, none is held, and the answer
    is yes. On Windows, an open file keeps its folder from being renamed and deleted.

    Raises
    ------
    OSError
        If the folder cannot be read.
    """
    if sys.platform == "win32":
        next(folder.iterdir(), None)
        yield True
    else:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            yield _could_be_locked(descriptor, wait)
        finally:
            os.close(descriptor)


def _could_be_locked(descriptor: int, wait: bool) -> bool:
    try:
        _lock(descriptor, wait)
    except BlockingIOError:
        return False
    except OSError:  # some file systems have no locks
        return True
    return True
