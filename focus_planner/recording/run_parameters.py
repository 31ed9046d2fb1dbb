# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameters as they are recorded: values to messages, and back."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from functools import lru_cache

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import message_of
from focus_planner.messages.writing import Fields
from focus_planner.parameters.declaration import Value

#: Plans for files have no limits; nor had nodes before limits were introduced.
WITHOUT_LIMITS: dict[str, Value] = {
    "max_points": 0,
    "max_triangles": 0,
    "max_cameras": 0,
    "max_problem_size": 0,
    "max_memory": 0,
}
_PARAMETER = "rcl_interfaces/msg/Parameter"


class _ParameterType(IntEnum):
    """Which field of a parameter's value is used; as in ``ParameterType.msg``."""

    BOOL = 1
    INTEGER = 2
    DOUBLE = 3
    STRING = 4
    DOUBLE_ARRAY = 8


@lru_cache(maxsize=8)
def parameters_to_messages(values: tuple[tuple[str, Value], ...]) -> list[Message]:
    """Return parameters as messages, cached because they are many and rarely change."""
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


def parameters_from_messages(parameters: Iterable[Message]) -> dict[str, Value]:
    """Return the values of parameters by name.

    Raises
    ------
    InputError
        If one is of an unknown type.
    """
    return {each.name: _parameter_from_message(each.value) for each in parameters}


def _parameter_from_message(value: Message) -> Value:
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
