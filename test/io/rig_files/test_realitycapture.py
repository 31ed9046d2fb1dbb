# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""RealityScan's registrations, against Epic's and nerfstudio's formulas; it cannot be run here."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import dome_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.realitycapture import load_realitycapture
from testing.photogrammetry import (
    realityscan_csv,
    realityscan_pixel,
    realityscan_xmp,
    yaw_pitch_roll,
)
from testing.projection import assert_images_alike

RIG = dome_rig(2, 6, radius=1.3, lowest=5.0, highest=55.0)
NAMES = [f"{camera.name}.jpg" for camera in RIG.cameras]
SIZE = (900, 1200)
OPTIONS = ImportOptions(scale=1.0, size=SIZE)
VALUES = {"f": 42.0, "px": 0.004, "py": -0.006}
BROWN = VALUES | {"k1": -0.1, "k2": 0.04, "k3": -0.01, "t1": 0.003, "t2": -0.002}


def write(folder: Path, values: Any = BROWN) -> Path:
    path = folder / "cameras.csv"
    path.write_text(realityscan_csv(RIG, values, NAMES))
    return path


def write_xmp(folder: Path, values: Any, model: str) -> Path:
    poses = zip(NAMES, camera_rotations(RIG), camera_positions(RIG), strict=True)
    for name, turn, place in poses:
        path = (folder / name).with_suffix(".xmp")
        path.write_text(realityscan_xmp(turn, place, values, model))
    return folder


def assert_posed(rig: Rig) -> None:
    assert [camera.name for camera in rig.cameras] == [camera.name for camera in RIG.cameras]
    np.testing.assert_allclose(camera_positions(rig), camera_positions(RIG), atol=1e-9)
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(RIG), atol=1e-9)


def test_poses_come_back(tmp_path: Path) -> None:
    rig, notes = load_realitycapture(write(tmp_path), OPTIONS)
    assert notes == []
    assert_posed(rig)
    _, (note,) = load_realitycapture(write(tmp_path), replace(OPTIONS, scale=None))
    assert note.startswith("a registration is in metres only if its project was scaled or")


def test_angles_are_those_that_nerfstudio_reads_as_well() -> None:
    """Its converter turns OpenGL's camera by Rz(-heading) Rx(pitch) Ry(roll)."""

    def about(axis: int, degrees: float) -> np.ndarray:
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        turn = np.eye(3)
        turn[[a, b], [a, b]] = np.cos(np.radians(degrees))
        turn[b, a] = np.sin(np.radians(degrees))
        turn[a, b] = -turn[b, a]
        return turn

    for rotation in camera_rotations(RIG):
        yaw, pitch, roll = yaw_pitch_roll(rotation)
        opengl = about(2, -yaw) @ about(0, pitch) @ about(1, roll)
        np.testing.assert_allclose(opengl @ np.diag([1, -1, -1]), rotation, atol=1e-9)


MODELS = {
    "brown3t2": (BROWN, "brown3t2", 1e-6),
    "brown3": ({**BROWN, "t1": 0.0, "t2": 0.0}, "brown3", 1e-6),
    "brown4t2": ({**BROWN, "k4": 0.005}, "brown4t2", 0.1),
    "division": ({**VALUES, "k1": 0.11, "division": 1.0}, "division", 1e-6),
    "none": (VALUES, "perspective", 1e-6),
}
every_model = pytest.mark.parametrize(
    ("values", "model", "within"), MODELS.values(), ids=MODELS.keys()
)


@every_model
def test_points_are_imaged_where_realityscan_has_them(
    tmp_path: Path, values: dict[str, float], model: str, within: float
) -> None:
    def pixel(point: Any) -> tuple[float, float]:
        return realityscan_pixel(values, SIZE, point)

    rig, notes = load_realitycapture(write(tmp_path, values), OPTIONS)
    assert_images_alike(rig, RIG, pixel, within)
    assert len(notes) == (within > 1e-6)
    rig, notes = load_realitycapture(write_xmp(tmp_path, values, model), OPTIONS)
    assert_posed(rig)
    assert_images_alike(rig, RIG, pixel, within)
    assert len(notes) == (within > 1e-6)


def test_images_beside_tell_their_size_and_lens(tmp_path: Path) -> None:
    unsized = replace(OPTIONS, size=None)
    with pytest.raises(InputError, match="line 2: expected the width and height"):
        load_realitycapture(write(tmp_path), unsized)
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0x920A] = 50.0
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    for name in NAMES:
        Image.new("L", (90, 120)).save(folder / name, exif=exif)
    rig, notes = load_realitycapture(write(tmp_path), replace(unsized, image_folder=folder))
    assert (rig.cameras[0].intrinsics.width, rig.cameras[0].lens.focal_length) == (90, 0.05)
    (note,) = notes
    assert note == (
        "focal length 50 mm for 9 of 9 cameras, from the EXIF of their images; --focal-length"
        " replaces it"
    )
    xmp = write_xmp(tmp_path, BROWN, "brown3t2")
    same, _ = load_realitycapture(xmp, replace(unsized, image_folder=folder))
    assert_posed(same)
    assert same.cameras[0].intrinsics == rig.cameras[0].intrinsics
    assert same.cameras[0].lens == rig.cameras[0].lens


def test_the_titles_may_be_elsewhere_and_fewer(tmp_path: Path) -> None:
    path = write(tmp_path, {})
    text = "# cameras 12\r\n\r\n" + path.read_text().replace("heading", "Yaw").replace("\n", "\r\n")
    path.write_bytes(text.encode())
    with pytest.raises(InputError, match="line 4: f: expected the focal length, got no"):
        load_realitycapture(path, OPTIONS)
    image = load_realitycapture(write(tmp_path), OPTIONS)[0].cameras[0].intrinsics
    path.write_bytes(text.encode())
    rig, _ = load_realitycapture(path, replace(OPTIONS, intrinsics_of=lambda _: image))
    assert_posed(rig)


@pytest.mark.parametrize(
    ("old", "new", "telling"),
    [
        (
            "#name,x,y,alt",
            "#name,lon,lat,alt",
            "line 1: expected titles with .* none of x, y",
        ),
        ("heading,pitch,roll", "omega,phi,kappa", "none of heading, pitch, roll among name, x"),
        ("#name,", "", "line 1: expected cameras exported by RealityScan, .* got another line"),
        ("#name,", "#other,", "line 2: expected .* got another line"),
        ("cam_0_00.jpg,", "cam_0_00.jpg,9,", "line 2: expected 16 values, as titles, got 17"),
        ("cam_0_00.jpg,", "cam_0_01.jpg,", "names that differ in letters and digits"),
        (",42.0,", ",-1,", "line 2: f: expected a number above 0, got -0.0277"),
        (",42.0,", ",x,", "line 2: expected a number, got something else"),
        (",42.0,", ",inf,", "line 2: f: expected a number, got inf"),
        (",42.0,", ',"42', "line 3: expected 16 values, as titles, got 15"),
    ],
)
def test_what_is_no_rig_is_refused(tmp_path: Path, old: str, new: str, telling: str) -> None:
    path = write(tmp_path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match=telling) as caught:
        load_realitycapture(path, OPTIONS)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "telling"),
    [
        (
            "xcr:Position>",
            "xcr:Place>",
            "got none with xcr:Rotation and xcr:Position",
        ),
        (
            'Skew="0"',
            'Skew="0.1"',
            "xcr:Skew: expected 0, got 0.1; give --image",
        ),
        (
            'Model="brown3t2"',
            'Model="kb4"',
            "xcr:DistortionModel: expected one of none",
        ),
        (' xcr:FocalLength35mm="42.0"', "", "xcr:FocalLength35mm: expected a value, got none"),
        ("<xcr:Rotation>", "<xcr:Rotation>2 ", "xcr:Rotation: expected 9 numbers, got 10"),
        ("</rdf:RDF>", "", "invalid XML: line"),
    ],
)
def test_xmp_files_that_are_no_rig_are_refused(
    tmp_path: Path, old: str, new: str, telling: str
) -> None:
    write_xmp(tmp_path, BROWN, "brown3t2")
    for path in tmp_path.iterdir():
        path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match=telling) as caught:
        load_realitycapture(tmp_path, OPTIONS)
    assert "\n" not in str(caught.value)


def test_a_folder_without_xmp_files_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="got a folder without any; export them beside the images"):
        load_realitycapture(tmp_path, OPTIONS)


def test_xmp_files_of_other_programs_are_passed_over(tmp_path: Path) -> None:
    write_xmp(tmp_path, BROWN, "brown3t2")
    (tmp_path / "edited.xmp").write_text("<x:xmpmeta xmlns:x='adobe:ns:meta/'/>")
    assert_posed(load_realitycapture(tmp_path, OPTIONS)[0])


def test_components_without_common_coordinates_are_refused(tmp_path: Path) -> None:
    write_xmp(tmp_path, BROWN, "brown3t2")
    own = 'xcr:Coordinates="relative" xcr:ComponentId="{%d}"'
    for i, path in enumerate(sorted(tmp_path.iterdir())):
        text = path.read_text().replace('xcr:Coordinates="absolute"', own % (i % 2))
        path.write_text(text)
    with pytest.raises(InputError, match="cameras of one component, got 2 components, each in"):
        load_realitycapture(tmp_path, OPTIONS)
    for path in tmp_path.iterdir():
        path.write_text(path.read_text().replace("{1}", "{0}"))
    assert_posed(load_realitycapture(tmp_path, OPTIONS)[0])
