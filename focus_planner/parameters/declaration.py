# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How parameters are declared: name, default, meaning, range."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

#: Upper limit of numbers that have no other.
FAR = 1e9
#: Of a signed 64-bit integer, which ROS has for whole numbers.
MAX_INTEGER = 2**63 - 1

Value = str | int | float | tuple[float, ...]


@dataclass(frozen=True)
class Declaration:
    """One parameter.

    Attributes
    ----------
    name : str
    default : bool, int, float, str or tuple
        Also says what type the parameter is of.
    description : str
        Full sentences, with the unit.
    low, high : int or float
        Limits of a number, both included.
    read_only : bool
        Whether it can only be set when the node starts.
    plans : bool
        Whether plans depend on it.
    """

    name: str
    default: Any
    description: str
    low: int | float = 0
    high: int | float = FAR
    read_only: bool = False
    plans: bool = True


def one_of(choices: Iterable[str]) -> str:
    """Return the sentence that lists the choices."""
    return "One of: " + ", ".join(choices) + "."


def with_defaults(declarations: Iterable[Declaration], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values by name, and the defaults of parameters that are left out."""
    return {each.name: each.default for each in declarations} | dict(values)


def group(values: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """Return the values of a group (``"lens."``) by their names within it."""
    return {
        name.removeprefix(prefix): value
        for name, value in values.items()
        if name.startswith(prefix)
    }
