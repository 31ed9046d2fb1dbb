# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A run that ``focus_planner replay`` was asked for, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.recording.replay import Difference
    from focus_planner.recording.run import Run

REPRODUCED, PLANNED, DIFFERS = "reproduced", "planned", "differs"
UNREADABLE, REFUSED = "unreadable", "refused"
#: Exit statuses.
STATUS = {REPRODUCED: 0, PLANNED: 0, DIFFERS: 1, UNREADABLE: 2, REFUSED: 2}


@dataclass
class ReplayedRun:
    """One run, how it was planned again, and the outcome.

    Attributes
    ----------
    path : Path
    outcome : str
        A key of :data:`STATUS`.
    why : str
        The new message, or why there is no plan.
    run : Run or None
        As recorded.
    now : FocusPlan or None
        The new plan.
    differences : list of Difference
    notes : tuple of str
        What was assumed for the changes.
    recorded_as : Path or None
        The new run's folder.
    again : Run or None
        The run as it was planned here, with its new end.
    """

    path: Path
    outcome: str
    why: str = ""
    run: Run | None = None
    now: FocusPlan | None = None
    differences: list[Difference] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    recorded_as: Path | None = None
    again: Run | None = None

    @property
    def plans(self) -> tuple[FocusPlan | None, FocusPlan | None]:
        """The recorded plan and the new one."""
        ending = self.run.ending if self.run else None
        return ending.plan if ending else None, self.now
