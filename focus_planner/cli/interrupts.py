# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Ctrl-C, acted on where it does no harm.

Python raises ``KeyboardInterrupt`` wherever the main thread happens to be. That may be a callback
of a C library or a finalizer, such as LLVM's while a kernel is compiled or loaded, and there Python
prints the exception and drops it. A command therefore notes Ctrl-C and stops at its next check.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

#: Exit status of a command that Ctrl-C ended, as a shell has it.
INTERRUPTED = 130


class CtrlC:
    """Whether Ctrl-C was typed, and what it does.

    Attributes
    ----------
    typed : bool
        Whether it was typed and not yet acted on.
    """

    def __init__(self) -> None:
        self.typed = False
        self._notify: Callable[[], object] | None = None

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Note Ctrl-C within the block, for :meth:`check` and for the end of the block to raise.

        Typed once more, it ends the process at once.

        Raises
        ------
        KeyboardInterrupt
            At the end of the block, if Ctrl-C was typed.
        """
        with _handler(self._note):
            try:
                yield
                self.check()
            finally:
                self.typed = False

    @contextmanager
    def immediate(self) -> Iterator[None]:
        """Let Ctrl-C raise at once within the block, which waits for something."""
        with _handler(signal.default_int_handler):
            self.check()
            yield

    @contextmanager
    def notifying(self, notify: Callable[[], object]) -> Iterator[None]:
        """Call ``notify`` if Ctrl-C is typed within the block; it must not block or raise."""
        self._notify = notify
        try:
            yield
        finally:
            self._notify = None

    def check(self) -> None:
        """Raise ``KeyboardInterrupt`` if Ctrl-C was typed."""
        if self.typed:
            raise KeyboardInterrupt

    def take(self) -> bool:
        """Return whether Ctrl-C was typed, and take it as acted on: the command goes on.

        Typed once more, it still ends the process at once.
        """
        typed, self.typed = self.typed, False
        return typed

    @staticmethod
    def stop_handling() -> None:
        """Let Ctrl-C end the process from now on, without an exception."""
        if _handled_here():
            signal.signal(signal.SIGINT, signal.SIG_DFL)

    def _note(self, *_: object) -> None:
        self.typed = True
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        if self._notify is not None:
            self._notify()


@contextmanager
def _handler(handle: Callable[..., Any]) -> Iterator[None]:
    """Handle SIGINT within the block."""
    if not _handled_here():
        yield
        return
    before = signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _handled_here() -> bool:
    """Return whether SIGINT can be handled, and is not ignored, as in the background of a shell."""
    in_main = threading.current_thread() is threading.main_thread()
    return in_main and signal.getsignal(signal.SIGINT) != signal.SIG_IGN


#: That of this process.
ctrl_c = CtrlC()
