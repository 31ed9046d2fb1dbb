# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The inputs of recorded runs, surfaces and rigs, as messages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from functools import partial
from typing import Any

from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud, Surface
from focus_planner.core.validation import InputError
from focus_planner.messages.frames import TF_STATIC, HeardFrames
from focus_planner.messages.limits import Limits
from focus_planner.messages.reading import (
    NO_FRAMES,
    Optics,
    cloud_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.transforms import transforms_from_bytes, transforms_to_bytes
from focus_planner.messages.typestore import (
    CLOUD,
    MESH,
    POSES,
    RIG,
    TRANSFORMS,
    VERTEX_DATA,
    serialize,
)
from focus_planner.messages.writing import (
    cloud_to_fields,
    datetime_stamp,
    mesh_to_bytes,
    rig_to_fields,
)
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.runtime.inputs import Arrival

#: Types of messages.
SURFACES, RIGS = (MESH, CLOUD), (POSES, RIG)
_NANO = 10**9
# Between the planner's name and the topic of what a rig was put together from.
_COMPOSED = "/rig/from"
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


# --- writing -----------------------------------------------------------------------------------


def input_messages(planner: str, arrival: Arrival[Any]) -> list[BagMessage]:
    """Return the messages to record of an input that the planner received.

    The transforms that it depends on come just before it. A rig that was put together from frames
    is recorded as such, under a topic of its own: in a bag, a topic has messages of one type.

    Parameters
    ----------
    planner : str
        The node's full name.
    arrival : Arrival
    """
    seconds, nanoseconds = datetime_stamp(arrival.at)
    at = seconds * _NANO + nanoseconds
    topic = arrival.topic
    if arrival.type_name == RIG and topic.endswith(TF_STATIC):
        topic = f"{planner}{_COMPOSED}{topic}"
    message = BagMessage(topic, arrival.type_name, arrival.payload, at)
    if not arrival.heard.transforms:
        return [message]
    payload = transforms_to_bytes(arrival.heard.transforms)
    return [BagMessage(TF_STATIC, TRANSFORMS, payload, at), message]


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


# --- reading -----------------------------------------------------------------------------------


def with_frames(messages: Iterable[BagMessage]) -> Iterator[tuple[BagMessage, HeardFrames]]:
    """Yield each input with the transforms that were recorded just before it."""
    heard = NO_FRAMES
    for message in messages:
        if message.type_name == TRANSFORMS:
            heard = HeardFrames(tuple(transforms_from_bytes(message.payload)))
        else:
            yield message, heard
            heard = NO_FRAMES


def arrival_of(
    message: BagMessage,
    heard: HeardFrames,
    read: Callable[[HeardFrames, Optics], Surface] | Callable[[HeardFrames, Optics], Rig],
) -> Arrival[Any]:
    """Return a recorded input as the planner received it.

    Parameters
    ----------
    message : BagMessage
    heard : HeardFrames
        The transforms that it depends on.
    read : callable
        Returns the surface or the rig of the message.
    """
    at = _EPOCH + timedelta(microseconds=message.at // 1000)
    _, composed, topic = message.topic.partition(_COMPOSED)
    return Arrival(
        topic if composed else message.topic,
        message.type_name,
        message.payload,
        partial(read, heard),
        at,
        heard=heard,
    )


def read_surface(
    message: BagMessage,
    data: list[BagMessage],
    settings: Settings,
    notes: tuple[Note, ...],
    limits: Limits,
    heard: HeardFrames,
    _: Optics,
) -> Surface:
    """Return the surface of a message.

    Parameters
    ----------
    message : BagMessage
    data : list of BagMessage
        What else there is of a mesh's vertices.
    settings : Settings
    notes : tuple of Note
        On the file that it was read from.
    limits : Limits
    heard : HeardFrames
        The transforms that it depends on.

    Raises
    ------
    InputError
        If it is none, or beyond the limits.
    """
    surface = _surface(message, data, settings, limits, heard)
    # What there was to note in a file is no longer in the message that was made from it.
    return replace(surface, notes=notes) if notes else surface


def _surface(
    message: BagMessage,
    data: list[BagMessage],
    settings: Settings,
    limits: Limits,
    heard: HeardFrames,
) -> Surface:
    if message.type_name == CLOUD:
        field = settings.importance_field
        return cloud_from_message(message.read(), settings.frame_id, limits, field, heard)
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


def read_rig(
    message: BagMessage, frame_id: str, limits: Limits, heard: HeardFrames, optics: Optics
) -> Rig:
    """Return the rig of a message.

    Raises
    ------
    InputError
        If it is none, or beyond the limits.
    """
    limits.check_rig(message.payload)
    from_message = rig_from_message if message.type_name == RIG else poses_from_message
    return from_message(message.read(), optics, frame_id, heard)
