# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Values in the cells of a table of text, such that reading returns what was written."""

from __future__ import annotations

import re
from typing import Any

from focus_planner.evaluation.experiment import Value

_BOOLEANS = {"True": True, "False": False}
_WHOLE = re.compile(r"-?\d+")
_FLOAT = re.compile(r"-?(\d+\.\d+(e[+-]?\d+)?|\d+e[+-]?\d+|inf)|nan")


def text_of(value: Value) -> str:
    """Return a value as text; floats to the last bit.

    Raises
    ------
    ValueError
        If it would be read as something else: a string that looks like a number, or has more than
        one line.
    """
    plain: Any = value.item() if hasattr(value, "item") else value  # a scalar of NumPy
    if isinstance(plain, (bool, int, float)):
        return repr(plain)
    if not isinstance(plain, str) or value_of(plain) is not plain or {"\n", "\r"} & set(plain):
        raise ValueError(f"{value!r} cannot be told from another value in a file of results")
    return plain


def value_of(text: str) -> Value:
    """Return the value that a text stands for."""
    if text in _BOOLEANS:
        return _BOOLEANS[text]
    if _WHOLE.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text
