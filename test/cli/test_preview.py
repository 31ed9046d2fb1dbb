# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner preview``: what is written, printed and refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from focus_planner import cylinder_rig, load_plan, save_rig
from focus_planner.cli import main as cli

REPOSITORY = Path(__file__).parents[2]
RUN = "bags/mesh_k_view"
NAMES = ("cam_0_00", "cam_1_00")


def run(*arguments: object) -> int:
    return cli.main(["preview", *map(str, arguments)])


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert run(RUN, *arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def test_one_picture_at_the_cameras_resolution(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "one.png"
    assert run(RUN, "--camera", NAMES[0], "--output", path) == 0
    with Image.open(path) as picture:
        assert picture.size == (580, 870)
    shown = capsys.readouterr()
    assert shown.out == f"{path}\n"
    assert "nothing tells the circle of confusion of 36 of 36 cameras: 29.3 µm is" in shown.err


def test_another_methods_picture_is_beside_it(tmp_path: Path) -> None:
    options = ("--method", "closest", "--scale", 0.2, "--output", tmp_path / "pairs")
    assert run(RUN, *options, "--camera", NAMES[0], "--camera", NAMES[1]) == 0
    names = sorted(path.name for path in (tmp_path / "pairs").iterdir())
    assert names == [f"{name}_closest_k_view.png" for name in NAMES]
    with Image.open(tmp_path / "pairs" / names[0]) as picture:
        assert picture.width > 2 * 116


def test_a_contact_sheet_and_every_picture(tmp_path: Path) -> None:
    assert run(RUN, "--all", "--scale", 0.05, "-o", tmp_path) == 0
    assert len(list(tmp_path.glob("cam_*.png"))) == 36
    assert (tmp_path / "contact_sheet.png").is_file()


def test_a_contact_sheet_alone(tmp_path: Path) -> None:
    assert run(RUN, "--all", "--output", tmp_path / "sheet.png") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]


@pytest.fixture
def limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A plan of two pictures for four cameras, and its files."""
    monkeypatch.chdir(tmp_path)
    surface = REPOSITORY / "focus_planner/bodies/arms_out.ply"
    save_rig(cylinder_rig(rows=2, columns=2), tmp_path / "rig.yaml")
    plan = ("plan", surface, "--rig", "rig.yaml", "--method", "em", "--samples", 300)
    assert cli.main([*map(str, plan), "--images", "2", "--output", "plan.json"]) == 0
    return surface


def test_only_pictures_that_are_taken_are_drawn(
    limited: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken, idle = [], []
    for camera in load_plan(Path("plan.json")).cameras:
        (taken if camera.shots else idle).append(camera.name)
    assert (len(taken), len(idle)) == (2, 2)
    files = ("plan.json", "--surface", limited, "--rig", "rig.yaml", "--scale", 0.05)
    assert run(*files, "--all", "--output", "all") == 0
    assert {path.stem for path in Path("all").iterdir()} == {"contact_sheet", *taken}
    capsys.readouterr()
    assert run(*files, "--camera", idle[0]) == 2
    error = capsys.readouterr().err
    assert f"--camera: expected a camera that takes a picture, got '{idle[0]}'" in error
    assert "the plan takes 2 pictures, none of them with it" in error
    # Autofocus may choose others.
    assert run(*files, "--camera", taken[0], "--method", "average", "-o", "pair") == 0
    assert len(list(Path("pair").iterdir())) == 1


def test_what_cannot_be_done_is_told_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "expected --camera NAME, or --all, got neither" in refused(capsys)
    error = refused(capsys, "--camera", "cam_0_0")
    assert "got 'cam_0_0'; did you mean" in error
    assert "they are named like cam_0_00" in refused(capsys, "--camera", "left")
    assert "--method" in refused(capsys, "--camera", NAMES[0], "--method", "best")
    for scale in ("0", "1.5", "nan"):
        assert "--scale: expected a number above 0" in refused(
            capsys, "--camera", NAMES[0], "--scale", scale
        )
    several = [word for name in NAMES for word in ("--camera", name)]
    error = refused(capsys, *several, "--output", tmp_path / "one.png")
    assert "expected a folder for 2 pictures" in error
    (tmp_path / "taken").write_text("")
    error = refused(capsys, "--camera", NAMES[0], "--output", tmp_path / "taken")
    assert "expected a name that ends in .png, .jpg, .jpeg, .tif or .tiff, or a folder" in error


@pytest.mark.parametrize(
    "wrong",
    [
        ("--camera", "left"),
        ("--camera", NAMES[0], "--method", "best"),
        ("--camera", NAMES[0], "--scale", "2"),
        ("--camera", NAMES[0], "--surface", "focus_planner/bodies/arms_down.ply"),
        ("--camera", NAMES[0], "--rig", "rig.yaml"),
        (),
    ],
)
def test_what_cannot_be_done_leaves_no_folder_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: tuple[str, ...]
) -> None:
    refused(capsys, *wrong, "-o", tmp_path / "pictures")
    assert not list(tmp_path.iterdir())


def test_a_run_that_cannot_be_read_leaves_no_folder_behind(tmp_path: Path) -> None:
    assert run(tmp_path / "none", "--all", "-o", tmp_path / "pictures") == 2
    assert not list(tmp_path.iterdir())


def test_a_new_folder_is_made_in_one_that_exists(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    error = refused(capsys, "--camera", NAMES[0], "-o", tmp_path / "none" / "pictures")
    assert "none/pictures: expected a folder, or a new one in one that exists" in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["one.gif", "one.PDF", "one.webp", ".svg"])
def test_the_name_of_another_kind_of_picture_is_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    error = refused(capsys, "--camera", NAMES[0], "--output", tmp_path / name)
    assert "--output: expected a name that ends in .png, .jpg, .jpeg, .tif or .tiff, or" in error
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize(
    ("name", "kind"),
    [("one.PNG", "PNG"), ("one.jpg", "JPEG"), ("one.jpeg", "JPEG"), ("one.TIFF", "TIFF")],
)
def test_a_picture_is_what_its_name_says(tmp_path: Path, name: str, kind: str) -> None:
    options = ("--camera", NAMES[0], "--scale", 0.1, "--output", tmp_path / name)
    assert run(RUN, *options) == 0
    with Image.open(tmp_path / name) as picture:
        assert (picture.format, picture.size) == (kind, (58, 87))
    assert run(RUN, "--all", "--output", tmp_path / f"sheet_{name}") == 0
    with Image.open(tmp_path / f"sheet_{name}") as sheet:
        assert sheet.format == kind


def test_a_name_of_nothing_but_an_ending_is_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    error = refused(capsys, "--camera", NAMES[0], "--output", tmp_path / ".png")
    assert "--output: expected a name before .png" in error
    assert not list(tmp_path.iterdir())
