"""What a recorded run tells of its plan, for a report."""

from __future__ import annotations

import math
from collections.abc import Iterable
from datetime import datetime
from typing import Any

from focus_planner.core.planning.field_spec import specified_fields
from focus_planner.core.planning.request import PlanRequest
from focus_planner.parameters.declaration import Value
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.recording.run import Run
from focus_planner.report.assembly import Provenance
from focus_planner.report.steps import steps_of


def provenance_of(run: Run) -> Provenance:
    """Return what a run tells of its plan; surface and rig are called by their topics."""
    beginning = run.beginning
    surface, rig = input_names(run)
    return Provenance(
        surface=surface,
        rig=rig,
        planned=datetime.fromtimestamp(beginning.at / 1e9).astimezone(),
        run=beginning.run_id,
        steps=steps_of(run.progress, run.elapsed),
        parameters=parameters_of(beginning.request, beginning.settings.values),
        software=tuple(beginning.software.items()),
    )


def input_names(run: Run) -> tuple[str, str]:
    """Return the topics of a run's newest surface and rig."""
    topics = [message.topic for message in reversed(run.inputs)]
    surface, rig = (
        next((topic for topic in topics if topic.endswith(ends)), "")
        for ends in (("/mesh", "/cloud"), ("/rig", "/camera_poses"))
    )
    return surface, rig


def parameters_of(
    request: PlanRequest, values: Iterable[tuple[str, Value]] = ()
) -> tuple[tuple[str, Any], ...]:
    """Return what was asked for, and those parameters beside it that make the plan what it is.

    Of the latter, only those that are not at their defaults; limits, which it kept to, do not
    change it.
    """
    asked = {each.name: getattr(request, each.name) for each in specified_fields(type(request))}
    given = dict(values)
    others = (
        (each.name, given[each.name])
        for each in DECLARATIONS
        if each.plans and not each.name.startswith("max_") and each.name not in asked
        if given.get(each.name, each.default) != each.default
    )
    told = ((name, "none" if value == math.inf else value) for name, value in asked.items())
    return (*told, *others)
