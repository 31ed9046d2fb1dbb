# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a planner reports of itself: its state, its inputs and their ages, its last run."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any

from focus_planner.core.planning.plan import CameraStatus, FocusPlan
from focus_planner.messages.writing import Fields, datetime_stamp, time_to_fields
from focus_planner.runtime.inputs import Arrival, InputState
from focus_planner.runtime.replanning import Replanned

_NO_SURFACE, _NO_RIG = InputState("surface"), InputState("rig")
_NONE_REPLANNED = Replanned()


@dataclass(frozen=True)
class LastRun:
    """How the last request ended.

    Attributes
    ----------
    plan_id : str
    message : str
        The answer to its caller.
    plan : FocusPlan or None
    seconds : float
        From the request to its answer.
    """

    plan_id: str
    message: str
    plan: FocusPlan | None
    seconds: float

    @property
    def cameras_seeing_nothing(self) -> list[str]:
        """Their names."""
        cameras = self.plan.cameras if self.plan else ()
        return [each.name for each in cameras if each.status is CameraStatus.SEES_NOTHING]


@dataclass(frozen=True)
class Snapshot:
    """The inputs and the last run, as of one moment.

    Attributes
    ----------
    surface, rig : InputState
        The newest.
    last_run : LastRun or None
    surfaces : tuple of InputState
        All that are planned for together, the oldest first.
    """

    surface: InputState = _NO_SURFACE
    rig: InputState = _NO_RIG
    last_run: LastRun | None = None
    surfaces: tuple[InputState, ...] = ()


@dataclass(frozen=True)
class LensSummary:
    """What is known of the lenses of the plan in force.

    Attributes
    ----------
    counts : Counter
        How many lenses are in which :class:`focus_planner.lenses.driver.LensStatus`.
    refused : int
        How many states of lenses were refused since the plan.
    refusal : str
        Why the last one was.
    publishers : str
        The nodes that publish such states.
    """

    counts: Counter[int]
    refused: int = 0
    refusal: str = ""
    publishers: str = ""


@dataclass(frozen=True)
class PlannerReport:
    """A planner, as of one moment.

    Attributes
    ----------
    state : str
        Of the managed node's life cycle.
    planning : str
        ``plan_id`` of the request being planned; empty if there is none.
    waiting : int
        How many requests wait for their turn.
    snapshot : Snapshot
    recording_failure : str
        Why the last run is not recorded; empty if it is, or need not be.
    runs_to_write : int
        How many jobs the recorder has.
    planning_pid : int or None
        The process that plans; None while there is none.
    skipped_runs : tuple
        Recorded runs that were skipped in the search for the last plan, and why: names and texts.
    compiling : str
        How far compiling is; empty while nothing is compiled.
    replanned : Replanned
        What became of the surfaces that were to be planned for without being asked.
    """

    state: str
    planning: str = ""
    waiting: int = 0
    snapshot: Snapshot = Snapshot()
    recording_failure: str = ""
    runs_to_write: int = 0
    planning_pid: int | None = None
    skipped_runs: tuple[tuple[str, str], ...] = ()
    compiling: str = ""
    replanned: Replanned = _NONE_REPLANNED


def without_problem(plan: FocusPlan) -> FocusPlan:
    """Return a plan without the problem that was solved for it, which takes much memory."""
    return FocusPlan(**{each.name: getattr(plan, each.name) for each in fields(FocusPlan)})


def plan_input_to_fields(arrival: Arrival[Any], taken: datetime) -> Fields:
    """Return a ``PlanInput`` message: an input, and its age when it was taken for a plan."""
    return {
        "topic": arrival.topic,
        "received": time_to_fields(datetime_stamp(arrival.at)),
        "stamp": time_to_fields(arrival.stamp),
        "age": (taken - arrival.at).total_seconds(),
    }


def input_to_fields(state: InputState, now: datetime) -> Fields:
    """Return an ``InputStatus`` message: an input and its age."""
    received = state.received
    return {
        "topic": state.topic,
        "received": time_to_fields(datetime_stamp(received) if received else (0, 0)),
        "stamp": time_to_fields(state.stamp),
        "age": age_of(state, now),
        "refused": state.refused,
        "unheard": state.unheard,
    }


def state_to_plan_input(state: InputState, now: datetime) -> Fields:
    """Return a ``PlanInput`` message: an input in force and its age."""
    names = "topic", "received", "stamp", "age"
    return {name: value for name, value in input_to_fields(state, now).items() if name in names}


def age_of(state: InputState, now: datetime) -> float:
    """Return how long ago an input was received, seconds; NaN while there is none."""
    return (now - state.received).total_seconds() if state.received else math.nan
