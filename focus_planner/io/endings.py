# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the end of a file's name says that the file is, and which pictures can be written.

What is written is what its name says, or nothing is.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from focus_planner.core.validation import InputError

#: Pictures of pixels, by the ends of their names: the format, and how both libraries that write
#: them are to do so. Compressed without loss, or nearly so.
PIXELS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    # Of 9: as small within a few percent as by the usual 6, in half the time.
    ".png": ("png", {"compress_level": 3}),
    ".jpg": ("jpeg", {"quality": 95, "subsampling": 0}),
    ".jpeg": ("jpeg", {"quality": 95, "subsampling": 0}),
    ".tif": ("tiff", {"compression": "tiff_adobe_deflate"}),
    ".tiff": ("tiff", {"compression": "tiff_adobe_deflate"}),
}

#: Drawings can also be enlarged.
DRAWINGS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    **PIXELS,
    ".pdf": ("pdf", {}),
    ".svg": ("svg", {}),
}

_OTHER_PICTURES = frozenset(
    (".avif", ".bmp", ".eps", ".exr", ".gif", ".heic", ".jp2", ".jxl", ".ppm", ".ps", ".svgz")
    + (".tga", ".webp")
)


def ending_of(path: Path) -> str:
    """Return the end of a name, in lower case: all of a name that is nothing else, as ``.png``."""
    name = path.name
    # To Path, what begins with a dot is all name.
    return (name if name.startswith(".") and not path.suffix else path.suffix).lower()


def check_ending(option: str, path: Path, endings: Collection[str], what: str = "") -> None:
    """Raise unless a name ends in one of these, and has something before that.

    Parameters
    ----------
    option : str
        What the user calls the name.
    path : Path
    endings : collection of str
        In lower case; "" lets names without any pass.
    what : str
        What has these ends, for the error, if not only they are possible.

    Raises
    ------
    InputError
    """
    ending = ending_of(path)
    if ending not in endings:
        expected = what or f"a name that ends in {one_of(endings)}"
        raise InputError(option, expected, str(path))
    if ending and path.name.lower() == ending:
        name = path.name
        raise InputError(option, f"a name before {name}", str(path), f"such as x{name}")


def one_of(endings: Collection[str]) -> str:
    """Return the ends as a phrase: ``.csv, .html or .pdf``."""
    *others, last = filter(None, endings)
    return f"{', '.join(others)} or {last}" if others else last


def is_named_picture(path: Path) -> bool:
    """Return whether a name is that of a picture, whether or not such a picture can be written."""
    return ending_of(path) in DRAWINGS or ending_of(path) in _OTHER_PICTURES
