# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Camera names from image paths and frame names."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from fnmatch import fnmatchcase

from focus_planner.core.rig.names import as_camera_name
from focus_planner.core.validation import InputError

_MAX_PATH = 4096  # characters, as in Linux


def camera_names(
    what: str,
    paths: Sequence[str],
    remedy: str = "rename one there, or leave it out with --cameras",
) -> list[str]:
    """Return a camera name for each path.

    Leading and trailing parts that all paths have in common are dropped: ``cam01/0001`` and
    ``cam02/0001`` become ``cam01`` and ``cam02``. The rest becomes a name as
    :func:`~focus_planner.core.rig.names.as_camera_name` says.

    Parameters
    ----------
    what : str
        What the paths refer to, for errors: ``"images"``.
    paths : sequence of str
        Parts separated by slashes, without suffixes.
    remedy : str, optional
        What to do about two that would have the same name.

    Raises
    ------
    InputError
        If two paths would have the same name, or one contains no letter or digit.
    """
    if any(len(path) > _MAX_PATH for path in paths):
        raise InputError(what, f"names of at most {_MAX_PATH:,} characters", "longer ones")
    names = [_name(what, path) for path in _without_common_ends(paths)]
    first: dict[str, str] = {}
    for name, path in zip(names, paths, strict=True):
        if name in first:
            raise InputError(
                what,
                "names that differ in letters and digits, to name cameras by",
                f"{_told(first[name], path)}, both of which make {name}",
                remedy,
            )
        first[name] = path
    return names


def matches(name: str, pattern: str) -> bool:
    """Return whether a name matches a pattern, however letters with marks are encoded in either."""
    name, pattern = (unicodedata.normalize("NFC", text) for text in (name, pattern))
    return fnmatchcase(name, pattern)


def _without_common_ends(paths: Sequence[str]) -> list[str]:
    parts = [[part for part in path.split("/") if part] for path in paths]
    for end in (0, -1):
        while len(parts) > 1 and _all_share(parts, end):
            for part in parts:
                del part[end]
    return ["/".join(part) for part in parts]


def _all_share(parts: list[list[str]], end: int) -> bool:
    return all(len(part) > 1 for part in parts) and len({part[end] for part in parts}) == 1


def _told(one: str, other: str) -> str:
    """Return two names that differ for a reader too, if they do."""
    same = unicodedata.normalize("NFC", one) == unicodedata.normalize("NFC", other)
    quoted = ascii if same and one != other else repr
    return f"{quoted(one)} and {quoted(other)}"


def _name(what: str, path: str) -> str:
    name = as_camera_name(path)
    if not name:
        raise InputError(what, "names with a letter or digit from A to Z", repr(path))
    return name
