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

import csv
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import trimesh
import yaml

from focus_planner.cli import main as cli
from focus_planner.core.planning.field_spec import specified_fields
from focus_planner.core.planning.request import BOUNDS, METHODS, SCOPES, TUPLES, PlanRequest
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.gantry import gantry_rig
from focus_planner.core.rig.layouts import cylinder_rig, dome_rig, turntable_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Rig
from focus_planner.io.bodies import body
from focus_planner.io.plans import load_plan
from focus_planner.io.rigs import load_rig, rig_to_yaml, save_rig
from focus_planner.runtime.stop_signals import StopSignals
from testing.terminal import on_a_terminal

RIG = cylinder_rig(2, 6, bottom=0.75, top=1.05)
BALL = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
BALL.apply_translation([0.0, 0.0, 0.9])
PROGRAM = [sys.executable, str(Path(__file__).parents[2] / "testing" / "program.py")]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with a ball, its cloud and a rig around them."""
    monkeypatch.chdir(tmp_path)
    BALL.export("ball.ply")
    np.savetxt("ball.xyz", BALL.vertices)
    save_rig(RIG, Path("rig.yaml"))
    return tmp_path


def plan(*options: str, surface: str = "ball.ply", rig: str = "rig.yaml") -> int:
    return cli.main(["plan", surface, "--rig", rig, *options])


def fails_in_one_line(capsys: pytest.CaptureFixture[str], status: int, *telling: str) -> None:
    out, err = capsys.readouterr()
    assert status == 2
    assert out == ""
    assert err.startswith("focus_planner: error: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for word in telling:
        assert word in err


# --- rig ---------------------------------------------------------------------------------------


def test_rig_cylinder_prints_the_contracts_rig(here: Path, capsys: Any) -> None:
    words = "rig cylinder --rows 7 --columns 24 --radius 0.75 --bottom 0.1 --top 1.7"
    assert cli.main(words.split()) == 0
    out, err = capsys.readouterr()
    assert [line.split(" of ")[0] for line in err.splitlines()] == [
        "focus_planner: note: nothing tells the lens",
        "focus_planner: note: nothing tells the image",
    ]
    without = [line for line in out.splitlines(keepends=True) if not line.startswith("defaults:")]
    assert "".join(without) == rig_to_yaml(cylinder_rig())
    assert yaml.safe_load(out)["defaults"] == ["image", "lens"]
    assert len(yaml.safe_load(out)["cameras"]) == 168


@pytest.mark.parametrize(
    ("words", "rig"),
    [
        ("dome", dome_rig()),
        (
            "dome --rings 2 --columns 6 --radius 0.9 --lowest 10 --highest 70 --height 0.4",
            dome_rig(2, 6, 0.9, 10.0, 70.0, 0.4),
        ),
        ("turntable", turntable_rig()),
        (
            "turntable --cameras 2 --stops 5 --radius 0.5 --lowest -5 --frame-id table",
            turntable_rig(2, 5, 0.5, -5.0, frame_id="table"),
        ),
        ("dome --rings 3 --one-camera", dome_rig(3, one_camera=True)),
        (
            "turntable --cameras 3 --bottom 0.1 --top 0.3 --one-camera",
            turntable_rig(3, bottom=0.1, top=0.3, one_camera=True),
        ),
        ("gantry", gantry_rig()),
        (
            "gantry --look left --centre 1 -2 0 --image 400x300 --fx 500 --distance 0.3",
            gantry_rig(
                distance=0.3,
                look="left",
                centre=(1, -2, 0),
                intrinsics=CameraIntrinsics(400, 300, 500.0, 500.0, 199.5, 149.5),
            ),
        ),
        ("gantry --width 2 --height 3 --overlap 0.7", gantry_rig(2.0, 3.0, overlap=0.7)),
        ("gantry --rows 4 --columns 9", gantry_rig(rows=4, columns=9)),
    ],
)
def test_rig_prints_other_layouts(words: str, rig: Rig, here: Path, capsys: Any) -> None:
    assert cli.main(["rig", *words.split()]) == 0
    Path("rig.yaml").write_text(capsys.readouterr().out)
    assert load_rig(Path("rig.yaml")) == rig


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("gantry --overlap 1", "--overlap: expected a share of at least 0, below 1, got 1"),
        ("gantry --distance 500", "--distance: expected metres, usually"),
        ("gantry --look north", "--look: expected one of down, up, forward"),
        ("turntable --bottom 0.1", "--bottom and --top: expected both or neither"),
        ("dome --lowest 5 --highest 1", "--highest: expected at least --lowest (5°), got 1°"),
        ("path poses.csv --closed", "--closed: expected --steps with it, got none"),
        ("path poses.csv --steps -2", "--steps: expected a whole number of at least 0, got -2"),
        ("path poses.csv --convention up", "--convention: expected one of optical, body, got 'up'"),
        ("path none.csv", "none.csv"),
        ("path rig.yaml", "rig.yaml: line 1: expected lines of x y z qx qy qz qw"),
    ],
)
def test_layouts_that_cannot_be(words: str, message: str, here: Path, capsys: Any) -> None:
    Path("poses.csv").write_text("x,y,z,target_x,target_y,target_z\n1,0,0,0,0,0\n0,1,0,0,0,0\n")
    fails_in_one_line(capsys, cli.main(["rig", *words.split()]), message)


def test_a_path_becomes_a_rig_a_plan_and_a_list_of_pictures(here: Path, capsys: Any) -> None:
    Path("ring.csv").write_text(
        "x,y,z\n1,0,0.9\n0,1,0.9\n-1,0,0.9\n0,-1,0.9\n"  # around the ball
    )
    options = "--target 0 0 0.9 --steps 6 --closed --hyperfocal-distance 8 --focal-length 0.05"
    assert cli.main(["rig", "path", "ring.csv", *options.split()]) == 0
    Path("ring.yaml").write_text(capsys.readouterr().out)
    rig = load_rig("ring.yaml")
    assert rig.sequence
    asked = ("--samples", "200", "--shots", "2", "-o", "plan.json", "-o", "capture.csv")
    assert plan(*asked, rig="ring.yaml") == 0
    planned = load_plan(Path("plan.json"))
    with Path("capture.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    told = [
        (
            (row["name"], int(row["shot"])),
            tuple(float(row[key]) for key in ("x_m", "y_m", "z_m")),
            tuple(float(row[key]) for key in ("qx", "qy", "qz", "qw")),
            *(float(row[key]) for key in ("distance_m", "dioptres", "from_sensor_m")),
            (int(row["picture"]), row["take"] == "1", row["frame"]),
        )
        for row in rows
    ]
    expected = [
        ((at.name, k), at.position, at.orientation)
        + (shot.focus_distance, 1 / shot.focus_distance, shot.from_sensor)
        for at, camera in zip(rig.cameras, planned.cameras, strict=True)
        for k, shot in enumerate(camera.shots, 1)
    ]
    needed = [shot.assigned_samples > 0 for each in planned.cameras for shot in each.shots]
    assert [row[:-1] for row in told] == expected
    assert [row[-1] for row in told] == [(i, take, "world") for i, take in enumerate(needed, 1)]


def test_rig_cylinder_takes_a_lens(here: Path, capsys: Any) -> None:
    options = ["--f-number", "8", "--circle-of-confusion", "3e-5", "--min-focus", "0.3"]
    options += ["--hiatus", "-0.004"]
    assert cli.main(["rig", "cylinder", "--frame-id", "booth", "--bottom", "-0.1", *options]) == 0
    Path("own.yaml").write_text(capsys.readouterr().out)
    rig = load_rig("own.yaml")
    assert rig.frame_id == "booth"
    assert rig.cameras[0].position[2] == -0.1
    lens = Lens(0.05, 0.05**2 / (8 * 3e-5), 0.3, hiatus=-0.004, circle_of_confusion=3e-5)
    assert rig.cameras[0].lens == lens


@pytest.mark.parametrize(
    ("options", "lens"),
    [
        ("--focus-distances 1.5 0.5 1e0", Lens(focus_distances=(0.5, 1.0, 1.5))),
        ("--min-focus 0.4 --focus-steps 20", Lens(min_focus=0.4, focus_steps=20)),
    ],
)
def test_rig_cylinder_takes_a_lens_of_certain_distances(
    here: Path, capsys: Any, options: str, lens: Lens
) -> None:
    assert cli.main(["rig", "cylinder", *options.split()]) == 0
    Path("own.yaml").write_text(capsys.readouterr().out)
    assert {camera.lens for camera in load_rig("own.yaml").cameras} == {lens}


@pytest.mark.parametrize(
    ("options", "telling"),
    [
        ("--rows 0", "error: --rows: expected a whole number of at least 1, got 0"),
        ("--rows many", "argument --rows: invalid int value: 'many'"),
        ("--radius -1", "radius: expected a number above 0"),
        ("--bottom 2 --top 1", "error: --top: expected at least --bottom"),
        ("--radius nan", "radius: expected a number"),
        (
            "--radius 750",
            "--radius: expected metres, usually 0.02 to 100, at most 200, got 750; 750",
        ),
        (
            "--top 1700",
            "--top: expected metres, usually 0.02 to 100, at most 200, got 1700; 1700 is",
        ),
        ("--radius 750", "is probably in millimetres: write 0.75"),
        (
            "--f-number 8 --circle-of-confusion 3e-5 --hyperfocal-distance 9",
            "lens options: expected either --hyperfocal-distance or --f-number, got both",
        ),
        ("--min-focus 3 --max-focus 2", "error: --min-focus: expected at most --max-focus (2 m)"),
        (
            "--hiatus 12",
            "error: --hiatus: expected above -4 focal lengths (-0.2 m) and at most 1 m, got 12 m;",
        ),
        (
            "--focal-length 50",
            "error: --focal-length: expected metres, usually 0.001 to 1, at most 2, got 50; 50 is",
        ),
        (
            "--focal-length 0.05 --f-number 8 --circle-of-confusion 0.03",
            "at most 0.001, got 0.03; 0.03 is probably in millimetres: write 3e-05",
        ),
        ("--f-number 8 --circle-of-confusion 20", "20 is probably in micrometres: write 2e-05"),
        ("--min-focus 350", "--min-focus: expected metres, usually 0.01 to 20, at most 100, got"),
        ("--focus-distances 400 900", "400 is probably in millimetres: write 0.4"),
        ("--hyperfocal-distance 10000", "10000 is probably in millimetres: write 10"),
        (
            "--focal-length 0.002 --f-number 8 --circle-of-confusion 1e-3",
            "error: --focal-length, --f-number, --circle-of-confusion: expected those of one lens",
        ),
        ("--colour red", "unrecognized arguments: --colour; did you mean --columns?"),
    ],
)
def test_rig_cylinder_refuses(options: str, telling: str, capsys: Any) -> None:
    fails_in_one_line(capsys, cli.main(["rig", "cylinder", *options.split()]), telling)


# --- plan --------------------------------------------------------------------------------------


def test_piped_it_prints_plan_json_and_nothing_else(here: Path, capsys: Any) -> None:
    assert plan("--samples", "200") == 0
    out, err = capsys.readouterr()
    assert err == ""
    data = json.loads(out)
    assert data["method"] == PlanRequest().method
    assert data["samples"] == 200
    assert len(data["cameras"]) == len(RIG)
    assert sorted(here.iterdir()) == sorted(here / n for n in ("ball.ply", "ball.xyz", "rig.yaml"))


def test_it_writes_what_is_asked_for(here: Path, capsys: Any) -> None:
    names = ["plan.json", "problem.npz", "plan.png"]
    options = ["-o", names[0], "--problem", names[1], "--picture", names[2]]
    assert plan("--samples", "200", "--method", "em", *options) == 0
    assert capsys.readouterr() == ("", "")
    assert load_plan(Path("plan.json")).method == "em"
    with np.load("problem.npz") as problem:
        assert len(problem["points"]) == 200
    assert Path("plan.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("surface", ["ball.ply", "ball.xyz"])
@pytest.mark.parametrize("method", ["closest", "k_view"])
def test_the_same_seed_gives_the_same_plan(
    here: Path, capsys: Any, method: str, surface: str
) -> None:
    plans = []
    for seed in ("3", "3", "4"):
        options = ["--method", method, "--samples", "300", "--seed", seed]
        assert plan(*options, surface=surface) == 0
        data = json.loads(capsys.readouterr().out)
        plans.append({key: value for key, value in data.items() if "seconds" not in key})
    assert plans[0] == plans[1]
    assert plans[0] != plans[2]


def test_every_option_reaches_the_planner(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[PlanRequest] = []

    def plan_focus(scene: Any, rig: Rig, request: PlanRequest, **_: Any) -> Any:
        seen.append(request)
        raise KeyboardInterrupt

    monkeypatch.setattr("focus_planner.core.planning.plan_focus.plan_focus", plan_focus)
    options = "--method k_view --k 3 --scope assigned --tuples grid --samples 7 --seed 5"
    options += " --shots 2 --depth-tolerance 0.01 --time-budget 1.5"
    options += " --fresh-samples 9 --standard-error 0.5 --bound tight --gap 0.01 --views 3"
    options += " --images 8"
    assert plan(*options.split()) == 130
    assert plan() == 130
    expected = PlanRequest(
        *("k_view", 7, 5, 3, "assigned", "grid", 1.5, 2, 0.01, 9, 0.5),
        bound="tight",
        gap=0.01,
        views=3,
        images=8,
    )
    assert seen == [expected, PlanRequest()]


def test_a_body_that_lies_on_its_side_is_told_and_turned(here: Path, capsys: Any) -> None:
    standing = trimesh.load_mesh(body("arms_down"), process=False)
    standing.export("standing.ply")
    x, y, z = standing.vertices.T
    trimesh.Trimesh(np.column_stack([x, z, -y]), standing.faces, process=False).export("lying.ply")
    save_rig(cylinder_rig(4, 8, radius=1.2), Path("wide.yaml"))
    options = ["--method", "em", "--samples", "300", "--bound", "none"]
    assert plan(*options, surface="lying.ply", rig="wide.yaml") == 0
    out, err = capsys.readouterr()
    (note,) = (each for each in json.loads(out)["notes"] if each["code"] == "up_axis")
    assert f"focus_planner: note: {note['text']}\n" in err
    assert "--up y" in note["text"]
    assert plan(*options, "--quiet", surface="lying.ply", rig="wide.yaml") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert note in json.loads(out)["notes"]
    assert plan(*options, "--up", "y", surface="lying.ply", rig="wide.yaml") == 0
    turned, err = capsys.readouterr()
    assert (json.loads(turned)["notes"], err) == ([], "")
    assert plan(*options, surface="standing.ply", rig="wide.yaml") == 0
    stood, _ = capsys.readouterr()
    assert json.loads(turned)["cameras"] == json.loads(stood)["cameras"]


def test_a_lens_that_nothing_tells_is_told(here: Path, capsys: Any) -> None:
    assert cli.main(["rig", "cylinder", "--rows", "3", "--columns", "8"]) == 0
    Path("made.yaml").write_text(capsys.readouterr().out)
    options = ["--method", "em", "--samples", "300", "--bound", "none", "--record", "runs"]
    assert plan(*options, rig="made.yaml") == 0
    notes = json.loads(capsys.readouterr().out)["notes"]
    assert [note["code"] for note in notes][:2] == ["default_lens", "default_image"]
    assert "under lens in made.yaml" in notes[0]["text"]
    # What was read is what a replay is told of; it reads no file.
    assert cli.main(["replay", "runs", "--json"]) == 0
    (replay,) = json.loads(capsys.readouterr().out)
    assert replay["now"]["notes"] == replay["recorded"]["notes"] == notes
    text = Path("made.yaml").read_text()
    Path("made.yaml").write_text(text.replace("defaults: [image, lens]", "defaults: []"))
    assert plan(*options[:-2], rig="made.yaml") == 0
    assert json.loads(capsys.readouterr().out)["notes"] == notes[2:]


def test_a_bound_is_written_unless_it_is_not_wanted(here: Path, capsys: Any) -> None:
    gaps = {}
    for options in ("", "--bound none", "--bound tight", "--method optimal --gap 0.001"):
        assert plan("--samples", "400", *options.split()) == 0
        data = json.loads(capsys.readouterr().out)
        assert data["lower_bound"] is None or data["lower_bound"] <= data["cost"]
        gaps[options] = data["lower_bound"] and 1 - data["lower_bound"] / data["cost"]
    assert gaps.pop("--bound none") is None
    assert gaps["--bound tight"] <= gaps[""] < 0.05
    assert gaps["--method optimal --gap 0.001"] <= 0.001 + 1e-9


TABLES = """
cameras:
  cam_0_00: {unit: focus_absolute, whole: true, distances: [0.3, 2], values: [90, 0]}
  cam_1_03: {unit: dioptres}
  of_another_rig: {unit: m}
"""


def test_device_values_are_told(here: Path, capsys: Any) -> None:
    Path("lenses.yaml").write_text(TABLES)
    assert plan("--samples", "300", "--lens-tables", "lenses.yaml") == 0
    cameras = {c["name"]: c for c in json.loads(capsys.readouterr().out)["cameras"]}
    counted = LensTable("focus_absolute", True, (0.3, 2.0), (90, 0))
    told = cameras["cam_0_00"]
    assert told["device_unit"] == "focus_absolute"
    assert told["focus_distance"] == counted.distance_at(told["device_value"])
    told = cameras["cam_1_03"]
    assert (told["device_value"], told["device_unit"]) == (1 / told["focus_distance"], "dioptres")
    assert sum("device_unit" in camera for camera in cameras.values()) == 2
    # As much as a table in the rig's own file.
    rig = load_rig("rig.yaml")
    first = replace(rig.cameras[0], lens=replace(rig.cameras[0].lens, table=counted))
    save_rig(replace(rig, cameras=(first, *rig.cameras[1:])), Path("told.yaml"))
    assert plan("--samples", "300", rig="told.yaml") == 0
    again = json.loads(capsys.readouterr().out)["cameras"]
    assert again[0] == cameras["cam_0_00"]


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("cameras: {left: {unit: m}}", "cameras: expected some of the rig's 12: cam_0_00, cam_0"),
        ("cameras: {cam_0_00: {unt: m}}", "did you mean unit?"),
        (
            "default: {unit: s, distances: [1.0e-3, 2.0e-3], values: [0, 1]}",
            "camera cam_0_00: lens.table: expected distances",
        ),
    ],
)
def test_bad_lens_tables_are_refused(here: Path, capsys: Any, text: str, telling: str) -> None:
    Path("lenses.yaml").write_text(text)
    fails_in_one_line(capsys, plan("--lens-tables", "lenses.yaml"), "lenses.yaml: ", telling)
    fails_in_one_line(capsys, plan("--lens-tables", "none.yaml"), "none.yaml", "no such file")


def test_samples_0_takes_as_many_of_a_mesh_as_are_asked_for(here: Path, capsys: Any) -> None:
    assert plan("--samples", "0", "--standard-error", "1.5", "--method", "em") == 0
    data = json.loads(capsys.readouterr().out)
    assert data["samples"] == data["fresh_samples"] > 2048
    assert data["fresh_standard_error"] == pytest.approx(1.5, rel=0.1)
    fails_in_one_line(capsys, plan("--samples", "0", "--standard-error", "1e-9"), "at least")


def test_samples_0_takes_the_clouds_points(here: Path, capsys: Any) -> None:
    assert plan("--samples", "0", "--method", "em", surface="ball.xyz") == 0
    assert json.loads(capsys.readouterr().out)["samples"] == len(BALL.vertices)


@pytest.mark.parametrize("surface", ["ball.ply", "ball.xyz"])
def test_importance_changes_the_plan(here: Path, capsys: Any, surface: str) -> None:
    plans = []
    np.savetxt("upper.txt", BALL.vertices[:, 2] > 0.9)
    for options in ([], ["--importance", "upper.txt"]):
        assert plan("--samples", "300", *options, surface=surface) == 0
        plans.append(json.loads(capsys.readouterr().out))
    assert plans[1]["covered_area"] < 0.6 * plans[0]["covered_area"]
    assert plans[1]["surface_area"] == plans[0]["surface_area"]


def test_a_property_counts_as_importance_when_asked(here: Path, capsys: Any) -> None:
    rows = np.column_stack([BALL.vertices, BALL.vertices[:, 2] > 0.9])
    np.savetxt("ball.csv", rows, delimiter=",", header="x,y,z,weight", comments="")
    plans = []
    for options in ([], ["--importance-property", "weight"]):
        assert plan("--samples", "300", *options, surface="ball.csv") == 0
        plans.append(json.loads(capsys.readouterr().out))
    assert plans[1]["covered_area"] < 0.6 * plans[0]["covered_area"]
    asked = "--importance-property", "confidence"
    fails_in_one_line(capsys, plan(*asked, surface="ball.csv"), "confidence, which --importance-pr")
    asked = *asked, "--importance", "numbers.txt"
    fails_in_one_line(capsys, plan(*asked, surface="ball.csv"), "expected one of them, got both")


@pytest.mark.parametrize(
    ("content", "telling"),
    [
        ("1\n2\n", "numbers.txt: expected 642 numbers, one per vertex, got 2"),
        ("1\n" * 641 + "nan\n", "mesh vertex_importance: expected finite numbers"),
        ("0\n" * 642, "mesh vertex_importance: expected some above 0"),
        ("many\n", "something else in place of a number"),
        ("", "got an empty file"),
    ],
)
def test_a_bad_importance_is_refused(here: Path, capsys: Any, content: str, telling: str) -> None:
    Path("numbers.txt").write_text(content)
    fails_in_one_line(capsys, plan("--importance", "numbers.txt"), telling)


def with_camera(**changes: Any) -> str:
    """Return a rig.yaml whose second camera is changed."""
    values = yaml.safe_load(rig_to_yaml(RIG))
    values["cameras"][1].update(changes)
    return yaml.safe_dump(values)


def ball(**changes: Any) -> trimesh.Trimesh:
    arrays = {"vertices": BALL.vertices.copy(), "faces": BALL.faces.copy()} | changes
    return trimesh.Trimesh(**arrays, process=False)


def bad_faces(index: list[int]) -> np.ndarray[Any, Any]:
    faces = np.array(BALL.faces)
    faces[3] = index
    return faces


@pytest.mark.parametrize(
    ("mesh", "telling"),
    [
        (ball(vertices=BALL.vertices * np.nan), "NaN or infinity in 642 of 642 (first: vertex 0)"),
        (ball(faces=bad_faces([0, 1, 999])), "expected vertex indices from 0 to 641"),
        (ball(faces=[[4, 4, 9]]), "1 of 1 degenerate (first: 0)"),
        (ball(faces=np.array(BALL.faces)[:, ::-1]), "normals are probably inverted"),
        (ball(vertices=1000 * BALL.vertices), "probably in millimetres"),
        (ball(vertices=BALL.vertices + [500, 0, 0]), "cameras within 100 times"),
    ],
)
def test_a_bad_mesh_is_refused(
    here: Path, capsys: Any, mesh: trimesh.Trimesh, telling: str
) -> None:
    mesh.export("bad.ply")
    fails_in_one_line(capsys, plan("--samples", "200", surface="bad.ply"), telling)


@pytest.mark.parametrize(
    ("name", "content", "telling"),
    [
        ("bad.ply", "not a mesh at all\n", "bad.ply: expected a complete ply file"),
        ("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangle"),
        ("bad.xyz", "# x y z\n", "an empty cloud"),
        ("bad.txt", "hello\n", "no line of numbers"),
        ("bad.doc", "hello\n", "got '.doc'"),
        ("rig.yaml", "cameras: []\n", "got '.yaml'"),
    ],
)
def test_what_is_no_surface_is_refused(
    here: Path, capsys: Any, name: str, content: str, telling: str
) -> None:
    save_rig(RIG, Path("other.yaml"))
    Path(name).write_text(content)
    fails_in_one_line(capsys, plan(surface=name, rig="other.yaml"), telling)


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        (with_camera(orientation=[0, 0, 0, 0]), "bad.yaml: camera cam_0_01: orientation"),
        (with_camera(orientation=[0, 0, 0, float("nan")]), "expected a unit quaternion"),
        (with_camera(position=[0, 0, float("nan")]), "position: expected finite coordinates"),
        (with_camera(position=[0.0, 0.0, 0.9]), "1 of 12 inside it (cam_0_01)"),
        (with_camera(name="cam_0_00"), "unique camera names"),
        (with_camera(lense={}), "did you mean lens?"),
        ("cameras: []\n", "at least one camera"),
        ("cameras: [\n", "expected YAML"),
        (
            rig_to_yaml(
                Rig(
                    tuple(
                        replace(c, position=tuple(1000 * x for x in c.position))
                        for c in RIG.cameras
                    )
                )
            ),
            "millimetres",
        ),
    ],
)
def test_a_bad_rig_is_refused(here: Path, capsys: Any, text: str, telling: str) -> None:
    Path("bad.yaml").write_text(text)
    fails_in_one_line(capsys, plan("--samples", "200", rig="bad.yaml"), telling)


@pytest.mark.parametrize(
    ("options", "telling"),
    [
        (
            "--method best",
            "error: --method: expected one of closest, average, em, greedy, k_view, optimal,",
        ),
        ("--k 4", "k: expected 2 or 3, got 4"),
        ("--scope some", "scope: expected one of all, assigned"),
        ("--tuples pairs", "tuples: expected one of overlap, grid"),
        ("--samples -1", "samples: expected a whole number of at least 0"),
        ("--fresh-samples 1", "--fresh-samples: expected a whole number of at least 2"),
        ("--samples 1e3", "invalid int value: '1e3'"),
        ("--seed -1", "seed: expected a whole number"),
        ("--time-budget -1", "error: --time-budget: expected a number of at least 0, got -1"),
        ("--shots 0", "shots: expected a whole number of at least 1"),
        ("--depth-tolerance -1", "--depth-tolerance: expected a number of at least 0"),
        ("--depth-tolerance 9 --samples 200", "with which nothing counts as in focus"),
        ("--bound some", "bound: expected one of none, quick, tight, got 'some'"),
        ("--gap -1", "gap: expected a number of at least 0, got -1"),
        ("--gap 1e300", "gap: expected at most 1, the whole cost, got 1e+300"),
        ("--gap small", "argument --gap: invalid float value: 'small'"),
        ("--output none/plan.json", "none/plan.json: expected a file in a folder that exists"),
        ("--output .", "got a folder"),
        ("--output .csv", "--output: expected a name before .csv, got .csv; such as x.csv"),
        ("--output ./.JSON", "--output: expected a name before .JSON, got .JSON; such as x.JSON"),
        ("--output .plan", "--output: expected a name that ends in .json for the plan, or in"),
        ("--problem -", "--problem: expected a name, got -, which stands for stdout; only --out"),
        ("--picture -", "--picture: expected a name, got -,"),
        ("--record -", "--record: expected a name, got -,"),
        ("--output - --output -", "expected different files, got the same twice"),
        ("--output plan.txt", "--output: expected a name that ends in .json for the plan, or in"),
        ("--output plan.json --output none/sheet.pdf", "none/sheet.pdf: expected a file in a fold"),
        ("--problem none/x.npz", "none/x.npz"),
        ("--picture none/x.png", "none/x.png"),
        ("--sampels 3", "unrecognized arguments: --sampels; did you mean --samples? (see focus"),
        ("--sam=3", "unrecognized arguments: --sam; did you mean --samples? (see focus"),
        ("--colour 3", "unrecognized arguments: --colour 3 (see focus_planner plan --help)"),
        ("--metod em", "unrecognized arguments: --metod; did you mean --method?"),
        ("--method kview", "got 'kview'; did you mean k_view?"),
        ("--tuples girds", "got 'girds'; did you mean grid?"),
        ("--up Y", "did you mean y?"),
    ],
)
def test_a_bad_option_is_refused(here: Path, capsys: Any, options: str, telling: str) -> None:
    fails_in_one_line(capsys, plan(*options.split()), telling)


def test_a_picture_that_nothing_can_draw_is_refused_before_it_is_planned(
    here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "focus_planner.io.picture", raising=False)
    status = plan("--samples", "200", "--picture", "plan.png", "--output", "plan.json")
    fails_in_one_line(capsys, status, "picture: expected matplotlib to draw it with")
    assert not Path("plan.json").exists()


def test_a_pdf_that_nothing_can_write_is_refused_before_it_is_planned(
    here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "reportlab", None)
    monkeypatch.delitem(sys.modules, "focus_planner.io.lens_sheet.pdf_pages", raising=False)
    status = plan("--samples", "200", "--output", "sheet.pdf", "--output", "plan.json")
    fails_in_one_line(capsys, status, "lens sheet: expected reportlab to write it as PDF with")
    assert not Path("plan.json").exists()
    assert plan("--samples", "200", "--output", "sheet.html", "--output", "plan.json") == 0


@pytest.mark.parametrize("words", [[], ["--k", "3"]])
def test_one_camera_is_planned(here: Path, capsys: Any, words: list[str]) -> None:
    save_rig(Rig(RIG.cameras[:1]), Path("one.yaml"))
    assert plan("--samples", "200", "--output", "-", *words, rig="one.yaml") == 0
    data = json.loads(capsys.readouterr().out)
    assert data["method"] == "k_view"
    assert [camera["status"] for camera in data["cameras"]] == ["planned"]


def test_grid_tuples_need_a_grid(here: Path, capsys: Any) -> None:
    save_rig(Rig(RIG.cameras), Path("loose.yaml"))
    status = plan("--samples", "200", "--tuples", "grid", rig="loose.yaml")
    fails_in_one_line(capsys, status, "give the rig's grid")


def test_missing_files_are_told(here: Path, capsys: Any) -> None:
    fails_in_one_line(capsys, plan(surface="none.ply"), "none.ply", "no such file")
    fails_in_one_line(capsys, plan(rig="none.yaml"), "none.yaml: expected a rig.yaml, got no such")


def test_one_file_is_not_written_twice(here: Path, capsys: Any) -> None:
    for option, name in (("--problem", "same.json"), ("--output", "./same.json")):
        status = plan("--output", "same.json", option, name)
        fails_in_one_line(capsys, status, "expected different files, got the same twice")
    assert not Path("same.json").exists()


def test_a_plan_and_lens_sheets_are_written_at_once(here: Path, capsys: Any) -> None:
    names = ("plan.json", "plain", "sheet.csv", "SHEET.HTML", "sheet.pdf")
    options = [word for name in names for word in ("--output", name)]
    assert plan("--samples", "200", *options) == 0
    assert capsys.readouterr() == ("", "")
    planned = load_plan(Path("plan.json"))
    assert load_plan(Path("plain")) == planned
    with Path("sheet.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert sorted(rows) == sorted(camera.name for camera in planned.cameras)
    for camera in planned.cameras:
        assert camera.from_sensor is not None
        assert float(rows[camera.name]["distance_m"]) == camera.focus_distance
        assert float(rows[camera.name]["from_sensor_m"]) == camera.from_sensor
        assert 0.05 < camera.from_sensor - camera.focus_distance < 0.1
    page = Path("SHEET.HTML").read_text(encoding="utf-8")
    assert "ball.ply" in page
    assert "rig.yaml" in page
    assert Path("sheet.pdf").read_bytes().startswith(b"%PDF")


def test_with_a_lens_sheet_alone_the_plan_is_still_printed(here: Path, capsys: Any) -> None:
    assert plan("--samples", "200", "--output", "sheet.csv") == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 200
    assert Path("sheet.csv").read_text(encoding="utf-8").startswith("set,name,distance_m,")


def test_a_plan_may_go_into_a_pipe(here: Path, capsys: Any) -> None:
    assert plan("--samples", "200", "--output", "/dev/null", "--output", "sheet.csv") == 0
    assert capsys.readouterr() == ("", "")


def test_a_plan_may_go_to_stdout_beside_files(here: Path, capsys: Any) -> None:
    assert plan("--samples", "200", "--output", "-", "--output", "plan.json") == 0
    out, err = capsys.readouterr()
    assert (out, err) == (Path("plan.json").read_text(encoding="utf-8"), "")
    assert plan("--samples", "200", "--output", "./-") == 0
    assert capsys.readouterr() == ("", "")
    assert json.loads(Path("-").read_text(encoding="utf-8"))["samples"] == 200


def test_where_to_write_is_checked_before_anything_is_read(here: Path, capsys: Any) -> None:
    status = plan("--output", "none/plan.json", surface="none.ply", rig="none.yaml")
    fails_in_one_line(capsys, status, "none/plan.json")


def test_too_little_memory_is_told(
    here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run_out(*_: Any, **__: Any) -> None:
        raise MemoryError("Unable to allocate 7 PiB")

    monkeypatch.setattr("focus_planner.core.planning.plan_focus.plan_focus", run_out)
    fails_in_one_line(capsys, plan(), "not enough memory")


# --- the rest ----------------------------------------------------------------------------------


def test_help_names_every_choice_and_default(capsys: Any) -> None:
    assert cli.main(["plan", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for choice in (*METHODS, *SCOPES, *TUPLES, *BOUNDS):
        assert choice in text
    defaults = PlanRequest()
    for field in specified_fields(PlanRequest):
        value = getattr(defaults, field.name)
        if isinstance(value, bool):
            assert f" --{field.name} {field.spec.help}" in text
            continue
        shown = {math.inf: "none", 1e-4: "0.0001", 2.0: "2", 0.0: "0"}.get(value, value)
        # With what it takes, unlike where another option's help mentions it.
        option = rf" --{field.name.replace('_', '-')} [A-Z{{].*?\(default: (.*?)\)"
        assert re.search(option, text.partition("how to plan:")[2])[1] == str(shown)


@pytest.mark.parametrize("words", ["", "rig", "node", "lens_adapter", "demo", "rig cylinder"])
def test_every_command_has_help(words: str, capsys: Any) -> None:
    assert cli.main([*words.split(), "--help"]) == 0
    assert "usage: focus_planner" in capsys.readouterr().out


@pytest.mark.parametrize("words", [[], ["rig"]])
def test_without_a_command_there_is_help(words: list[str], capsys: Any) -> None:
    assert cli.main(words) == 0
    shown = capsys.readouterr()
    assert cli.main([*words, "--help"]) == 0
    assert capsys.readouterr() == shown
    assert shown.err == ""


@pytest.mark.parametrize("words", [["fly"], ["plan"], ["rig", "sphere"]])
def test_an_incomplete_command_is_refused(words: list[str], capsys: Any) -> None:
    fails_in_one_line(capsys, cli.main(words), "--help)")


def test_it_tells_its_version(capsys: Any) -> None:
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("focus_planner")


@pytest.mark.processes
def test_python_runs_the_package() -> None:
    words = [sys.executable, "-m", "focus_planner", "--version"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("focus_planner")
    assert done.stderr == ""


@pytest.mark.processes
@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("focus_planner r", {"rig", "replay", "report"}),
        ("focus_planner plan --method ", set(METHODS)),
        ("focus_planner plan --sco", {"--scope"}),
        ("focus_planner report --compare ", set(METHODS)),
    ],
)
def test_a_shell_completes_without_loading_what_plans(typed: str, offered: set[str]) -> None:
    heavy = ("numba", "open3d", "rclpy", "scipy", "trimesh", "rosbags", "matplotlib")
    program = f"""
import atexit, os, sys
from focus_planner.cli import main
os._exit = sys.exit
atexit.register(lambda: print(*sys.modules.keys() & {set(heavy)!r}, file=sys.stderr))
main.main()
"""
    completing = {"_ARGCOMPLETE": "1", "COMP_LINE": typed, "COMP_POINT": str(len(typed))}
    # What a shell gives as descriptor 8.
    completing |= {"_ARGCOMPLETE_STDOUT_FILENAME": "/dev/stdout", "_ARGCOMPLETE_IFS": " "}
    words = [sys.executable, "-c", program]
    done = subprocess.run(
        words, capture_output=True, text=True, check=True, env=os.environ | completing
    )
    assert {word.strip() for word in done.stdout.split()} == offered
    assert done.stderr.strip() == ""


@pytest.mark.parametrize("entry", [cli.__file__, Path(cli.__file__).parents[1] / "__main__.py"])
def test_argcomplete_finds_its_marker(entry: Path) -> None:
    assert "PYTHON_ARGCOMPLETE_OK" in Path(entry).read_text(encoding="utf-8")[:1024]


def module(name: str, monkeypatch: pytest.MonkeyPatch, **functions: Any) -> None:
    stand_in = ModuleType(name)
    vars(stand_in).update(functions)
    monkeypatch.setitem(sys.modules, name, stand_in)


@pytest.mark.parametrize("command", ["node", "lens_adapter", "simulated_lens"])
def test_node_passes_everything_on(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []

    def main(args: list[str], signals: StopSignals) -> int:
        signals.undo()
        seen.append(args)
        return 7

    module(f"focus_planner.ros.{command}", monkeypatch, main=main)
    assert cli.main([command, "--ros-args", "-p", "samples:=9", "--help"]) == 7
    assert seen == [["--ros-args", "-p", "samples:=9", "--help"]]


def test_demo_takes_a_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Path, bool]] = []

    def run(folder: Path, _: Any, *, show: bool) -> None:
        seen.append((folder, show))

    module("focus_planner.demo", monkeypatch, run=run)
    assert cli.main(["demo"]) == 0
    assert cli.main(["demo", "--output", "there"]) == 0
    assert cli.main(["demo", "--no-open"]) == 0
    there, usual = Path("there"), Path("demo_output")
    assert seen == [(usual, True), (there, True), (usual, False)]


# --- as a process ------------------------------------------------------------------------------


@pytest.mark.processes
def test_a_closed_pipe_is_quiet() -> None:
    ours, theirs = os.pipe()
    os.close(ours)
    words = [*PROGRAM, "rig", "cylinder"]
    done = subprocess.run(words, stdout=theirs, stderr=subprocess.PIPE, check=False)
    os.close(theirs)
    assert done.returncode == 141
    assert all(line.startswith(b"focus_planner: note: ") for line in done.stderr.splitlines())


@pytest.mark.processes
def test_a_process_is_quiet_when_piped_and_bad_input_costs_one_line(here: Path) -> None:
    words = [*PROGRAM, "plan", str(body("arms_down")), "--rig", "rig.yaml", "--samples", "200"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert json.loads(done.stdout)["samples"] == 200
    done = subprocess.run([*words, "--k", "9"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "focus_planner: error: --k: expected 2 or 3, got 9\n"


def plan_on_a_terminal(*options: str, **how: Any) -> tuple[int, str]:
    words = ["plan", "ball.ply", "--rig", "rig.yaml", "--samples", "300", *options]
    return on_a_terminal(words, **how)


@pytest.mark.processes
def test_a_person_sees_progress_and_a_summary(here: Path) -> None:
    status, shown = plan_on_a_terminal()
    assert status == 0
    assert "finding what 12 cameras see" in shown
    for word in ("cost", "fresh cost", "in focus", " ± ", "m²", "% of the surface", "planned"):
        assert word in shown
    for word in ("in 1 view", "in 5 views", "sharp in so many or more", "resolution", "mm/px"):
        assert word in shown
    for word in ("lower bound", "no plan costs less on these samples: within", "% of the best"):
        assert word in shown
    assert '"cameras"' not in shown


@pytest.mark.processes
def test_a_person_sees_what_lenses_are_told(here: Path) -> None:
    Path("lenses.yaml").write_text(TABLES)
    status, shown = plan_on_a_terminal("--lens-tables", "lenses.yaml")
    assert status == 0
    assert re.search(r"lenses\W+\d+ to \d+\W+focus_absolute", shown)
    assert re.search(r"lenses\W+[\d.]+ to [\d.]+\W+dioptres", shown)
    told = (
        r"focused at\W+([\d.]+) to [\d.]+ m\W+from the centre of projection; ([\d.]+) to [\d.]+ m"
    )
    near, marked = map(float, re.search(told, shown).groups())  # type: ignore[union-attr]
    assert 0.05 < marked - near < 0.1


@pytest.mark.processes
def test_a_person_sees_progress_beside_a_pipe(here: Path) -> None:
    with Path("plan.json").open("wb") as file:
        status, shown = plan_on_a_terminal(stdout=file.fileno())
    assert status == 0
    assert "finding what" in shown
    assert "in focus" not in shown
    assert json.loads(Path("plan.json").read_text())["samples"] == 300


@pytest.mark.processes
def test_quiet_is_quiet_on_a_terminal(here: Path) -> None:
    assert plan_on_a_terminal("--quiet", "--output", "plan.json") == (0, "")
    status, shown = plan_on_a_terminal("--quiet", "--output", "-")
    assert (status, json.loads(shown)["samples"]) == (0, 300)
    assert load_plan(Path("plan.json")).samples == 300


def test_what_is_read_is_not_written(here: Path, capsys: Any) -> None:
    Path("lenses.yaml").write_text(TABLES)
    for option, path in (
        ("--output", "rig.yaml"),
        ("--picture", "ball.ply"),
        ("--problem", "lenses.yaml"),
    ):
        before = Path(path).read_bytes()
        status = plan(option, path, "--lens-tables", "lenses.yaml")
        fails_in_one_line(capsys, status, "an output file that is not an input as well")
        assert Path(path).read_bytes() == before
