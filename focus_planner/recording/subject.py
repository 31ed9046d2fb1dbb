# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a recorded run planned: its plan, surface, rig and request."""

from __future__ import annotations

from collections.abc import Callable

from focus_planner.core.planning.subject import PlannedSubject, one_of
from focus_planner.core.validation import InputError
from focus_planner.recording.replay import feed
from focus_planner.recording.run import Run
from focus_planner.runtime.log import SilentLog
from focus_planner.runtime.planner import Planner


def subject_of(
    run: Run, on_preparing: Callable[[float], object] = lambda _: None, name: str | None = None
) -> PlannedSubject:
    """Return the plan of a run and what it was made for, without planning again.

    Of a plan for several subjects, it is what it is worth for one of them.

    Parameters
    ----------
    run : Run
    name : str, optional
        Of one of several subjects; by default the one that costs most.
    on_preparing : callable, optional
        Called with the share that is done, 0 to 1, while the surface is made ready.

    Raises
    ------
    InputError
        If the run has no plan, or its inputs no longer pass, or there is no such subject.
    """
    plan = run.ending.plan if run.ending else None
    if plan is None:
        why = run.fault or (run.ending.message if run.ending else "")
        raise InputError(str(run.path), "a run with a plan", f"one without: {why}")
    planner = Planner(SilentLog(), on_preparing=on_preparing)
    feed(planner, run)
    surface, rig = planner.surface.in_force, planner.rig.in_force
    if surface is None or rig is None:
        slot = planner.rig if surface else planner.surface
        raise InputError(str(run.path), "a run with valid inputs", str(slot.objection()))
    settings = run.beginning.settings
    begun = run.beginning
    planned = PlannedSubject(surface.value, rig.value, begun.request, plan, settings.model)
    if not plan.subjects:
        check_alone(name, str(run.path))
        return planned
    subjects = planner.subjects(begun.subjects)
    if len(subjects) != len(plan.subjects):
        raise InputError(
            str(run.path),
            f"the surfaces of {len(plan.subjects)} subjects",
            f"{len(subjects)} that can be used",
        )
    return one_of(subjects, planned, name)


def check_alone(name: str | None, where: str) -> None:
    """Raise if a subject is named of what was planned for one surface.

    Raises
    ------
    InputError
    """
    if name is not None:
        raise InputError(
            "--subject", "a plan for several surfaces", f"{where}, which is for one", "leave it out"
        )
