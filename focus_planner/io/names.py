"""Camera names from image paths and frame names."""

from __future__ import annotations

import re
from collections.abc import Sequence

from focus_planner.core.validation import InputError

_MAX_PATH = 4096  # characters, as in Linux
_SEPARATORS = re.compile(r"[^A-Za-z0-9]+")


def camera_names(what: str, paths: Sequence[str]) -> list[str]:
    """Return a camera name for each path.

    Leading and trailing parts that all paths have in common are dropped: ``cam01/0001`` and
    ``cam02/0001`` become ``cam01`` and ``cam02``. Every run of other characters than letters and
    digits becomes an underscore, and names that do not start with a letter get the prefix
    ``cam_``.

    Parameters
    ----------
    what : str
        What the paths refer to, for errors: ``"images"``.
    paths : sequence of str
        Parts separated by slashes, without suffixes.

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
                f"{first[name]!r} and {path!r}, both of which make {name}",
                "rename one, or choose fewer",
            )
        first[name] = path
    return names


def _without_common_ends(paths: Sequence[str]) -> list[str]:
    parts = [[part for part in path.split("/") if part] for path in paths]
    for end in (0, -1):
        while len(parts) > 1 and _all_share(parts, end):
            for part in parts:
                del part[end]
    return ["/".join(part) for part in parts]


def _all_share(parts: list[list[str]], end: int) -> bool:
    return all(len(part) > 1 for part in parts) and len({part[end] for part in parts}) == 1


def _name(what: str, path: str) -> str:
    name = _SEPARATORS.sub("_", path).strip("_")
    if not name:
        raise InputError(what, "names with a letter or digit", repr(path))
    return name if name[0].isalpha() else f"cam_{name}"
