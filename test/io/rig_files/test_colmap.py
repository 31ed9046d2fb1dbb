# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.frames import Similarity, similarity_from_matrix, similarity_from_pose
from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.alignment import load_alignment
from focus_planner.io.rig_files.colmap import load_colmap

# The numbers and the counts of parameters are those of COLMAP's documentation.
MODELS = {
    "SIMPLE_PINHOLE": (0, "", (500, 320, 240), ()),
    "PINHOLE": (1, "", (500, 510, 320, 240), ()),
    "SIMPLE_RADIAL": (2, "plumb_bob", (500, 320, 240, 0.1), (0.1, 0, 0, 0, 0)),
    "RADIAL": (3, "plumb_bob", (500, 320, 240, 0.1, 0.2), (0.1, 0.2, 0, 0, 0)),
    "OPENCV": (
        *(4, "plumb_bob", (500, 510, 320, 240, 0.1, 0.2, 0.3, 0.4)),
        (0.1, 0.2, 0.3, 0.4, 0),
    ),
    "OPENCV_FISHEYE": (
        *(5, "equidistant", (500, 510, 320, 240, 0.1, 0.2, 0.3, 0.4)),
        (0.1, 0.2, 0.3, 0.4),
    ),
    "FULL_OPENCV": (
        *(6, "rational_polynomial", (500, 510, 320, 240, 1, 2, 3, 4, 5, 6, 7, 8)),
        (1, 2, 3, 4, 5, 6, 7, 8),
    ),
    "FOV": (7, "", (500, 510, 320, 240, 0), ()),
    "SIMPLE_RADIAL_FISHEYE": (8, "equidistant", (500, 320, 240, 0.1), (0.1, 0, 0, 0)),
    "RADIAL_FISHEYE": (9, "equidistant", (500, 320, 240, 0.1, 0.2), (0.1, 0.2, 0, 0)),
    "THIN_PRISM_FISHEYE": (
        *(10, "equidistant", (500, 510, 320, 240, 0.1, 0.2, 0, 0, 0.3, 0.4, 0, 0)),
        (0.1, 0.2, 0.3, 0.4),
    ),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        *(11, "equidistant", (500, 510, 320, 240, 0.1, 0.2, 0.3, 0.4, *[0] * 8)),
        (0.1, 0.2, 0.3, 0.4),
    ),
    "SIMPLE_DIVISION": (12, "", (500, 320, 240, 0), ()),
    "DIVISION": (13, "", (500, 510, 320, 240, 0), ()),
    "SIMPLE_FISHEYE": (14, "equidistant", (500, 320, 240), (0, 0, 0, 0)),
    "FISHEYE": (15, "equidistant", (500, 510, 320, 240), (0, 0, 0, 0)),
}
LENS = Lens(0.035, 5.0)
RIG = cylinder_rig(2, 6, lens=LENS)
Cameras = list[tuple[int, str, int, int, tuple[float, ...]]]
# id, w, x, y, z of cam_from_world, its translation, camera, name, points
Images = list[tuple[int, tuple[float, ...], tuple[float, ...], int, str, list[Any]]]
ONE: tuple[Cameras, Images] = (
    [(1, "PINHOLE", 640, 480, (500.0, 510.0, 320.0, 240.0))],
    [(1, (1, 0, 0, 0), (0, 0, 0), 1, "a.jpg", [])],
)


def write_text(folder: Path, cameras: Cameras, images: Images) -> None:
    lines = ["# Camera list", "# Number of cameras: 1", ""]
    lines += [f"{i} {m} {w} {h} {' '.join(map(repr, p))}" for i, m, w, h, p in cameras]
    (folder / "cameras.txt").write_text("\n".join(lines) + "\n")
    lines = ["# Image list with two lines of data per image:", "#   IMAGE_ID, QW, ..."]
    for i, turn, place, camera, name, points in images:
        lines.append(f"{i} {' '.join(map(repr, (*turn, *place)))} {camera} {name}")
        lines.append(" ".join(f"{x} {y} {point}" for x, y, point in points))
    (folder / "images.txt").write_text("\n".join(lines) + "\n")


def write_binary(folder: Path, cameras: Cameras, images: Images) -> None:
    data = struct.pack("<Q", len(cameras))
    for i, model, width, height, parameters in cameras:
        data += struct.pack("<IiQQ", i, MODELS[model][0], width, height)
        data += struct.pack(f"<{len(parameters)}d", *parameters)
    (folder / "cameras.bin").write_bytes(data)
    data = struct.pack("<Q", len(images))
    for i, turn, place, camera, name, points in images:
        data += struct.pack("<I7dI", i, *turn, *place, camera) + name.encode() + b"\0"
        data += struct.pack("<Q", len(points))
        data += b"".join(struct.pack("<ddq", *point) for point in points)
    (folder / "images.bin").write_bytes(data)


WRITERS = pytest.mark.parametrize("write", [write_text, write_binary])
Write = Callable[[Path, Cameras, Images], None]


def model_of(
    rig: Rig, parameters: Callable[[CameraIntrinsics], tuple[str, tuple[float, ...]]]
) -> Any:
    """Return COLMAP's cameras and images of a rig, by matrices instead of quaternions."""
    cameras: Cameras = []
    images: Images = []
    for i, (camera, turn) in enumerate(zip(rig.cameras, camera_rotations(rig), strict=True)):
        x, y, z, w = camera.orientation
        cameras.append(
            (
                7 + i,
                camera.intrinsics.width,
                camera.intrinsics.height,
                *parameters(camera.intrinsics),
            )
        )
        place = -turn.T @ camera.position
        points = [(1.5, 2.5, -1)] * (i % 3)
        images.append(
            (100 - i, (w, -x, -y, -z), tuple(place.tolist()), 7 + i, f"{camera.name}.jpg", points)
        )
    return [(i, m, w, h, p) for i, w, h, m, p in cameras], images[::-1]


def pinhole(intrinsics: CameraIntrinsics) -> tuple[str, tuple[float, ...]]:
    # The first pixel's centre is (0.5, 0.5) there.
    return "PINHOLE", (intrinsics.fx, intrinsics.fy, intrinsics.cx + 0.5, intrinsics.cy + 0.5)


def assert_same(rig: Rig, expected: Rig) -> None:
    assert [c.name for c in rig.cameras] == [c.name for c in expected.cameras]
    for own, other in zip(rig.cameras, expected.cameras, strict=True):
        np.testing.assert_allclose(own.position, other.position, atol=1e-12)
        assert abs(np.dot(own.orientation, other.orientation)) == pytest.approx(1, abs=1e-12)
        assert own.lens == other.lens
        assert (own.intrinsics.width, own.intrinsics.height) == (
            other.intrinsics.width,
            other.intrinsics.height,
        )
        for name in ("fx", "fy", "cx", "cy"):
            assert getattr(own.intrinsics, name) == pytest.approx(
                getattr(other.intrinsics, name), rel=1e-12
            )
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(expected), atol=1e-12)


@WRITERS
def test_a_cylinder_comes_back(tmp_path: Path, write: Write) -> None:
    write(tmp_path, *model_of(RIG, pinhole))
    rig = load_colmap(tmp_path, lens=LENS, frame_id="booth")
    assert_same(rig, RIG)
    assert (rig.frame_id, rig.grid) == ("booth", None)


@WRITERS
def test_it_moves_turns_and_scales(tmp_path: Path, write: Write) -> None:
    model_from_rig = similarity_from_pose("", (1, -2, 3), (0.6, 0, 0, 0.8)) @ Similarity(scale=40.0)
    turned = [
        Camera(camera.name, at.position, at.orientation, camera.intrinsics, camera.lens)
        for camera in RIG.cameras
        for at in [model_from_rig @ similarity_from_pose("", camera.position, camera.orientation)]
    ]
    write(tmp_path, *model_of(Rig(tuple(turned)), pinhole))
    assert_same(load_colmap(tmp_path, rig_from_model=model_from_rig.inverse(), lens=LENS), RIG)


@WRITERS
@pytest.mark.parametrize("model", MODELS)
def test_camera_models_are_those_of_camera_info(tmp_path: Path, write: Write, model: str) -> None:
    _, distortion_model, parameters, coefficients = MODELS[model]
    write(tmp_path, [(1, model, 640, 480, tuple(map(float, parameters)))], ONE[1])
    fy = 510 if parameters[1] == 510 else 500
    assert load_colmap(tmp_path).cameras[0].intrinsics == CameraIntrinsics(
        *(640, 480, 500, fy, 319.5, 239.5),
        distortion_model=distortion_model,
        distortion=coefficients,
    )


@pytest.mark.parametrize(
    ("model", "parameters", "got"),
    [
        ("FOV", (500, 510, 320, 240, 0.9), "FOV with omega = 0.9"),
        (
            *("THIN_PRISM_FISHEYE", (500, 510, 320, 240, 0, 0, 0.1, 0, 0, 0, 0, -0.2)),
            "THIN_PRISM_FISHEYE with p1 = 0.1, sy1 = -0.2",
        ),
        (
            *("RAD_TAN_THIN_PRISM_FISHEYE", (500, 510, 320, 240, *[0] * 4, 1, *[0] * 7)),
            "RAD_TAN_THIN_PRISM_FISHEYE with k5 = 1",
        ),
        ("SIMPLE_DIVISION", (500, 320, 240, 0.1), "SIMPLE_DIVISION with k = 0.1"),
        ("EUCM", (500, 510, 320, 240, 0.6, 1.1), "EUCM with alpha = 0.6, beta = 1.1"),
        ("EQUIRECTANGULAR", (640, 480), "EQUIRECTANGULAR"),
    ],
)
def test_camera_models_that_camera_info_has_not_are_refused(
    tmp_path: Path, model: str, parameters: tuple[float, ...], got: str
) -> None:
    write_text(tmp_path, [(1, model, 640, 480, parameters)], ONE[1])
    telling = (
        "cameras.txt: line 4: expected a camera model that sensor_msgs/CameraInfo can represent"
        f" exactly, got {got}; estimate the cameras as OPENCV, FULL_OPENCV or OPENCV_FISHEYE"
    )
    with pytest.raises(InputError, match=re.escape(telling)):
        load_colmap(tmp_path)


def test_rigs_and_frames_do_not_matter(tmp_path: Path) -> None:
    write_text(tmp_path, *ONE)
    (tmp_path / "rigs.txt").write_text("1 1 CAMERA 1\n")
    (tmp_path / "frames.txt").write_text("1 1 1 0 0 0 0 0 0 1 CAMERA 1 1\n")
    (tmp_path / "points3D.txt").write_text("not read")
    text = load_colmap(tmp_path)
    assert len(text) == 1


@WRITERS
def test_images_can_be_chosen_and_name_cameras(tmp_path: Path, write: Write) -> None:
    names = ["right/1.jpg", "left side/1.jpg", "left side/2.jpg"]
    images = [(*ONE[1][0][:4], name, []) for name in names]
    write(tmp_path, ONE[0], images)
    chosen = load_colmap(tmp_path, images="*/1.jpg")
    assert [camera.name for camera in chosen.cameras] == ["left_side", "right"]
    everyone = [camera.name for camera in load_colmap(tmp_path).cameras]
    assert everyone == ["left_side_1", "left_side_2", "right_1"]
    telling = "images: expected some that match up/*, got none among 3, for example right/1.jpg"
    with pytest.raises(InputError, match=re.escape(telling)):
        load_colmap(tmp_path, images="up/*")


# --- what is wrong -----------------------------------------------------------------------------


def fails(folder: Path, telling: str) -> None:
    with pytest.raises(InputError, match=re.escape(telling)):
        load_colmap(folder)


@pytest.mark.parametrize(
    ("file", "old", "new", "telling"),
    [
        (
            "cameras",
            "1 PINHOLE",
            "1 WIDE_ANGLE",
            "line 4: expected a camera model of COLMAP, got WIDE_ANGLE",
        ),
        (
            *("cameras", " 240.0", ""),
            "line 4: expected 4 parameters of PINHOLE: fx fy cx cy, got 3",
        ),
        ("cameras", "1 PINHOLE", "one PINHOLE", "expected a whole number, got something else"),
        ("cameras", "500.0", "wide", "expected numbers, got something else"),
        ("cameras", "500.0", "nan", "line 4: expected finite numbers, got nan 510 320 240"),
        ("cameras", "500.0", "-1", "line 4: image.fx: expected a number above 0, got -1"),
        ("cameras", " 480 500.0 510.0 320.0 240.0", "", "expected CAMERA_ID MODEL WIDTH HEIGHT"),
        ("images", "1 1 0 0 0", "1 2 0 0 0", "line 3: rotation: expected a unit quaternion"),
        ("images", "1 1 0 0 0", "1 nan 0 0 0", "line 3: expected finite numbers"),
        ("images", "0 1 a.jpg", "0 2 a.jpg", "image a.jpg: camera: expected one of the model"),
        ("images", "1 a.jpg", "", "line 3: expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"),
        (
            *("images", "a.jpg\n", "a.jpg\n2 1 0 0 0 0 0 0 1 b.jpg\n"),
            "line 4: expected the points of a.jpg: X Y POINT3D_ID each, got something else",
        ),
        ("images", "1 1 0 0 0 0 0 0 1 a.jpg", "#", "expected some that match *, got none among 0"),
        ("images", "0 0 0 1 a.jpg", "0 0 1e9 1 a.jpg", "image a.jpg: camera a: position: expected"),
    ],
)
def test_text_that_cannot_be_read_is_refused(
    tmp_path: Path, file: str, old: str, new: str, telling: str
) -> None:
    write_text(tmp_path, *ONE)
    path = tmp_path / f"{file}.txt"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    fails(tmp_path, telling)


@pytest.mark.parametrize("file", ["cameras.bin", "images.bin"])
def test_binaries_cut_anywhere_are_refused(tmp_path: Path, file: str) -> None:
    points = [(1.0, 2.0, -1)]
    write_binary(tmp_path, ONE[0], [(*ONE[1][0][:5], points)])
    whole = (tmp_path / file).read_bytes()
    for end in range(1, len(whole)):
        (tmp_path / file).write_bytes(whole[:end])
        fails(tmp_path, f"{file}: expected a complete bin file, got")
    (tmp_path / file).write_bytes(whole + b"12")
    fails(tmp_path, f"{file}: expected a complete bin file, got 2 bytes too many")
    (tmp_path / file).write_bytes(b"")
    fails(tmp_path, f"{file}: expected COLMAP's binary, got an empty file")


def test_binary_beside_text_must_say_the_same(tmp_path: Path) -> None:
    cameras, images = model_of(RIG, pinhole)
    write_binary(tmp_path, cameras, images)
    write_text(tmp_path, cameras, images)
    assert_same(load_colmap(tmp_path, lens=LENS), RIG)
    moved = [(*images[0][:2], (9.0, 9.0, 9.0), *images[0][3:]), *images[1:]]
    renamed = [(*images[0][:4], "other.jpg", []), *images[1:]]
    wider = [(*cameras[0][:2], 999, *cameras[0][3:]), *cameras[1:]]
    for differs, *stale in [
        ("poses", cameras, moved),
        ("names of images", cameras, renamed),
        ("names of images", cameras, images[1:]),
        ("intrinsics", wider, images),
        ("cameras", cameras[1:], images),
    ]:
        write_binary(tmp_path, *stale)
        fails(tmp_path, f"one model, got two, binary and text, with different {differs}; remove")


@pytest.mark.parametrize("left", ["cameras", "images"])
def test_a_single_stale_file_does_not_matter(tmp_path: Path, left: str) -> None:
    for kept, stale in ((write_text, ".bin"), (write_binary, ".txt")):
        (tmp_path / stale).mkdir()
        kept(tmp_path / stale, *model_of(RIG, pinhole))
        (tmp_path / stale / f"{left}{stale}").write_text("of another model")
        assert_same(load_colmap(tmp_path / stale, lens=LENS), RIG)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_does_not_matter(tmp_path: Path, encoding: str) -> None:
    write_text(tmp_path, *model_of(RIG, pinhole))
    for name in ("cameras.txt", "images.txt"):
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text.replace("\n", "\r\n"), encoding=encoding, newline="")
    assert_same(load_colmap(tmp_path, lens=LENS), RIG)


def test_texts_announce_their_numbers(tmp_path: Path) -> None:
    write_text(tmp_path, *ONE)
    for name in ("cameras", "images"):
        text = (tmp_path / f"{name}.txt").read_text().replace("# Number of cameras: 1\n", "")
        (tmp_path / f"{name}.txt").write_text(f"# Number of {name}: 2, mean 3\n{text}")
        fails(tmp_path, f"{name}.txt: expected a complete txt file, got 1 {name} of the 2 announ")
        (tmp_path / f"{name}.txt").write_text(text)


def test_a_last_line_without_a_newline_is_told(tmp_path: Path) -> None:
    write_text(tmp_path, *ONE)
    for name in ("cameras", "images"):
        path = tmp_path / f"{name}.txt"
        path.write_text(path.read_text().rstrip("\n"))
    assert [(note.code, note.text.split(": ")[0]) for note in load_colmap(tmp_path).notes] == [
        ("left_out", str(tmp_path / "cameras.txt")),
        ("left_out", str(tmp_path / "images.txt")),
    ]


@pytest.mark.parametrize("points", ["1.5 2.5 x", "1.5 2.5 0.5", "1.5 nan 3", "a b c", "1 2 3 4"])
def test_points_are_numbers(tmp_path: Path, points: str) -> None:
    write_text(tmp_path, *ONE)
    path = tmp_path / "images.txt"
    path.write_text(path.read_text().replace("a.jpg\n", f"a.jpg\n{points}\n"))
    fails(tmp_path, "line 4: expected the points of a.jpg: X Y POINT3D_ID each, got")


def test_binaries_of_other_cameras_are_refused(tmp_path: Path) -> None:
    write_binary(tmp_path, *ONE)
    data = struct.pack("<QIiQQ", 1, 5, 99, 640, 480)
    (tmp_path / "cameras.bin").write_bytes(data)
    fails(tmp_path, "cameras.bin: camera 5: expected a camera model of COLMAP, got number 99")
    write_binary(tmp_path, [replace_width(ONE[0][0], 0)], ONE[1])
    fails(tmp_path, "cameras.bin: camera 1: image.width: expected a whole number of at least 1")
    write_binary(tmp_path, ONE[0], [(3, (0, 0, 0, 0), (0, 0, 0), 1, "a.jpg", [])])
    fails(tmp_path, "images.bin: image 3: rotation: expected a unit quaternion")


def replace_width(camera: Any, width: int) -> Any:
    return (*camera[:2], width, *camera[3:])


def test_a_folder_without_a_model_is_refused(tmp_path: Path) -> None:
    expected = "expected a sparse model: cameras and images, .bin or .txt, got"
    fails(tmp_path / "none", f"none: {expected} no such folder")
    fails(tmp_path, f"{tmp_path}: {expected} a folder without them")
    (tmp_path / "file").write_text("a\n")
    fails(tmp_path / "file", f"file: {expected} a file")
    model = tmp_path / "sparse" / "0"
    model.mkdir(parents=True)
    write_text(model, *ONE)
    fails(tmp_path, f"a folder without them; did you mean {model}?")
    (model / "images.txt").unlink()
    fails(model, "images.txt: expected COLMAP's text, got no such file")


# --- alignments --------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["{}\n{}\n{}\n{}\n", "{},{};{},{}"])
def test_an_alignment_is_16_numbers(tmp_path: Path, text: str) -> None:
    matrix = np.array([[0, -2, 0, 1], [2, 0, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]])
    separator = "," if "," in text else " "
    rows = [separator.join(map(str, row)) for row in matrix.tolist()]
    path = tmp_path / "matrix.txt"
    path.write_text(text.format(*rows))
    alignment, expected = load_alignment(path), similarity_from_matrix("", matrix)
    assert alignment.position == expected.position == (1, 2, 3)
    assert alignment.orientation == expected.orientation
    assert alignment.scale == pytest.approx(2, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("1 2 3\n", "m.txt: expected 16 numbers, a 4 × 4 matrix row by row, got 3"),
        ("a" + " 1" * 15, "m.txt: expected numbers, got something else"),
        ("1 " * 16, "m.txt: expected the last row 0 0 0 1"),
        ("", "m.txt: expected 16 numbers, a 4 × 4 matrix row by row, got an empty file"),
    ],
)
def test_what_is_no_alignment_is_refused(tmp_path: Path, text: str, telling: str) -> None:
    path = tmp_path / "m.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(telling)):
        load_alignment(path)
