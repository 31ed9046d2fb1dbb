# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Whatever is wrong with a file is said in the words of a user, not of Python or NumPy."""

from __future__ import annotations

import base64
import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.surfaces import load_surface

PROGRAMMERS = re.compile(
    r"invalid literal|could not|codec|out of range|out of bounds|unhashable|None|Error|dtype"
    r"|buffer is|argument|object is|operand|broadcast|unpack|subscript|inhomogeneous|\w\(\)|not"
    r" supported|base 10|literal|indices must|float64|int64|strides|reshape|iterable"
)
MUTANTS = 80
WORDS = (
    *(
        b"x",
        b"-1",
        b"1e999",
        b"nan",
        b"1,5",
        b"0x10",
        b"9" * 20,
        b"9" * 5000,
        b'"a"',
        b"[1]",
        b"{}",
    ),
    *(b"null", b"3.7", b"true", b"", b"\xff\xfe", b"[[1, 2], 3]", b"1_000", "\u0661".encode()),
)

BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype="<f4")
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = [(a, *pair) for a, b, c, d in QUADS for pair in ((b, c), (c, d))]
POINTS = np.random.default_rng(0).normal(size=(20, 3))
PCD = (
    "VERSION .7\nFIELDS x y z i\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 20\nHEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 20\nDATA "
)


def rows(values: object, before: str = "", after: str = "", separator: str = " ") -> str:
    lines = (separator.join(f"{x:g}" for x in row) for row in np.asarray(values))
    return "".join(f"{before}{line}{after}\n" for line in lines)


def gltf() -> str:
    buffer = BOX.tobytes() + np.array(TRIANGLES, dtype="<u2").tobytes()
    part = {"componentType": 5123, "count": 1, "bufferView": 1}
    sparse = {"count": 1, "indices": part, "values": {"bufferView": 0}}
    points = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "sparse": sparse}
    corners = {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}
    mesh = {"attributes": {"POSITION": 0}, "indices": 1, "mode": 4, "targets": [{"POSITION": 0}]}
    uri = "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()
    data = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": [0, 0, 0, 1], "scale": [1, 1, 1], "children": [1]}, {}],
        "meshes": [{"primitives": [mesh], "weights": [0.5]}],
        "accessors": [points, corners],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "buffers": [{"byteLength": len(buffer), "uri": uri}],
    }
    return json.dumps(data, indent=1)


def compressed() -> bytes:
    columns = POINTS.T.astype("<f4").tobytes() + bytes(80)
    packed = b"".join(bytes([31]) + columns[i : i + 32] for i in range(0, len(columns), 32))
    head = (PCD + "binary_compressed\n").encode()
    return head + struct.pack("<II", len(packed), len(columns)) + packed


def facets() -> str:
    corners = (rows(BOX[list(each)], "vertex ") for each in TRIANGLES)
    return "".join(f"facet normal 0 0 1\nouter loop\n{c}endloop\nendfacet\n" for c in corners)


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    "property float z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n"
)
FILES = {
    "a.off": "OFF\n8 6 0\n" + rows(BOX) + rows(QUADS, "4 "),
    "n.off": "NOFF\n8 6 0\n" + rows(BOX, after=" 0 0 1") + rows(QUADS, "4 "),
    "a.obj": rows(BOX, "v ") + "vn 0 0 1\n" + re.sub(
        r"(?m)(\d+)(?=[ \n])", r"\1//1", rows(np.array(QUADS) + 1, "f ")),
    "a.ply": PLY + rows(BOX) + rows(QUADS, "4 "),
    "a.stl": f"solid s\n{facets()}endsolid s\n",
    "a.gltf": gltf(),
    "a.xyz": rows(POINTS),
    "a.csv": "x,y,z\n" + rows(POINTS, separator=","),
    "named.csv": "name;x;y;z\n" + rows(POINTS, "p;", separator=";"),
    "a.pts": "20\n" + rows(POINTS),
    "a.xyzn": rows(POINTS, after=" 0 0 1"),
    "a.pcd": PCD + "ascii\n" + rows(POINTS, after=" 3"),
    "b.pcd": (PCD + "binary\n").encode()
    + b"".join(row.astype("<f4").tobytes() + bytes(4) for row in POINTS),
    "c.pcd": compressed(),
}  # fmt: skip


def mutant(content: bytes, random: np.random.Generator) -> bytes:
    """Change a word, mostly near the beginning, or a byte, or cut the file off."""
    head = content[: min(len(content), 3000) if random.random() < 0.6 else None]
    kind = random.integers(6)
    at = int(random.integers(len(head)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + bytes([random.integers(256)]) + content[at + 1 :]
    if kind == 2:
        return content[:at] + content[at + int(random.choice([1, 2, 5, 50])) :]
    words = list(re.finditer(rb"[-+\w.]+", head))
    word = words[random.integers(len(words))]
    return content[: word.start()] + WORDS[random.integers(len(WORDS))] + content[word.end() :]


@pytest.mark.parametrize("name", FILES)
def test_errors_are_in_a_users_words(tmp_path: Path, name: str) -> None:
    content = FILES[name]
    content = content.encode() if isinstance(content, str) else content
    path = tmp_path / name
    path.write_bytes(content)
    load_surface(path)
    random, refused = np.random.default_rng(7), 0
    for _ in range(MUTANTS):
        path.write_bytes(mutant(content, random))
        try:
            load_surface(path)
        except InputError as error:
            said = re.sub(r"'.*'|\".*\"", "", str(error).replace(str(tmp_path), ""))
            assert PROGRAMMERS.search(said) is None, said
            assert "\n" not in said
            refused += 1
    assert refused > MUTANTS / 8


def test_json_that_is_nested_too_deep(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").write_text('{"nodes": ' + "[" * 200_000)
    with pytest.raises(InputError, match="more than 50 lists within one another"):
        load_surface(tmp_path / "a.gltf")


def test_a_file_in_utf_16_that_is_cut_off(tmp_path: Path) -> None:
    for name in ("a.off", "a.obj", "a.ply", "a.pcd", "a.xyz", "a.gltf"):
        path = tmp_path / name
        path.write_bytes(str(FILES[name]).encode("utf-16")[:-1])
        with pytest.raises(InputError, match="got text that is not complete"):
            load_surface(path)
