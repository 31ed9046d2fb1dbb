# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Work that is begun in a thread of its own before its result is asked for.

Kernels take one core for small problems, and rays do as long as such work goes on, so another is
free meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, suppress
from threading import Thread
from types import TracebackType
from typing import Generic, TypeVar

from numba import config

from focus_planner.core import kernels

Result = TypeVar("Result")


class Ahead(Generic[Result]):
    """Does some work in a thread of its own, if there is a core for it, while a context lasts.

    Whoever asks for the result does the work if it was not begun, or failed there, whatever the
    reason. So it must do no harm to do it twice.

    Parameters
    ----------
    work : callable
        Returns the result.
    when : bool
        Whether to begin; else it is done when its result is asked for.
    """

    def __init__(self, work: Callable[[], Result], *, when: bool = True) -> None:
        self._work = work
        self._when = when and config.NUMBA_NUM_THREADS > 1
        self._thread: Thread | None = None
        self._results: list[Result] = []
        self._sharing = ExitStack()

    def __enter__(self) -> Ahead[Result]:
        if self._when:
            # One that never starts would keep this, and what the work is on, from being freed.
            thread = Thread(target=self._run, name="ahead")
            with suppress(RuntimeError):  # no memory for a thread
                thread.start()
                self._thread = thread
                self._sharing.enter_context(kernels.one_core())
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.wait()

    def wait(self) -> None:
        """Wait for what was begun, if anything was."""
        if self._thread is not None:
            self._thread.join()
        self._sharing.close()

    def result(self) -> Result:
        """Return the result."""
        self.wait()
        return self._results[0] if self._results else self._work()

    def _run(self) -> None:
        # An error is told by the work of who asks for its result.
        with suppress(Exception), kernels.one_core(), kernels.threads_for(0):
            self._results.append(self._work())
