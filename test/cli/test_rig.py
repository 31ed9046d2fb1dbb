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

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from focus_planner.cli import main as cli
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.validation import InputError
from focus_planner.io.rigs import load_rig, save_rig
from testing.calibrations import (
    SCALE,
    write_kalibr,
    write_metashape,
    write_nerfstudio,
    write_realitycapture,
)
from testing.calibrations import write_transforms as write_transforms_of_ros

LENS = Lens(0.035, 5.0)
RIG = cylinder_rig(2, 6, bottom=0.75, top=1.05, lens=LENS)
CASES = Path(__file__).parents[1] / "io/cases"
LENS_OPTIONS = ["--focal-length", "0.035", "--hyperfocal-distance", "5"]
BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
BALL.apply_translation([0.0, 0.0, 0.9])
CALIBRATION = """image_width: 580
image_height: 870
camera_matrix: {rows: 3, cols: 3, data: [1190.732, 0, 284.813, 0, 1190.732, 434.440, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_model(folder: Path, unit: float) -> None:
    """Write the rig as a COLMAP model of which one unit is so many metres."""
    intrinsics = RIG.cameras[0].intrinsics
    centre = f"{intrinsics.cx + 0.5!r} {intrinsics.cy + 0.5!r}"
    size = f"{intrinsics.width} {intrinsics.height}"
    folder.mkdir(parents=True)
    (folder / "cameras.txt").write_text(
        f"1 PINHOLE {size} {intrinsics.fx!r} {intrinsics.fy!r} {centre}\n"
    )
    lines = []
    for i, turn in enumerate(camera_rotations(RIG)):
        camera = RIG.cameras[i]
        x, y, z, w = camera.orientation
        place = -turn.T @ camera.position / unit
        words = (i, w, -x, -y, -z, *place.tolist())
        lines += [f"{' '.join(map(repr, words))} 1 {camera.name}/1.jpg", "1.5 2.5 -1"]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")


def write_transforms(path: Path, suffix: str = "_optical_frame") -> None:
    lines = [
        f"{' '.join(map(repr, (*camera.position, *camera.orientation)))} hall {camera.name}{suffix}"
        for camera in RIG.cameras
    ]
    path.write_text("\n".join(lines) + "\n")


def made(capsys: Any, *options: str) -> tuple[Any, str]:
    """Return the rig that the command prints, and what it says on stderr."""
    assert cli.main(["rig", *options]) == 0
    out, err = capsys.readouterr()
    Path("made.yaml").write_text(out)
    return load_rig("made.yaml"), err


def fails(capsys: Any, telling: str, *options: str) -> None:
    assert cli.main(["rig", *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("focus_planner: error: ")
    assert err.count("\n") == 1
    assert telling in err


def assert_same(rig: Any) -> None:
    for own, other in zip(rig.cameras, RIG.cameras, strict=True):
        assert (own.name, own.lens) == (other.name, other.lens)
        np.testing.assert_allclose(own.position, other.position, atol=1e-12)
        assert own.intrinsics.cx == pytest.approx(other.intrinsics.cx, rel=1e-12)
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(RIG), atol=1e-12)


def cost(capsys: Any, rig: str) -> float:
    assert cli.main(["plan", "ball.ply", "--rig", rig, "--samples", "300", "--method", "em"]) == 0
    return float(json.loads(capsys.readouterr().out)["cost"])


def test_rigs_of_colmap_and_of_transforms_plan_as_well(here: Path, capsys: Any) -> None:
    BALL.export("ball.ply")
    save_rig(RIG, Path("rig.yaml"))
    expected = cost(capsys, "rig.yaml")
    write_model(Path("sparse/0"), 0.01)
    rig, notes = made(capsys, "colmap", "sparse/0", "--scale", "0.01", *LENS_OPTIONS)
    assert notes == ""
    assert_same(rig)
    assert rig.frame_id == "world"
    assert cost(capsys, "made.yaml") == pytest.approx(expected, rel=1e-9)
    write_transforms(Path("tf.txt"))
    Path("camera.yaml").write_text(CALIBRATION)
    rig, notes = made(capsys, "transforms", "tf.txt", "--camera-info", "camera.yaml", *LENS_OPTIONS)
    assert notes == ""
    assert_same(rig)
    assert rig.frame_id == "hall"
    assert cost(capsys, "made.yaml") == pytest.approx(expected, rel=1e-9)


def test_a_model_without_a_scale_says_so(here: Path, capsys: Any) -> None:
    write_model(Path("model"), 0.01)
    rig, notes = made(
        capsys, "colmap", "model", "--frame-id", "booth", "--images", "cam_0*", *LENS_OPTIONS
    )
    assert notes == (
        "focus_planner: note: a COLMAP model has no unit; if it is metres, the cameras span"
        " 150 m; otherwise give the metres per unit with --scale\n"
    )
    assert (len(rig), rig.frame_id) == (6, "booth")


def test_a_model_says_nothing_of_its_lens(here: Path, capsys: Any) -> None:
    rig, notes = made(capsys, "colmap", str(CASES / "20_import_lens_guessed/model"), "--scale", "1")
    assert notes.startswith(
        "focus_planner: note: nothing tells the lens of 2 of 2 cameras: focal length 50 mm and"
        " hyperfocal distance 10 m are assumed, as in the paper"
    )
    (note,) = rig.notes
    assert note.code == "default_lens"


def test_distorted_images_stay_so(here: Path, capsys: Any) -> None:
    write_model(Path("model"), 1.0)
    Path("model/cameras.txt").write_text(
        "1 OPENCV 580 870 1190 1191 285 435 -0.1 0.2 0.003 0.004\n"
    )
    rig, _ = made(capsys, "colmap", "model", "--scale", "1")
    intrinsics = CameraIntrinsics(
        *(580, 870, 1190, 1191, 284.5, 434.5),
        distortion_model="plumb_bob",
        distortion=(-0.1, 0.2, 0.003, 0.004, 0),
    )
    assert {camera.intrinsics for camera in rig.cameras} == {intrinsics}


def test_a_model_can_be_aligned(here: Path, capsys: Any) -> None:
    write_model(Path("model"), 0.01)
    Path("to_rig.txt").write_text("0 -10 0 1\n10 0 0 2\n0 0 10 3\n0 0 0 1\n")
    rig, notes = made(
        capsys, "colmap", "model", "--transform", "to_rig.txt", "--scale", "0.001", *LENS_OPTIONS
    )
    assert notes == ""
    for own, other in zip(rig.cameras, RIG.cameras, strict=True):
        x, y, z = other.position
        np.testing.assert_allclose(own.position, (1 - y, 2 + x, 3 + z), atol=1e-12)
    about_z = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(camera_rotations(rig), about_z @ camera_rotations(RIG), atol=1e-12)


@pytest.mark.parametrize("kind", ["nerfstudio", "transforms"])
def test_frames_of_images_are_read_in_one_way(here: Path, capsys: Any, kind: str) -> None:
    write_nerfstudio(Path("transforms.json"))
    options = [kind, "transforms.json", "--scale", str(SCALE), *LENS_OPTIONS]
    rig, notes = made(capsys, *options, "--cameras", "images/cam0*")
    told = "frames of images: read as by focus_planner rig nerfstudio, which has more options"
    assert notes == f"focus_planner: note: {told}\n" * (kind == "transforms")
    assert [camera.name for camera in rig.cameras] == [f"cam0{i}" for i in range(1, 10)]
    assert rig.cameras[0].position == pytest.approx((1.2, 0, 0.1))
    assert rig.frame_id == "world"
    frames = json.loads(Path("transforms.json").read_text())
    Path("transforms.json").write_text(json.dumps(frames | {"w": None}))
    fails(capsys, "expected the width and height of its image", *options)
    rig, _ = made(capsys, *options, "--image", "2000x3000")
    assert rig.cameras[0].intrinsics.width == 2000


def test_rigs_of_other_programs_plan(here: Path, capsys: Any) -> None:
    larger = BALL.copy()
    larger.apply_scale([1, 1, 2]).apply_translation([0, 0, -0.9])
    larger.export("ball.ply")
    aperture = ["--f-number", "8", "--circle-of-confusion", "2e-5"]
    write_metashape(Path("cameras.xml"))
    rig, notes = made(capsys, "metashape", "cameras.xml", *aperture)
    lens, unaligned = notes.splitlines()
    assert lens == (
        "focus_planner: note: focal length 50 mm for 12 of 12 cameras, from the focal_length of"
        " their sensors; --focal-length replaces it"
    )
    assert unaligned == (
        "focus_planner: note: left out 1 of 13 cameras, not aligned: Kamera (13).JPG; align them"
        " in Metashape, and export again"
    )
    assert (rig.notes, rig.cameras[0].name) == ((), "Kamera_1")
    assert rig.cameras[0].lens.hyperfocal_distance == pytest.approx(0.05**2 / 8 / 2e-5)
    assert cost(capsys, "made.yaml") < 900
    write_realitycapture(Path("scan"))
    rig, notes = made(capsys, "realitycapture", "scan/cameras.csv", *aperture, "--scale", "1")
    assert notes.startswith("focus_planner: note: focal length 50 mm for 13 of 13 cameras")
    assert (rig.cameras[0].intrinsics.width, rig.cameras[0].intrinsics.fx) == (400, 800)
    assert cost(capsys, "made.yaml") < 900
    rig, _ = made(capsys, "realityscan", "scan/cameras.csv", "--image", "4000x6000")
    assert (rig.cameras[0].intrinsics.width, rig.cameras[0].intrinsics.fx) == (4000, 8000)
    write_kalibr(Path("camchain.yaml"))
    Path("pose.txt").write_text("0 0 1 1.5\n1 0 0 0\n0 1 0 0.9\n0 0 0 1\n")
    rig, notes = made(capsys, "kalibr", "camchain.yaml", "--transform", "pose.txt", *LENS_OPTIONS)
    assert (notes, rig.frame_id, len(rig)) == ("", "world", 4)
    assert rig.cameras[0].position == (1.5, 0, 0.9)


@pytest.mark.parametrize("kind", ["nerfstudio", "metashape", "realitycapture", "kalibr"])
def test_other_files_are_refused_in_a_line(here: Path, capsys: Any, kind: str) -> None:
    write_transforms(Path("tf.txt"))
    fails(capsys, "tf.txt: ", kind, "tf.txt", "--scale", "1")
    fails(capsys, "none", kind, "none")
    fails(capsys, "--scale: expected a number above 0, got -1", *good_file(kind), "--scale", "-1")
    fails(capsys, "tf.txt: expected 16 numbers", *good_file(kind), "--transform", "tf.txt")
    fails(capsys, "some that match zzz", *good_file(kind), "--cameras", "zzz")
    if kind in ("metashape", "kalibr"):
        fails(capsys, "--image and --fx: expected both", *good_file(kind), "--image", "4x3")
    else:
        fails(capsys, "--image: expected WIDTHxHEIGHT", *good_file(kind), "--image", "4")


KINDS = ["nerfstudio", "metashape", "realitycapture", "kalibr"]


@pytest.mark.parametrize("kind", ["nerfstudio", "metashape", "kalibr"])
def test_the_folder_of_a_file_names_the_file(here: Path, capsys: Any, kind: str) -> None:
    _, path = good_file(kind)
    Path("data").mkdir()
    Path(path).rename(f"data/{path}")
    fails(capsys, f"got a folder; give the file in it: data/{path}\n", kind, "data")


def test_a_file_given_as_a_colmap_model_is_recognised(here: Path, capsys: Any) -> None:
    _, path = good_file("nerfstudio")
    fails(
        capsys,
        "got a file; it looks like a file for focus_planner rig nerfstudio\n",
        "colmap",
        path,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_of_another_kind_is_recognised(here: Path, capsys: Any, kind: str) -> None:
    _, path = good_file(kind)
    other = KINDS[KINDS.index(kind) - 1]
    fails(capsys, f"; it looks like a file for focus_planner rig {kind}\n", other, path)
    if kind != "nerfstudio":
        fails(capsys, f"; it looks like a file for focus_planner rig {kind}\n", "transforms", path)
    write_transforms_of_ros(Path("tf.yaml"))
    fails(capsys, "; it looks like a file for focus_planner rig transforms\n", kind, "tf.yaml")
    with pytest.raises(InputError) as caught:
        load_rig(path)
    assert str(caught.value) == (
        f"{path}: expected a rig.yaml, got another program's cameras; make one of it with"
        f" focus_planner rig {kind} {path}"
    )


def good_file(kind: str) -> list[str]:
    """Write a good file of a kind, unless it is there, and return the arguments that read it."""
    write, path = {
        "nerfstudio": (write_nerfstudio, "transforms.json"),
        "metashape": (write_metashape, "cameras.xml"),
        "realitycapture": (write_realitycapture, "scan"),
        "kalibr": (write_kalibr, "camchain.yaml"),
    }[kind]
    if not Path(path).exists():
        write(Path(path))
    return [kind, f"{path}/cameras.csv" if kind == "realitycapture" else path]


def test_guesses_are_told(here: Path, capsys: Any) -> None:
    write_transforms(Path("tf.txt"), suffix="")
    rig, notes = made(capsys, "transforms", "tf.txt")
    axes, lens, image = notes.splitlines()
    assert axes.startswith(
        "focus_planner: note: assumed from their names to be body frames, x forward"
    )
    assert lens == (
        "focus_planner: note: nothing tells the lens of 12 of 12 cameras: focal length 50 mm and"
        " hyperfocal distance 10 m are assumed, as in the paper, and the plan holds for nothing"
        " else; use --focal-length, and --f-number with --circle-of-confusion, or"
        " --hyperfocal-distance, or edit the rig's file"
    )
    assert image.startswith(
        "focus_planner: note: nothing tells the image of 12 of 12 cameras: width 580"
    )
    assert [note.code for note in rig.notes] == ["default_lens", "default_image"]
    assert rig.cameras[0].intrinsics == CameraIntrinsics()
    options = ["--convention", "optical", "--image", "640x480", "--fx", "500", *LENS_OPTIONS]
    rig, notes = made(capsys, "transforms", "tf.txt", *options)
    assert (notes, rig.notes) == ("", ())
    assert rig.cameras[0].intrinsics == CameraIntrinsics(640, 480, 500, 500, 319.5, 239.5)
    options += ["--fy", "510", "--cx", "0", "--cy", "7.5", "--frame-id", "booth"]
    options += ["--root", "hall", "--cameras", "cam_1_0*", "--scale", "2"]
    rig, _ = made(capsys, "transforms", "tf.txt", *options)
    assert rig.cameras[0].intrinsics == CameraIntrinsics(640, 480, 500, 510, 0, 7.5)
    assert (len(rig), rig.frame_id) == (6, "booth")
    np.testing.assert_allclose(rig.cameras[0].position, (1.5, 0, 2.1))


@pytest.mark.parametrize("layout", ["cylinder --rows 1 --columns 4", "transforms tf.txt"])
def test_what_was_told_is_never_assumed_even_if_it_is_the_default(
    here: Path, capsys: Any, layout: str
) -> None:
    write_transforms(Path("tf.txt"))
    rig, notes = made(capsys, *layout.split(), "--focal-length", "0.05")
    (lens,) = (note.text for note in rig.notes if note.code == "default_lens")
    assert "hyperfocal distance 10 m is assumed" in lens
    assert "focal" not in lens.partition(" is assumed")[0].replace("hyperfocal", "")
    assert lens.partition(";")[0] in notes
    lens_told = ["--focal-length", "0.05", "--hyperfocal-distance", "10"]
    image_told = ["--image", "580x870", "--fx", "1190.732", "--cx", "284.813", "--cy", "434.44"]
    rig, notes = made(capsys, *layout.split(), *lens_told, *image_told)
    assert (notes, rig.notes) == ("", ())
    assert rig.cameras[0].intrinsics == CameraIntrinsics()


@pytest.mark.parametrize("layout", ["cylinder --rows 1 --columns 3", "transforms tf.txt"])
def test_an_f_number_takes_a_circle_by_each_cameras_image(
    here: Path, capsys: Any, layout: str
) -> None:
    write_transforms(Path("tf.txt"))
    aperture = ["--focal-length", "0.05", "--f-number", "8"]
    rig, told = made(capsys, *layout.split(), *aperture, "--image", "6000x4000", "--fx", "8333")
    circle = 2 * 0.05 / 8333
    assert rig.cameras[0].lens.circle_of_confusion == pytest.approx(circle, rel=1e-15)
    assert rig.cameras[0].lens.hyperfocal_distance == pytest.approx(0.05**2 / (8 * circle))
    assert "cameras: 12 µm is assumed, two pixels; the depth of field is" in told
    assert "use --circle-of-confusion, or give circle_of_confusion under lens in" in told
    assert "f_number: 8.0" in Path("made.yaml").read_text()
    (note,) = rig.notes  # read again, it is still a guess
    assert "12 µm is assumed, two pixels" in note.text
    rig, told = made(capsys, *layout.split(), *aperture)
    diagonal = 0.05 * math.hypot(580, 870) / 1190.732
    assert rig.cameras[0].lens.circle_of_confusion == pytest.approx(diagonal / 1500)
    assert "29.3 µm is assumed, the sensor's diagonal / 1500" in told


def test_each_camera_has_its_own_calibration(here: Path, capsys: Any) -> None:
    write_transforms(Path("tf.txt"))
    Path("info").mkdir()
    for i, camera in enumerate(RIG.cameras):
        Path(f"info/{camera.name}.yaml").write_text(
            CALIBRATION.replace("data: [0,", f"data: [0.{i},")
        )
    rig, _ = made(capsys, "transforms", "tf.txt", "--camera-info", "info")
    assert rig.cameras[0].intrinsics == CameraIntrinsics()
    assert [note.code for note in rig.notes] == ["default_lens"]  # and no image
    assert rig.cameras[3].intrinsics.distortion == (0.3, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("options", "telling"),
    [
        ("colmap none", "none: expected a sparse model"),
        ("colmap model --scale 0", "--scale: expected a number above 0, got 0"),
        ("colmap model --scale big", "argument --scale: invalid float value: 'big'"),
        ("colmap model --transform tf.txt", "tf.txt: expected 16 numbers"),
        ("colmap model --images x", "images: expected some that match x"),
        (
            "colmap model --f-number 8 --hyperfocal-distance 9",
            "lens options: expected either --hyperfocal-distance or --f-number, got both",
        ),
        ("colmap model --focal-length 50", "got 50; 50 is probably in millimetres: write 0.05"),
        ("colmap", "the following arguments are required: FOLDER"),
        ("transforms none", "none: expected a list of transforms, got no such file"),
        ("transforms tf.txt --root x", "tf.txt: root: expected one of hall, "),
        ("transforms tf.txt --convention x", "convention: expected one of optical, body, got 'x'"),
        ("transforms tf.txt --image 4x3", "--image and --fx: expected both or neither"),
        ("transforms tf.txt --fx 3", "--image and --fx: expected both or neither"),
        ("transforms tf.txt --image 4 --fx 3", "--image: expected WIDTHxHEIGHT in pixels, such as"),
        ("transforms tf.txt --image 4x0 --fx 3", "--image: expected a whole number of at"),
        ("transforms tf.txt --camera-info x --fx 3", "--camera-info: expected it, or --image and"),
        ("transforms tf.txt --camera-info none", "none: expected the YAML of a camera_calibration"),
        ("transforms tf.txt --camera-info model", "model: expected cam_0_00.yaml, a file per"),
        ("transforms tf.txt --colours red", "unrecognized arguments: --colours red"),
    ],
)
def test_it_refuses(here: Path, capsys: Any, options: str, telling: str) -> None:
    write_model(Path("model"), 1.0)
    write_transforms(Path("tf.txt"))
    fails(capsys, telling, *options.split())
