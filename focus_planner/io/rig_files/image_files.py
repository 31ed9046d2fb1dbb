# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the files of images tell of the cameras that took them, by their headers alone."""

from __future__ import annotations

import math
import unicodedata
import warnings
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from focus_planner.core.validation import InputError
from focus_planner.io.files import is_file, open_regular

_FORMATS = ("JPEG", "PNG", "TIFF", "WEBP", "BMP")
_SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp")
_ORIENTATION, _EXIF, _FOCAL_LENGTH = 0x0112, 0x8769, 0x920A
_SIDEWAYS = (5, 6, 7, 8)  # of EXIF's orientations: those that swap width and height
_LONGEST = 5.0  # metres of focal length
_HINT = "give --image WxH, or --image-folder with the images that the file names"


class ImageHeader(NamedTuple):
    """What the header of an image file tells.

    Attributes
    ----------
    width, height : int
        Pixels, as stored.
    is_sideways : bool
        Whether it is to be shown turned by a quarter.
    focal_length : float or None
        Of the lens, metres, by EXIF.
    """

    width: int
    height: int
    is_sideways: bool
    focal_length: float | None


class ImageFiles:
    """The images that a rig's file names, looked for beside it or in a folder that was given.

    Parameters
    ----------
    beside : Path
        The folder of the rig's file.
    folder : Path, optional
        Where else they are.
    size : tuple of 2 ints, optional
        Width and height, pixels, of those whose size nothing tells.
    """

    def __init__(
        self, beside: Path, folder: Path | None = None, size: tuple[int, int] | None = None
    ) -> None:
        self._folders = (beside, beside / "images") if folder is None else (folder,)
        self._given = size

    def size(self, where: str, name: str) -> tuple[int, int]:
        """Return an image's width and height, pixels.

        Parameters
        ----------
        where : str
            What names it, for errors.
        name : str
            Its path as the file has it, with slashes; its ending may be missing.

        Raises
        ------
        InputError
            If nothing tells it: there is no such image, or it is to be shown turned, so that
            programs differ on which side is its width.
        """
        if self._given is not None:
            return self._given
        header = self._header(name)
        expected = "the width and height of its image"
        if header is None:
            raise InputError(where, expected, "neither, nor an image beside it", _HINT)
        if header.is_sideways:
            got = "an image that its EXIF turns by 90°"
            remedy = "give --image WxH, as the program had it that made the file"
            raise InputError(where, expected, got, remedy)
        return header.width, header.height

    def focal_length(self, name: str) -> float | None:
        """Return the focal length of the lens that took an image, metres; None if unknown."""
        header = self._header(name)
        return None if header is None else header.focal_length

    def _header(self, name: str) -> ImageHeader | None:
        path = self._path(name)
        return None if path is None else _header(path)

    def _path(self, name: str) -> Path | None:
        """Return where an image is. A name that leads out of the folders is looked for by its end.

        What a file of another's names is opened nowhere else.
        """
        parts = PurePosixPath(name).parts
        inside = bool(parts) and ".." not in parts and parts[0] != "/" and ":" not in parts[0]
        tails = (name, parts[-1]) if inside else parts[-1:]
        for folder in self._folders:
            for tail in dict.fromkeys(tails):
                for path in _spellings(folder / tail):
                    if is_file(path):
                        return path
        return None


def _spellings(path: Path) -> Iterator[Path]:
    """Yield the path, and paths with the endings of images if it has none."""
    for form in ("NFC", "NFD"):  # as Linux and as macOS have letters with marks
        yield path.with_name(unicodedata.normalize(form, path.name)) if path.name else path
    if path.suffix.lower() not in _SUFFIXES:
        for suffix in _SUFFIXES:
            yield path.with_name(path.name + suffix)
            yield path.with_name(path.name + suffix.upper())


@lru_cache(maxsize=4096)
def _header(path: Path) -> ImageHeader | None:
    """Return what a header tells; None if it is none of an image."""
    from PIL import Image  # noqa: PLC0415 - few rigs need it

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of many pixels, which are not decoded
        try:
            with (
                open_regular(path, "an image") as file,
                Image.open(file, formats=_FORMATS) as image,
            ):
                return _told_by(image)
        except Exception:  # noqa: BLE001 - whatever the library raises for broken files
            return None


def _told_by(image: Any) -> ImageHeader:
    # Of a PNG only what precedes its pixels: Pillow would decode them to look for more.
    exif: Any = {} if image.format == "PNG" and "exif" not in image.info else image.getexif()
    try:
        of_camera = exif.get_ifd(_EXIF) if exif else {}
        focal_length = float(of_camera.get(_FOCAL_LENGTH, math.nan)) / 1000
    except (TypeError, ValueError, ArithmeticError):
        focal_length = math.nan
    width, height = image.size
    return ImageHeader(
        width,
        height,
        exif.get(_ORIENTATION) in _SIDEWAYS,
        focal_length if 0 < focal_length <= _LONGEST else None,
    )
