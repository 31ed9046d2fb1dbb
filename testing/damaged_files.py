# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Files of every kind that a name can lead to, good, damaged and absurd; and who reads them.

What is damaged is drawn from a generator that the caller seeds; some of it leaves a good file. Run
as a program, it reads so many of each kind: ``python -m testing.damaged_files 500``.
"""

from __future__ import annotations

import base64
import json
import math
import re
import struct
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from focus_planner.io.camera_info import load_camera_info
from focus_planner.io.importance import load_importance
from focus_planner.io.lens_tables import load_lens_tables
from focus_planner.io.plans import load_plan, plan_to_json
from focus_planner.io.rig_files.alignment import load_alignment
from focus_planner.io.rig_files.colmap import load_colmap
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.kalibr import load_kalibr
from focus_planner.io.rig_files.metashape import load_metashape
from focus_planner.io.rig_files.nerfstudio import load_nerfstudio
from focus_planner.io.rig_files.realitycapture import load_realitycapture
from focus_planner.io.rig_files.transforms import load_transforms
from focus_planner.io.rigs import load_rig, rig_to_yaml
from focus_planner.io.surfaces import load_surface
from testing import calibrations, lens_sheets, photogrammetry
from testing.malformed import BALL, CLOUD, RIG

REQUEST = PlanRequest("em", samples=60, fresh_samples=60)
SCENE = Scene(BALL)
#: What a number may be. 400 digits are infinite as a double; Python refuses to convert 5,000.
ABSURD = (
    *("1e300", "-1e300", "1e-300", "1.0e+400", "-0.0", "0", "-1", ".nan", "nan", ".inf", "-inf"),
    *("NaN", "Infinity", "1e9", "1.0e-9", "9" * 20, "9" * 400, "9" * 5000, "0x" + "f" * 4000),
    *("4294967296", "18446744073709551616", "1:" * 200 + "1", "true", "null", "[]", "{}", '""'),
)
#: What no error may quote: the lines of a key.
SECRET = "".join(np.random.default_rng(7).choice(list("ABCDEFGHabcdefgh0123456789+/"), 64))
PRIVATE_KEY = f"-----BEGIN OPENSSH PRIVATE KEY-----\n{SECRET}\n-----END OPENSSH PRIVATE KEY-----\n"
_NUMBER = re.compile(rb"(?<![\w.#/])[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?(?![\w.])|\.inf\b")


@dataclass(frozen=True)
class Kind:
    """A kind of file: a good one, its name, and what reads it and uses what it read."""

    name: str
    content: bytes
    use: Callable[[Path], object]
    #: Files beside it, by name.
    others: tuple[tuple[str, bytes], ...] = ()

    def read(self, folder: Path, content: bytes) -> str | None:
        """Read a file of this content and use what it says; return why it was refused, or None."""
        for name, other in self.others:
            (folder / name).write_bytes(other)
        (folder / self.name).write_bytes(content)
        try:
            self.use(folder / self.name)
        except InputError as error:
            return str(error)
        return None


# --- damage ------------------------------------------------------------------------------------


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Return a file that was damaged in one to three ways."""
    for _ in range(random.integers(1, 4)):
        content = _DAMAGES[random.integers(len(_DAMAGES))](content or b"0", random)
    return content


def with_absurd_number(content: bytes, random: np.random.Generator) -> bytes:
    """Return a text with one of its numbers replaced."""
    places = list(_NUMBER.finditer(content))
    if not places:
        return _word(content, random)
    place = places[random.integers(len(places))]
    value = ABSURD[random.integers(len(ABSURD))].encode()
    return content[: place.start()] + value + content[place.end() :]


def with_every_absurd_number(content: bytes, most_places: int = 60) -> list[bytes]:
    """Return a text with each of its first numbers replaced by each of :data:`ABSURD`."""
    places = list(_NUMBER.finditer(content))[:most_places]
    return [
        content[: place.start()] + value.encode() + content[place.end() :]
        for place in places
        for value in ABSURD
    ]


def _cut(content: bytes, random: np.random.Generator) -> bytes:
    return content[: random.integers(len(content))]


def _flipped(content: bytes, random: np.random.Generator) -> bytes:
    flipped = np.frombuffer(content, np.uint8).copy()
    for at in random.integers(0, 8 * len(flipped), random.integers(1, 9)):
        flipped[at // 8] ^= 1 << (at % 8)
    return flipped.tobytes()


def _without_a_part(content: bytes, random: np.random.Generator) -> bytes:
    start, end = sorted(random.integers(0, len(content) + 1, 2))
    return content[:start] + content[end:]


def _twice(content: bytes, random: np.random.Generator) -> bytes:
    start, end = sorted(random.integers(0, len(content) + 1, 2))
    return content[:end] + content[start:]


def _inserted(content: bytes, random: np.random.Generator) -> bytes:
    at, what = random.integers(len(content) + 1), _INSERTED[random.integers(len(_INSERTED))]
    return content[:at] + what + content[at:]


def _word(content: bytes, random: np.random.Generator) -> bytes:
    """Return the file with eight bytes replaced by those of a number, as binary files hold them."""
    value, at = _WORDS[random.integers(len(_WORDS))], int(random.integers(len(content)))
    return content[:at] + value + content[at + len(value) :]


def _spliced(content: bytes, random: np.random.Generator) -> bytes:
    other = list(KINDS.values())[random.integers(len(KINDS))].content
    return content[: random.integers(len(content))] + other[random.integers(len(other)) :]


_DAMAGES = (
    *(_cut, _flipped, _without_a_part, _twice, _inserted, _word, _spliced),
    *(with_absurd_number, with_absurd_number),
)
_INSERTED = (
    *(b"[" * 2000, b"{" * 2000, b'{"a":' * 2000, b"- " * 2000, b"\0", b"\xff\xfe", b"\x80", b'"'),
    *(b"&a ", b"*a ", b"<<: ", b"!!float ", b"!!python/name:os.system ", b"\n---\n", b"? "),
    *(b"\r", b"\n" * 50, b"\t", b"#", b"%TAG ! x\n", PRIVATE_KEY.encode(), b"9" * 3000, b"\x1b[2J"),
)
_WORDS = (
    *(struct.pack("<d", x) for x in (1e300, -1e300, 1e-300, -0.0, math.nan, math.inf, 1e9)),
    *(struct.pack("<f", x) for x in (3e38, 1e-38, math.nan, -math.inf)),
    *(struct.pack("<Q", x) for x in (0, 1, 2**16, 2**31, 2**63, 2**64 - 1)),
    *(struct.pack("<I", x) for x in (0, 2**24, 2**31, 2**32 - 1)),
)


def aliases(levels: int = 9, width: int = 9) -> bytes:
    """Return YAML that stands for ``width ** levels`` values."""
    lines = ["a0: &a0 [" + ", ".join(["x"] * width) + "]"]
    lines += [f"a{i}: &a{i} [" + ", ".join([f"*a{i - 1}"] * width) + "]" for i in range(1, levels)]
    return "\n".join(lines).encode()


# --- use ---------------------------------------------------------------------------------------


def _plan(scene: Scene, rig: object) -> None:
    with suppress(InputError):  # cameras may well look elsewhere by now
        assert plan_focus(scene, rig, REQUEST).cost >= 0  # type: ignore[arg-type]


def _plan_with(rig: object) -> None:
    text = rig_to_yaml(rig)  # type: ignore[arg-type]
    assert yaml.safe_load(text)["cameras"]
    _plan(SCENE, rig)


def _plan_for(path: Path) -> None:
    _plan(Scene(load_surface(path)), RIG)


def _plan_by_tables(path: Path) -> None:
    _plan(SCENE, load_lens_tables(path).apply(RIG))


def _plan_by_camera_info(path: Path) -> None:
    image: CameraIntrinsics = load_camera_info(path)
    _plan_with(load_transforms_of(path.with_name("tf.yaml"), image))


def load_transforms_of(path: Path, image: CameraIntrinsics) -> object:
    return load_transforms(path, convention="optical", scale=1.0, intrinsics_of=lambda _: image)[0]


def _plan_by_transforms(path: Path) -> None:
    _plan_with(load_transforms(path)[0])


def _plan_by(load: Callable[..., tuple[object, object]]) -> Callable[[Path], None]:
    options = ImportOptions(scale=1.0, size=(580, 870))
    return lambda path: _plan_with(load(path, options)[0])


def _plan_by_xmp(path: Path) -> None:
    _plan_with(load_realitycapture(path.parent, ImportOptions(scale=1.0, size=(580, 870)))[0])


def _plan_by_colmap(path: Path) -> None:
    _plan_with(load_colmap(path.parent))


def _plan_by_alignment(path: Path) -> None:
    _plan_with(load_colmap(path.parent, rig_from_model=load_alignment(path)))


def _count(path: Path) -> None:
    values, _ = load_importance(path, len(CLOUD.points), "point")
    surface = type(CLOUD)(CLOUD.points, CLOUD.normals, values)
    _plan(Scene(surface), RIG)


def _tell(path: Path) -> None:
    plan = load_plan(path)
    assert plan.summary()
    assert plan_to_json(plan)
    assert all(0 < each.focus_distance < math.inf for each in plan.cameras)
    assert plan.sensor_offsets is None or plan.gap is not None or plan.lower_bound is None


# --- good files --------------------------------------------------------------------------------


def _npy(values: np.ndarray) -> bytes:
    stream = BytesIO()
    np.save(stream, values)
    return stream.getvalue()


def _rows(values: np.ndarray, first: str = "", last: str = "\n") -> str:
    return last.join(first + " ".join(map(repr, row)) for row in values.tolist()) + last


def _written(write: Callable[[Path], None], name: str) -> bytes:
    with TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def _colmap_texts() -> dict[str, bytes]:
    with TemporaryDirectory() as folder:
        model = Path(folder) / "model"
        calibrations.write_colmap(model)
        return {file.name: file.read_bytes() for file in model.iterdir()}


def _colmap_binaries() -> dict[str, bytes]:
    camera = struct.pack("<QIiQQ4d", 1, 1, 1, 640, 480, 500.0, 510.0, 320.0, 240.0)
    images = struct.pack("<Q", 6)
    for i in range(6):
        angle = i * math.pi / 6
        pose = (math.cos(angle), 0.0, math.sin(angle), 0.0, 0.0, 0.0, 1.5)
        images += struct.pack("<I7dI", i, *pose, 1) + f"cam{i}/1.jpg\0".encode()
        images += struct.pack("<QddQ", 1, 3.5, 4.5, 2)
    return {"cameras.bin": camera, "images.bin": images}


def _nerfstudio() -> bytes:
    frames = [
        {
            "file_path": f"images/cam_{i}.png",
            "transform_matrix": [[1, 0, 0, 0.1 * i], [0, 1, 0, 0], [0, 0, 1, 1.5], [0, 0, 0, 1]],
        }
        for i in range(4)
    ]
    image = {"w": 580, "h": 870, "fl_x": 1190.7, "fl_y": 1190.7, "cx": 290.1, "cy": 435.2}
    return json.dumps(image | {"camera_model": "OPENCV", "k1": 0.01, "frames": frames}).encode()


def _registration() -> bytes:
    with TemporaryDirectory() as folder:
        calibrations.write_realitycapture(Path(folder) / "scan")
        return (Path(folder) / "scan" / "cameras.csv").read_bytes()


def _xmp() -> bytes:
    values = {"f": 48.0, "px": 0.002, "k1": -0.03, "k2": 0.01, "t1": 1e-4}
    turn = np.diag([1.0, -1.0, -1.0])
    return photogrammetry.realityscan_xmp(turn, np.array([0, 0, 1.5]), values, "brown3t2").encode()


def _gltf() -> tuple[dict[str, object], bytes]:
    points, corners = BALL.vertices.astype("<f4"), BALL.triangles.astype("<u2")
    data = points.tobytes() + corners.tobytes()
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": points.nbytes},
        {"buffer": 0, "byteOffset": points.nbytes, "byteLength": corners.nbytes},
    ]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": corners.size, "type": "SCALAR"},
    ]
    content: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0.0, 0.0, 0.0], "scale": [1.0, 1.0, 1.0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return content, data


def _gltf_text() -> bytes:
    content, data = _gltf()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(content | {"buffers": [{"byteLength": len(data), "uri": uri}]}).encode()


def _glb() -> bytes:
    content, data = _gltf()
    text = json.dumps(content).encode()
    text, data = text + b" " * (-len(text) % 4), data + b"\0" * (-len(data) % 4)
    length = 12 + 8 + len(text) + 8 + len(data)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    return (
        struct.pack("<4sII", b"glTF", 2, length)
        + chunks
        + struct.pack("<II", len(data), 0x4E4942)
        + data
    )


def _ply(form: str) -> bytes:
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {len(BALL.vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(BALL.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if form == "ascii":
        return (head + _rows(BALL.vertices) + _rows(BALL.triangles, "3 ")).encode()
    faces = np.empty(len(BALL.triangles), np.dtype([("n", "u1"), ("corners", "<i4", 3)]))
    faces["n"], faces["corners"] = 3, BALL.triangles
    return head.encode() + BALL.vertices.astype("<f8").tobytes() + faces.tobytes()


def _pcd(form: str) -> bytes:
    count = len(CLOUD.points)
    head = (
        f"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {form}\n"
    )
    points = CLOUD.points.astype("<f4")
    if form == "ascii":
        return (head + _rows(points)).encode()
    if form == "binary":
        return head.encode() + points.tobytes()
    raw = points.T.tobytes()
    packed = b"".join(
        bytes([len(raw[i : i + 32]) - 1]) + raw[i : i + 32] for i in range(0, len(raw), 32)
    )
    return head.encode() + struct.pack("<II", len(packed), len(raw)) + packed


def _stl(binary: bool) -> bytes:
    corners = BALL.vertices[BALL.triangles]
    if binary:
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
        records = np.zeros(len(corners), record)
        records["corners"] = corners
        return bytes(80) + struct.pack("<I", len(records)) + records.tobytes()
    facets = [
        "facet normal 0 0 0\nouter loop\n" + _rows(each, "vertex ") + "endloop\nendfacet\n"
        for each in corners
    ]
    return ("solid ball\n" + "".join(facets) + "endsolid ball\n").encode()


_TEXTS, _BINARIES = _colmap_texts(), _colmap_binaries()
_SHEET = lens_sheets.plan()
_TABLES = (
    "default: {unit: dioptres}\ncameras:\n"
    "  cam_0_00: {unit: steps, whole: true, distances: [0.3, 1.0, .inf], values: [9, 60, 90]}\n"
    "  cam_0_01: &other {unit: turns, distances: [0.25, 3.5], values: [10.5, 0.25], step: 0.25}\n"
    "  cam_1_00: *other\n"
)


def _kinds() -> dict[str, Kind]:
    obj = _rows(BALL.vertices, "v ") + _rows(BALL.triangles + 1, "f ")
    off = f"OFF\n{len(BALL.vertices)} {len(BALL.triangles)} 0\n"
    tf = _written(calibrations.write_transforms, "tf.yaml")
    lines = "".join(f"{i}.5 0 1.25 0 0 0 1 world cam_{i}_optical\n" for i in range(4))
    flags = "".join(
        f"ros2 run tf2_ros static_transform_publisher --x {i}.5 --yaw 0.25 --qw 1"
        f" --frame-id world --child-frame-id c{i}_optical\n".replace(" --qw 1", "")
        for i in range(3)
    )
    info = yaml.safe_dump(
        {
            "image_width": 1920,
            "image_height": 1080,
            "camera_matrix": {"data": [1400.0, 0.0, 959.5, 0.0, 1405.0, 541.0, 0.0, 0.0, 1.0]},
            "distortion_model": "plumb_bob",
            "distortion_coefficients": {"data": [-0.2, 0.05, 0.001, -0.0005, 0.0]},
        }
    )
    matrix = "0.2 0 0 0.1\n0 0.2 0 0.2\n0 0 0.2 0.3\n0 0 0 1\n"
    surfaces = {
        "a.obj": obj.encode(),
        "a.off": (off + _rows(BALL.vertices) + _rows(BALL.triangles, "3 ")).encode(),
        "a.gltf": _gltf_text(),
        "a.glb": _glb(),
        "a.npy": _npy(CLOUD.points),
        "a.xyz": _rows(CLOUD.points).encode(),
        "a.csv": (
            "x,y,z,importance\n" + _rows(np.c_[CLOUD.points, CLOUD.importance]).replace(" ", ",")
        ).encode(),
    }
    several = {
        **{f"ply {form}": ("a.ply", _ply(form)) for form in ("ascii", "binary_little_endian")},
        **{
            f"pcd {form}": ("a.pcd", _pcd(form))
            for form in ("ascii", "binary", "binary_compressed")
        },
        **{f"stl {binary}": ("a.stl", _stl(binary)) for binary in (False, True)},
    }
    text, binary = tuple(_TEXTS.items()), tuple(_BINARIES.items())
    return {
        "rig": Kind("rig.yaml", rig_to_yaml(RIG).encode(), lambda path: _plan_with(load_rig(path))),
        "lens tables": Kind("lenses.yaml", _TABLES.encode(), _plan_by_tables),
        "plan": Kind("plan.json", plan_to_json(_SHEET).encode(), _tell),
        "camera info": Kind("info.yaml", info.encode(), _plan_by_camera_info, (("tf.yaml", tf),)),
        "transforms": Kind("tf.yaml", tf, _plan_by_transforms),
        "transforms, lines": Kind("tf.txt", lines.encode(), _plan_by_transforms),
        "transforms, flags": Kind("tf.launch", flags.encode(), _plan_by_transforms),
        "nerfstudio": Kind("transforms.json", _nerfstudio(), _plan_by(load_nerfstudio)),
        "metashape": Kind(
            "c.xml", _written(calibrations.write_metashape, "c.xml"), _plan_by(load_metashape)
        ),
        "kalibr": Kind(
            "c.yaml", _written(calibrations.write_kalibr, "c.yaml"), _plan_by(load_kalibr)
        ),
        "realitycapture": Kind("cameras.csv", _registration(), _plan_by(load_realitycapture)),
        "xmp": Kind("cam01.xmp", _xmp(), _plan_by_xmp),
        **{f"colmap {n}": Kind(n, _TEXTS[n], _plan_by_colmap, text) for n in _TEXTS},
        **{f"colmap {n}": Kind(n, _BINARIES[n], _plan_by_colmap, binary) for n in _BINARIES},
        "alignment": Kind("matrix.txt", matrix.encode(), _plan_by_alignment, text),
        "importance": Kind("importance.txt", _rows(CLOUD.importance[:, None]).encode(), _count),
        "importance npy": Kind("importance.npy", _npy(CLOUD.importance), _count),
        **{name: Kind(name, content, _plan_for) for name, content in surfaces.items()},
        **{kind: Kind(name, content, _plan_for) for kind, (name, content) in several.items()},
    }


KINDS = _kinds()


# --- many --------------------------------------------------------------------------------------


def read_damaged(kind: Kind, count: int, folder: Path, first: int = 0) -> dict[str, int]:
    """Read so many damaged files of a kind; return how many were refused, and how many read.

    Raises
    ------
    Exception
        Whatever a reader raises but ``InputError``, a warning included; its notes tell the seed.
    """
    outcomes = {"refused": 0, "read": 0}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for seed in range(first, first + count):
            content = damaged(kind.content, np.random.default_rng(seed))
            try:
                reason = kind.read(folder, content)
            except Exception as error:
                raise AssertionError(f"{kind.name}, seed {seed}: {error!r}") from error
            assert reason is None or SECRET[:12] not in reason, (kind.name, seed, reason)
            assert reason is None or "\n" not in reason
            outcomes["read" if reason is None else "refused"] += 1
    return outcomes


def main(arguments: list[str]) -> None:
    """Read damaged files of every kind, and print what became of them."""
    count = int(arguments[0]) if arguments else 500
    with TemporaryDirectory() as folder:
        for name, kind in KINDS.items():
            place = Path(folder) / re.sub(r"\W", "_", name)
            place.mkdir()
            print(f"{name}: {read_damaged(kind, count, place)}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
