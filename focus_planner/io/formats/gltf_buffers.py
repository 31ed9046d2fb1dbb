# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The data of a gltf file: its json, its buffers, and the arrays in them."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    SURFACE,
    BrokenFileError,
    read_bytes,
    unreadable,
    without_byte_order_mark,
)
from focus_planner.io.formats.contents import (
    bytes_after_end,
    optional_library,
)
from focus_planner.io.json_values import read_json

DRACO = "KHR_draco_mesh_compression"
_QUANTIZATION = "KHR_mesh_quantization"
# They change how a surface looks, not where it is.
_APPEARANCE = (
    *("KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_animation_", "KHR_xmp"),
    *("EXT_texture_", "EXT_lights_", "MSFT_texture_"),
)
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_JSON, _BIN = 0x4E4F534A, 0x004E4942
# Numbers that an accessor without data, which stands for zeros, may announce.
_MAX_ZEROS = 1 << 28


@dataclass(frozen=True, eq=False)
class Gltf:
    """A glTF asset.

    Attributes
    ----------
    path : Path
    json : dict
    chunk : bytes
        The buffer in a glb file itself.
    notes : tuple of Note
    """

    path: Path
    json: dict[str, Any]
    chunk: bytes = b""
    notes: tuple[Note, ...] = ()

    def items(self, name: str) -> list[dict[str, Any]]:
        """Return one of the top-level lists, which may be missing."""
        found: list[dict[str, Any]] = self.json.get(name, [])
        if not isinstance(found, list) or not all(isinstance(each, dict) for each in found):
            raise BrokenFileError(f"{name} that are no list of objects")
        return found

    def item(self, name: str, index: Any) -> dict[str, Any]:
        """Return one of a top-level list, by its number counted from 0."""
        items = self.items(name)
        if isinstance(index, bool) or not isinstance(index, int):
            raise BrokenFileError(f"one of its {name} by something else than a number")
        if not 0 <= index < len(items):
            raise BrokenFileError(f"number {index} of its {name}, of which there are {len(items)}")
        return items[index]

    def not_read(self, extension: str, got: str = "") -> InputError:
        """Return the error for geometry that is in an extension."""
        return InputError(
            str(self.path),
            "glTF without compression or extensions of its geometry",
            got or f"the extension {extension}",
            "export it again without, or as ply",
        )

    def accessor(self, index: int) -> NDArray[Any]:
        """Return the (count, size) numbers of an accessor; normalized ones as floats.

        Raises
        ------
        BrokenFileError
            If there are not as many as it announces.
        """
        accessor = self.item("accessors", index)
        kind, size = np.dtype(_TYPES[accessor["componentType"]]), _SIZES[accessor["type"]]
        count = accessor["count"]
        if "bufferView" in accessor:
            values = self._values(accessor, kind, count, size)
        elif count * size <= _MAX_ZEROS:
            values = np.zeros((count, size), kind)
        else:
            raise BrokenFileError(f"accessor {index} of {count} zeros")
        if "sparse" in accessor:
            values = self._with_changes(values, accessor["sparse"], kind)
        if accessor.get("normalized") and kind.kind in "iu":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def _values(
        self, place: dict[str, Any], kind: np.dtype[Any], count: int, size: int
    ) -> NDArray[Any]:
        view, data = self.item("bufferViews", place["bufferView"]), self.view(place["bufferView"])
        each = kind.itemsize * size
        stride, offset = view.get("byteStride", each), place.get("byteOffset", 0)
        # Less than a row apart, a few bytes would stand for any number of vertices.
        if stride < each or min(offset, count) < 0:
            raise BrokenFileError(f"{count} rows of {each} bytes at {offset}, {stride} bytes apart")
        if count and offset + stride * (count - 1) + each > len(data):
            raise BrokenFileError(f"{len(data)} bytes for {count} rows of {each}")
        return np.ndarray((count, size), kind, data, offset, (stride, kind.itemsize)).copy()

    def _with_changes(
        self, values: NDArray[Any], sparse: dict[str, Any], kind: np.dtype[Any]
    ) -> NDArray[Any]:
        count = sparse["count"]
        where = sparse["indices"]
        rows = self._values(where, np.dtype(_TYPES[where["componentType"]]), count, 1)[:, 0]
        values[rows] = self._values(sparse["values"], kind, count, values.shape[1])
        return values

    def view(self, index: int) -> bytes:
        """Return a part of a buffer.

        Raises
        ------
        BrokenFileError
            If it is not all there.
        """
        view = self.item("bufferViews", index)
        start, length = view.get("byteOffset", 0), view["byteLength"]
        if min(start, length) < 0:
            raise BrokenFileError("a part of a buffer before its start")
        self.item("buffers", view["buffer"])
        data: bytes = self._buffers[view["buffer"]][start : start + length]
        if len(data) < length:
            raise BrokenFileError(f"{len(data)} bytes of the {length} announced")
        return data

    @cached_property
    def _buffers(self) -> list[bytes]:
        return [self._buffer(i, buffer) for i, buffer in enumerate(self.items("buffers"))]

    def _buffer(self, index: int, buffer: dict[str, Any]) -> bytes:
        uri: str | None = buffer.get("uri")
        data: bytes
        if uri is None:
            data = self.chunk if index == 0 else b""
        elif uri.startswith("data:"):
            data = bytes_in_uri(uri, "a buffer")
        else:
            file = self.path.parent / unquote(uri)
            data = read_bytes(file, f"a buffer of {self.path.name}")
        announced = int(buffer["byteLength"])
        if len(data) < announced:
            raise BrokenFileError(f"{len(data)} bytes of the {announced} announced")
        return data

    def is_only_in_draco(self, primitive: dict[str, Any]) -> bool:
        """Return whether a primitive is compressed, and there is no copy that is not."""
        position = self.item("accessors", primitive["attributes"]["POSITION"])
        return DRACO in primitive.get("extensions", {}) and "bufferView" not in position

    def draco(self, primitive: dict[str, Any]) -> dict[str, NDArray[Any]]:
        """Return the attributes of a compressed primitive by name, and its ``indices``.

        Raises
        ------
        InputError
            If it cannot be decompressed, or is not what its accessors announce.
        """
        library = optional_library(self.path, f"glTF's {DRACO}", "DracoPy")
        packed = primitive["extensions"][DRACO]
        try:
            mesh = library.decode(self.view(packed["bufferView"]))
        except Exception:  # noqa: BLE001 - whatever the library raises
            raise self.not_read(DRACO, f"{DRACO} that cannot be decoded") from None
        by_id = {each["unique_id"]: each["data"] for each in mesh.attributes}
        found = {name: np.asarray(by_id[i]) for name, i in packed["attributes"].items()}
        if "indices" in primitive:
            found["indices"] = np.asarray(mesh.faces)
        places = {**primitive["attributes"], "indices": primitive.get("indices")}
        for name, values in found.items():
            count = values.size if name == "indices" else len(values)
            if count != self.item("accessors", places[name])["count"]:
                raise self.not_read(DRACO, f"{DRACO} with {count} numbers in {name}")
        return found


def bytes_in_uri(uri: str, what: str) -> bytes:
    """Return the bytes that a ``data:`` uri holds itself.

    Raises
    ------
    BrokenFileError
        If they are no base64.
    """
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except ValueError:
        raise BrokenFileError(f"{what} that is no base64") from None


def read_gltf_file(path: Path) -> Gltf:
    """Read a file's json, after which its required extensions are checked before anything else.

    Raises
    ------
    InputError
        If it is truncated, no glTF 2.0, or needs an extension that is not read here.
    BrokenFileError, LookupError, TypeError or ValueError
        If it is broken otherwise.
    """
    content = read_bytes(path, SURFACE)
    if content.startswith(b"glTF"):
        text, chunk, notes = _chunks(path, content)
    else:
        text, chunk, notes = without_byte_order_mark(content), b"", ()
    try:
        data = read_json(str(path), text, "json")
    except InputError as error:
        raise unreadable(path, path.suffix[1:].lower(), f"no json ({error.got})") from None
    if not isinstance(data, dict):
        raise unreadable(path, path.suffix[1:].lower(), "json of something else")
    gltf = Gltf(path, data, chunk, notes)
    for extension in data.get("extensionsRequired", []):
        known = extension in {DRACO, _QUANTIZATION} or extension.startswith(_APPEARANCE)
        if not known:
            raise gltf.not_read(extension)
    version = str(data["asset"]["version"])
    if not version.startswith("2."):
        raise InputError(str(path), "glTF 2.0", f"glTF {version}", "convert it")
    return gltf


def _chunks(path: Path, content: bytes) -> tuple[bytes, bytes, tuple[Note, ...]]:
    """Return the json and the buffer of a glb file."""
    if len(content) < 12:
        raise unreadable(path, "glb", f"{len(content)} bytes")
    version, length = np.frombuffer(content, "<u4", 2, 4).tolist()
    if version != 2:
        raise InputError(str(path), "glTF 2.0", f"version {version}", "convert it")
    if len(content) < length:
        raise unreadable(path, "glb", f"{len(content)} bytes of the {length} announced")
    chunks, at = dict[int, bytes](), 12
    while at + 8 <= length:
        size, kind = np.frombuffer(content, "<u4", 2, at).tolist()
        if at + 8 + size > length:
            raise unreadable(path, "glb", f"a chunk of {size} bytes at {at}")
        chunks.setdefault(kind, content[at + 8 : at + 8 + size])
        at += 8 + size
    notes = bytes_after_end(path, "glb", content[length:], len(content), "chunks")
    return chunks.get(_JSON, b""), chunks.get(_BIN, b""), notes
