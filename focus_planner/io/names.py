"""Names of cameras out of paths of images and names of frames."""

from __future__ import annotations

import re
from collections.abc import Sequence

from focus_planner.core.validation import InputError

_OTHERS = re.compile(r"[^A-Za-z0-9]+")


def camera_names(what: str, paths: Sequence[str]) -> list[str]:
    """Return a camera's name for each path.

    Parts that all paths begin or end with are left out: ``cam01/0001`` and ``cam02/0001`` make
    ``cam01`` and ``cam02``. Whatever stands between letters and digits becomes one underscore, and
    a name that does not start with a letter gets ``cam_`` in front.

    Parameters
    ----------
    what : str
        What the paths are of, for the error: ``"images"``.
    paths : sequence of str
        Parts separated by slashes, without suffixes.

    Raises
    ------
    InputError
        If two would have one name, or one has no letter or digit to make a name of.
    """
    names = [_name(what, path) for path in _shortened(paths)]
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


def _shortened(paths: Sequence[str]) -> list[str]:
    parts = [[part for part in path.split("/") if part] for path in paths]
    for end in (0, -1):
        while len(parts) > 1 and _have_common(parts, end):
            for part in parts:
                del part[end]
    return ["/".join(part) for part in parts]


def _have_common(parts: list[list[str]], end: int) -> bool:
    return all(len(part) > 1 for part in parts) and len({part[end] for part in parts}) == 1


def _name(what: str, path: str) -> str:
    name = _OTHERS.sub("_", path).strip("_")
    if not name:
        raise InputError(what, "names with a letter or digit", repr(path))
    return name if name[0].isalpha() else f"cam_{name}"
