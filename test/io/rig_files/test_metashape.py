# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Metashape's cameras, against its manual's formulas (testing.photogrammetry); it cannot be run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import dome_rig
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.metashape import load_metashape
from testing.photogrammetry import (
    metashape_camera,
    metashape_document,
    metashape_matrices,
    metashape_pixel,
    metashape_sensor,
    metashape_transform,
)
from testing.projection import assert_images_alike

RIG = dome_rig(2, 6, radius=1.3, lowest=5.0, highest=55.0)
SIZE = (1200, 900)
TERMS = {"f": 1400.0, "cx": 7.25, "cy": -4.5, "k1": -0.12, "k2": 0.05, "k3": -0.01}
TANGENTIAL = {"p1": 0.004, "p2": -0.0015}
TURN = Rotation.from_euler("xyz", [20, -35, 110], degrees=True).as_matrix()
PLACED: tuple[np.ndarray, np.ndarray, float] = TURN, np.array([1.0, -2.0, 0.5]), 0.37
NOWHERE: tuple[np.ndarray, np.ndarray, float] = np.eye(3), np.zeros(3), 1.0
METRES = ImportOptions(scale=1.0)


def write(
    path: Path,
    terms: Any = TERMS,
    placed: Any = PLACED,
    *,
    kind: str = "frame",
    version: str = "2.0.0",
    cameras: Any = None,
    **sensor: float,
) -> Path:
    sensors = [metashape_sensor(terms, SIZE, kind=kind, **sensor)]
    listed = cameras or [
        metashape_camera(i, f"{camera.name}.JPG", matrix)
        for i, (camera, matrix) in enumerate(
            zip(RIG.cameras, metashape_matrices(RIG, *placed), strict=True)
        )
    ]
    transform = "" if placed is NOWHERE else metashape_transform(*placed)
    path.write_text(metashape_document(sensors, listed, transform, version))
    return path


@pytest.mark.parametrize("version", ["1.4.0", "2.0.0"])
def test_poses_come_back(tmp_path: Path, version: str) -> None:
    rig, notes = load_metashape(write(tmp_path / "c.xml", version=version), ImportOptions())
    assert (notes, rig.notes, rig.frame_id) == ([], (), "world")
    assert [camera.name for camera in rig.cameras] == [camera.name for camera in RIG.cameras]
    np.testing.assert_allclose(camera_positions(rig), camera_positions(RIG), atol=1e-12)
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(RIG), atol=1e-12)


LENSES = {
    "usual": (TERMS | TANGENTIAL, "frame", 1e-6, ""),
    "pinhole": ({"f": 1400.0}, "frame", 1e-6, ""),
    "affinity": (TERMS | TANGENTIAL | {"b1": 12.5}, "frame", 1e-6, ""),
    "skew": (
        TERMS | TANGENTIAL | {"b2": -0.8},
        "frame",
        0.3,
        "skew, which CameraInfo",
    ),
    "eighth power": (
        TERMS | TANGENTIAL | {"k4": 0.02},
        "frame",
        0.1,
        "a radial term",
    ),
    "higher": (
        *(TERMS | TANGENTIAL | {"p3": 0.2}, "frame", 1.2),
        "tangential terms of higher powers, which CameraInfo",
    ),
    "fisheye": (TERMS | {"k4": 0.003}, "fisheye", 1e-6, ""),
    "fisheye of 2.x": (TERMS | {"k4": 0.003}, "equidistant_fisheye", 1e-6, ""),
    "fisheye, tangential": (
        *(TERMS | {"p1": 5e-4, "p2": -2e-4}, "fisheye", 1.0),
        "tangential terms of a fisheye, which",
    ),
}


@pytest.mark.parametrize(("terms", "kind", "within", "told"), LENSES.values(), ids=LENSES.keys())
def test_points_are_imaged_where_metashape_has_them(
    tmp_path: Path, terms: dict[str, float], kind: str, within: float, told: str
) -> None:
    rig, notes = load_metashape(write(tmp_path / "c.xml", terms, kind=kind), METRES)
    fisheye = kind != "frame"
    assert_images_alike(
        rig, RIG, lambda point: metashape_pixel(terms, SIZE, point, fisheye=fisheye), within
    )
    if told:
        (note,) = notes
        assert note.startswith(f"9 of 9 cameras: {told}")
        assert float(note.split("within ")[1].split()[0]) <= within
    else:
        assert notes == []


def test_swapped_tangential_terms_would_be_noticed(tmp_path: Path) -> None:
    terms = TERMS | TANGENTIAL
    rig, _ = load_metashape(write(tmp_path / "c.xml", terms), METRES)
    swapped = terms | {"p1": terms["p2"], "p2": terms["p1"]}
    with pytest.raises(AssertionError):
        assert_images_alike(rig, RIG, lambda point: metashape_pixel(swapped, SIZE, point), 0.5)


def test_the_lens_is_that_of_the_sensor_unless_told(tmp_path: Path) -> None:
    path = write(tmp_path / "c.xml", focal_length=35.0, pixel=0.025)
    rig, notes = load_metashape(path, METRES)
    (note,) = notes
    assert note == (
        "focal length 35 mm for 9 of 9 cameras, from the focal_length of their sensors;"
        " --focal-length replaces it"
    )
    assert {camera.lens.focal_length for camera in rig.cameras} == {0.035}
    assert set(rig.assumed.values()) == {frozenset({"lens.hyperfocal_distance"})}
    f_number = {"f_number": 8.0, "circle_of_confusion": 2e-5}
    rig, _ = load_metashape(path, replace(METRES, lens=f_number))
    assert rig.cameras[0].lens.hyperfocal_distance == pytest.approx(0.035**2 / 8 / 2e-5)
    unknown = write(tmp_path / "d.xml", focal_length=0.0, pixel=0.0)
    assert load_metashape(unknown, METRES)[1] == []


def test_a_sensor_without_calibration_has_that_of_its_lens(tmp_path: Path) -> None:
    rig, _ = load_metashape(write(tmp_path / "c.xml", {}, focal_length=35.0, pixel=0.025), METRES)
    image = rig.cameras[0].intrinsics
    assert (image.fx, image.cx, image.cy) == (pytest.approx(1400.0), 599.5, 449.5)


def test_what_is_left_out_is_told(tmp_path: Path) -> None:
    matrices = metashape_matrices(RIG, *PLACED)
    cameras = [
        metashape_camera(0, "Kamera (1).jpg", matrices[0]),
        "<group id='0' label='Group 1'>"
        + metashape_camera(1, "Kamera (2).jpg", matrices[1], more='enabled="1"')
        + metashape_camera(2, "off.jpg", matrices[2], more='enabled="false"')
        + "</group>",
        metashape_camera(3, "lost.jpg", None),
        metashape_camera(4, "slave.jpg", None, more='master_id="0"'),
    ]
    rig, notes = load_metashape(write(tmp_path / "c.xml", cameras=cameras), METRES)
    assert notes == []
    assert [camera.name for camera in rig.cameras] == ["Kamera_1", "Kamera_2"]
    assert {note.code for note in rig.notes} == {"left_out"}
    assert [note.text for note in rig.notes] == [
        "left out 1 of 5 cameras, disabled: off.jpg; enable them in Metashape, and export again",
        "left out 1 of 5 cameras, not aligned: lost.jpg; align them in Metashape, and export again",
        (
            "left out 1 of 5 cameras, slaves of a multi-camera system, which have no poses of their"
            " own: slave.jpg; align them as single cameras, and export again"
        ),
    ]


def test_sensors_differ(tmp_path: Path) -> None:
    other = {"f": 900.0}
    sensors = [metashape_sensor(TERMS, SIZE), metashape_sensor(other, (640, 480), number=7)]
    cameras = [
        metashape_camera(i, f"a{i}", matrix, sensor=7 * (i % 2))
        for i, matrix in enumerate(metashape_matrices(RIG, *PLACED))
    ]
    path = tmp_path / "c.xml"
    path.write_text(metashape_document(sensors, cameras, metashape_transform(*PLACED)))
    rig, _ = load_metashape(path, replace(METRES, cameras="a[01]"))
    assert [camera.intrinsics.width for camera in rig.cameras] == [1200, 640]


def test_sensors_that_are_off_differently_share_a_note(tmp_path: Path) -> None:
    sensors = [metashape_sensor(TERMS | {"b2": 4.0 + i}, SIZE, number=i) for i in range(len(RIG))]
    cameras = [
        metashape_camera(i, f"a{i}", matrix, sensor=i)
        for i, matrix in enumerate(metashape_matrices(RIG, *PLACED))
    ]
    path = tmp_path / "c.xml"
    path.write_text(metashape_document(sensors, cameras, metashape_transform(*PLACED)))
    _, (note,) = load_metashape(path, METRES)
    assert note.startswith("9 of 9 cameras: skew, which CameraInfo has no place for, approximated")


def test_a_chunk_that_is_nowhere_has_no_unit(tmp_path: Path) -> None:
    path = write(tmp_path / "c.xml", placed=NOWHERE, version="1.4.0")
    _, (note,) = load_metashape(path, ImportOptions())
    assert note.startswith(
        "the chunk has no scale or reference; if it is metres, the cameras span 2"
    )
    assert load_metashape(path, METRES)[1] == []


def test_a_chunk_on_the_globe_says_so(tmp_path: Path) -> None:
    placed = TURN, np.array([4.1e6, 6.2e5, 4.8e6]), 0.37
    cameras = [
        metashape_camera(i, f"a{i}", matrix)
        for i, matrix in enumerate(metashape_matrices(RIG, *PLACED))
    ]
    earth = write(tmp_path / "c.xml", placed=placed, cameras=cameras)
    rig, (note,) = load_metashape(earth, ImportOptions())
    assert note.startswith("the chunk has a geographic reference: poses are geocentric (ECEF")
    assert "EPSG::4978" in note
    assert len(rig) == len(RIG)


@pytest.mark.parametrize(
    ("old", "new", "telling"),
    [
        ("<chunk ", "<chunk", "invalid XML: line 2, column"),
        ("</document>", "", "invalid XML: line 3, column 1: no element found"),
        (
            '<?xml version="1.0" encoding="UTF-8"?>',
            "<!DOCTYPE a []>",
            "XML with a document type",
        ),
        ("cameras", "views", "got XML without cameras in a chunk; choose File > Export > Export C"),
        ("<f>1400.0</f>", "", r"sensors\[0\]: expected an element f, got none"),
        ("<f>1400.0</f>", "<f>wide</f>", r"sensors\[0\]: f: expected a number, got something else"),
        ("<f>1400.0</f>", "<f>-1</f>", r"sensors\[0\]: f: expected a number above 0, got -1"),
        (
            "<f>1400.0</f>",
            "<fx>1</fx>",
            "expected a calibration with f, as",
        ),
        ("<k1>", "<b2>90</b2><k1>", "skew, without which it is .* pixels off; calibrate without"),
        (
            'type="frame"',
            'type="spherical"',
            "expected one of frame, fisheye, equidistant_fisheye, got spherical; a picture has",
        ),
        (
            'type="frame"',
            'type="equisolid_fisheye"',
            "got equisolid_fisheye; calibrate the sensor as Equidistant Fisheye, and export again",
        ),
        ('sensor_id="0"', 'sensor_id="4"', r"cameras\[0\]: sensor_id: expected the id of a sensor"),
        ('label="cam_0_00.JPG"', 'label=""', r"cameras\[0\]: label: expected the camera's label"),
        ('label="cam_0_00.JPG"', 'label="cam_0_01"', "names that differ in letters and digits"),
        ("<transform>", "<transform>1 ", r"cameras\[0\]: transform: expected 16 numbers, got 17"),
        ("</scale>", "e-400</scale>", "scale: expected a number above 0, got 0"),
    ],
)
def test_what_is_no_rig_is_refused(tmp_path: Path, old: str, new: str, telling: str) -> None:
    path = write(tmp_path / "c.xml")
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError, match=telling) as caught:
        load_metashape(path, ImportOptions())
    assert "\n" not in str(caught.value)


def test_nothing_aligned_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "c.xml", cameras=[metashape_camera(0, "a.jpg", None)])
    with pytest.raises(InputError, match="expected cameras that are aligned, got 1 that are not"):
        load_metashape(path, METRES)


def test_components_have_places_of_their_own(tmp_path: Path) -> None:
    elsewhere = np.eye(3), np.array([0.0, 0.0, 4.0]), 2.0
    placed = metashape_transform(*PLACED), metashape_transform(*elsewhere)
    cameras = [
        metashape_camera(i, f"a{i % 2}_{i}", matrix, more=f'component_id="{i % 2}"')
        for i, matrix in enumerate(metashape_matrices(RIG, *PLACED))
    ]
    other = [
        metashape_camera(i, f"a{i % 2}_{i}", matrix, more=f'component_id="{i % 2}"')
        for i, matrix in enumerate(metashape_matrices(RIG, *elsewhere))
    ]
    mixed = [pair[i % 2] for i, pair in enumerate(zip(cameras, other, strict=True))]
    text = metashape_document([metashape_sensor(TERMS, SIZE)], mixed, placed[0])
    both = text.replace("</components>", f'<component id="1">{placed[1]}</component></components>')
    path = tmp_path / "c.xml"
    path.write_text(both)
    np.testing.assert_allclose(
        camera_positions(load_metashape(path, METRES)[0]), camera_positions(RIG), atol=1e-12
    )
    path.write_text(text)
    with pytest.raises(InputError, match="expected cameras of one component"):
        load_metashape(path, METRES)
    rig, _ = load_metashape(path, replace(METRES, cameras="a0*"))
    np.testing.assert_allclose(camera_positions(rig), camera_positions(RIG)[::2], atol=1e-12)
