# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a recorded run tells of its plan, for a report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from typing import Any

from focus_planner.core.planning.field_spec import specified_fields
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.parameters.declaration import Value
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.recording.run import Run
from focus_planner.report.assembly import Provenance
from focus_planner.report.steps import steps_of
from focus_planner.runtime.inputs import Arrival


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
    """Return the topics of the surface and the rig that a run was planned on.

    Where these are not the newest, because that was refused, the names say so.
    """
    optics = run.beginning.settings.optics
    return _planned_on(run.surfaces(), optics), _planned_on(run.rigs(), optics)


def _planned_on(arrivals: Sequence[Arrival[Any]], optics: Optics) -> str:
    newest = arrivals[-1] if arrivals else None
    if newest is None or len(arrivals) == 1:
        return newest.topic if newest else ""
    for arrival in reversed(arrivals):
        with suppress(InputError):
            arrival.read(optics)
            if arrival is newest:
                return arrival.topic
            return f"{arrival.topic} (a newer one, on {newest.topic}, was refused)"
    return ""


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
    unlimited = {"images": 0}
    told = (
        (name, "none" if value in {math.inf, unlimited.get(name)} else value)
        for name, value in asked.items()
    )
    return (*told, *others)
