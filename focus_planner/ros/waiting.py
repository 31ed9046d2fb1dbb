# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Waiting in steps, so that whoever waits can be interrupted."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

# Seconds: what nobody notices.
_STEP = 0.02
_EVENT_STEP = 0.1


def wait_for(condition: Callable[[], bool], timeout: float, on_wait: Callable[[], object]) -> bool:
    """Wait until a condition holds; return whether it did in time.

    Parameters
    ----------
    condition : callable
    timeout : float
        Seconds.
    on_wait : callable
        Called between two looks at the condition; what it raises ends the wait.
    """
    end = time.monotonic() + timeout
    while not condition():
        on_wait()
        if time.monotonic() >= end:
            return False
        time.sleep(_STEP)
    return True


def wait_for_event(event: threading.Event, timeout: float, on_wait: Callable[[], object]) -> bool:
    """Wait for an event, as :func:`wait_for` waits for a condition, and wake up with it."""
    end = time.monotonic() + timeout
    while not event.wait(min(_EVENT_STEP, max(end - time.monotonic(), 0.0))):
        on_wait()
        if time.monotonic() >= end:
            return False
    return True
