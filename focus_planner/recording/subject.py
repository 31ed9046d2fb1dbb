"""What a recorded run planned: its plan, surface, rig and request."""

from __future__ import annotations

from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.validation import InputError
from focus_planner.recording.replay import feed
from focus_planner.recording.run import Run
from focus_planner.runtime.log import SilentLog
from focus_planner.runtime.planner import Planner


def subject_of(run: Run) -> PlannedSubject:
    """Return the plan of a run and what it was made for, without planning again.

    Raises
    ------
    InputError
        If the run has no plan, or its inputs no longer pass.
    """
    plan = run.ending.plan if run.ending else None
    if plan is None:
        why = run.fault or (run.ending.message if run.ending else "")
        raise InputError(str(run.path), "a run with a plan", f"one without: {why}")
    planner = Planner(SilentLog())
    feed(planner, run)
    surface, rig = planner.surface.in_force, planner.rig.in_force
    if surface is None or rig is None:
        slot = planner.rig if surface else planner.surface
        raise InputError(str(run.path), "a run with valid inputs", str(slot.objection()))
    settings = run.beginning.settings
    return PlannedSubject(surface.value, rig.value, run.beginning.request, plan, settings.model)
