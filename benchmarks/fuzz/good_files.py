# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A small good file of every kind that the command line reads, and the command that reads it."""

from __future__ import annotations

import json
import struct
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from focus_planner import cylinder_rig
from focus_planner.io.rigs import save_rig
from testing.calibrations import (
    write_camera_info,
    write_colmap,
    write_kalibr,
    write_metashape,
    write_path,
    write_realitycapture,
    write_transforms,
)
from testing.malformed import RIG, ball

_BALL = ball(rings=7)
_VERTICES, _TRIANGLES = _BALL.vertices, _BALL.triangles
_QUICK = ("--quiet", "--method", "closest", "--samples", "50", "--fresh-samples", "50")
_BOUND = ("--bound", "none")


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes
    ----------
    name : str
        Of the file.
    good : bytes
        What is in a good one.
    argv : callable
        Returns the arguments that have it read, given its path.
    """

    name: str
    good: bytes
    argv: Callable[[Path], list[str]]


def kinds(folder: Path) -> list[Kind]:
    """Return all kinds; what their commands read besides is written to a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rig = folder / "rig.yaml"
    save_rig(cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1), rig)
    save_rig(RIG, folder / "mixed.yaml")
    (folder / "good.obj").write_bytes(_obj())
    return [*_surfaces(rig), *_beside_a_surface(folder, rig), *_rigs(folder), *_run()]


def _surfaces(rig: Path) -> list[Kind]:
    def argv(path: Path) -> list[str]:
        return ["plan", str(path), "--rig", str(rig), *_QUICK, *_BOUND]

    files = {
        "s.ply": _ply("ascii"),
        "binary.ply": _ply("binary_little_endian"),
        "s.obj": _obj(),
        "s.off": _off(),
        "s.stl": _stl(),
        "s.pcd": _pcd(),
        "s.xyz": _rows(" "),
        "s.csv": b"x,y,z\n" + _rows(","),
        "s.npy": _npy(_VERTICES),
        "s.gltf": json.dumps(_gltf(embedded=True)).encode(),
        "s.glb": _glb(),
    }
    return [Kind(name, good, argv) for name, good in files.items()]


def _beside_a_surface(folder: Path, rig: Path) -> list[Kind]:
    surface = str(folder / "good.obj")
    numbers = np.linspace(0.5, 1.0, len(_VERTICES))
    tables = b"default: {unit: steps, whole: true, distances: [0.25, 9.0], values: [200, 50]}\n"

    def option(name: str) -> Callable[[Path], list[str]]:
        start = ["plan", surface, "--rig", str(rig), *_QUICK, *_BOUND]
        return lambda path: [*start, name, str(path)]

    return [
        Kind("i.txt", "\n".join(map(str, numbers)).encode(), option("--importance")),
        Kind("i.npy", _npy(numbers), option("--importance")),
        Kind("t.yaml", tables, option("--lens-tables")),
        Kind(
            "rig.yaml",
            (folder / "mixed.yaml").read_bytes(),
            lambda path: ["plan", surface, "--rig", str(path), *_QUICK, *_BOUND],
        ),
    ]


def _rigs(folder: Path) -> list[Kind]:
    write_colmap(folder / "colmap")
    write_transforms(folder / "tf.yaml")
    write_camera_info(folder / "info")
    write_metashape(folder / "metashape.xml")
    write_path(folder / "path.csv")
    write_kalibr(folder / "camchain.yaml")
    write_realitycapture(folder / "scan")
    images, cameras = (folder / "colmap" / f"{name}.txt" for name in ("images", "cameras"))
    lines = "".join(
        f"{0.9 * x} {0.9 * y} 1 -0.5 -0.5 0.5 0.5 world c{i}_optical\n"
        for i, (x, y) in enumerate([(1, 0), (0, 1), (-1, 0)])
    ).encode()
    (folder / "tf.txt").write_bytes(lines)
    matrix = b"1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"

    def colmap(other: Path) -> Callable[[Path], list[str]]:
        """Read a model whose other file is the good one."""

        def argv(path: Path) -> list[str]:
            (path.parent / other.name).write_bytes(other.read_bytes())
            return ["rig", "colmap", str(path.parent)]

        return argv

    def transforms(path: Path) -> list[str]:
        return ["rig", "transforms", str(path)]

    def kind(name: str, *more: str) -> Callable[[Path], list[str]]:
        return lambda path: ["rig", name, str(path), *more]

    def info(path: Path) -> list[str]:
        return ["rig", "transforms", str(folder / "tf.txt"), "--camera-info", str(path)]

    def transform(path: Path) -> list[str]:
        return ["rig", "colmap", str(folder / "colmap"), "--transform", str(path)]

    return [
        Kind("images.txt", images.read_bytes(), colmap(cameras)),
        Kind("cameras.txt", cameras.read_bytes(), colmap(images)),
        Kind("tf.yaml", (folder / "tf.yaml").read_bytes(), transforms),
        Kind("tf.txt", lines, transforms),
        Kind("transforms.json", json.dumps(_nerfstudio()).encode(), kind("nerfstudio")),
        Kind("metashape.xml", (folder / "metashape.xml").read_bytes(), kind("metashape")),
        Kind(
            "path.csv", (folder / "path.csv").read_bytes(), kind("path", "--target", "0", "0", "0")
        ),
        Kind("camchain.yaml", (folder / "camchain.yaml").read_bytes(), kind("kalibr")),
        Kind(
            "cameras.csv",
            (folder / "scan" / "cameras.csv").read_bytes(),
            kind("realitycapture", "--image", "400x600"),
        ),
        Kind("info.yaml", (folder / "info" / "cam_0.yaml").read_bytes(), info),
        Kind("matrix.txt", matrix, transform),
    ]


def _run() -> list[Kind]:
    source = Path(__file__).parents[2] / "bags" / "mesh_closest"
    (file,) = source.glob("*.mcap")
    return [Kind("r.mcap", file.read_bytes(), lambda path: ["replay", str(path), "--quiet"])]


# --- contents ----------------------------------------------------------------------------------


def _rows(separator: str) -> bytes:
    lines = (separator.join(f"{x:.6f}" for x in vertex) for vertex in _VERTICES)
    return ("\n".join(lines) + "\n").encode()


def _ply(form: str) -> bytes:
    header = (
        f"ply\nformat {form} 1.0\nelement vertex {len(_VERTICES)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(_TRIANGLES)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in _TRIANGLES)
        return header + _rows(" ") + faces.encode()
    faces = b"".join(struct.pack("<Biii", 3, *map(int, triangle)) for triangle in _TRIANGLES)
    return header + _VERTICES.astype("<f4").tobytes() + faces


def _obj() -> bytes:
    vertices = "".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in _VERTICES)
    return (vertices + "".join(f"f {a} {b} {c}\n" for a, b, c in _TRIANGLES + 1)).encode()


def _off() -> bytes:
    faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in _TRIANGLES)
    return f"OFF\n{len(_VERTICES)} {len(_TRIANGLES)} 0\n".encode() + _rows(" ") + faces.encode()


def _stl() -> bytes:
    parts = [bytes(80), struct.pack("<I", len(_TRIANGLES))]
    for corners in _VERTICES[_TRIANGLES].astype("<f4"):
        parts += [bytes(12), corners.tobytes(), bytes(2)]
    return b"".join(parts)


def _pcd() -> bytes:
    count = len(_VERTICES)
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA ascii\n"
    )
    return header.encode() + _rows(" ")


def _npy(array: np.ndarray) -> bytes:
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {array.shape}, }}"
    header = header.ljust(117) + "\n"
    start = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode()
    return start + np.ascontiguousarray(array, "<f8").tobytes()


def _gltf(*, embedded: bool) -> dict[str, object]:
    data = _gltf_data()
    uri = "data:application/octet-stream;base64," + b64encode(data).decode()
    split = 12 * len(_VERTICES)
    low, high = (f(axis=0).tolist() for f in (_VERTICES.min, _VERTICES.max))
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(data)} | ({"uri": uri} if embedded else {})],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": split},
            {"buffer": 0, "byteOffset": split, "byteLength": len(data) - split},
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(_VERTICES),
                "type": "VEC3",
                "min": low,
                "max": high,
            },
            {"bufferView": 1, "componentType": 5125, "count": _TRIANGLES.size, "type": "SCALAR"},
        ],
    }


def _gltf_data() -> bytes:
    return _VERTICES.astype("<f4").tobytes() + _TRIANGLES.astype("<u4").tobytes()


def _glb() -> bytes:
    text = json.dumps(_gltf(embedded=False)).encode()
    text += b" " * (-len(text) % 4)
    data = _gltf_data()
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _nerfstudio() -> dict[str, object]:
    def frame(i: int) -> dict[str, object]:
        angle = 2 * np.pi * i / 3
        c, s = float(np.cos(angle)), float(np.sin(angle))
        matrix = [[-s, 0, c, c], [c, 0, s, s], [0, 1, 0, 0], [0, 0, 0, 1]]
        return {"file_path": f"images/cam{i}/1.jpg", "transform_matrix": matrix}

    image = {"w": 640, "h": 480, "fl_x": 700.0, "fl_y": 700.0, "cx": 320.0, "cy": 240.0}
    return {"camera_model": "OPENCV", **image, "frames": [frame(i) for i in range(3)]}
