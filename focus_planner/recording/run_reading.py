# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading recorded runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.progress import Progress
from focus_planner.core.validation import InputError
from focus_planner.io.importance import IMPORTANCE
from focus_planner.messages.plan_checking import check_values
from focus_planner.messages.plan_reading import note_from_message, plan_from_message
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import (
    CLOUD,
    PLAN,
    PLAN_REQUEST,
    RUN,
    RUN_PROGRESS,
    RUN_RESULT,
    TRANSFORMS,
    VERTEX_DATA,
    fields_of,
)
from focus_planner.parameters.declaration import Value
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.bag_reading import Bag, read_bag
from focus_planner.recording.run import Beginning, Ending, Run
from focus_planner.recording.run_inputs import RIGS, SURFACES
from focus_planner.recording.run_parameters import WITHOUT_LIMITS, parameters_from_messages
from focus_planner.recording.run_writing import QUALITY_CLOUD
from focus_planner.runtime.inputs import KnownSubject

_NANO = 10**9


def read_run(path: Path) -> Run:
    """Read a run, even an incomplete one as long as it contains the request.

    Raises
    ------
    InputError
        If there is no run, or its request is missing or invalid.
    """
    bag = read_bag(path)
    messages = _by_type(bag)
    if RUN not in messages or PLAN_REQUEST not in messages:
        why = bag.fault or f"a bag of {', '.join(messages) or 'nothing'}"
        raise InputError(str(path), "a recorded run", why)
    try:
        return _run(path, bag, messages)
    except InputError as error:
        raise InputError(str(path), "a recorded run", f"one with a bad {error}") from None
    except Exception as error:  # noqa: BLE001 - whatever values of unknown types lead to
        why = " ".join(f"one with a bad value: {error}".split())
        raise InputError(str(path), "a recorded run", why, "update focus_planner") from None


def _run(path: Path, bag: Bag, messages: dict[str, list[BagMessage]]) -> Run:
    run, asked = (messages[name][0].read() for name in (RUN, PLAN_REQUEST))
    values = parameters_from_messages(run.parameters)
    result, plan = messages.get(RUN_RESULT), messages.get(PLAN)
    steps = [message.read() for message in messages.get(RUN_PROGRESS, [])]
    fault = bag.fault or ("" if result else "no result")
    return Run(
        path=path,
        inputs=tuple(
            message
            for message in bag.messages
            if message.type_name in (*SURFACES, *RIGS, VERTEX_DATA, TRANSFORMS)
            and message.topic != f"{run.planner}/{QUALITY_CLOUD}"
        ),
        beginning=Beginning(
            run_id=run.run_id,
            planner=run.planner,
            settings=Settings.from_values(
                WITHOUT_LIMITS | _importance_field(values, messages) | values, run.lens_tables
            ),
            asked=fields_of(asked),
            at=run.stamp.sec * _NANO + run.stamp.nanosec,
            software={entry.key: entry.value for entry in run.software},
            warm_start=_warm_start_from_message(run.warm_start),
            input_notes=tuple(map(note_from_message, run.input_notes)),
            subjects=tuple(map(_subject_from_message, run.subjects)),
        ),
        progress=tuple(map(_progress_from_message, steps)),
        ending=_ending(result[0].read(), plan and plan[0].read()) if result and not fault else None,
        fault=fault,
        elapsed=tuple(step.elapsed for step in steps),
    )


def _importance_field(
    values: Mapping[str, Value], messages: dict[str, list[BagMessage]]
) -> dict[str, Value]:
    """Return the parameter of runs that are older than it: a field weight counted by itself."""
    if "importance_field" in values:
        return {}
    fields = set()
    for cloud in messages.get(CLOUD, []):
        with suppress(InputError):  # refused then, and refused again when it is planned with
            fields |= {field.name for field in cloud.read().fields}
    by_weight = "weight" in fields and IMPORTANCE not in fields
    return {"importance_field": "weight"} if by_weight else {}


def _by_type(bag: Bag) -> dict[str, list[BagMessage]]:
    messages: dict[str, list[BagMessage]] = {}
    for message in bag.messages:
        messages.setdefault(message.type_name, []).append(message)
    return messages


def _warm_start_from_message(message: Message) -> WarmStart | None:
    if not message.cameras:
        return None
    return WarmStart(
        tuple(message.cameras),
        np.asarray(message.focus_distances),
        message.points.reshape(-1, 3),
        message.prices if len(message.prices) else None,
    )


def _subject_from_message(message: Message) -> KnownSubject:
    notes = tuple(map(note_from_message, message.notes))
    return KnownSubject(message.name, message.weight, notes)


def _progress_from_message(message: Message) -> Progress:
    bound = message.lower_bound
    return Progress(
        message.stage, message.iteration, message.cost, None if math.isnan(bound) else bound
    )


def _ending(result: Message, plan: Message | None) -> Ending:
    if plan is not None:
        check_values(plan)
    return Ending(
        success=result.success,
        message=result.message,
        plan=None if plan is None else plan_from_message(plan),
        stamp=(0, 0) if plan is None else (plan.header.stamp.sec, plan.header.stamp.nanosec),
        stop_log=StopLog.from_counts(result.answers.tolist()),
        fingerprints=tuple(
            Fingerprint(f.stage, tuple(f.counts.tolist()), tuple(f.digests.tolist()))
            for f in result.fingerprints
        ),
    )
