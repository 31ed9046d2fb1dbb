# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Ctrl-C while a plan is made: the best one so far is what the command goes on with.

Before the solver begins there is no plan to go on with, and Ctrl-C ends the command.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.progress import Shows, Tell

if TYPE_CHECKING:
    from focus_planner.core.progress import Progress, ProgressCallback

#: Begins what is said of a plan that Ctrl-C cut short: the record says it as well.
CUT_SHORT = "stopped by Ctrl-C, the best plan found by then"
_WHOLE = "Ctrl-C came when the plan was made: it is whole"
_STOPPING = "stopping with the best plan so far; Ctrl-C again to stop now"


class BestSoFar:
    """A progress callback that ends planning on Ctrl-C.

    Parameters
    ----------
    tell : callable
        As :func:`~focus_planner.cli.progress.shown` yields it.
    on_progress : ProgressCallback
        Called before; it stops the planner once Ctrl-C was typed.
    """

    def __init__(self, tell: Tell, on_progress: ProgressCallback) -> None:
        self._tell = tell
        self._on_progress = on_progress
        self._has_plan = False
        self._is_cut = False

    def __call__(self, progress: Progress) -> bool:
        """Note a step; return whether to take another."""
        solving = progress.stage == "solving" or progress.cost == progress.cost  # not NaN
        if solving and not self._has_plan and not ctrl_c.typed:
            self._has_plan = True
            if isinstance(self._tell, Shows):
                self._tell.when_stopping(_STOPPING)
        more = self._on_progress(progress)
        self._is_cut = self._is_cut or not more
        return more

    def end(self) -> str:
        """Return what Ctrl-C did to the plan, to be called once it is made; empty if nothing.

        Ctrl-C has been acted on then: the command goes on, and another one ends it at once.

        Raises
        ------
        KeyboardInterrupt
            If Ctrl-C was typed before there was any plan.
        """
        if not self._has_plan:
            ctrl_c.check()
        typed = ctrl_c.take()
        if isinstance(self._tell, Shows):
            self._tell.when_stopping()
            if typed:
                self._tell.go_on()
        if not typed:
            return ""
        return CUT_SHORT if self._is_cut else _WHOLE
