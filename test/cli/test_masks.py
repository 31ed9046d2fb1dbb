# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner masks``: what is written, printed and refused; COLMAP reads the masks itself."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image

from focus_planner.cli import main as cli
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.io.rig_files.found import ImportOptions
from focus_planner.io.rig_files.nerfstudio import load_nerfstudio
from focus_planner.io.rigs import save_rig
from testing.problems import around
from testing.runs import TORUS, record

IMAGE = CameraIntrinsics(200, 150, 170.0, 170.0, 99.5, 74.5)
CAMERAS = 4


def rig_of(image: CameraIntrinsics = IMAGE) -> Rig:
    return around(CAMERAS, 2.5, intrinsics=image, lens=Lens(0.085, 40.0))


@pytest.fixture(scope="module")
def run_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    path: Path = record(folder, PlanRequest("em", 300, fresh_samples=300), rig=rig_of())
    return path


def masks(*words: object) -> int:
    return cli.main(["masks", *map(str, words), "--quiet"])


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        assert image.mode == "L"
        return np.asarray(image)


@pytest.mark.parametrize(
    ("program", "mask"),
    [
        ("colmap", "c{}.jpg.png"),
        ("nerfstudio", "c{}.png"),
        ("metashape", "c{}_mask.png"),
        ("none", "c{}.png"),
    ],
)
def test_every_picture_has_a_mask(
    run_path: Path, tmp_path: Path, program: str, mask: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert masks(run_path, "--output", tmp_path / "out", "--for", program) == 0
    files = {mask.format(i) for i in range(CAMERAS)}
    assert {file.name for file in (tmp_path / "out" / "masks").iterdir()} == files
    shares = []
    for name in files:
        values = pixels(tmp_path / "out" / "masks" / name)
        assert values.shape == (IMAGE.height, IMAGE.width)
        assert set(np.unique(values)) == {0, 255}
        shares.append((values > 0).sum())
    said = capsys.readouterr().out
    assert f"masks: {CAMERAS} in {tmp_path / 'out' / 'masks'}" in said
    assert re.search(r"in focus: [\d.]+% of the pixels .*; by picture .*% to .*%, median", said)
    assert re.search(r"of the blurred pixels, sharp in another picture: [\d.]+%", said)


@pytest.mark.parametrize("kind", ["tiff", "exr"])
def test_maps_agree_with_the_masks(run_path: Path, tmp_path: Path, kind: str) -> None:
    if kind == "exr":
        openexr = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    words = ["--depth", "--blur", "--maps", kind, "--max-blur", 1.5]
    assert masks(run_path, "--output", tmp_path, *words) == 0
    for i in range(CAMERAS):
        mask = pixels(tmp_path / "masks" / f"c{i}.png") > 0
        found = []
        for what, channel in (("depth", "Z"), ("blur", "Y")):
            file = str(tmp_path / what / f"c{i}.{kind}")
            if kind == "tiff":
                found.append(cv2.imread(file, cv2.IMREAD_UNCHANGED))
            else:
                found.append(openexr.File(file).channels()[channel].pixels)
        depths, blur = found
        np.testing.assert_array_equal(np.isfinite(depths), np.isfinite(blur))
        assert np.isfinite(depths[mask]).all()
        assert blur[mask].max(initial=0) <= 1.5


def test_a_plan_file_gives_the_same_masks_as_its_run(run_path: Path, tmp_path: Path) -> None:
    save_rig(rig_of(), tmp_path / "rig.yaml")
    surface = tmp_path / "torus.ply"
    trimesh.Trimesh(TORUS.vertices, TORUS.triangles, process=False).export(surface)
    words = [surface, "--rig", tmp_path / "rig.yaml", "--samples", "300", "--method", "em"]
    words += ["--output", tmp_path / "plan.json", "--record", tmp_path / "runs"]
    assert cli.main(["plan", *map(str, words)]) == 0
    (run,) = (tmp_path / "runs").iterdir()
    named = ["--surface", surface, "--rig", tmp_path / "rig.yaml"]
    assert masks(tmp_path / "plan.json", *named, "--output", tmp_path / "one") == 0
    assert masks(run, "--output", tmp_path / "other") == 0
    for i in range(CAMERAS):
        one, other = (pixels(tmp_path / out / "masks" / f"c{i}.png") for out in ("one", "other"))
        np.testing.assert_array_equal(one, other)


# --- programs ----------------------------------------------------------------------------------


def test_colmap_finds_features_only_where_masks_are_white(run_path: Path, tmp_path: Path) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap has no wheel for this Python")
    assert masks(run_path, "--output", tmp_path, "--for", "colmap") == 0
    random = np.random.default_rng(4)
    (tmp_path / "images").mkdir()
    for i in range(CAMERAS):
        noise = random.integers(0, 256, (IMAGE.height // 5, IMAGE.width // 5)).astype(np.uint8)
        noise = cv2.resize(noise, (IMAGE.width, IMAGE.height), interpolation=cv2.INTER_CUBIC)
        cv2.imwrite(str(tmp_path / "images" / f"c{i}.jpg"), noise)
    found = {}
    for kind in ("masked", "whole"):
        options = pycolmap.ImageReaderOptions()
        if kind == "masked":
            options.mask_path = str(tmp_path / "masks")
        extraction = pycolmap.FeatureExtractionOptions()
        extraction.num_threads = 1
        database = tmp_path / f"{kind}.db"
        pycolmap.extract_features(
            database,
            tmp_path / "images",
            reader_options=options,
            extraction_options=extraction,
            device=pycolmap.Device.cpu,
        )
        with pycolmap.Database.open(database) as opened:
            found[kind] = {
                image.name: np.asarray(opened.read_keypoints(image.image_id))[:, :2]
                for image in opened.read_all_images()
            }
    assert set(found["masked"]) == {f"c{i}.jpg" for i in range(CAMERAS)}
    for name in found["whole"]:
        mask = pixels(tmp_path / "masks" / f"{name}.png") > 0
        held = {
            kind: mask[tuple(np.floor(keypoints[name]).astype(int).T[::-1])]
            for kind, keypoints in found.items()
        }
        assert held["masked"].all()
        assert len(held["masked"]) == held["whole"].sum() < len(held["whole"])
    assert sum(map(len, found["masked"].values())) > 20


def test_nerfstudio_gets_the_rig_and_its_masks(run_path: Path, tmp_path: Path) -> None:
    words = ["--output", tmp_path, "--for", "nerfstudio", "--images", "{camera}.png"]
    assert masks(run_path, *words) == 0
    data = json.loads((tmp_path / "transforms.json").read_text())
    assert [frame["file_path"] for frame in data["frames"]] == [
        f"images/c{i}.png" for i in range(CAMERAS)
    ]
    for frame in data["frames"]:
        assert (tmp_path / frame["mask_path"]).is_file()
    rig, _ = load_nerfstudio(tmp_path / "transforms.json", ImportOptions(scale=1.0))
    for camera, planned in zip(rig.cameras, rig_of().cameras, strict=True):
        assert camera.name in (planned.name, f"images_{planned.name}")
        np.testing.assert_allclose(camera.position, planned.position, atol=1e-12)
        turned = np.abs(np.dot(camera.orientation, planned.orientation))
        assert turned == pytest.approx(1, abs=1e-12)
        assert camera.intrinsics == planned.intrinsics


def test_nerfstudios_own_cameras_are_completed(run_path: Path, tmp_path: Path) -> None:
    frames = [{"file_path": f"./pictures/c{i}.jpeg", "other": i} for i in (2, 0)]
    (tmp_path / "transforms.json").write_text(json.dumps({"fl_x": 5.0, "frames": frames}))
    for _ in range(2):  # once more changes nothing
        assert masks(run_path, "--output", tmp_path, "--for", "nerfstudio") == 0
        data = json.loads((tmp_path / "transforms.json").read_text())
        assert data == {
            "fl_x": 5.0,
            "frames": [
                {**frame, "mask_path": f"masks/c{i}.png"}
                for frame, i in zip(frames, (2, 0), strict=True)
            ],
        }


def test_cameras_of_nerfstudio_that_are_no_pictures_of_the_plan_are_told(
    run_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = json.dumps({"frames": [{"file_path": "images/frame_00001.jpg"}]})
    (tmp_path / "transforms.json").write_text(text)
    assert masks(run_path, "--output", tmp_path, "--for", "nerfstudio") == 2
    said = capsys.readouterr().err
    assert "frames[0].file_path: expected a picture of the plan" in said
    assert "none of them is called 'frame_00001'; say with --images" in said
    assert (tmp_path / "transforms.json").read_text() == text
    assert not (tmp_path / "masks").exists()


# --- what is refused ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--max-blur", "0"], "expected a number of pixels above 0, got '0'"),
        (["--max-blur", "x"], "expected a number of pixels above 0, got 'x'"),
        (["--for", "other"], "invalid choice: 'other'"),
        (["--images", "{camera}"], "--images: expected a name of picture files such as"),
        (["--images", "a.jpg"], "a.jpg twice by 'a.jpg'"),
        (["--rig", "rig.yaml"], "a run has its own"),
    ],
)
def test_bad_input_is_told_in_one_line_before_the_work(
    run_path: Path,
    tmp_path: Path,
    words: list[str],
    told: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert masks(run_path, "--output", tmp_path / "out", *words) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["x" * 300, "masks", "{camera}"])
def test_what_cannot_be_made_of_a_name_is_told(
    run_path: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if name == "masks":  # a file where a folder should be
        (tmp_path / "masks").write_text("")
    image = f"{name}.jpg" if "{" in name else name + "{camera}.jpg"
    if name == "{camera}":
        (tmp_path / "masks" / "c0.png").mkdir(parents=True)
    assert masks(run_path, "--output", tmp_path, "--images", image) == 2
    told = {"masks": "masks: expected a folder, got a file", "{camera}": "got a folder"}
    said = capsys.readouterr().err
    assert told.get(name, "got File name too long") in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("what", ["a file", "in no folder"])
def test_where_nothing_can_be_written_is_told(
    run_path: Path, tmp_path: Path, what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a file").write_text("")
    folder = tmp_path / ("a file" if what == "a file" else "missing/out")
    assert masks(run_path, "--output", folder) == 2
    told = "expected a folder to write to, got a file" if what == "a file" else "no folder"
    assert told in capsys.readouterr().err


def test_a_run_that_cannot_be_read_leaves_no_folder_behind(tmp_path: Path) -> None:
    assert masks(tmp_path / "none", "-o", tmp_path / "out") == 2
    assert not list(tmp_path.iterdir())


def test_a_rig_that_nerfstudio_cannot_represent_has_masks_all_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image = CameraIntrinsics(
        *(200, 150, 170.0, 170.0, 99.5, 74.5),
        distortion_model="rational_polynomial",
        distortion=(0.01, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0),
    )
    path = record(tmp_path / "runs", PlanRequest("em", 300, fresh_samples=300), rig=rig_of(image))
    assert masks(path, "--output", tmp_path / "out", "--for", "nerfstudio") == 0
    assert len(list((tmp_path / "out" / "masks").iterdir())) == CAMERAS
    assert not (tmp_path / "out" / "transforms.json").exists()
    told = "no transforms.json is written: camera c0: expected a distortion model of nerfstudio's"
    assert told in capsys.readouterr().err
