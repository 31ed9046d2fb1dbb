# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Requests in messages and in parameters, derived from the fields of :class:`PlanRequest`.

In parameters, as in requests, a limit of 0 is none. A message has those fields that its definition
names, and leaves open which are 0 or "": they are the parameters'. There, infinity is no limit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from focus_planner.core.planning.field_spec import specified_fields
from focus_planner.core.planning.request import PlanRequest
from focus_planner.messages.reading import Message
from focus_planner.messages.writing import Fields

_FIELD = re.compile(r"^\w+ (\w+)$", re.MULTILINE)


@cache
def request_message_fields() -> frozenset[str]:
    """Return the names of the fields of ``PlanRequest.msg``; services and actions have the same."""
    # Not by way of the type store, which takes half a second to make.
    file = files("focus_planner.messages") / "definitions" / "msg" / "PlanRequest.msg"
    return frozenset(_FIELD.findall(file.read_text(encoding="utf-8")))


def request_from_message(message: Message, defaults: PlanRequest) -> PlanRequest:
    """Return the request; what it leaves out (0, "" or no such field) is taken from ``defaults``.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    names = [each.name for each in specified_fields(type(defaults))]
    values = {name: getattr(message, name, None) or getattr(defaults, name) for name in names}
    return type(defaults)(**values)


def request_to_fields(request: PlanRequest) -> Fields:
    """Return those fields of the request that messages have; no time limit is 0."""
    values = request_to_values(request)
    return {name: values[name] for name in values if name in request_message_fields()}


def request_from_values(values: Mapping[str, Any]) -> PlanRequest:
    """Return the request of parameters by name, which may be others as well.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    return PlanRequest(**{each.name: values[each.name] for each in specified_fields(PlanRequest)})


def request_to_values(request: PlanRequest) -> dict[str, Any]:
    """Return the request as parameters by name."""
    values = {each.name: getattr(request, each.name) for each in specified_fields(type(request))}
    return {name: 0.0 if value == math.inf else value for name, value in values.items()}
