# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Conversions between ROS messages and fields.

The meaning of the fields is the business of :mod:`focus_planner.messages`.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import import_module
from typing import Any, TypeVar

from focus_planner.messages.writing import Fields

# "std_msgs/Header", "sequence<geometry_msgs/Pose>"
_NESTED = re.compile(r"(\w+)/(\w+)")

Message = TypeVar("Message")


def type_name_of(message_type: type) -> str:
    """Return the name of a message's type, such as ``"shape_msgs/msg/Mesh"``."""
    return f"{message_type.__module__.split('.')[0]}/msg/{message_type.__name__}"


def message_to_ros(message_type: type[Message], fields: Fields) -> Message:
    """Return a message with these fields.

    Parameters
    ----------
    message_type : type
        A generated class.
    fields : dict
        As :mod:`focus_planner.messages.writing` makes them. Missing ones keep their defaults.

    Raises
    ------
    TypeError
        If the message, or one nested in it, has no field of that name.
    """
    message = message_type()
    _fill(message, fields)
    return message


def fields_from_ros(message: Any) -> Fields:
    """Return the fields of a message that nests no others."""
    return {name: getattr(message, name) for name in message.get_fields_and_field_types()}


def _fill(message: Any, fields: Fields) -> None:
    nested_types = _nested_types(message.__class__)
    for name, value in fields.items():
        if name not in nested_types:
            raise TypeError(
                f"{type(message).__name__} message: expected fields among"
                f" {', '.join(nested_types)}, got {name!r}"
            )
        nested_type = nested_types[name]
        if nested_type is None:
            setattr(message, name, value)
        elif isinstance(value, dict):
            # The nested message exists already; making another would take as long as filling it.
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, [message_to_ros(nested_type, item) for item in value])


def message_from_ros(message: Any) -> Fields:
    """Return the fields of a message, nested messages as dicts and sequences as lists."""
    return {name: _plain(getattr(message, name)) for name in message.get_fields_and_field_types()}


def _plain(value: Any) -> Any:
    if hasattr(value, "get_fields_and_field_types"):
        return message_from_ros(value)
    if hasattr(value, "tolist"):  # an array of numbers
        return value.tolist()
    return [_plain(each) for each in value] if isinstance(value, list) else value


@cache
def _nested_types(message_type: Any) -> dict[str, type[Any] | None]:
    """Return the class of each field's nested messages, None for plain values."""
    types = message_type.get_fields_and_field_types()
    return {name: _nested_type(text) for name, text in types.items()}


def _nested_type(text: str) -> type[Any] | None:
    nested = _NESTED.search(text)
    if nested is None:
        return None
    package, name = nested.groups()
    message_type: type[Any] = getattr(import_module(f"{package}.msg"), name)
    return message_type
