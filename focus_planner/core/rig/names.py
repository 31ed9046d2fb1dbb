# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Names of cameras, which become parts of topics' names, made of any text."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection
from itertools import count

#: Characters of a camera's name: topics that contain it are limited to 247.
MAX_NAME = 100

_ALLOWED = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_OTHERS = re.compile(r"[^A-Za-z0-9]+")
# Letters that are no other letter with a mark.
_SPELT = str.maketrans(
    {"ß": "ss", "æ": "ae", "œ": "oe", "ø": "o", "ł": "l", "đ": "d", "ð": "d", "þ": "th", "ı": "i"}
    | {"ẞ": "SS", "Æ": "AE", "Œ": "OE", "Ø": "O", "Ł": "L", "Đ": "D", "Ð": "D", "Þ": "TH"}
)


def is_camera_name(text: str) -> bool:
    """Return whether a text has only letters, digits and underscores, a letter first."""
    return _ALLOWED.match(text) is not None


def as_camera_name(text: str) -> str:
    """Return a text as a camera's name; "" if nothing of it can be part of one.

    Letters lose their marks (``ä`` becomes ``a``, however it is encoded), every run of other
    characters than letters and digits becomes an underscore, and what does not start with a letter
    gets the prefix ``cam_``.
    """
    plain = unicodedata.normalize("NFKD", text.translate(_SPELT))
    unmarked = "".join(c for c in plain if not unicodedata.category(c).startswith("M"))
    name = _OTHERS.sub("_", unmarked).strip("_")
    return name if not name or name[0].isalpha() else f"cam_{name}"


def proposed_name(text: str, taken: Collection[str] = ()) -> str:
    """Return a name for a camera that cannot be called what a text says.

    Parameters
    ----------
    text : str
    taken : collection of str
        The names of the rig's other cameras, from which it differs.
    """
    name = as_camera_name(text[: 10 * MAX_NAME])[: MAX_NAME - len("_250000")] or "cam"
    if name != "cam" and name not in taken:
        return name
    first = 2 if name in taken else 1
    return next(each for i in count(first) if (each := f"{name}_{i}") not in taken)
