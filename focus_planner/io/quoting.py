# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an error may quote of a file: never more than a short key, name or number.

A path may lead to any file, a private key among them, and errors reach logs and whoever asked.
"""

from __future__ import annotations

import re
from typing import Any

_MAX_QUOTED = 40  # characters
_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_. -]{0,39}")
# What numbers are made of, and what may have been meant for one: 1,5 or 1e-5m or -nan(ind).
_LIKE_NUMBER = re.compile(
    r"[-+.,]*\d[-+\d.,:;eE/#()_%°]{0,23}[a-zA-Z]{0,3}|[-+]?(nan|inf|ind|null|none|n/a)[()a-z]{0,5}",
    re.IGNORECASE,
)


def kind_of(value: Any) -> str:
    """Return what a value is, without its contents, where keys or a list should be."""
    if value is None:
        return "nothing"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value):,}" if value else "an empty list"
    kinds = {dict: "keys and values", str: "text", bool: "true or false"}
    return kinds.get(type(value), "a number" if isinstance(value, (int, float)) else "a date")


def abbreviated(value: Any) -> str:
    """Return a single value if it is short, else what it is."""
    if isinstance(value, (dict, list, tuple)) or value is None:
        return kind_of(value)
    if isinstance(value, int) and abs(value) >= 10**_MAX_QUOTED:
        return "a whole number of more than 40 digits"  # repr may refuse it
    text = repr(value)
    if len(text) <= _MAX_QUOTED + 2:
        return text
    return f"text of {len(value):,} characters" if isinstance(value, str) else kind_of(value)


def key_name(key: Any) -> str:
    """Return a key if it looks like one, else that it does not."""
    text = str(key) if isinstance(key, (str, bool, float)) else ""
    return text if _KEY.fullmatch(text) else "(a key that is no name)"


def word(text: str) -> str:
    """Return a word, in place of which a number was expected, if it might be meant for one."""
    return repr(text) if _LIKE_NUMBER.fullmatch(text) else "something else"
