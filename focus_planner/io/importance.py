# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The importance of a surface's parts: from a column of its own file, or from a separate file."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.validation import InputError, check_array, first_few
from focus_planner.io.files import (
    DIGITS,
    MAX_BYTES,
    BrokenFileError,
    read_array,
    read_text,
    unfinished_line,
)
from focus_planner.io.formats.tables import numbers_of_text

#: Name of the property of files and of the field of messages that is used without being asked for.
IMPORTANCE = "importance"
# What it might also be, but mostly is not: scanners call their confidence so.
_SIMILAR = "weight"


def choose_importance(
    argument: str, names: Collection[str], name: str, option: str
) -> tuple[str | None, tuple[Note, ...]]:
    """Return which of the columns of a file or the fields of a message holds the importance.

    Parameters
    ----------
    argument : str
        Where the columns are, for errors and notes.
    names : collection of str
        What the file or the message says of its vertices or points.
    name : str
        The column to use. One named otherwise than ``importance`` must be there.
    option : str
        What users call ``name``.

    Returns
    -------
    name : str or None
        None where all count the same.
    notes : tuple of Note

    Raises
    ------
    InputError
        If the column is not there; names those that are.
    """
    if name in names:
        used = f"{argument}: {name} is used as the importance of the surface"
        why = "; rename it if it is something else" if name == IMPORTANCE else ", as asked"
        return name, (Note("importance", used + why),)
    if name != IMPORTANCE:
        got = first_few(names) or "none"
        raise InputError(argument, f"{name}, which {option} asks for, among its numbers", got)
    if _SIMILAR not in names:
        return None, ()
    unused = f"{argument}: {_SIMILAR} is not used, since scanners call their confidence so"
    return None, (
        Note(
            "importance", f"{unused}; if it is the importance, give {option} the value {_SIMILAR}"
        ),
    )


def load_importance(path: Path, count: int, what: str) -> tuple[NDArray[Any], tuple[Note, ...]]:
    """Read one number per vertex or point of a surface.

    Parameters
    ----------
    path : Path
        A ``.npy`` file with one array, or a text file with one number per line.
    count : int
        How many vertices or points the surface's file has.
    what : {"vertex", "point"}

    Returns
    -------
    values : (count,) array
    notes : tuple of Note
        That they were used, and whether the last may be incomplete.

    Raises
    ------
    InputError
        If the file is missing, or contains anything but one number per vertex or point.
    """
    expected = f"{count} numbers, one per {what}"
    text = ""
    if path.suffix.lower() == ".npy":
        values = check_array(str(path), read_array(path), (None,))
    else:
        text = read_text(path, expected, MAX_BYTES)
        values = _numbers(path, text, expected)
    if len(values) != count:
        raise InputError(str(path), expected, str(len(values)))
    used = Note("importance", f"{path}: used as the importance of the surface")
    return values, (used, *unfinished_line(path, text.encode(), DIGITS))


def _numbers(path: Path, text: str, expected: str) -> NDArray[Any]:
    try:
        return numbers_of_text(text.encode())
    except BrokenFileError as error:
        raise InputError(str(path), expected, str(error)) from None
