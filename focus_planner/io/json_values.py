# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading JSON of any origin: bounded in depth and in the length of its numbers."""

from __future__ import annotations

import json
import re
from typing import Any

from focus_planner.core.validation import InputError

#: Objects and lists within one another; what is read here has at most ten.
MAX_DEPTH = 50
_MAX_DIGITS = 100  # Python converts longer numbers slowly, or not at all
# A string as a whole, also one without an end, or a bracket.
_TOKEN = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*(?:"|\\?\Z)|[\[{\]}]', re.DOTALL)


def read_json(where: str, text: str | bytes, what: str) -> Any:
    """Return the contents of a JSON text.

    Parameters
    ----------
    where : str
        Where the text is from, for errors.
    text : str or bytes
        UTF-8 if bytes.
    what : str
        What was expected there, for errors.

    Raises
    ------
    InputError
        If it is not valid JSON, or beyond a limit; names the line, and quotes nothing.
    """
    try:
        text = text if isinstance(text, str) else text.decode()
        _check_depth(text)
        return json.loads(text, parse_int=_whole)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        got = f"invalid JSON: {place}: {error.msg.partition(':')[0]}"
    except UnicodeDecodeError:
        got = "something that is not text"
    except ValueError as error:
        got = f"invalid JSON: {error}"
    raise InputError(where, what, got)


def _check_depth(text: str) -> None:
    if text.count("[") + text.count("{") <= MAX_DEPTH:
        return
    depth = 0
    for match in _TOKEN.finditer(text):
        sign = text[match.start()]
        depth += (sign in "[{") - (sign in "]}")
        if depth > MAX_DEPTH:
            raise ValueError(f"more than {MAX_DEPTH} lists within one another")


def _whole(digits: str) -> int:
    if len(digits) > _MAX_DIGITS:
        raise ValueError(f"a number of {len(digits):,} digits")
    return int(digits)
