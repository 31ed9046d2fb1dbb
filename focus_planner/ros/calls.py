# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calls to a planner's services, and waiting for their responses."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, final

from rclpy.client import Client
from rclpy.task import Future

from focus_planner.ros.waiting import wait_for, wait_for_event

# Seconds without a response after which a call is made again.
_AGAIN = 5.0
# Seconds without a server after which it is not expected to respond any more. Discovery may lose
# one that is there for a moment.
_GONE = 10.0


def wait_for_service(
    client: Client, timeout: float, on_wait: Callable[[], object] = lambda: None
) -> None:
    """Wait until a node offers the service of a client.

    Raises
    ------
    TimeoutError
        If none does in time.
    """
    if not wait_for(client.service_is_ready, timeout, on_wait):
        raise TimeoutError(f"no planner offers {client.service_name}; is the node running?")


def result_of(
    future: Future, timeout: float, what: str, on_wait: Callable[[], object] = lambda: None
) -> Any:
    """Wait for a future, and return its result.

    Raises
    ------
    TimeoutError
        If it has none in time.
    """
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    if not wait_for_event(done, timeout, on_wait):
        raise _no_response(what, timeout)
    return future.result()


@final
class WhileOffered:
    """To be called while a response is waited for, which it ends once nobody is left to send one.

    Parameters
    ----------
    is_offered : callable
        Returns whether the service is there.
    what : str
        Its name.
    on_wait : callable
        Called besides.
    """

    def __init__(
        self, is_offered: Callable[[], bool], what: str, on_wait: Callable[[], object]
    ) -> None:
        self._is_offered = is_offered
        self._what = what
        self._on_wait = on_wait
        self._missed_since: float | None = None

    def __call__(self) -> None:
        """Look.

        Raises
        ------
        TimeoutError
            If the service has been away for too long.
        """
        self._on_wait()
        if self._is_offered():
            self._missed_since = None
            return
        now = time.monotonic()
        if self._missed_since is None:
            self._missed_since = now
        if now - self._missed_since > _GONE:
            raise TimeoutError(f"no response from {self._what}: the node has ended, or lost touch")


def call_until_answered(
    client: Client, request: Any, timeout: float, what: str, on_wait: Callable[[], object]
) -> Any:
    """Call a service for which twice is as good as once, and again if no response comes.

    A server's middleware drops the response to a client whose reader it has not discovered within a
    tenth of a second, which on a busy machine may be too soon; the server warns, the client never
    learns of it.

    Raises
    ------
    TimeoutError
        If no response comes in time.
    """
    done, answered = threading.Event(), list[Future]()

    def note(future: Future) -> None:
        answered.append(future)
        done.set()

    end = time.monotonic() + timeout
    while (left := end - time.monotonic()) > 0:
        client.call_async(request).add_done_callback(note)
        if wait_for_event(done, min(_AGAIN, left), on_wait):
            return answered[0].result()
    raise _no_response(what, timeout)


def _no_response(what: str, timeout: float) -> TimeoutError:
    return TimeoutError(f"no response from {what} within {timeout:g} s")
