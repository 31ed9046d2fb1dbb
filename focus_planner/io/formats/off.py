"""Meshes from off files: their counts, then a line for every vertex and every polygon."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    DIGITS,
    SURFACE,
    BrokenFileError,
    read_bytes,
    refusing,
    unfinished_line,
    unreadable,
    without_byte_order_mark,
)
from focus_planner.io.formats.contents import (
    SurfaceContents,
    check_announced,
)
from focus_planner.io.formats.polygons import triangulate
from focus_planner.io.formats.tables import columns_of_lines
from focus_planner.io.quoting import word as quoted

_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")
_COMMENT = re.compile(r"#[^\n]*")
# Texture coordinates, colours and normals of vertices; four coordinates, or n of them.
_KEYWORD = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF\b")


def read_off(path: Path) -> SurfaceContents:
    """Read an off file.

    Raises
    ------
    InputError
        If it is truncated, no off file, or of another kind than polygons in space.
    """
    with refusing(path, "off"):
        return _read(path, without_byte_order_mark(read_bytes(path, SURFACE)))


def _read(path: Path, content: bytes) -> SurfaceContents:
    text = _COMMENT.sub("", content.decode("utf-8", "replace")).strip()
    keyword = _KEYWORD.match(text)
    if keyword is None:
        raise unreadable(path, "off", "no OFF at its beginning")
    lines = [line for line in text[keyword.end() :].splitlines() if line.strip()]
    if keyword[4] or keyword[5] or (lines and lines[0].split()[0] == "BINARY"):
        raise InputError(
            str(path), "text with three coordinates per vertex", f"{text[:20]!r}", "convert it"
        )
    try:
        vertices, faces, *_ = (int(count) for count in lines[0].split())
    except (IndexError, ValueError):
        raise unreadable(path, "off", "no counts of vertices and faces") from None
    check_announced(path, "off", "lines", len(lines) - 1, vertices + faces)
    wanted = [0, 1, 2, *((3, 4, 5) if keyword[3] else ())]
    table = columns_of_lines(lines[1 : vertices + 1], wanted) if vertices else np.empty((0, 3))
    corners, counts = _polygons(lines[vertices + 1 :])
    return SurfaceContents(
        table[:, :3],
        triangulate(table[:, :3], corners, counts),
        table[:, 3:] if keyword[3] else None,
        notes=unfinished_line(path, content, DIGITS),
    )


def _polygons(lines: list[str]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the corners of all polygons, and how many each has; colours may follow them."""
    corners, counts = list[int](), list[int]()
    for line in lines:
        count, *words = line.split()
        counts.append(_whole(count))
        if not 0 < counts[-1] <= len(words):
            raise BrokenFileError(f"{len(words)} corners of the {count} announced")
        corners += map(_whole, words[: counts[-1]])
    return np.array(corners, dtype=np.int64), np.array(counts, dtype=np.int64)


def _whole(text: str) -> int:
    if not _WHOLE.fullmatch(text):
        raise BrokenFileError(f"{quoted(text)} in place of a whole number")
    return int(text)
