"""What a planner tells of itself: states, ages, its last run."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any

from focus_planner.core.planning.plan import CameraStatus, FocusPlan
from focus_planner.messages.writing import Fields, datetime_stamp, time_to_fields
from focus_planner.runtime.inputs import Arrival, InputState


def plan_input_to_fields(arrival: Arrival[Any], asked: datetime) -> Fields:
    """Return what an input was, and how old when a plan on it was asked for."""
    return {
        "topic": arrival.topic,
        "received": time_to_fields(datetime_stamp(arrival.at)),
        "stamp": time_to_fields(arrival.stamp),
        "age": (asked - arrival.at).total_seconds(),
    }


@dataclass(frozen=True)
class LastRun:
    """How the last request ended.

    Attributes
    ----------
    plan_id : str
    message : str
        What its caller was told.
    plan : FocusPlan or None
    seconds : float
        From the request to its answer.
    """

    plan_id: str
    message: str
    plan: FocusPlan | None
    seconds: float

    @property
    def blind(self) -> list[str]:
        """The cameras that see nothing."""
        cameras = self.plan.cameras if self.plan else ()
        return [each.name for each in cameras if each.status is CameraStatus.SEES_NOTHING]


def without_problem(plan: FocusPlan) -> FocusPlan:
    """Return a plan without the problem that was solved, which takes much room."""
    return FocusPlan(**{each.name: getattr(plan, each.name) for each in fields(FocusPlan)})


def input_to_fields(state: InputState, now: datetime) -> Fields:
    """Return what there is of an input, and how old it is."""
    received = state.received
    return {
        "topic": state.topic,
        "received": time_to_fields(datetime_stamp(received) if received else (0, 0)),
        "stamp": time_to_fields(state.stamp),
        "age": age_of(state, now),
        "refused": state.refused,
    }


def age_of(state: InputState, now: datetime) -> float:
    """Return how long ago an input was received, seconds; NaN while there is none."""
    return (now - state.received).total_seconds() if state.received else math.nan
