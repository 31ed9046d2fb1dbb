# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The steps of an executor: what one raises is logged, and does not end the others."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType

from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.executors import ExternalShutdownException

from focus_planner.core.text import MAX_REASON, printable
from focus_planner.ros.log import PrintableLogger
from focus_planner.runtime.log import log_exception

# Seconds without a step that worked, after which none will.
_SECONDS_TO_RECOVER = 5.0
# Between attempts of an executor that cannot even wait.
_SECONDS_TO_PAUSE = 0.05
_OURS, _WAITING = "focus_planner.", "_wait_for_ready_callbacks"


class Steps:
    """Has an executor take steps.

    Parameters
    ----------
    get_logger : callable
    fail : callable
        Called, with the reason, when the executor cannot go on: it has no memory, or cannot even
        wait for work. Whatever peers send is not such a reason.

    Attributes
    ----------
    have_failed : bool
        Whether that has been called.
    """

    def __init__(
        self, get_logger: Callable[[], PrintableLogger], fail: Callable[[str], None]
    ) -> None:
        self._get_logger = get_logger
        self._fail = fail
        self.have_failed = False
        self._failing_since: float | None = None

    def take(self, spin_once: Callable[[], None]) -> None:
        """Take a step; log what goes wrong."""
        try:
            spin_once()
        except InvalidHandle:
            pass  # another thread destroyed an entity that the executor was waiting for
        except ExternalShutdownException:
            pass
        except Exception as error:  # noqa: BLE001 - no message and no caller may end the node
            self._note(error)
        else:
            self._failing_since = None

    def _note(self, error: Exception) -> None:
        through = _frames(error.__traceback__)
        is_waiting = any(function == _WAITING for _, function in through)
        told = printable(f"{type(error).__name__}: {error}", MAX_REASON)
        if is_waiting or isinstance(error, MemoryError):
            self._count(told)
            if is_waiting:
                time.sleep(_SECONDS_TO_PAUSE)
        elif any(module.startswith(_OURS) for module, _ in through[1:]):  # the first is this one
            log_exception(self._get_logger())
        else:
            self._get_logger().warning(
                f"could not read what a peer sent, or not answer it: {told}",
                throttle_duration_sec=1.0,
            )

    def _count(self, told: str) -> None:
        """Fail, if the executor has not recovered for long."""
        now = time.monotonic()
        if self._failing_since is None:
            self._failing_since = now
        self._get_logger().error(f"a step failed: {told}", throttle_duration_sec=1.0)
        if not self.have_failed and now - self._failing_since > _SECONDS_TO_RECOVER:
            self.have_failed = True
            self._fail(f"nothing works any more: {told}")


def _frames(traceback: TracebackType | None) -> list[tuple[str, str]]:
    """Return the modules and functions that an exception went through, the outermost first."""
    through = []
    while traceback:
        frame = traceback.tb_frame
        through.append((str(frame.f_globals.get("__name__")), frame.f_code.co_name))
        traceback = traceback.tb_next
    return through
