# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The textures and materials of obj files, which are in other files beside them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours, Texture
from focus_planner.io.files import MAX_TEXT, is_file, read_text
from focus_planner.io.formats.polygons import triangulate_corners
from focus_planner.io.formats.tables import columns_of_lines, numbers_of_text, words_per_line
from focus_planner.io.formats.textures import (
    Wrapped,
    file_beside,
    image_beside,
    looks_or_note,
    texture_of,
)


def statement(keyword: bytes) -> re.Pattern[bytes]:
    """Return an expression that finds the statements of a keyword, and what follows it."""
    return re.compile(rb"(?m)^[ \t]*" + keyword + rb"(?:[ \t]+([^\n]*))?$")


FACE = statement(b"fo?")  # fo in old files
_COORDINATES, _LIBRARY, _USED = statement(b"vt"), statement(b"mtllib"), statement(b"usemtl")
_KEYWORD = re.compile(rb"(?m)^[ \t]*(vt|fo?)(?:[ \t]|$)")
_OPTION = re.compile(r"-[a-z]+")
_VALUE = re.compile(r"on|off|[rgbmlz]|[-+]?[.\d][-+.\deE]*")
_DEFAULT = (204, 204, 204)  # of materials that tell no colour


class _Material(NamedTuple):
    """The colour of a material, and the name of the image that covers it, if there is one."""

    colour: tuple[int, int, int] = _DEFAULT
    image: str = ""


def read_texture(
    path: Path,
    text: bytes,
    faces: Sequence[bytes],
    points: FloatArray,
    corners: NDArray[np.int64],
    counts: NDArray[np.int64],
    notes: list[Note],
) -> Texture | None:
    """Return what the faces look like by their materials.

    Parameters
    ----------
    path : Path
    text : bytes
        The file's, without comments and continued lines.
    faces : sequence of bytes
        What is in its statements of faces.
    points : (V, 3) array
    corners, counts
        The vertices of all faces, and how many each has.
    notes : list of Note
        Is added to if images or materials cannot be read.

    Returns
    -------
    Texture or None
        None if there are no materials, or all is of the same grey.
    """
    if b"mtllib" not in text or b"usemtl" not in text:
        return None
    texture: Texture | None = looks_or_note(
        path,
        "the texture",
        lambda: _texture(path, text, faces, points, corners, counts, notes),
        notes,
    )
    return texture


def _texture(
    path: Path,
    text: bytes,
    faces: Sequence[bytes],
    points: FloatArray,
    corners: NDArray[np.int64],
    counts: NDArray[np.int64],
    notes: list[Note],
) -> Texture | None:
    lines = _COORDINATES.findall(text)
    materials = _materials(path, text, notes if lines else [])
    names, of_faces = _used(text)
    if not materials or not names:
        return None
    used = [materials.get(name, _Material()) for name in names]
    images, which = _images(path, used if lines else [], notes)
    colours = np.array([each.colour for each in used], dtype=np.uint8)
    if not images and not (np.ptp(colours, axis=0).any() or np.ptp(colours, axis=1).any()):
        return None
    places, polygons = triangulate_corners(points, corners, counts)
    materials_of = of_faces[polygons]
    coordinates = np.zeros((len(places), 3, 2))
    shown = np.full(len(places), -1)
    if images:
        of_corners = _coordinates_of_corners(text, faces, lines, len(corners))[places]
        covered = np.isfinite(of_corners).all(axis=(1, 2))
        coordinates[covered] = of_corners[covered]
        shown = np.where(covered, np.array(which)[materials_of], -1)
    return texture_of(images, Wrapped(shown, coordinates, colours[materials_of]))


def _used(text: bytes) -> tuple[list[str], NDArray[np.int64]]:
    """Return the names of materials, and the number of that of each face; "" above the first."""
    names, numbers, repeats, at, number = {"": 0}, list[int](), list[int](), 0, 0
    for match in _USED.finditer(text):
        repeats.append(len(FACE.findall(text, at, match.start())))
        numbers.append(number)
        name = (match[1] or b"").decode("utf-8", "replace").strip()
        number, at = names.setdefault(name, len(names)), match.start()
    repeats.append(len(FACE.findall(text, at)))
    numbers.append(number)
    of_faces = np.repeat(numbers, repeats)
    used, of_faces = np.unique(of_faces, return_inverse=True)
    return [list(names)[i] for i in used], of_faces.ravel()


def _images(
    path: Path, materials: Sequence[_Material], notes: list[Note]
) -> tuple[list[Colours], list[int]]:
    """Return the images of materials, and the number of that of each; -1 for none."""
    images, numbers = list[Colours](), {"": -1}
    names = [name for name in dict.fromkeys(each.image for each in materials) if name]
    for name in names:
        image = looks_or_note(
            path, "the texture", partial(image_beside, path, name, len(names)), notes
        )
        numbers[name] = -1 if image is None else len(images)
        images += [] if image is None else [image]
    return images, [numbers[material.image] for material in materials]


def _coordinates_of_corners(
    text: bytes, faces: Sequence[bytes], lines: Sequence[bytes], count: int
) -> NDArray[np.float64]:
    """Return (count, 2) the place in its image of every corner; NaN where there is none."""
    table = b"\n".join(lines)
    widths = words_per_line(table)
    if len(widths) == len(lines) and (widths == widths[0]).all() and widths[0] > 1:
        coordinates = numbers_of_text(table).reshape(len(lines), -1)[:, :2]
    else:
        coordinates = columns_of_lines(table.decode("utf-8", "replace").split("\n"), (0, 1))
    numbers = _numbers_of_corners(b"\n".join(faces), count)
    if (numbers < 0).any():
        keywords = np.array(_KEYWORD.findall(text))
        before = np.cumsum(keywords == b"vt")[keywords != b"vt"]
        back = np.repeat(before, words_per_line(b"\n".join(faces))) + numbers
        numbers = np.where(numbers < 0, back + 1, numbers)
    known = (numbers > 0) & (numbers <= len(coordinates))
    return np.where(known[:, None], coordinates[np.where(known, numbers - 1, 0)], np.nan)


def _numbers_of_corners(text: bytes, count: int) -> NDArray[np.int64]:
    """Return the number after the first slash of every corner; 0 where there is none."""
    values: NDArray[np.float64]
    parts, rest = divmod(text.count(b"/"), count)
    spread = text.replace(b"/", b" ")
    if not rest and b"//" not in text and len(spread.split()) == (parts + 1) * count and parts:
        values = numbers_of_text(spread).reshape(count, -1)[:, 1]
    else:
        words = (word.split(b"/") for word in text.split())
        values = numbers_of_text(b" ".join(w[1] or b"0" if len(w) > 1 else b"0" for w in words))
    return values.astype(np.int64)


# --- material files ----------------------------------------------------------------------------


def _materials(path: Path, text: bytes, notes: list[Note]) -> dict[str, _Material]:
    materials: dict[str, _Material] = {}
    for line in dict.fromkeys(_LIBRARY.findall(text)):
        name = line.decode("utf-8", "replace").strip()
        # Several names may stand in a line; one may have spaces.
        for each in [name] if is_file(path.parent / name) else name.split():
            found: dict[str, _Material] = looks_or_note(
                path, "the materials", partial(_materials_of, path, each), notes, {}
            )
            materials = found | materials
    return materials


def _materials_of(path: Path, name: str) -> dict[str, _Material]:
    file = file_beside(path, name)
    materials: dict[str, _Material] = {}
    current = ""
    for line in read_text(file, "materials", MAX_TEXT).splitlines():
        match line.split():
            case ["newmtl", *_]:
                current = line.split(None, 1)[1].strip() if len(line.split()) > 1 else ""
                materials[current] = _Material()
            case ["Kd", *words] if current in materials:
                materials[current] = materials[current]._replace(colour=_colour(words))
            case ["map_Kd" | "map_kd", *words] if current in materials:
                materials[current] = materials[current]._replace(image=_image_name(words))
    return materials


def _colour(words: Sequence[str]) -> tuple[int, int, int]:
    """Return a colour of 0 to 1; one number is a grey, and a spectrum or so on is none."""
    try:
        values = [float(word) for word in words[:3]]
    except ValueError:
        return _DEFAULT
    if len(values) not in (1, 3):
        return _DEFAULT
    red, green, blue = np.clip(np.nan_to_num([*values, *values, *values][:3]), 0.0, 1.0) * 255
    return round(red), round(green), round(blue)


def _image_name(words: list[str]) -> str:
    """Return the name of an image, before which options may stand with their values."""
    words = list(words)
    while len(words) > 1 and _OPTION.fullmatch(words[0]):
        del words[0]
        while len(words) > 1 and _VALUE.fullmatch(words[0]):
            del words[0]
    return " ".join(words)
