"""Recorded runs: conversion of requests, inputs and results to messages, and back."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta, timezone
from enum import IntEnum
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.plan import FocusPlan, WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.progress import Progress
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud, Surface
from focus_planner.core.validation import InputError
from focus_planner.io.importance import IMPORTANCE
from focus_planner.io.lens_tables import LensTables
from focus_planner.messages.limits import Limits
from focus_planner.messages.plan_checking import check_values
from focus_planner.messages.reading import (
    Message,
    Optics,
    cloud_from_message,
    mesh_from_bytes,
    note_from_message,
    plan_from_message,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.requests import (
    request_from_message,
    request_to_fields,
    request_to_values,
)
from focus_planner.messages.typestore import (
    CLOUD,
    MARKERS,
    MESH,
    PACKAGE,
    PLAN,
    POSES,
    RIG,
    RUN,
    deserialize,
    fields_of,
    message_of,
    serialize,
)
from focus_planner.messages.writing import (
    Fields,
    Stamp,
    cloud_to_fields,
    datetime_stamp,
    mesh_to_bytes,
    note_to_fields,
    plan_to_fields,
    rig_to_fields,
)
from focus_planner.parameters.declaration import Value
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.bag_reading import Bag, read_bag
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.planning_orders import Visuals

VERTEX_DATA = f"{PACKAGE}/msg/VertexData"
_REQUEST = f"{PACKAGE}/msg/PlanRequest"
_PROGRESS, _RESULT = f"{PACKAGE}/msg/RunProgress", f"{PACKAGE}/msg/RunResult"
_PARAMETER = "rcl_interfaces/msg/Parameter"
# Of the type of an input, and none.
_QUALITY_CLOUD = "quality_cloud"
_SURFACES, _RIGS = (MESH, CLOUD), (POSES, RIG)
_NANO = 10**9
# Plans for files have no limits; nor had nodes before limits were introduced.
_WITHOUT_LIMITS = {
    "max_points": 0,
    "max_triangles": 0,
    "max_cameras": 0,
    "max_problem_size": 0,
    "max_memory": 0,
}
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


class _ParameterType(IntEnum):
    """Which field of a parameter's value is used; as in ``ParameterType.msg``."""

    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    DOUBLE_ARRAY = 8


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
        What was noticed when the inputs were read from files.
    """

    run_id: str
    planner: str
    settings: Settings
    asked: Fields
    at: int
    software: Mapping[str, str]
    warm_start: WarmStart | None = None
    input_notes: tuple[Note, ...] = ()

    @property
    def request(self) -> PlanRequest:
        """The request, completed from the settings.

        Raises
        ------
        InputError
            If a value is out of range.
        """
        message = deserialize(_REQUEST, serialize(_REQUEST, self.asked))
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
        The surfaces and rigs that the planner had, oldest first.
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
        data = [message for message in self.inputs if message.type_name == VERTEX_DATA]
        return [
            _arrival(
                message,
                partial(_read_noted_surface, message, data, self.beginning, self._limits),
            )
            for message in self.inputs
            if message.type_name in _SURFACES
        ]

    def rigs(self) -> list[Arrival[Rig]]:
        """Return the rigs as the planner received them."""
        frame_id = self.beginning.settings.frame_id
        return [
            _arrival(message, partial(_read_rig, message, frame_id, self._limits))
            for message in self.inputs
            if message.type_name in _RIGS
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


def stamp_of(at: int) -> Stamp:
    """Return nanoseconds since the epoch as seconds and nanoseconds."""
    return divmod(at, _NANO)


def input_message(arrival: Arrival[Any]) -> BagMessage:
    """Return an input that the planner received as the message to record."""
    seconds, nanoseconds = datetime_stamp(arrival.at)
    at = seconds * _NANO + nanoseconds
    return BagMessage(arrival.topic, arrival.type_name, arrival.payload, at)


# --- writing -----------------------------------------------------------------------------------


def beginning_of(
    run_id: str,
    planner: str,
    request: PlanRequest,
    frame_id: str,
    software: Mapping[str, str],
    tables: LensTables | None = None,
    notes: tuple[Note, ...] = (),
) -> Beginning:
    """Return the beginning of a run that plans for files rather than for messages.

    The parameters are taken from the request, except for the lens tables.
    """
    values = _WITHOUT_LIMITS | request_to_values(request) | {"frame_id": frame_id}
    values["lens_tables"] = tables.where if tables else ""
    settings = Settings.from_values(values, tables.text if tables else "")
    asked = request_to_fields(request)
    return Beginning(run_id, planner, settings, asked, time.time_ns(), software, input_notes=notes)


def inputs_of(beginning: Beginning, surface: Surface, rig: Rig) -> list[BagMessage]:
    """Return the input messages for a surface and a rig that were read from files."""
    planner, at = beginning.planner, beginning.at
    messages = surface_messages(planner, surface, rig.frame_id, at)
    return [*messages, rig_message(planner, rig, at)]


def surface_messages(planner: str, surface: Surface, frame_id: str, at: int) -> list[BagMessage]:
    """Return the input messages for a surface that was read from a file."""
    if isinstance(surface, PointCloud):
        payload = serialize(CLOUD, cloud_to_fields(surface, frame_id))
        return [BagMessage(f"{planner}/cloud", CLOUD, payload, at)]
    messages = [BagMessage(f"{planner}/mesh", MESH, mesh_to_bytes(surface), at)]
    data = {
        "normals": surface.vertex_normals,
        "colors": surface.colours_of_vertices(),
        "importance": surface.vertex_importance,
    }
    given = {name: values for name, values in data.items() if values is not None}
    if given:
        payload = serialize(VERTEX_DATA, given)
        messages.append(BagMessage(f"{planner}/mesh/vertex_data", VERTEX_DATA, payload, at))
    return messages


def rig_message(planner: str, rig: Rig, at: int) -> BagMessage:
    """Return the input message for a rig that was read from a file."""
    return BagMessage(f"{planner}/rig", RIG, serialize(RIG, rig_to_fields(rig)), at)


def beginning_messages(beginning: Beginning) -> list[BagMessage]:
    """Return the messages at the beginning of a run, after its inputs."""
    seconds, nanoseconds = stamp_of(beginning.at)
    warm_start = beginning.warm_start
    run = {
        "stamp": {"sec": seconds, "nanosec": nanoseconds},
        "run_id": beginning.run_id,
        "planner": beginning.planner,
        "parameters": _parameters(beginning.settings.values),
        "lens_tables": beginning.settings.lens_tables_text,
        "input_notes": [note_to_fields(note) for note in beginning.input_notes],
        "seed": beginning.asked.get("seed", 0) or beginning.settings.request.seed,
        "software": [{"key": key, "value": value} for key, value in beginning.software.items()],
        "warm_start": {} if warm_start is None else _warm_start_to_fields(warm_start),
    }
    message_of_run = partial(_message, beginning)
    return [
        message_of_run("run", RUN, run),
        message_of_run("run/request", _REQUEST, beginning.asked),
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
    return _message(beginning, "run/progress", _PROGRESS, fields, at)


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
    yield _message(beginning, "run/result", _RESULT, result, at)


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
    yield BagMessage(f"{beginning.planner}/{_QUALITY_CLOUD}", CLOUD, visuals.quality_cloud, at)


def _message(
    beginning: Beginning, topic: str, type_name: str, fields: Fields, at: int | None = None
) -> BagMessage:
    payload = serialize(type_name, fields)
    at = beginning.at if at is None else at
    return BagMessage(f"{beginning.planner}/{topic}", type_name, payload, at)


@lru_cache(maxsize=8)
def _parameters(values: tuple[tuple[str, Value], ...]) -> list[Message]:
    """Return the messages of parameters, cached because they are many and rarely change."""
    return [
        message_of(_PARAMETER, {"name": name, "value": _parameter_to_fields(value)})
        for name, value in values
    ]


def _parameter_to_fields(value: Value) -> Fields:
    if isinstance(value, bool):
        return {"type": _ParameterType.BOOL, "bool_value": value}
    if isinstance(value, int):
        return {"type": _ParameterType.INTEGER, "integer_value": value}
    if isinstance(value, float):
        return {"type": _ParameterType.DOUBLE, "double_value": value}
    if isinstance(value, str):
        return {"type": _ParameterType.STRING, "string_value": value}
    return {"type": _ParameterType.DOUBLE_ARRAY, "double_array_value": value}


def _warm_start_to_fields(warm_start: WarmStart) -> Fields:
    return {
        "cameras": warm_start.names,
        "focus_distances": warm_start.focus_distances,
        "points": warm_start.points,
        "prices": () if warm_start.prices is None else warm_start.prices,
    }


# --- reading -----------------------------------------------------------------------------------


def read_run(path: Path) -> Run:
    """Read a run, even an incomplete one as long as it contains the request.

    Raises
    ------
    InputError
        If there is no run, or its request is missing or invalid.
    """
    bag = read_bag(path)
    messages = _by_type(bag)
    if RUN not in messages or _REQUEST not in messages:
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
    run, asked = (messages[name][0].read() for name in (RUN, _REQUEST))
    values = {p.name: _parameter_from_message(p.value) for p in run.parameters}
    result, plan = messages.get(_RESULT), messages.get(PLAN)
    steps = [message.read() for message in messages.get(_PROGRESS, [])]
    fault = bag.fault or ("" if result else "no result")
    return Run(
        path=path,
        inputs=tuple(
            message
            for message in bag.messages
            if message.type_name in (*_SURFACES, *_RIGS, VERTEX_DATA)
            and message.topic != f"{run.planner}/{_QUALITY_CLOUD}"
        ),
        beginning=Beginning(
            run_id=run.run_id,
            planner=run.planner,
            settings=Settings.from_values(
                _WITHOUT_LIMITS | _importance_field(values, messages) | values, run.lens_tables
            ),
            asked=fields_of(asked),
            at=run.stamp.sec * _NANO + run.stamp.nanosec,
            software={entry.key: entry.value for entry in run.software},
            warm_start=_warm_start_from_message(run.warm_start),
            input_notes=tuple(map(note_from_message, run.input_notes)),
        ),
        progress=tuple(map(_progress_from_message, steps)),
        ending=_ending(result[0].read(), plan and plan[0].read()) if result and not fault else None,
        fault=fault,
        elapsed=tuple(step.elapsed for step in steps),
    )


def _importance_field(
    values: Mapping[str, Value | None], messages: dict[str, list[BagMessage]]
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


def _read_noted_surface(
    message: BagMessage,
    data: list[BagMessage],
    beginning: Beginning,
    limits: Limits,
    optics: Optics,
) -> Surface:
    """Return a surface with the notes on the file that it was read from."""
    surface = _read_surface(message, data, beginning.settings, limits, optics)
    # What there was to note in a file is no longer in the message that was made from it.
    return replace(surface, notes=beginning.input_notes) if beginning.input_notes else surface


def _read_surface(
    message: BagMessage, data: list[BagMessage], settings: Settings, limits: Limits, _: Optics
) -> Surface:
    if message.type_name == CLOUD:
        field = settings.importance_field
        return cloud_from_message(message.read(), settings.frame_id, limits, field)
    mesh = mesh_from_bytes(message.payload, limits)
    if not data:
        return mesh
    vertices = data[0].read()
    normals, importance = vertices.normals, vertices.importance
    colours = vertices.colors
    return Mesh(
        mesh.vertices,
        mesh.triangles,
        _of_three("normals", normals),
        importance if len(importance) else None,
        mesh.notes,
        _of_three("colors", colours),
    )


def _of_three(name: str, values: NDArray[Any]) -> NDArray[Any] | None:
    """Return (V, 3) what a message has of each vertex; None if it has nothing."""
    if len(values) % 3:
        raise InputError(f"vertex_data {name}", "three numbers per vertex", f"{len(values)} in all")
    return values.reshape(-1, 3) if len(values) else None


def _read_rig(message: BagMessage, frame_id: str, limits: Limits, optics: Optics) -> Rig:
    limits.check_rig(message.payload)
    from_message = rig_from_message if message.type_name == RIG else poses_from_message
    return from_message(message.read(), optics, frame_id)


def _arrival(message: BagMessage, read: Any) -> Arrival[Any]:
    at = _EPOCH + timedelta(microseconds=message.at // 1000)
    return Arrival(message.topic, message.type_name, message.payload, read, at)


def _parameter_from_message(value: Message) -> Value | None:
    names = {
        _ParameterType.BOOL: "bool_value",
        _ParameterType.INTEGER: "integer_value",
        _ParameterType.DOUBLE: "double_value",
        _ParameterType.STRING: "string_value",
    }
    if value.type == _ParameterType.DOUBLE_ARRAY:
        return tuple(value.double_array_value.tolist())
    if value.type not in names:
        raise InputError("parameter", "a value of a known type", f"type {value.type}")
    plain: Value = getattr(value, names[_ParameterType(value.type)])
    return plain


def _warm_start_from_message(message: Message) -> WarmStart | None:
    if not message.cameras:
        return None
    return WarmStart(
        tuple(message.cameras),
        np.asarray(message.focus_distances),
        message.points.reshape(-1, 3),
        message.prices if len(message.prices) else None,
    )


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
