# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Textures of surface files: their images, and several of them as one.

What is wrong with a texture is never an error: a surface is planned for without it, and a note says
so.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path, PureWindowsPath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours, Texture
from focus_planner.core.validation import InputError
from focus_planner.io.files import BrokenFileError, read_bytes, resolved

_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "TIFF")
# More is neither decoded nor kept: a small file may announce any number.
_MAX_PIXELS = 1 << 27
_MAX_SIDE = 8192
_MAX_BYTES = 1 << 30
# Of all images of a surface: as many are decoded, one after the other, and so many kept.
_MAX_DECODED = 1 << 32
_MAX_ATLAS = 1 << 26
_MAX_REPEATS = 8
# Of images side by side, so that what interpolates between pixels does not mix them.
_MARGIN = 2
_NAME = re.compile(r"[\w.()/ -]{1,60}")
# Float32 tells places within an image apart up to here.
_FARTHEST = 1e4
_ignored: ContextVar[bool] = ContextVar("ignored", default=False)


class Wrapped(NamedTuple):
    """Which image each triangle shows, and where.

    Attributes
    ----------
    images : (T,) array of int
        -1 for a triangle of one colour.
    coordinates : (T, 3, 2) array
        As :class:`Texture` has them.
    plain : (T, 3) array of uint8
        The colours of triangles without an image.
    """

    images: NDArray[np.int64]
    coordinates: NDArray[Any]
    plain: Colours


def without_looks(path: Path, what: str, reason: str) -> Note:
    """Return the note on colours or a texture that cannot be shown."""
    return Note(
        "left_out",
        f"left out: {what} of {path}: {reason}; the plan is the same, pictures of it are without",
    )


@contextmanager
def ignoring_looks() -> Iterator[None]:
    """Read no materials and textures of the surfaces that the block reads."""
    token = _ignored.set(True)
    try:
        yield
    finally:
        _ignored.reset(token)


def looks_or_note(
    path: Path, what: str, read: Callable[[], Any], notes: list[Note], default: Any = None
) -> Any:
    """Return what ``read`` does; if it fails for what is in the file, note that and go on.

    Within :func:`ignoring_looks` nothing is read, and nothing noted.

    Parameters
    ----------
    path : Path
        Of the surface.
    what : str
        What is read, for the note.
    read : callable
    notes : list of Note
        Is added to.
    default
        Returned if it fails.
    """
    if _ignored.get():
        return default
    try:
        return read()
    except InputError as error:
        note = without_looks(path, what, f"{_quoted(Path(error.argument).name)}: {error.got}")
    except BrokenFileError as error:
        note = without_looks(path, what, str(error))
    except (
        *(ArithmeticError, AttributeError, LookupError, MemoryError),
        *(RecursionError, TypeError, ValueError),
    ):
        note = without_looks(path, what, "values that do not fit together")
    if note not in notes:
        notes.append(note)
    return default


def image_beside(path: Path, name: str, of: int = 1) -> Colours:
    """Return the image of a file in the folder of a surface, or below it; see :func:`image_of`.

    Raises
    ------
    InputError
        If it is missing, or no regular file.
    BrokenFileError
        If it is elsewhere, or no image of a size that can be shown.
    """
    return image_of(read_bytes(file_beside(path, name), "an image", _MAX_BYTES), of)


def file_beside(path: Path, name: str) -> Path:
    """Return the place of a file that a surface names, in its folder or below it.

    A place on the computer where the surface was made stands for a file beside it.

    Raises
    ------
    BrokenFileError
        If it is anywhere else.
    """
    name = name.strip().strip('"')
    told = PureWindowsPath(name)  # which also takes the slashes of others
    within = told.name if told.drive or told.root else told.as_posix()
    file = path.parent / within
    if not within or not resolved(file).is_relative_to(resolved(path.parent)):
        raise BrokenFileError(f"{_quoted(name)} is not in the folder of the surface")
    return file


def _quoted(name: str) -> str:
    """Return the name of a file if it looks like one."""
    return name if _NAME.fullmatch(name) else "a file that it names"


def image_of(content: bytes, of: int = 1) -> Colours:
    """Return (H, W, 3) the image in a file's content, made smaller if it is very large.

    Parameters
    ----------
    content : bytes
    of : int
        How many images the surface has: the more, the smaller each may be.

    Raises
    ------
    BrokenFileError
        If it is none, or has too many pixels.
    """
    # Here, as most surfaces have no texture.
    from PIL import Image  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of sizes, which are limited below
        try:
            with Image.open(io.BytesIO(content), formats=_FORMATS) as image:
                return _pixels(image, of)
        except Image.DecompressionBombError:
            raise _TooLargeError("an image of too many pixels") from None
        except _TooLargeError:
            raise
        except Exception:  # noqa: BLE001 - whatever the library raises for broken files
            raise BrokenFileError("an image that cannot be read") from None


def _pixels(image: Any, of: int) -> Colours:
    image.draft("RGB", (_MAX_SIDE, _MAX_SIDE))  # what can be decoded smaller is
    count = image.width * image.height
    most = min(_MAX_PIXELS, _MAX_DECODED // of)
    if count > most:
        raise _TooLargeError(f"an image of {image.width} x {image.height} pixels", most)
    step = math.ceil(max(image.size) / _MAX_SIDE)
    if of > 1:
        step = max(step, math.ceil(math.sqrt(count * of / _MAX_ATLAS)))
    pixels = _eight_bits(image)
    return np.asarray(pixels.reduce(step) if step > 1 else pixels)


class _TooLargeError(BrokenFileError):
    def __init__(self, what: str, most: int = _MAX_PIXELS) -> None:
        super().__init__(f"{what}, of at most {most:,}")


def _eight_bits(image: Any) -> Any:
    """Return the image as RGB; Pillow cuts off what is above 255."""
    if image.mode[0] not in "IF":
        return image.convert("RGB")
    values = np.asarray(image, dtype=np.float64)
    most = 1.0 if image.mode == "F" else 65535.0
    grey = np.clip(np.nan_to_num(values) * (255 / most), 0, 255).astype(np.uint8)
    return _from_array(np.repeat(grey[:, :, None], 3, axis=2))


def _from_array(pixels: Colours) -> Any:
    from PIL import Image  # noqa: PLC0415

    return Image.fromarray(pixels)


# --- several as one ----------------------------------------------------------------------------


def texture_of_faces(colours: Colours) -> Texture:
    """Return a texture in which each of T triangles has one of (T, 3) colours."""
    image, coordinates = _palette(colours)
    return Texture(image, coordinates.astype(np.float32))


def texture_of(images: Sequence[Colours], wrapped: Wrapped) -> Texture:
    """Return one texture that shows what several images do, side by side.

    An image that repeats within a triangle is there as often, up to eight times each way; where it
    repeats more often, it is shown larger.
    """
    which = wrapped.images.copy()
    coordinates = _usable(wrapped.coordinates)
    plain = which < 0
    images = list(images)
    if plain.any():
        palette, places = _palette(wrapped.plain[plain])
        which[plain] = len(images)
        coordinates[plain] = places
        images.append(palette)
    used, which = np.unique(which, return_inverse=True)
    images, which = [images[i] for i in used], which.ravel()
    if len(images) == 1:
        return Texture(images[0], coordinates.astype(np.float32))
    return _side_by_side(images, which, coordinates)


def _usable(coordinates: NDArray[Any]) -> NDArray[np.float64]:
    """Return finite coordinates: those that are none, or beyond all reason, are 0."""
    values = np.array(coordinates, dtype=np.float64)
    values[~(np.abs(values) <= _FARTHEST).all(axis=(1, 2))] = 0.0
    return values


def _palette(colours: Colours) -> tuple[Colours, NDArray[np.float64]]:
    """Return an image with a pixel of each colour, and (n, 3, 2) the place of each row's."""
    distinct, which = np.unique(colours, axis=0, return_inverse=True)
    width = math.ceil(math.sqrt(len(distinct)))
    height = math.ceil(len(distinct) / width)
    image = np.zeros((height * width, 3), dtype=np.uint8)
    image[: len(distinct)] = distinct
    row, column = np.divmod(which.ravel(), width)
    places = np.stack([(column + 0.5) / width, 1 - (row + 0.5) / height], axis=1)
    return image.reshape(height, width, 3), np.repeat(places[:, None], 3, axis=1)


def _side_by_side(
    images: Sequence[Colours], which: NDArray[np.int64], coordinates: NDArray[np.float64]
) -> Texture:
    # Whole repetitions aside, a triangle starts within the image.
    coordinates -= np.floor(coordinates.min(axis=1, keepdims=True))
    tiles, repeats = [], np.ones((len(images), 2))
    for i, image in enumerate(images):
        most = np.ceil(coordinates[which == i].max(axis=(0, 1)) - 1e-6)
        repeats[i] = np.clip(most, 1, _MAX_REPEATS)
        tiles.append(image)
    spans = np.maximum(coordinates.max(axis=1) / repeats[which], 1.0)
    coordinates /= spans[:, None]
    areas = [math.prod(t.shape[:2]) * r.prod() for t, r in zip(tiles, repeats, strict=True)]
    step = math.ceil(math.sqrt(max(sum(areas) / _MAX_ATLAS, 1.0)))
    tiles = [
        np.tile(_reduced(tile, step), (int(rows), int(columns), 1))
        for tile, (columns, rows) in zip(tiles, repeats, strict=True)
    ]
    sizes = [(tile.shape[0] + 2 * _MARGIN, tile.shape[1] + 2 * _MARGIN) for tile in tiles]
    places, (height, width) = _packed(sizes)
    atlas = np.zeros((height, width, 3), dtype=np.uint8)
    firsts, scales = np.empty((len(tiles), 2)), np.empty((len(tiles), 2))
    for i, (tile, (top, left), (rows, columns)) in enumerate(
        zip(tiles, places, sizes, strict=True)
    ):
        margins = ((_MARGIN, _MARGIN), (_MARGIN, _MARGIN), (0, 0))
        atlas[top : top + rows, left : left + columns] = np.pad(tile, margins, mode="wrap")
        bottom = height - top - _MARGIN - tile.shape[0]
        firsts[i] = (left + _MARGIN) / width, bottom / height
        scales[i] = np.array([tile.shape[1] / width, tile.shape[0] / height]) / repeats[i]
    moved = firsts[which][:, None] + coordinates * scales[which][:, None]
    return Texture(atlas, moved.astype(np.float32))


def _reduced(image: Colours, step: int) -> Colours:
    if step == 1 or min(image.shape[:2]) <= step:
        return image
    return np.asarray(_from_array(image).reduce(step))


def _packed(
    sizes: Sequence[tuple[int, int]],
) -> tuple[list[tuple[int, int]], tuple[int, int]]:
    """Return the top left corners of images in rows, the tallest first, and the size of all."""
    area = sum(rows * columns for rows, columns in sizes)
    width = max(math.ceil(math.sqrt(area)), *(columns for _, columns in sizes))
    places, top, left, tallest = [(0, 0)] * len(sizes), 0, 0, 0
    for i in sorted(range(len(sizes)), key=lambda i: (-sizes[i][0], i)):
        rows, columns = sizes[i]
        if left + columns > width:
            top, left, tallest = top + tallest, 0, 0
        places[i] = top, left
        left, tallest = left + columns, max(tallest, rows)
    return places, (top + tallest, width)
