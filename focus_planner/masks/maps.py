# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures of numbers: 32-bit floating point, as TIFF or EXR; and masks, as PNG."""

from __future__ import annotations

import importlib
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.validation import InputError
from focus_planner.io.files import atomic_write


def write_mask(path: Path, mask: NDArray[np.bool_]) -> None:
    """Write a mask as PNG of 8 bits: 255 where it is true, 0 elsewhere.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    _write_image(path, mask.astype(np.uint8) * np.uint8(255), "PNG", compress_level=6)


def write_tiff(path: Path, values: NDArray[np.float32], _: str) -> None:
    """Write a map as TIFF, compressed without loss.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    _write_image(path, values, "TIFF", compression="tiff_adobe_deflate")


def write_exr(path: Path, values: NDArray[np.float32], channel: str) -> None:
    """Write a map as EXR with one channel, compressed without loss.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    openexr = _openexr()
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    image = openexr.File(header, {channel: np.ascontiguousarray(values, dtype=np.float32)})
    try:
        with TemporaryDirectory() as folder:  # it writes only to a name
            image.write(str(Path(folder) / "map.exr"))
            content = (Path(folder) / "map.exr").read_bytes()
    except (OSError, RuntimeError) as error:
        raise InputError(
            gettempdir(),
            "a folder for temporary files with room for a map",
            str(getattr(error, "strerror", None) or error),
            "set TMPDIR to another folder; or choose tiff, which needs none",
        ) from None
    with atomic_write(path) as file:
        file.write(content)


def _write_image(path: Path, pixels: NDArray[Any], kind: str, **options: Any) -> None:
    from PIL import Image  # noqa: PLC0415

    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, kind, **options)
    with atomic_write(path) as file:
        file.write(stream.getvalue())


def _openexr() -> Any:
    try:
        return importlib.import_module("OpenEXR")
    except ImportError as error:
        raise InputError(
            "--maps",
            "the Python package that writes EXR",
            f"no module {error.name}",
            "install it with: pip install openexr; or choose tiff",
        ) from None


def check_writer(kind: str) -> None:
    """Raise if maps of a kind cannot be written here; called before the work, not after it.

    Raises
    ------
    InputError
        Names what to install.
    """
    if kind == "exr":
        _openexr()


#: By the ending of their files: what writes an array, whose channel is named where it has a name.
WRITERS: Mapping[str, Callable[[Path, NDArray[np.float32], str], None]] = {
    "tiff": write_tiff,
    "exr": write_exr,
}
