# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Short ``repr`` of objects that hold many numbers, for notebooks, logs and tracebacks."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import MISSING, Field, fields
from typing import Any

import numpy as np

# Longer sequences and texts are told by their length.
_MAX_ITEMS = 4
_MAX_TEXT = 80


def brief_repr(self: Any) -> str:
    """Return a dataclass as a line: arrays by their shape, long sequences by their length.

    To be assigned to ``__repr__`` in the body of a dataclass. Fields that have their default, and
    those that are not to be shown, are left out.
    """
    return f"{type(self).__name__}({', '.join(_parts(self))})"


def _parts(data: Any) -> Iterator[str]:
    for field in fields(data):
        value = getattr(data, field.name)
        if field.repr and not _is_default(field, value):
            yield f"{field.name}={_brief(value)}"


def _is_default(field: Field[Any], value: Any) -> bool:
    default = field.default if field.default_factory is MISSING else field.default_factory()
    return value is default or (type(value) is type(default) and _equal(value, default))


def _equal(one: Any, other: Any) -> bool:
    """Return whether two values are equal; arrays, which may be large, do not count as such."""
    return not isinstance(one, np.ndarray) and bool(one == other)


def _brief(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<{' × '.join(map(str, value.shape))} {value.dtype}>"
    if isinstance(value, Mapping):
        return f"<{len(value)} entries>"
    if isinstance(value, (str, bytes)):
        unit = "characters" if isinstance(value, str) else "bytes"
        return repr(value) if len(value) <= _MAX_TEXT else f"<{len(value)} {unit}>"
    if isinstance(value, (tuple, list, frozenset)):
        short = len(value) <= _MAX_ITEMS and len(repr(value)) <= _MAX_TEXT
        return repr(value) if short else f"<{len(value)} {_kind(value)}>"
    return repr(value)


def _kind(items: Collection[Any]) -> str:
    kinds = {type(item).__name__ for item in items}
    return kinds.pop() if len(kinds) == 1 else "items"
