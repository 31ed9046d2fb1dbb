# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a setting means and which values it takes, stated once where its dataclass declares it.

Whatever offers the setting to users, such as a command line or a node's parameters, is derived from
here.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple, TypeVar

from focus_planner.core.validation import InputError, check_choice, check_number, check_whole

_KEY = "spec"
_WIDTH = 92
#: Says so to users.
NO_LIMIT = "0 for no limit"
_REFERENCE = re.compile(r"``(\w+)``")

T = TypeVar("T")


@dataclass(frozen=True)
class FieldSpec:
    """The meaning and the range of a field.

    Attributes
    ----------
    help : str
        What the field means: a clause in lower case without a full stop. The name of another field
        stands in double backquotes.
    unit : str
        In the plural (``"seconds"``); empty for counts, names and ratios.
    at_least, above : float, optional
        The lower limit of a number, included or excluded.
    at_most : float, optional
        The upper limit of a number, included.
    at_most_is : str
        What the upper limit means, for the error that names it.
    choices : tuple
        All values that the field takes.
    unlimited : bool
        Whether infinity is a value, for no limit; 0 stands for it.
    """

    help: str
    unit: str = ""
    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    at_most_is: str = ""
    choices: tuple[str, ...] | tuple[int, ...] = ()
    unlimited: bool = False

    def help_with(self, name_of: Callable[[str], str]) -> str:
        """Return the help with other fields called by ``name_of``, given their names."""
        return _REFERENCE.sub(lambda match: name_of(match[1]), self.help)


class SpecifiedField(NamedTuple):
    """A field of a dataclass that has a specification."""

    name: str
    default: Any
    spec: FieldSpec

    def check(self, value: Any) -> None:
        """Raise ``InputError`` unless the field takes this value."""
        spec = self.spec
        if isinstance(self.default, str):
            check_choice(self.name, value, tuple(map(str, spec.choices)))
        elif spec.choices:
            if type(value) is not type(self.default) or value not in spec.choices:
                raise InputError(self.name, " or ".join(map(str, spec.choices)), repr(value))
        elif isinstance(self.default, bool):
            if not isinstance(value, bool):
                raise InputError(self.name, "True or False", repr(value))
        elif isinstance(self.default, int):
            self._check_at_most(check_whole(self.name, value, int(spec.at_least or 0)))
        else:
            limits = {"above": spec.above, "at_least": spec.at_least, "infinite": spec.unlimited}
            self._check_at_most(check_number(self.name, value, **limits))  # type: ignore[arg-type]

    def _check_at_most(self, number: float) -> None:
        at_most = self.spec.at_most
        if at_most is not None and number > at_most:
            meaning = f", {self.spec.at_most_is}" if self.spec.at_most_is else ""
            raise InputError(self.name, f"at most {_text(at_most)}{meaning}", _text(number))


def specified(default: T, spec: FieldSpec, *, kw_only: bool = False) -> T:
    """Declare a dataclass's field with a default and a specification.

    One that joins older fields between them is ``kw_only``, so that these keep their places for
    callers who give them by position.
    """
    declared: T = field(default=default, metadata={_KEY: spec}, kw_only=kw_only)
    return declared


def specified_fields(cls: type) -> list[SpecifiedField]:
    """Return the fields of a dataclass that have a specification, in their order."""
    return [
        SpecifiedField(each.name, each.default, each.metadata[_KEY])
        for each in fields(cls)
        if _KEY in each.metadata
    ]


def documented(cls: type[T]) -> type[T]:
    """Add the section "Parameters", made from the specifications, to a dataclass's docstring."""
    summary, *rest = (cls.__doc__ or "").partition("\n\n")
    entries = "\n".join(map(_numpydoc, specified_fields(cls)))
    cls.__doc__ = f"{summary}\n\n    Parameters\n    ----------\n{entries}" + "".join(rest)
    return cls


def _numpydoc(entry: SpecifiedField) -> str:
    spec = entry.spec
    kind = type(entry.default).__name__
    if spec.choices:
        kind = "{" + ", ".join(map(repr, spec.choices)) + "}"
    unit = f", {spec.unit}" if spec.unit else ""
    text = f"{spec.help[0].upper()}{spec.help[1:]}{f'; {NO_LIMIT}' if spec.unlimited else ''}."
    body = textwrap.fill(
        text, _WIDTH, initial_indent=8 * " ", subsequent_indent=8 * " ", break_on_hyphens=False
    )
    return f"    {entry.name} : {kind}{unit}, default {_text(entry.default)}\n{body}"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return "inf" if math.isinf(value) else f"{value:g}"
    return str(value)
