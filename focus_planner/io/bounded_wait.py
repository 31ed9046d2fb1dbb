# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading for those who cannot wait: the disk may be another machine's, which never answers."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from focus_planner.core.validation import InputError

T = TypeVar("T")
# Seconds for which a result is kept that came too late.
_KEPT = 60.0


class BoundedWait:
    """Calls functions on a thread of its own, one at a time, and waits a limited time for each.

    What comes too late is kept for a while, and returned when it is asked for again.

    Parameters
    ----------
    seconds : float
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._job: _Job | None = None

    def call(self, argument: str, key: Hashable, read: Callable[[], T]) -> T:
        """Return what ``read()`` returns.

        Parameters
        ----------
        argument : str
            What is read, for errors.
        key : hashable
            Tells whether it is the same as before.
        read : callable

        Raises
        ------
        InputError
            If it does not return in time, or one called before still does not; or that of ``read``.
        """
        if self._job is not None and self._job.is_stale(key):
            self._job = None
        if self._job is None:
            self._job = _Job(key, read)
        if self._job.key != key:
            got = "one that still reads what was named before"
            raise InputError(argument, "a disk that answers", got, "try again later")
        if not self._job.ended.wait(self._seconds):
            raise InputError(
                argument,
                f"a file that can be read within {self._seconds:g} s",
                "no answer of its disk yet",
                "set it again, in case it has answered by then",
            )
        job, self._job = self._job, None
        result: T = job.result()
        return result


class _Job:
    """A call on a thread that nobody waits for at the end of the process."""

    def __init__(self, key: Hashable, read: Callable[[], Any]) -> None:
        self.key, self.ended = key, threading.Event()
        self._read, self._when = read, 0.0
        self._value: Any = None
        self._error: Exception | None = None
        threading.Thread(target=self._run, name="reading", daemon=True).start()

    def is_stale(self, key: Hashable) -> bool:
        """Return whether it has ended, and for something else or long ago."""
        old = time.monotonic() - self._when > _KEPT
        return self.ended.is_set() and (self.key != key or old)

    def result(self) -> Any:
        if self._error is not None:
            raise self._error
        return self._value

    def _run(self) -> None:
        try:
            self._value = self._read()
        except Exception as error:  # noqa: BLE001 - raised where it was called
            self._error = error
        self._when = time.monotonic()
        self.ended.set()
