# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recorded runs: what was given and asked for, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from focus_planner.core.brief import brief_repr
from focus_planner.core.notes import Note
from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.plan import FocusPlan, WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.progress import Progress
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Surface
from focus_planner.messages.frames import HeardFrames
from focus_planner.messages.limits import Limits
from focus_planner.messages.requests import request_from_message
from focus_planner.messages.typestore import (
    CLOUD,
    PLAN_REQUEST,
    VERTEX_DATA,
    deserialize,
    serialize,
)
from focus_planner.messages.writing import Fields, Stamp
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.run_inputs import (
    RIGS,
    SURFACES,
    arrival_of,
    read_rig,
    read_surface,
    with_frames,
)
from focus_planner.runtime.inputs import Arrival, KnownSubject


@dataclass(frozen=True)
class Beginning:
    """The request, and all else that a plan depends on besides the surface and the rig.

    Attributes
    ----------
    run_id : str
        The name of the run and its folder, and the id of its plan.
    planner : str
        The node's full name, the prefix of the recorded topics.
    settings : Settings
    asked : dict
        The fields of the request; those that are 0 or "" default to the settings.
    at : int
        The time of the request, nanoseconds since the epoch.
    software : dict
        Versions by name.
    warm_start : WarmStart or None
        The earlier plan to start from.
    input_notes : tuple of Note
        What was noticed when the inputs were read from files; of several surfaces, each has its
        own.
    subjects : tuple of KnownSubject
        What is known of each of several surfaces that were read from files; else empty.
    """

    run_id: str
    planner: str
    settings: Settings
    asked: Fields
    at: int
    software: Mapping[str, str]
    warm_start: WarmStart | None = None
    input_notes: tuple[Note, ...] = ()
    subjects: tuple[KnownSubject, ...] = ()

    __repr__ = brief_repr

    @property
    def request(self) -> PlanRequest:
        """The request, completed from the settings.

        Raises
        ------
        InputError
            If a value is out of range.
        """
        message = deserialize(PLAN_REQUEST, serialize(PLAN_REQUEST, self.asked))
        return request_from_message(message, self.settings.request)


@dataclass(frozen=True)
class Ending:
    """The outcome of a run.

    Attributes
    ----------
    success : bool
    message : str
        The response's message.
    plan : FocusPlan or None
    stop_log : StopLog
        Where the plan was ended.
    fingerprints : tuple of Fingerprint
    stamp : tuple of int
        The plan's stamp, seconds and nanoseconds.
    """

    success: bool
    message: str
    plan: FocusPlan | None = None
    stop_log: StopLog = field(default_factory=StopLog)
    fingerprints: tuple[Fingerprint, ...] = ()
    stamp: Stamp = (0, 0)


@dataclass(frozen=True)
class Run:
    """A recorded run.

    Attributes
    ----------
    path : Path
        Its folder or file.
    inputs : tuple of BagMessage
        The surfaces and rigs that the planner had, oldest first, each after the transforms that it
        depends on.
    beginning : Beginning
    progress : tuple of Progress
    ending : Ending or None
        None if the recording is incomplete.
    fault : str
        Why the recording is incomplete; empty if it is complete.
    elapsed : tuple of float
        When each step of ``progress`` was done, seconds since the request.
    """

    path: Path
    inputs: tuple[BagMessage, ...] = field(repr=False)
    beginning: Beginning
    progress: tuple[Progress, ...] = field(repr=False)
    ending: Ending | None
    fault: str
    elapsed: tuple[float, ...] = field(default=(), repr=False, compare=False)

    def surfaces(self) -> list[Arrival[Surface]]:
        """Return the surfaces as the planner received them."""
        begun = self.beginning
        surfaces: list[tuple[BagMessage, HeardFrames, list[BagMessage]]] = []
        for message, heard in with_frames(self.inputs):
            if message.type_name in SURFACES:
                surfaces.append((message, heard, []))
            elif message.type_name == VERTEX_DATA and surfaces:
                surfaces[-1][2].append(message)
        arrivals = []
        for number, (message, heard, data) in enumerate(surfaces):
            notes = begun.input_notes
            if number < len(begun.subjects):
                notes = begun.subjects[number].notes
            read = partial(read_surface, message, data, begun.settings, notes, self._limits)
            arrivals.append(arrival_of(message, heard, read))
        return arrivals

    @property
    def has_clouds(self) -> bool:
        """Whether a surface is a cloud."""
        return any(message.type_name == CLOUD for message in self.inputs)

    def rigs(self) -> list[Arrival[Rig]]:
        """Return the rigs as the planner received them."""
        frame_id = self.beginning.settings.frame_id
        return [
            arrival_of(message, heard, partial(read_rig, message, frame_id, self._limits))
            for message, heard in with_frames(self.inputs)
            if message.type_name in RIGS
        ]

    @property
    def resources(self) -> ResourceLimits:
        """The limits on the plan; none for a run with a plan, which kept to them."""
        planned = self.ending is not None and self.ending.success
        return ResourceLimits() if planned else self.beginning.settings.resources

    @property
    def _limits(self) -> Limits:
        """The limits on inputs; none for a run with a plan, whose inputs were accepted."""
        planned = self.ending is not None and self.ending.success
        return Limits() if planned else self.beginning.settings.limits
