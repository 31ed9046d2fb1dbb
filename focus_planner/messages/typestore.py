# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Messages as objects and as bytes without ROS: definitions and CDR by the library ``rosbags``.

This package's own messages are defined in ``msg_defs``, of which the package has a copy; all others
are those of ROS 2 Jazzy.
"""

from __future__ import annotations

import dataclasses
import re
import struct
from collections.abc import Iterator
from functools import cache, lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Message
from focus_planner.messages.writing import Fields

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc, Typesdict

PACKAGE = "focus_planner_msgs"
MARKERS = "visualization_msgs/msg/MarkerArray"
MESH, CLOUD = "shape_msgs/msg/Mesh", "sensor_msgs/msg/PointCloud2"
POSES, RIG = "geometry_msgs/msg/PoseArray", f"{PACKAGE}/msg/CameraRig"
TRANSFORMS, CAMERA_INFO = "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/CameraInfo"
PLAN, LENS_STATE = f"{PACKAGE}/msg/FocusPlan", f"{PACKAGE}/msg/LensState"
RUN, ORDER = f"{PACKAGE}/msg/Run", f"{PACKAGE}/msg/CameraFocus"
PLAN_REQUEST, VERTEX_DATA = f"{PACKAGE}/msg/PlanRequest", f"{PACKAGE}/msg/VertexData"
RUN_PROGRESS, RUN_RESULT = f"{PACKAGE}/msg/RunProgress", f"{PACKAGE}/msg/RunResult"
#: Characters: several times the longest definition here, comments and nested messages included.
MAX_DEFINITION = 50_000
_ENCAPSULATION = 4
_LITTLE_ENDIAN = {b"\x00\x00": False, b"\x00\x01": True}
# Raised by the library on corrupt bytes.
_BROKEN = (
    SerdeError,
    MemoryError,
    LookupError,
    TypeError,
    OverflowError,
    ValueError,
    AssertionError,
    struct.error,
)
# Separates a message's definition from those of nested messages, as rosbag2 writes them.
_RULER = "=" * 80
_NUMBERS = {
    **{f"{kind}{bits}": f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)},
    "float32": "float32",
    "float64": "float64",
    "bool": "bool",
    "byte": "uint8",
    "char": "uint8",
    "octet": "uint8",
}


def serialize(type_name: str, fields: Fields) -> bytes:
    """Return the bytes of a message in little-endian CDR.

    Parameters
    ----------
    type_name : str
        Such as ``"focus_planner_msgs/msg/FocusPlan"``.
    fields : dict
        As :mod:`focus_planner.messages.writing` makes them; those left out are zero or empty.

    Raises
    ------
    TypeError
        If the message, or a nested one, has no field of this name.
    """
    message = message_of(type_name, fields)
    return bytes(_store().serialize_cdr(message, type_name, little_endian=True))


def message_of(type_name: str, fields: Fields) -> Message:
    """Return a message of these fields, which can be a value in the fields of another message.

    Raises
    ------
    TypeError
        As :func:`serialize`.
    """
    return _filled(_store(), type_name, fields)


def deserialize(type_name: str, payload: bytes, definition: str | None = None) -> Message:
    """Return the message in these bytes.

    Parameters
    ----------
    type_name : str
    payload : bytes
    definition : str, optional
        The writer's definition, if it may be older or newer than the one known here. Fields that it
        does not have are zero or empty.

    Raises
    ------
    InputError
        If the bytes do not fit the definition, or the message has fields that are not known here.
    """
    if definition is None or definition == definition_of(type_name):
        return _deserialized(_store(), type_name, payload)
    message = _deserialized(_store_of(type_name, definition), type_name, payload)
    try:
        return _filled(_store(), type_name, fields_of(message))
    except TypeError as error:
        raise InputError(
            type_name, "a message known to this version", str(error), "update focus_planner"
        ) from None


def fields_of(message: Message) -> Fields:
    """Return the fields of a message from :func:`deserialize`, with nested messages as dicts."""
    # In the library's classes, constants and the type's name are fields with a default.
    fields = [each for each in dataclasses.fields(message) if each.default is dataclasses.MISSING]
    return {each.name: _plain(getattr(message, each.name)) for each in fields}


@cache
def definition_of(type_name: str) -> str:
    """Return the definitions of a message and of all nested messages, as bags embed them.

    This package's own come with their comments, which give meanings and units.
    """
    text, _ = _store().generate_msgdef(type_name, ros_version=2)
    first, *others = text.split(f"{_RULER}\n")
    parts = [_commented(type_name, first)]
    for other in others:
        head, _, body = other.partition("\n")
        package, name = head.removeprefix("MSG: ").split("/")
        parts.append(f"{head}\n{_commented(f'{package}/msg/{name}', body)}")
    return f"{_RULER}\n".join(parts)


@cache
def type_hash(type_name: str) -> str:
    """Return a message's hash as ROS 2 computes it (REP 2011)."""
    return _store().hash_rihs01(type_name)


def _commented(type_name: str, text: str) -> str:
    return dict(_own_definitions()).get(type_name, text)


def _own_definitions() -> Iterator[tuple[str, str]]:
    folder = files("focus_planner.messages") / "definitions" / "msg"
    for file in sorted(folder.iterdir(), key=lambda file: file.name):
        yield f"{PACKAGE}/msg/{file.name.removesuffix('.msg')}", file.read_text(encoding="utf-8")


@cache
def _store() -> Typestore:
    store = get_typestore(Stores.ROS2_JAZZY)
    types = {}
    for type_name, text in _own_definitions():
        types.update(get_types_from_msg(text, type_name))
    store.register(types)
    return store


# How many definitions other than today's are kept, ready to read with.
_MAX_STORES = 64


@lru_cache(maxsize=_MAX_STORES)
def _store_of(type_name: str, definition: str) -> Typestore:
    """Return a store of this definition alone: a message and those nested in it."""
    if len(definition) > MAX_DEFINITION:
        raise InputError(
            type_name, f"a definition of at most {MAX_DEFINITION} characters", f"{len(definition)}"
        )
    store = get_typestore(Stores.EMPTY)
    try:
        given = get_types_from_msg(definition, type_name)
        store.register(_of_known_fields(type_name, given, {}))
        store.get_msgdef(type_name)
    except InputError:
        raise
    except (TypesysError, LookupError, ValueError, SyntaxError, RecursionError) as error:
        raise InputError(type_name, "its definition", _short(error)) from None
    return store


def _of_known_fields(type_name: str, given: Typesdict, done: Typesdict) -> Typesdict:
    """Return the given types with today's fields of the same names, in the given order.

    Nothing else of a definition is used: the library makes code of it, and a field of another type
    may stand for any amount of memory.
    """
    if type_name in done:
        return done
    known: dict[str, FieldDesc] = dict(_store().fielddefs[type_name][1])
    names = [name for name, _ in given[type_name][1]]
    for name, kind in given[type_name][1]:
        if name not in known:
            raise InputError(
                type_name,
                f"fields among {', '.join(known)}",
                repr(name),
                "update focus_planner",
            )
        if kind != known[name] or names.count(name) > 1:
            what = "twice" if names.count(name) > 1 else "of another type"
            raise InputError(type_name, "its definition", f"one with {name} {what}")
    done[type_name] = ([], [(name, known[name]) for name in names])
    for name in names:
        nested = _nested(known[name])
        if nested:
            _of_known_fields(nested, given, done)
    return done


def _nested(kind: FieldDesc) -> str:
    """Return the name of the message that a field is or is a sequence of; "" if it is of none."""
    of_each: Any = kind[1][0] if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else kind
    return str(of_each[1]) if of_each[0] == Nodetype.NAME else ""


def _deserialized(store: Typestore, type_name: str, payload: bytes) -> Message:
    # Not the library's deserialize_cdr, which refuses bytes after the end: rclpy leaves some where
    # it overestimated the size of a message, and ignores them when reading.
    little_endian = _LITTLE_ENDIAN.get(bytes(payload[:2]))
    try:
        if little_endian is None or len(payload) < _ENCAPSULATION:
            raise SerdeError("no plain CDR")
        known = store.get_msgdef(type_name)
        read = known.deserialize_cdr_le if little_endian else known.deserialize_cdr_be
        return read(memoryview(payload)[_ENCAPSULATION:], 0, known.cls, store)[0]
    except _BROKEN as error:
        raise InputError(
            f"{type_name} message", "its serialized form", f"other bytes ({_short(error)})"
        ) from None


def _short(error: Exception) -> str:
    return re.sub(r"\s+", " ", str(error) or type(error).__name__)[:200]


def _plain(value: Any) -> Any:
    if hasattr(value, "__msgtype__"):
        return fields_of(value)
    return [_plain(item) for item in value] if isinstance(value, list) else value


def _filled(store: Typestore, type_name: str, given: Fields | Message) -> Message:
    if not isinstance(given, dict):
        return given
    members = store.fielddefs[type_name][1]
    unknown = given.keys() - {name for name, _ in members}
    if unknown:
        raise TypeError(
            f"{type_name}: expected fields among {', '.join(name for name, _ in members)},"
            f" got {min(unknown)!r}"
        )
    values = {
        name: _value(store, kind, given[name]) if name in given else _default(store, kind)
        for name, kind in members
    }
    return store.types[type_name](**values)


def _value(store: Typestore, kind: Any, value: Any) -> Any:
    """Return a value in the form that the library expects."""
    node, description = kind
    if node == Nodetype.NAME:
        return _filled(store, description, value)
    if node == Nodetype.BASE:
        return value
    of_each, _ = description
    if of_each[0] == Nodetype.NAME:
        return [_filled(store, of_each[1], item) for item in value]
    if of_each[1][0] == "string":
        return list(value)
    if isinstance(value, (bytes, bytearray, memoryview)):
        return np.frombuffer(value, np.uint8)
    return np.asarray(value, _NUMBERS[of_each[1][0]]).ravel()


def _default(store: Typestore, kind: Any) -> Any:
    node, description = kind
    if node == Nodetype.NAME:
        return _filled(store, description, {})
    if node == Nodetype.BASE:
        name = description[0]
        return "" if name == "string" else np.dtype(_NUMBERS[name]).type(0).item()
    of_each, length = description
    count = length if node == Nodetype.ARRAY else 0
    if of_each[0] == Nodetype.NAME or of_each[1][0] == "string":
        return [_default(store, of_each) for _ in range(count)]
    return np.zeros(count, _NUMBERS[of_each[1][0]])
