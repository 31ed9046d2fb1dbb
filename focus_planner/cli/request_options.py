# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Options of a request, derived from the fields of :class:`PlanRequest`."""

from __future__ import annotations

import argparse
import math
from typing import Any

from focus_planner.core.planning.field_spec import NO_LIMIT, SpecifiedField, specified_fields
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.validation import InputError


def add_request_options(group: Any, request_type: type[PlanRequest] = PlanRequest) -> None:
    """Add an option for each field."""
    for field in specified_fields(request_type):
        choices = field.spec.choices
        if isinstance(field.default, bool):
            group.add_argument(_option(field.name), action="store_true", help=_help(field))
            continue
        option = group.add_argument(
            _option(field.name),
            type=type(field.default),
            default=field.default,
            metavar=_metavar(field),
            help=_help(field),
        )
        if choices:
            # Not argparse's choices: the request itself names them in its error.
            option.completer = lambda choices=choices, **_: map(str, choices)


def request_from_options(
    options: argparse.Namespace, request_type: type[PlanRequest] = PlanRequest
) -> PlanRequest:
    """Return the request that the options ask for.

    Raises
    ------
    InputError
        If a value is out of range; called by its option.
    """
    names = [field.name for field in specified_fields(request_type)]
    try:
        return request_type(**{name: getattr(options, name) for name in names})
    except InputError as error:
        if error.argument not in names:
            raise
        option = _option(error.argument)
        raise InputError(option, error.expected, error.got, error.remedy) from None


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _metavar(field: SpecifiedField) -> str:
    if field.spec.choices:
        return "{" + ",".join(map(str, field.spec.choices)) + "}"
    return field.spec.unit.upper().partition(" ")[0] or (
        "N" if isinstance(field.default, int) else "X"
    )


def _help(field: SpecifiedField) -> str:
    default, text = field.default, field.spec.help_with(_option)
    if field.spec.unlimited:
        text += f"; {NO_LIMIT}"
    if isinstance(default, bool):
        return text.replace("%", "%%")
    shown = (
        "none" if default == math.inf else f"{default:g}" if default != str(default) else default
    )
    return f"{text} (default: {shown})".replace("%", "%%")
