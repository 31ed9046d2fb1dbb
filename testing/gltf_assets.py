# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Gltf files for tests."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

KINDS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SIZES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Asset:
    """A file under construction."""

    def __init__(self, **data: Any) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "bufferViews": [],
            "accessors": [],
            **data,
        }
        self.buffer = b""

    def view(self, data: bytes, **more: Any) -> int:
        self.buffer += bytes(-len(self.buffer) % 4)
        place = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)}
        self.json["bufferViews"].append(place | more)
        self.buffer += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: Any, kind: str = "f4", **more: Any) -> int:
        array = np.atleast_2d(np.array(values).T).T.astype(f"<{kind}")
        place = {"bufferView": self.view(array.tobytes()), "componentType": KINDS[kind]}
        place |= {"count": len(array), "type": SIZES[array.shape[1]]}
        self.json["accessors"].append(place | more)
        return len(self.json["accessors"]) - 1

    def mesh(self, *primitives: dict[str, Any], **more: Any) -> Asset:
        self.json.setdefault("meshes", []).append({"primitives": list(primitives), **more})
        return self

    def glb(self, path: Path) -> Path:
        data = self.json | {"buffers": [{"byteLength": len(self.buffer)}]}
        text = json.dumps(data).encode()
        text += b" " * (-len(text) % 4)
        parts = struct.pack("<II", len(text), 0x4E4F534A) + text
        if self.buffer:
            padded = self.buffer + bytes(-len(self.buffer) % 4)
            parts += struct.pack("<II", len(padded), 0x004E4942) + padded
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(parts)) + parts)
        return path

    def gltf(self, path: Path, uri: str) -> Path:
        buffer = {"byteLength": len(self.buffer), "uri": uri}
        path.write_text(json.dumps(self.json | {"buffers": [buffer]}))
        return path
