# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Writing recorded runs: their parts as messages."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.progress import Progress
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud, Surface
from focus_planner.io.lens_tables import LensTables
from focus_planner.messages.requests import request_to_fields, request_to_values
from focus_planner.messages.typestore import (
    CLOUD,
    MARKERS,
    PLAN,
    PLAN_REQUEST,
    RUN,
    RUN_PROGRESS,
    RUN_RESULT,
    serialize,
)
from focus_planner.messages.writing import Fields, Stamp, note_to_fields, plan_to_fields
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.run import Beginning, Ending
from focus_planner.recording.run_inputs import rig_message, surface_messages
from focus_planner.recording.run_parameters import WITHOUT_LIMITS, parameters_to_messages
from focus_planner.runtime.inputs import KnownSubject
from focus_planner.runtime.planning_orders import Visuals

#: Of the topic of what shows a plan as a cloud, after the planner's name.
QUALITY_CLOUD = "quality_cloud"
_NANO = 10**9


def stamp_of(at: int) -> Stamp:
    """Return nanoseconds since the epoch as seconds and nanoseconds."""
    return divmod(at, _NANO)


def beginning_of(
    run_id: str,
    planner: str,
    request: PlanRequest,
    frame_id: str,
    software: Mapping[str, str],
    tables: LensTables | None = None,
    notes: tuple[Note, ...] = (),
    subjects: tuple[KnownSubject, ...] = (),
) -> Beginning:
    """Return the beginning of a run that plans for files rather than for messages.

    The parameters are taken from the request, except for the lens tables.
    """
    values = WITHOUT_LIMITS | request_to_values(request) | {"frame_id": frame_id}
    values["subjects"] = max(len(subjects), 1)
    values["lens_tables"] = tables.where if tables else ""
    settings = Settings.from_values(values, tables.text if tables else "")
    asked = request_to_fields(request)
    return Beginning(
        run_id,
        planner,
        settings,
        asked,
        time.time_ns(),
        software,
        input_notes=notes,
        subjects=subjects,
    )


def inputs_of(
    beginning: Beginning, surfaces: Surface | Sequence[Surface], rig: Rig
) -> list[BagMessage]:
    """Return the input messages for one or several surfaces and a rig, read from files."""
    planner, at = beginning.planner, beginning.at
    messages = [
        message
        for surface in ([surfaces] if isinstance(surfaces, (Mesh, PointCloud)) else surfaces)
        for message in surface_messages(planner, surface, rig.frame_id, at)
    ]
    return [*messages, rig_message(planner, rig, at)]


def beginning_messages(beginning: Beginning) -> list[BagMessage]:
    """Return the messages at the beginning of a run, after its inputs."""
    seconds, nanoseconds = stamp_of(beginning.at)
    warm_start = beginning.warm_start
    run = {
        "stamp": {"sec": seconds, "nanosec": nanoseconds},
        "run_id": beginning.run_id,
        "planner": beginning.planner,
        "parameters": parameters_to_messages(beginning.settings.values),
        "lens_tables": beginning.settings.lens_tables_text,
        "input_notes": [note_to_fields(note) for note in beginning.input_notes],
        "subjects": [_subject_to_fields(subject) for subject in beginning.subjects],
        "seed": beginning.asked.get("seed", 0) or beginning.settings.request.seed,
        "software": [{"key": key, "value": value} for key, value in beginning.software.items()],
        "warm_start": {} if warm_start is None else _warm_start_to_fields(warm_start),
    }
    message_of_run = partial(_message, beginning)
    return [
        message_of_run("run", RUN, run),
        message_of_run("run/request", PLAN_REQUEST, beginning.asked),
    ]


def progress_message(beginning: Beginning, elapsed: float, progress: Progress) -> BagMessage:
    """Return the message of a step, ``elapsed`` seconds after the beginning."""
    bound = progress.lower_bound
    fields = {
        "elapsed": elapsed,
        "stage": progress.stage,
        "iteration": progress.iteration,
        "cost": progress.cost,
        "lower_bound": math.nan if bound is None else bound,
    }
    at = beginning.at + int(elapsed * _NANO)
    return _message(beginning, "run/progress", RUN_PROGRESS, fields, at)


def ending_messages(
    beginning: Beginning, ending: Ending, at: int, published: bool = True
) -> Iterator[BagMessage]:
    """Yield the messages at the end of a run, and before them its plan if the ending has one."""
    if ending.plan is not None:
        frame_id = beginning.settings.frame_id
        fields = plan_to_fields(ending.plan, frame_id, ending.stamp, beginning.run_id)
        yield _message(beginning, _plan_topic(published), PLAN, fields, at)
    result = {
        "success": ending.success,
        "message": ending.message,
        "answers": ending.stop_log.to_counts(),
        "fingerprints": [vars(fingerprint) for fingerprint in ending.fingerprints],
    }
    yield _message(beginning, "run/result", RUN_RESULT, result, at)


def plan_message(beginning: Beginning, payload: bytes, *, published: bool) -> BagMessage:
    """Return the message of a serialized plan."""
    topic = f"{beginning.planner}/{_plan_topic(published)}"
    return BagMessage(topic, PLAN, payload, time.time_ns())


def _plan_topic(published: bool) -> str:
    """Return the topic of a plan; those that were never in force have one of their own."""
    return "focus_plan" if published else "run/focus_plan"


def visuals_messages(beginning: Beginning, visuals: Visuals, at: int) -> Iterator[BagMessage]:
    """Yield the messages that show a plan."""
    yield BagMessage(f"{beginning.planner}/markers", MARKERS, visuals.markers, at)
    yield BagMessage(f"{beginning.planner}/{QUALITY_CLOUD}", CLOUD, visuals.quality_cloud, at)


def _message(
    beginning: Beginning, topic: str, type_name: str, fields: Fields, at: int | None = None
) -> BagMessage:
    payload = serialize(type_name, fields)
    at = beginning.at if at is None else at
    return BagMessage(f"{beginning.planner}/{topic}", type_name, payload, at)


def _subject_to_fields(subject: KnownSubject) -> Fields:
    notes = [note_to_fields(note) for note in subject.notes]
    return {"name": subject.name, "weight": subject.weight, "notes": notes}


def _warm_start_to_fields(warm_start: WarmStart) -> Fields:
    return {
        "cameras": warm_start.names,
        "focus_distances": warm_start.focus_distances,
        "points": warm_start.points,
        "prices": () if warm_start.prices is None else warm_start.prices,
    }
