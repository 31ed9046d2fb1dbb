# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""SIGINT and SIGTERM of a process of nodes: noted from its first line on, ignored once it stops.

Imports nothing that takes long: a program calls it before it imports anything that does.
"""

from __future__ import annotations

import faulthandler
import os
import signal

_NUMBERS = (signal.SIGINT, signal.SIGTERM)
# Many times what it takes to end on a busy machine.
_SECONDS_TO_END = 60.0


class StopSignals:
    """Notes SIGINT and SIGTERM instead of acting on them, from when it is made.

    To be made by the main thread, before this process has others. Signals are blocked in it and in
    all threads that it starts: no call of the middleware and no import is interrupted, and rclpy's
    own handler would end the context before waiting callers are answered. Threads that are there
    already still receive them while the main thread is not waiting, so it waits for what the
    handler writes, in whichever thread that ran.
    """

    def __init__(self) -> None:
        self._noted, self._note = os.pipe()
        os.set_blocking(self._note, False)
        self._mask = signal.pthread_sigmask(signal.SIG_BLOCK, _NUMBERS)
        self._has_arrived = False
        self._handlers = {each: signal.signal(each, self._arrive) for each in _NUMBERS}
        self._wakeup = signal.set_wakeup_fd(self._note, warn_on_full_buffer=False)

    @property
    def have_arrived(self) -> bool:
        """Whether one has been sent to this process, so that :meth:`wait` returns at once."""
        # Kept, as another thread may take it from there before its handler has run.
        self._has_arrived |= not signal.sigpending().isdisjoint(_NUMBERS)
        return self._has_arrived

    def wait(self) -> None:
        """Wait for a signal; from then on the process is stopping, and ignores further ones."""
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _NUMBERS)
        while os.read(self._noted, 1)[0] not in _NUMBERS:
            pass
        self.ignore()
        _end_in_any_case()

    def ignore(self) -> None:
        """Ignore the signals until the process has ended.

        Not only their handlers but the process itself ignores them: Python gives up its handlers
        before it has ended, and a signal would then change the exit status.
        """
        # Or one that arrives in between would find no handler, of which Python warns.
        signal.pthread_sigmask(signal.SIG_BLOCK, _NUMBERS)
        for each in _NUMBERS:
            signal.signal(each, signal.SIG_IGN)

    def undo(self) -> None:
        """Let signals act as they did before, in a process that does not end with its nodes."""
        faulthandler.cancel_dump_traceback_later()
        signal.pthread_sigmask(signal.SIG_SETMASK, self._mask)
        signal.set_wakeup_fd(self._wakeup)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        os.close(self._note)
        os.close(self._noted)

    def _arrive(self, *_: object) -> None:
        self._has_arrived = True


def _end_in_any_case() -> None:
    """Have this process end, with status 1, if it has not ended by itself after a while.

    Fast DDS can wait for itself for ever when a participant is deleted while another one ends, and
    holds Python's lock meanwhile: nothing but a thread of C can end the process then.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)  # for as long as this process lives
    faulthandler.dump_traceback_later(_SECONDS_TO_END, exit=True, file=nowhere)
