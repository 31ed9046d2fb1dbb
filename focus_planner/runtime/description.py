"""What a record says of a plan besides the plan itself."""

from __future__ import annotations

from focus_planner.core.planning.fingerprint import fingerprints
from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.rig.rig import Rig
from focus_planner.messages.markers import markers_to_fields
from focus_planner.messages.typestore import MARKERS, serialize
from focus_planner.messages.writing import Stamp
from focus_planner.runtime.planning_orders import Description


def describe_plan(plan: SolvedPlan, rig: Rig, markers_stamp: Stamp | None) -> Description:
    """Return the description of a plan for this rig.

    Parameters
    ----------
    plan : SolvedPlan
    rig : Rig
    markers_stamp : tuple of int or None
        The stamp of its markers, seconds and nanoseconds; None to leave them out.
    """
    markers = None
    if markers_stamp is not None:
        markers = serialize(MARKERS, markers_to_fields(plan, rig, markers_stamp))
    return Description(fingerprints(plan), markers)
