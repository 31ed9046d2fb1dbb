# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Point clouds from text: a line per point, as people and their programs write them.

Numbers are separated by white space, commas or semicolons, with a point or a comma before the
decimals. Titles may stand above them, and the number of points; several scans may follow one
another, each below its number of points.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours
from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    DIGITS,
    SURFACE,
    THE_REST,
    BrokenFileError,
    read_bytes,
    refusing,
    unfinished_line,
    without_byte_order_mark,
)
from focus_planner.io.formats.colours import colours_among
from focus_planner.io.formats.contents import (
    SurfaceContents,
    check_announced,
)
from focus_planner.io.formats.tables import (
    columns_of_lines,
    is_number,
    numbers_of_text,
    with_usual_nan,
    words_per_line,
)
from focus_planner.io.quoting import word as quoted

_COMMENT = re.compile(rb"(#|//)[^\n]*")
_DECIMAL_COMMA = re.compile(rb"[-+]?\d*,\d+([eE][-+]?\d+)?")
_EMPTY_CELL = re.compile(rb"((?<=[,;])|^)[ \t]*(?=[,;])", re.MULTILINE)
_EMPTY = (b",,", b";;", b", ,", b"; ;", b"\n,", b"\n;", b"\t,", b"\t;")
_UNIT = re.compile(r"[\[(][^\[(\])]*[\])]|[^a-z0-9_:,;\s]")
_TITLES = 50  # lines that may stand above the first point
_LAST_LINES = 20
# Three titles are those of the point, or of the normal, if one of these finds x, y, z in them, or
# 0, 1, 2. What programs write: X, "Points:0", Points_0, pos_x, x_coord, "Point X", x_m.
_POINT = (
    re.compile(
        r"(?:(?:points?|pos|position|coord|coordinate)[_:.]?)?([xyz])(?:_?(?:coord|pos|m))?"
    ),
    re.compile(r"(?:points?|position)s?[_:.]([012])"),
)
_NORMAL = (
    re.compile(r"(?:n|normals?[_:.]?)([xyz])"),
    re.compile(r"normals?[_:.]([012])"),
)
_SURVEY = {"easting": "x", "northing": "y", "elevation": "z", "height": "z", "altitude": "z"}


# A comment with one of these is titles too, of columns in an order that is not known.
_OTHERS = {
    *("id", "index", "time", "timestamp", "t", "intensity", "label", "class", "scan", "ring"),
    *("r", "theta", "phi", "rho", "lat", "lon", "latitude", "longitude", "range", "azimuth"),
    *("g", "b", "red", "green", "blue", "nx", "ny", "nz"),
}


class _Titles(NamedTuple):
    """The titles in the line above the points; those of a comment may be anything."""

    names: list[str]
    comment: bool


class _Columns(NamedTuple):
    """Which columns hold what; ``numbers`` by their titles."""

    points: Sequence[int]
    normals: Sequence[int]
    numbers: dict[str, int]
    understood: bool = True
    # Which may be colours, where there are no titles.
    others: Sequence[int] = ()


def read_text_cloud(path: Path) -> SurfaceContents:
    """Read a cloud of x, y and z per line; other columns may follow, in ``.xyzn`` the normal.

    Titles, if there are any, tell which columns are x, y, z, the normal, and others.

    Raises
    ------
    InputError
        If it is truncated, has other points than announced, or is no such text; or if its titles do
        not say which columns are x, y and z.
    """
    kind = path.suffix.lower().removeprefix(".")
    content = read_bytes(path, SURFACE)
    with refusing(path, kind):
        text = whole = without_byte_order_mark(content)
        if b"\n" not in text:
            text = text.replace(b"\r", b"\n")
        titles, text = _without_titles(with_usual_nan(text))
        text = _separated(_COMMENT.sub(b"", text) if b"#" in text or b"//" in text else text)
        scans, counted = _scans(path, kind, text)
        if not counted and not whole.endswith((b"\n", b"\r")):
            _check_last_digits(text)
        columns = _columns(path, kind, titles, min((words for words, _ in scans), default=3))
        tables = [_table(lines, words, columns) for words, lines in scans]
    if tables:
        narrowest = min(table.shape[1] for table in tables)
        table = np.concatenate([table[:, :narrowest] for table in tables])
    else:
        table = np.empty((0, 3 + len(columns.normals)))
    normals = table[:, 3:6] if columns.normals else None
    numbers = {
        title: table[:, i]
        for i, title in enumerate(columns.numbers, start=3 + len(columns.normals))
        if i < table.shape[1]
    }
    notes = unfinished_line(path, whole, DIGITS if counted else THE_REST)
    if not columns.understood:
        notes += (_not_understood(path, titles),)
    colours = colours_among(numbers)
    if columns.others and table.shape[1] == 3 + len(columns.others):
        colours = _untitled_colours(table[:, 3:])
    return SurfaceContents(table[:, :3], None, normals, numbers, notes=notes, colours=colours)


def _untitled_colours(values: FloatArray) -> Colours | None:
    """Return columns as colours if they can hardly be anything else: normals go up to 1."""
    whole = ((values >= 0) & (values <= 255) & (values % 1 == 0)).all()
    return values.astype(np.uint8) if whole and values.max(initial=0) > 1 else None


def _not_understood(path: Path, titles: _Titles) -> Note:
    return Note(
        "left_out",
        f"{path}: the comment above its points, {' '.join(titles.names)!r}, is not understood as"
        " titles: the first three columns are taken for x, y and z; if they are others, name the"
        " columns x, y and z",
    )


def _without_titles(text: bytes) -> tuple[_Titles, bytes]:
    """Return the titles above the first line of numbers, and the text without them."""
    titles, start, above = _Titles([], comment=False), 0, list[bytes]()
    for _ in range(_TITLES):
        end = text.find(b"\n", start) + 1 or len(text)
        line = text[start:end].strip()
        words = re.split(rb"[\s,;]+", line)
        # Three numbers may follow the name of a point.
        numbers = bool(line) and (is_number(words[0]) or sum(map(is_number, words)) >= 3)
        if numbers and not _are_ordinals(words, text[end:]):
            break
        if line:
            titles = _Titles(_names(line), comment=bool(_COMMENT.match(line)))
            above.append(line)
        start = end
    else:
        if any(not _COMMENT.match(line) for line in above):
            raise BrokenFileError(f"no line of numbers among its first {_TITLES}")
    body = text[start:]
    for line in above:  # which the next scan may have as well
        if b"\n" + line in body:
            body = re.sub(rb"(?m)^[ \t]*" + re.escape(line) + rb"[ \t\r]*$", b"", body)
    return titles, body


def _are_ordinals(words: list[bytes], below: bytes) -> bool:
    """Return whether a line is 0, 1, 2, ... above numbers with decimals: pandas' titles."""
    next_line = below.partition(b"\n")[0]
    ordinals = [str(i).encode() for i in range(len(words))]
    return len(words) > 2 and words == ordinals and next_line.count(b".") > 2


def _names(line: bytes) -> list[str]:
    """Return the titles in a line, in lower case and without units."""
    text = _UNIT.sub("", line.decode("utf-8", "replace").lower()).strip()
    if re.search(r"[,;]", text):
        return ["_".join(name.split()) for name in re.split(r"[,;]", text)]
    return text.split()


def _separated(text: bytes) -> bytes:
    """Return the numbers with decimal points, separated by white space."""
    first = next((line for line in text[:100_000].split(b"\n") if len(line.split()) > 1
                  or b"," in line or b";" in line), b"")  # fmt: skip
    words = first.split()
    decimals = (b";" in first and b"," in first) or (
        len(words) > 2 and all(map(_DECIMAL_COMMA.fullmatch, words[:3]))
    )
    cells = b";" in first or (b"," in first and not decimals)
    if cells and any(sign in text for sign in _EMPTY):  # the expression takes seconds
        text = _EMPTY_CELL.sub(b"nan", text)
    if b'"' in first:
        text = text.replace(b'"', b" ")
    if decimals:
        return text.replace(b",", b".").replace(b";", b" ")
    return text.translate(bytes.maketrans(b",;", b"  "))


def _scans(path: Path, kind: str, text: bytes) -> tuple[list[tuple[int, bytes]], bool]:
    """Return the words per line and the lines of every scan; whether their points were counted."""
    words = words_per_line(text)
    alone = np.flatnonzero(words == 1)
    if not len(alone):
        return ([(_width(words, 0), text)] if words.any() else []), False
    lines = text.split(b"\n")
    bounds = [*alone.tolist(), len(words)]
    scans = []
    if words[: alone[0]].any():
        raise BrokenFileError(f"a single number in line {alone[0] + 1}, below points")
    for first, last in pairwise(bounds):
        counts = words[first + 1 : last]
        wanted = lines[first].strip()
        if not wanted.isdigit():
            said = quoted(wanted.decode("utf-8", "replace"))
            raise BrokenFileError(f"{said} in place of a point")
        check_announced(path, kind, "points", int((counts > 0).sum()), int(wanted))
        if counts.any():
            scans.append((_width(counts, first + 1), b"\n".join(lines[first + 1 : last])))
    return scans, True


def _width(words: NDArray[np.int64], above: int) -> int:
    """Return how many words every line has, of those that have any."""
    filled = np.flatnonzero(words)
    width = int(words[filled[0]])
    others = filled[words[filled] != width]
    if width < 3:
        raise BrokenFileError(f"{width} numbers in line {above + filled[0] + 1} of the points")
    if len(others):
        raise BrokenFileError(
            f"{words[others[0]]} numbers in line {above + others[0] + 1} of the points,"
            f" {width} in the first"
        )
    return width


def _columns(path: Path, kind: str, titles: _Titles, width: int) -> _Columns:
    """Return what is in which column; the point in the first three where there are no titles."""
    names = titles.names
    points, normals = _titled(names, _POINT), _titled(names, _NORMAL)
    if points and len(names) == width and (kind != "xyzn" or normals):
        taken = {*points, *normals}
        others = {name: i for i, name in enumerate(names) if i not in taken}
        return _Columns(points, normals, others)
    if points and tuple(points) != (0, 1, 2):
        raise BrokenFileError(f"{len(names)} titles of {width} columns")
    ordinals = names == [str(i) for i in range(width)]
    understood = bool(points) or len(names) != width or ordinals
    if titles.comment:
        understood = understood or _OTHERS.isdisjoint(names)
    elif not understood:
        raise InputError(
            str(path),
            "titles that say which columns are x, y and z",
            ", ".join(names),
            "name them x, y and z, or delete the line if the first three are",
        )
    if kind != "xyzn":
        first = 4 if kind == "pts" and width > 6 else 3  # in pts the intensity comes before
        untitled = (*range(first, first + 3),) if width > 5 and not names else ()
        return _Columns((0, 1, 2), (), {}, understood, untitled)
    if width < 6:
        raise BrokenFileError(f"{width} numbers per line, where the normal follows the point")
    return _Columns((0, 1, 2), (3, 4, 5), {}, understood)


def _titled(titles: list[str], choices: Sequence[re.Pattern[str]]) -> Sequence[int]:
    """Return the columns whose titles are x, y and z by the first of the choices that finds all."""
    for pattern in choices:
        found: dict[str, int] = {}
        for i, title in enumerate(titles):
            match = pattern.fullmatch(_SURVEY.get(title, title))
            if match:
                found.setdefault(match[1], i)
        if len(found) == 3:
            return [found[axis] for axis in sorted(found)]
    return ()


def _table(lines: bytes, words: int, columns: _Columns) -> FloatArray:
    """Return the points, the normals, and all numbers if nothing but numbers is in the lines."""
    wanted = [*columns.points, *columns.normals]
    try:
        numbers = numbers_of_text(lines).reshape(-1, words)
    except ValueError:
        text = lines.decode("utf-8", "replace").split("\n")
        return columns_of_lines([line for line in text if line.strip()], wanted)
    return numbers[:, [*wanted, *columns.numbers.values(), *columns.others]]


def _check_last_digits(text: bytes) -> None:
    """Raise if the last number has fewer decimals than all others of its column.

    Only where the program wrote the same number of decimals in every line: one that drops zeros at
    the end would end so by chance.
    """
    lines = text[-10_000:].split(b"\n")[-_LAST_LINES - 1 :]
    *before, last = ([len(word.partition(b".")[2]) for word in line.split()] for line in lines)
    same = all(decimals == before[0] for decimals in before)
    if len(before) == _LAST_LINES and same and last[-1:] < before[0][-1:] and last:
        raise BrokenFileError(
            f"a last number of {last[-1]} decimals, where others have {before[0][-1]}"
        )
