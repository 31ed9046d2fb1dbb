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
from focus_planner.io.files import (
    DIGITS,
    THE_REST,
    unfinished_line,
    unreadable,
    without_byte_order_mark,
)
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

_COMMENT = re.compile(rb"(#|//)[^\n]*")
_DECIMAL_COMMA = re.compile(rb"[-+]?\d*,\d+([eE][-+]?\d+)?")
_EMPTY_CELL = re.compile(rb"((?<=[,;])|^)[ \t]*(?=[,;])", re.MULTILINE)
_EMPTY = (b",,", b";;", b", ,", b"; ;", b"\n,", b"\n;", b"\t,", b"\t;")
_UNIT = re.compile(r"[\[(][^\])]*[\])]|[^a-z0-9_:,;\s]")
_TITLES = 50  # lines that may stand above the first point
_LAST_LINES = 20
_POINT = (("x", "y", "z"), ("points:0", "points:1", "points:2"))
_NORMAL = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"))


class _Columns(NamedTuple):
    """Which columns hold what; ``numbers`` by their titles."""

    points: Sequence[int]
    normals: Sequence[int]
    numbers: dict[str, int]


def read_text_cloud(path: Path) -> SurfaceContents:
    """Read a cloud of x, y and z per line; other columns may follow, in ``.xyzn`` the normal.

    Titles, if there are any, tell which columns are x, y, z, the normal, and others.

    Raises
    ------
    InputError
        If it is truncated, has other points than announced, or is no such text.
    """
    kind = path.suffix.lower().removeprefix(".")
    content = path.read_bytes()
    try:
        text = without_byte_order_mark(content)
        if b"\n" not in text:
            text = text.replace(b"\r", b"\n")
        titles, text = _without_titles(with_usual_nan(text))
        text = _separated(_COMMENT.sub(b"", text) if b"#" in text or b"//" in text else text)
        scans, counted = _scans(path, kind, text)
        if not counted and not content.endswith((b"\n", b"\r")):
            _check_last_digits(text)
        columns = _columns(kind, titles, min((words for words, _ in scans), default=3))
        tables = [_table(lines, words, columns) for words, lines in scans]
    except ValueError as error:
        raise unreadable(path, kind, str(error)) from None
    table = np.concatenate(tables) if tables else np.empty((0, 3 + len(columns.normals)))
    normals = table[:, 3:6] if columns.normals else None
    numbers = {
        title: table[:, i]
        for i, title in enumerate(columns.numbers, start=3 + len(columns.normals))
        if i < table.shape[1]
    }
    notes = unfinished_line(path, content, DIGITS if counted else THE_REST)
    return SurfaceContents(table[:, :3], None, normals, numbers, notes=notes)


def _without_titles(text: bytes) -> tuple[list[str], bytes]:
    """Return the titles above the first line of numbers, and the text without them."""
    titles, start, above = list[str](), 0, list[bytes]()
    for _ in range(_TITLES):
        end = text.find(b"\n", start) + 1 or len(text)
        line = text[start:end].strip()
        words = re.split(rb"[\s,;]+", line)
        if line and is_number(words[0]):
            break
        if sum(map(is_number, words)) >= 3:  # below a name of the point
            break
        if line:
            names = _UNIT.sub("", line.decode("utf-8", "replace").lower())
            titles = re.split(r"\s*[,;]\s*|\s+", names.strip())
            above.append(line)
        start = end
    else:
        if any(not _COMMENT.match(line) for line in above):
            raise ValueError(f"no line of numbers among its first {_TITLES}")
    body = text[start:]
    for line in above:  # which the next scan may have as well
        if b"\n" + line in body:
            body = re.sub(rb"(?m)^[ \t]*" + re.escape(line) + rb"[ \t\r]*$", b"", body)
    return titles, body


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
        raise ValueError(f"a single number in line {alone[0] + 1}, below points")
    for first, last in pairwise(bounds):
        counts = words[first + 1 : last]
        wanted = lines[first].strip()
        if not wanted.isdigit():
            raise ValueError(f"{wanted.decode('utf-8', 'replace')!r} in place of a point")
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
        raise ValueError(f"{width} numbers in line {above + filled[0] + 1} of the points")
    if len(others):
        raise ValueError(
            f"{words[others[0]]} numbers in line {above + others[0] + 1} of the points,"
            f" {width} in the first"
        )
    return width


def _columns(kind: str, titles: list[str], width: int) -> _Columns:
    points, normals = _titled(titles, _POINT), _titled(titles, _NORMAL)
    if not points or (kind == "xyzn" and not normals):
        normals = (3, 4, 5) if kind == "xyzn" else ()
        if normals and width < 6:
            raise ValueError(f"{width} numbers per line, where the normal follows the point")
        return _Columns((0, 1, 2), normals, {})
    if len(titles) != width:
        if tuple(points) != (0, 1, 2):
            raise ValueError(f"{len(titles)} titles of {width} columns")
        return _Columns(points, (), {})
    taken = {*points, *normals}
    return _Columns(points, normals, {title: i for i, title in enumerate(titles) if i not in taken})


def _titled(titles: list[str], choices: Sequence[tuple[str, ...]]) -> Sequence[int]:
    for names in choices:
        if set(names) <= set(titles):
            return [titles.index(name) for name in names]
    return ()


def _table(lines: bytes, words: int, columns: _Columns) -> FloatArray:
    """Return the points, the normals, and all numbers if nothing but numbers is in the lines."""
    wanted = [*columns.points, *columns.normals]
    try:
        numbers = numbers_of_text(lines).reshape(-1, words)
    except ValueError:
        text = lines.decode("utf-8", "replace").split("\n")
        return columns_of_lines([line for line in text if line.strip()], wanted)
    return numbers[:, [*wanted, *columns.numbers.values()]]


def _check_last_digits(text: bytes) -> None:
    """Raise if the last number has fewer decimals than all others of its column."""
    lines = text[-10_000:].split(b"\n")[-_LAST_LINES - 1 :]
    *before, last = (len(words[-1].partition(b".")[2]) for line in lines if (words := line.split()))
    if len(before) == _LAST_LINES and len(set(before)) == 1 and last < before[0]:
        raise ValueError(f"a last number of {last} decimals, where others have {before[0]}")
