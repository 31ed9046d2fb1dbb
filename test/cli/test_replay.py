# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner replay``, and ``plan --record``: what is printed, written and returned."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from focus_planner.cli import main as cli
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.rigs import save_rig
from focus_planner.messages.typestore import deserialize, fields_of, serialize
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.replay import plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import inputs_of
from focus_planner.recording.what_if import parse_changes, with_changes
from testing.forked import run_forked
from testing.runs import (
    REQUEST,
    RIG,
    TORUS,
    beginning_with,
    partial_copy,
    record,
    record_failure,
    rewritten,
    solved,
    with_payload,
)
from testing.terminal import CTRL_C_AT_A_STEP, on_a_terminal

RUN = "focus_planner_msgs/msg/Run"
KEYS = {
    "run",
    "path",
    "outcome",
    "message",
    "recorded_message",
    "differences",
    "notes",
    "software",
    "recorded",
    "now",
    "same_samples",
    "same_fresh_samples",
    "same_measure",
    "cameras",
    "recorded_as",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with runs: one good, one that differs, one that failed, one partial, one broken."""
    folder = tmp_path_factory.mktemp("made")
    good = record(folder / "recorded")
    good.rename(folder / "good")

    def other_cost(message: Any) -> Any:
        if not message.topic.endswith("focus_plan"):
            return message
        fields = fields_of(deserialize(message.type_name, message.payload))
        fields["cameras"][3]["focus_distance"] += 0.25
        return with_payload(message, serialize(message.type_name, fields))

    def other_software(message: Any) -> Any:
        if message.type_name != RUN:
            return message
        fields = fields_of(deserialize(message.type_name, message.payload))
        for entry in fields["software"]:
            if entry["key"] == "numpy":
                entry["value"] = "0.[bold]1"
        return with_payload(message, serialize(message.type_name, fields))

    rewritten(
        rewritten(folder / "good", folder / "tmp", other_cost), folder / "differs", other_software
    )
    shutil.rmtree(folder / "tmp")
    partial_copy(folder / "good", folder / "cut")
    (folder / "broken").mkdir()
    (folder / "broken" / "x.mcap").write_bytes(np.random.default_rng(0).bytes(5000))
    shutil.rmtree(folder / "recorded")
    return folder


@pytest.fixture
def here(made: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A working directory beside copies of the runs."""
    shutil.copytree(made, tmp_path / "runs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def replay(*words: str) -> int:
    return cli.main(["replay", *words])


def replayed_json(capsys: Any, *words: str, status: int = 0) -> list[dict[str, Any]]:
    assert replay(*words, "--json") == status

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    values: list[dict[str, Any]] = json.loads(capsys.readouterr().out, parse_constant=refuse)
    return values


def cells_of(out: str) -> dict[str, list[str]]:
    """Return the cells of tables by what their rows begin with, without those that are empty."""
    rows = (re.split(r"\s{2,}", line.strip()) for line in out.splitlines())
    return {name: cells for name, *cells in rows}


def one_line(err: str) -> str:
    assert err.startswith("focus_planner: error: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    return err


# --- exit statuses -----------------------------------------------------------------------------


def test_what_is_reproduced_is_0(here: Path, capsys: Any) -> None:
    before = sorted(here.rglob("*"))
    assert replay("runs/good") == 0
    out, err = capsys.readouterr()
    assert err == ""
    first, second = out.splitlines()
    assert first == "good reproduced"
    assert second.startswith("  em, cost 8")
    assert sorted(here.rglob("*")) == before


@pytest.mark.parametrize("path", ["runs/good/", "runs/good/*.mcap"])
def test_a_run_may_be_named_in_several_ways(here: Path, capsys: Any, path: str) -> None:
    paths = [str(p) for p in here.glob(path)]
    assert len(paths) == 1
    assert replay(*paths) == 0


def test_a_run_may_be_the_working_directory(
    here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(here / "runs" / "good")
    assert replay(".") == 0
    assert capsys.readouterr().out.startswith("good reproduced\n")


def test_what_differs_is_1_and_told(here: Path, capsys: Any) -> None:
    assert replay("runs/differs") == 1
    out, err = capsys.readouterr()
    assert err == ""
    assert out.splitlines() == [
        "differs differs",
        "  focus: 1 of 8 cameras; the farthest, c3, by 250 mm",
        f"  numpy: 0.[bold]1 then, {np.__version__} now",
    ]


def failed_run(folder: Path) -> Path:
    beginning = beginning_with(replace(REQUEST, depth_tolerance=9.0))
    with pytest.raises(InputError) as told:
        solved(beginning)
    inputs = inputs_of(beginning, TORUS, RIG)
    path: Path = record_failure(folder, beginning, inputs, str(told.value))
    return path


def test_what_fails_as_it_did_is_0(here: Path, capsys: Any) -> None:
    assert replay(str(failed_run(here))) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.splitlines()[1].startswith("  no plan, then as now: depth_tolerance: expected")
    assert len(out.splitlines()) == 2


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("runs/broken", "runs/broken: expected a recorded run, got "),
        ("runs/none", "runs/none: expected a recorded run, got no such folder or file"),
        ("runs/good/metadata.yaml", "metadata.yaml: expected a recorded run, got "),
        ("a" * 300, "expected a recorded run, got File name too long"),
        ("empty", "empty: expected the folder of a run with one .mcap file, got a folder without"),
        ("runs/cut.partial", "cut.partial: expected a complete run, got a partial one: "),
    ],
)
def test_what_cannot_be_read_is_2_in_one_line(
    here: Path, capsys: Any, name: str, told: str
) -> None:
    Path("empty").mkdir()
    assert replay(name) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert told in one_line(err)


def test_a_partial_run_says_what_to_do(here: Path, capsys: Any) -> None:
    assert replay("runs/cut.partial") == 2
    err = one_line(capsys.readouterr().err)
    assert err.endswith("; use --set or --record to plan from its inputs\n")


def test_truncated_and_random_bytes_are_told_in_one_line(here: Path, capsys: Any) -> None:
    (file,) = (here / "runs" / "good").glob("*.mcap")
    whole = file.read_bytes()
    random = np.random.default_rng(3)
    for k in range(12):
        noise = random.bytes(200) if k % 3 else b""
        Path("bad.mcap").write_bytes(whole[: 500 * k] + noise)
        assert replay("bad.mcap") == 2
        out, err = capsys.readouterr()
        assert out == ""
        one_line(err)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--set", "samples=many"], "--set samples: expected a whole number, got 'many'"),
        (["--set", "x=8"], "got 'x'; these can be: method, "),
        (["--set", "method=best"], "method: expected one of closest"),
        (["--set", "depth_tolerance=9"], "depth_tolerance: expected metres that some camera's"),
        (["--live", "--set", "k=2"], "--live: expected neither --set, --record nor --report"),
        (["--live", "--record", "x"], "--live: expected neither --set, --record nor --report"),
        (["--sett", "k=2"], "unrecognized arguments: --sett; did you mean --set?"),
        (["--set", "f_nmber=8"], "can be changed, got 'f_nmber'; did you mean f_number?"),
    ],
)
def test_what_is_asked_wrongly_is_2_in_one_line(
    here: Path, capsys: Any, words: list[str], told: str
) -> None:
    assert replay("runs/good", *words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert told in one_line(err)


def test_a_run_is_required(capsys: Any) -> None:
    assert replay() == 2
    one_line(capsys.readouterr().err)


# --- several -----------------------------------------------------------------------------------


def test_several_runs_are_summed_up(here: Path, capsys: Any) -> None:
    shutil.copytree("runs/good", "runs/[odd] name")
    assert replay("runs/good", "runs/[odd] name", "runs/differs", "runs/broken") == 2
    out, err = capsys.readouterr()
    assert "runs/broken: expected" in one_line(err)
    assert "  focus: 1 of 8 cameras; the farthest, c3, by 250 mm\n" in out
    assert out.splitlines()[-1] == "2 reproduced, 1 differs, 1 unreadable"
    rows = cells_of(out)
    assert rows["run"] == ["outcome", "method", "samples", "cost", "s"]
    assert rows["good"][:3] == rows["[odd] name"][:3] == ["reproduced", "em", "300"]
    assert rows["differs"][:3] == ["differs: focus", "em", "300"]
    assert rows["broken"] == ["unreadable"]


def test_what_is_no_run_in_a_folder_of_runs_is_left_out(here: Path, capsys: Any) -> None:
    folder = here / "mixed"
    shutil.copytree(here / "runs" / "good", folder / "good")
    shutil.copytree(here / "runs" / "good", folder / ".prepared.partial")
    for name in ("fifo.mcap", "folder/fifo.mcap", "folder/metadata.yaml"):
        (folder / name).parent.mkdir(exist_ok=True)
        if name != "fifo.mcap":
            os.mkfifo(folder / name)
    (folder / "link").symlink_to("/nowhere")
    assert [run["path"] for run in replayed_json(capsys, str(folder))] == [str(folder / "good")]


def test_access_of_others_is_as_asked(here: Path) -> None:
    assert replay("runs/good", "--record", "group", "--record-access", "group") == 0
    (path,) = Path("group").iterdir()
    assert {mode(path), mode(path.parent)} == {0o750}
    assert {mode(file) for file in path.iterdir()} == {0o640}


def test_a_folder_of_runs_is_all_of_them(here: Path, capsys: Any) -> None:
    (data,) = replayed_json(capsys, "runs/good")
    runs = replayed_json(capsys, "runs", status=2)
    assert [Path(run["path"]).name for run in runs] == ["broken", "cut.partial", "differs", "good"]
    outcomes = [run["outcome"] for run in runs]
    assert outcomes == ["unreadable", "unreadable", "differs", "reproduced"]
    assert runs[-1]["recorded"] == data["recorded"]


def test_the_worst_of_several_counts(here: Path, capsys: Any) -> None:
    assert replay("runs/good", "runs/good") == 0
    assert replay("runs/differs", "runs/good") == 1
    capsys.readouterr()
    assert replay("runs/good", "runs/differs", "runs/none") == 2


def test_whose_error_it_is_is_told(here: Path, capsys: Any) -> None:
    failed = failed_run(here)
    assert replay("runs/good", str(failed), "--set", "samples=200") == 2
    out, err = capsys.readouterr()
    assert one_line(err).startswith(f"focus_planner: error: {failed}: depth_tolerance: expected")
    assert out.splitlines()[-1] == "1 planned, 1 refused"


# --- JSON --------------------------------------------------------------------------------------


def test_json_says_it_all(here: Path, capsys: Any) -> None:
    (good,) = replayed_json(capsys, "runs/good")
    assert set(good) == KEYS
    run = read_run(Path("runs/good"))
    assert run.ending is not None
    assert run.ending.plan is not None
    assert good["run"] == run.beginning.run_id
    assert good["path"] == "runs/good"
    assert good["outcome"] == "reproduced"
    assert good["recorded_message"] == run.ending.message
    assert (good["differences"], good["notes"], good["software"], good["cameras"]) == (
        [],
        [],
        {},
        [],
    )
    assert good["recorded"]["cost"] == good["now"]["cost"] == run.ending.plan.cost
    assert good["recorded"]["cameras"] == good["now"]["cameras"]
    assert good["recorded_as"] is None
    (differs,) = replayed_json(capsys, "runs/differs", status=1)
    assert set(differs) == KEYS
    (difference,) = differs["differences"]
    assert difference == {
        "stage": "focus",
        "what": "1 of 8 cameras; the farthest, c3, by 250 mm",
    }
    assert differs["software"] == {"numpy": {"recorded": "0.[bold]1", "now": np.__version__}}
    (camera,) = differs["cameras"]
    assert camera["name"] == "c3"
    assert camera["before"] - camera["after"] == pytest.approx(0.25)


def test_json_knows_no_infinity_and_no_nan(here: Path, capsys: Any) -> None:
    # Beyond the hyperfocal distance all is sharp to infinity; without a bound there is none.
    words = ["--set", "hyperfocal_distance=0.5", "--set", "bound=none"]
    (data,) = replayed_json(capsys, "runs/good", *words)
    assert data["now"]["lower_bound"] is None
    assert data["now"]["cameras"][0]["far_limit"] is None


def test_json_of_what_cannot_be_read(here: Path, capsys: Any) -> None:
    (data,) = replayed_json(capsys, "runs/broken", status=2)
    assert set(data) == KEYS
    assert data["outcome"] == "unreadable"
    assert "expected a recorded run" in data["message"]
    assert data["run"] is data["recorded"] is data["now"] is None


# --- what if -----------------------------------------------------------------------------------


def test_what_if_is_compared(here: Path, capsys: Any) -> None:
    words = ["--set", "method=k_view", "--set", "f_number=8", "--set", "samples=400"]
    assert replay("runs/good", *words) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.splitlines()[0] == "good planned"
    assert "note: nothing tells the circle of confusion of 8 of 8 cameras: " in out
    rows = cells_of(out)
    assert rows["method"] == ["em", "k_view"]
    assert rows["samples"] == ["300", "400"]
    assert rows["cost"][-1] == "other samples"
    before, after, change = rows["fresh cost"]
    difference = float(after.split(" ± ")[0]) - float(before.split(" ± ")[0])
    percent = 100 * difference / float(before.split(" ± ")[0])
    assert change.startswith(f"{difference:+.2f}"[:4])
    assert change.endswith(f"({percent:+.2f} %)")
    assert re.fullmatch(r"[\d.]+ ± [\d.]+ m²", rows["in focus area"][1])
    assert "% " not in rows["total seconds"][-1]
    assert "of 8 cameras are focused at other distances, by " in out
    assert rows["c3"][0].endswith(" m")
    assert 0.05 < float(rows["c3"][2].removesuffix(" m")) - float(rows["c3"][1][:-2]) < 0.1
    assert rows["c3"][3].endswith(" mm")


def test_what_if_in_json_has_every_camera(here: Path, capsys: Any) -> None:
    (data,) = replayed_json(capsys, "runs/good", "--set", "f_number=8", "--set", "method=optimal")
    assert data["outcome"] == "planned"
    assert data["now"]["method"] == "optimal"
    assert len(data["notes"]) == 1
    assert data["differences"] == []
    before = {camera["name"]: camera for camera in data["recorded"]["cameras"]}
    after = {camera["name"]: camera for camera in data["now"]["cameras"]}
    moved = [abs(c["after"] - c["before"]) for c in data["cameras"]]
    assert moved == sorted(moved, reverse=True)
    for camera in data["cameras"]:
        name = camera["name"]
        assert camera["before"] == before[name]["focus_distance"]
        assert camera["after"] == after[name]["focus_distance"]
        assert camera["samples_after"] == after[name]["assigned_samples"]


def test_what_changes_nothing_is_said(here: Path, capsys: Any) -> None:
    assert replay("runs/good", "--set", "method=em") == 0
    assert "0 of 8 cameras are focused at other distances.\n" in capsys.readouterr().out


def test_a_partial_run_is_planned_with_what_is_set(here: Path, capsys: Any) -> None:
    assert replay("runs/cut.partial", "--set", "samples=250") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.splitlines()[0] == "cut.partial planned"
    rows = cells_of(out)
    assert rows["samples"] == ["none", "250"]
    assert "compare" not in out


def test_the_summary_says_what_was_changed(here: Path, capsys: Any) -> None:
    assert replay("runs/good", "runs/cut.partial", "--set", "method=closest") == 0
    out = capsys.readouterr().out
    assert "em → closest" in out
    assert out.splitlines()[-1] == "2 planned"


SAMES = {
    "f_number=8": (True, True),
    "method=k_view": (True, True),
    "samples=400": (False, True),
    "fresh_samples=500": (True, False),
    "seed=3": (False, False),
}


@pytest.mark.parametrize("change", SAMES)
def test_what_does_not_compare_is_said(here: Path, capsys: Any, change: str) -> None:
    same, same_fresh = SAMES[change]
    assert replay("runs/good", "--set", change) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert ("The costs are on different samples and do not compare." in out) is not same
    assert ("other samples" in out) is not same
    fresh = f"on {'the same' if same_fresh else 'different'} fresh samples, which is"
    assert (fresh in out) is not (same and same_fresh)
    (data,) = replayed_json(capsys, "runs/good", "--set", change)
    assert (data["same_samples"], data["same_fresh_samples"]) == (same, same_fresh)
    (run,) = (read_run(path) for path in [Path("runs/good")])
    again = plan_run(with_changes(run, parse_changes([change])).run).ending
    assert run.ending is not None
    prints = [{each.stage: each for each in ending.fingerprints} for ending in (run.ending, again)]
    for stage, expected in (("samples", same), ("fresh samples", same_fresh)):
        assert (prints[0][stage] == prints[1][stage]) is expected


MEASURES = {
    "views=3": ("for 1 view then, for 3 views now", "for 3 views"),
    "max_mm_per_pixel=4": (
        "for 1 view then, for 1 view of at most 4 mm per pixel now",
        "for 1 view of at most 4 mm per pixel",
    ),
}


@pytest.mark.parametrize("change", MEASURES)
def test_costs_that_mean_something_else_are_said_not_to_compare(
    here: Path, capsys: Any, change: str
) -> None:
    sentence, short = MEASURES[change]
    words = ("--set", change, "--set", "bound=none")
    assert replay("runs/good", *words) == 0
    out = capsys.readouterr().out
    told = " ".join(out.split())
    assert f"The costs are {sentence}, and do not compare; the areas" in told
    rows = cells_of(out)
    assert rows["cost"][-1] == rows["fresh cost"][-1] == "other measure"
    assert "other samples" not in out
    for name in ("sharp in 1 view", "sharp in 3 views"):
        assert re.fullmatch(r"[\d.]+ ± [\d.]+ m²", rows[name][1])
        assert re.match(r"[+-][\d.]+", rows[name][2])
    assert re.fullmatch(r"[\d.]+ mm/px", rows["median resolution"][0])
    (data,) = replayed_json(capsys, "runs/good", *words)
    assert (data["same_measure"], data["same_samples"]) == (False, True)
    assert replay("runs/good", "runs/good", *words) == 0
    assert f" {short}" in " ".join(capsys.readouterr().out.split())


def test_a_run_for_several_views_is_recorded_and_reproduced(here: Path, capsys: Any) -> None:
    words = ("--set", "views=3", "--set", "max_mm_per_pixel=4", "--set", "bound=none")
    assert replay("runs/good", *words, "--record", "again") == 0
    (path,) = Path("again").iterdir()
    recorded = read_run(path)
    assert recorded.beginning.request.views == 3
    assert recorded.beginning.request.max_mm_per_pixel == 4.0
    assert recorded.ending is not None
    plan = recorded.ending.plan
    assert plan is not None
    assert (plan.views, plan.max_mm_per_pixel) == (3, 4.0)
    assert [each.views for each in plan.sharp_areas] == [1, 2, 3, 5]
    assert plan.resolution is not None
    assert plan.resolution.percentile_90 <= 4.0
    capsys.readouterr()
    assert replay(str(path)) == 0
    assert "reproduced" in capsys.readouterr().out


def test_what_the_recorded_plan_did_not_tell_is_said(here: Path, capsys: Any) -> None:
    def older(message: Any) -> Any:
        if not message.topic.endswith("focus_plan"):
            return message
        fields = fields_of(deserialize(message.type_name, message.payload))
        fields |= {"views": 0, "sharp_views": [], "sharp_area": [], "sharp_standard_error": []}
        fields |= {"median_mm_per_pixel": 0.0, "percentile_90_mm_per_pixel": 0.0}
        return with_payload(message, serialize(message.type_name, fields))

    rewritten(here / "runs" / "good", here / "older", older)
    assert replay("older") == 0
    assert "reproduced" in capsys.readouterr().out
    assert replay("older", "--set", "method=k_view") == 0
    rows = cells_of(capsys.readouterr().out)
    assert rows["views"] == ["1", "1"]
    assert rows["sharp in 3 views"][0] == rows["median resolution"][0] == "not told"


def test_the_list_of_changed_runs_has_fresh_costs(here: Path, capsys: Any) -> None:
    assert replay("runs/good", "runs/good", "--set", "samples=400", "--set", "method=k_view") == 0
    rows = cells_of(capsys.readouterr().out.split("run  ")[-1].join(["run  ", ""]))
    assert rows["run"] == ["outcome", "method", "samples", "fresh cost", "s"]
    assert rows["good"][:3] == ["planned", "em → k_view", "300 → 400"]
    assert re.fullmatch(r"[\d.]+ → [\d.]+", rows["good"][3])


# --- recording ---------------------------------------------------------------------------------


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


@pytest.mark.parametrize("words", [[], ["--set", "f_number=8", "--set", "method=k_view"]])
def test_answers_are_runs_themselves(here: Path, capsys: Any, words: list[str]) -> None:
    (data,) = replayed_json(capsys, "runs/good", "--record", "answers/new", *words)
    (path,) = Path("answers/new").iterdir()
    assert data["recorded_as"] == str(path)
    run = read_run(path)
    assert run.fault == ""
    assert run.ending is not None
    assert run.ending.plan is not None
    assert run.ending.plan.cost == data["now"]["cost"]
    assert run.beginning.run_id == path.name != data["run"]
    assert ("numpy", np.__version__) in run.beginning.software.items()
    topics = {message.topic for message in read_bag(path).messages}
    assert "/focus_planner/markers" not in topics
    # A node that starts puts what was published in force again, and not a what-if.
    assert last_plan(path.parent, "/focus_planner").plan is None
    assert {mode(path), mode(path.parent)} == {0o700}
    assert {mode(file) for file in path.iterdir()} == {0o600}
    assert replay(str(path)) == 0
    assert "reproduced" in capsys.readouterr().out


def test_answers_are_named_and_may_hold_markers(here: Path, capsys: Any) -> None:
    words = ["--record", "answers", "--markers"]
    assert replay("runs/good", "runs/cut.partial", *words) == 0
    out = capsys.readouterr().out
    for path in Path("answers").iterdir():
        assert f"  recorded: {path}\n" in out
        topics = {message.topic for message in read_bag(path).messages}
        assert topics >= {"/focus_planner/markers", "/focus_planner/quality_cloud"}
    assert len(list(Path("answers").iterdir())) == 2


def test_an_answer_that_cannot_be_recorded_is_told(here: Path, capsys: Any) -> None:
    Path("file").write_text("")
    assert replay("runs/good", "--record", "file/below") == 1
    out, err = capsys.readouterr()
    assert "Not a directory" in one_line(err)
    assert err.startswith("focus_planner: error: not recorded: run ")
    assert out.startswith("good reproduced\n")


@pytest.fixture
def ball(here: Path) -> Path:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    mesh.apply_translation([0.0, 0.0, 0.9])
    mesh.export("ball.ply")
    save_rig(cylinder_rig(2, 6, bottom=0.75, top=1.05), Path("rig.yaml"))
    return here


def plan(*options: str) -> int:
    small = ["--samples", "200", "--fresh-samples", "200"]
    return cli.main(["plan", "ball.ply", "--rig", "rig.yaml", *small, *options])


def test_what_plan_records_is_replayed(ball: Path, capsys: Any) -> None:
    np.savetxt("importance.txt", 1.0 + np.arange(162) % 3)
    words = ["--importance", "importance.txt", "--method", "k_view", "--tuples", "grid"]
    assert plan(*words, "--shots", "2", "--seed", "4", "--record", "here", "--markers") == 0
    planned, err = capsys.readouterr()
    assert all(line.startswith("focus_planner: note: ") for line in err.splitlines())
    (path,) = Path("here").iterdir()
    topics = {message.topic for message in read_bag(path).messages}
    assert topics >= {"/focus_planner/markers", "/focus_planner/quality_cloud"}
    (data,) = replayed_json(capsys, "here")
    assert data["outcome"] == "reproduced"
    assert data["recorded"] == json.loads(planned)
    assert data["now"]["notes"] == data["recorded"]["notes"] != []
    assert plan(*words, "--shots", "2", "--seed", "4") == 0
    without = json.loads(capsys.readouterr().out)
    assert without["cameras"] == data["now"]["cameras"]


def test_what_lenses_were_told_is_replayed_without_their_file(ball: Path, capsys: Any) -> None:
    file = Path("lenses.yaml")
    file.write_text("default: {unit: steps, whole: true, distances: [0.3, 2], values: [90, 0]}")
    assert plan("--lens-tables", "lenses.yaml", "--record", "here") == 0
    planned = json.loads(capsys.readouterr().out)
    file.unlink()
    (data,) = replayed_json(capsys, "here")
    assert data["outcome"] == "reproduced"
    assert data["recorded"] == planned
    assert data["now"]["cameras"] == planned["cameras"]
    assert {camera["device_unit"] for camera in data["now"]["cameras"]} == {"steps"}
    # What if the lenses were others?
    file.write_text("default: {unit: dioptres}")
    (data,) = replayed_json(capsys, "here", "--set", "lens_tables=lenses.yaml")
    assert {camera["device_unit"] for camera in data["now"]["cameras"]} == {"dioptres"}
    (data,) = replayed_json(capsys, "here", "--set", "lens_tables=")
    assert "device_unit" not in data["now"]["cameras"][0]
    file.write_text("cameras: {x: {unit: dioptres}}")
    assert replay("here", "--set", "lens_tables=lenses.yaml") == 2
    assert "expected some of the rig's 12" in one_line(capsys.readouterr().err)


def test_a_plan_that_fails_is_recorded_too(ball: Path, capsys: Any) -> None:
    assert plan("--depth-tolerance", "9", "--record", "here") == 2
    one_line(capsys.readouterr().err)
    assert replay("here") == 0
    assert "no plan, then as now: depth_tolerance: expected" in capsys.readouterr().out


def test_a_plan_that_cannot_be_recorded_is_printed_all_the_same(ball: Path, capsys: Any) -> None:
    Path("file").write_text("")
    assert plan() == 0
    expected = json.loads(capsys.readouterr().out)
    for place in ("file/below", "/proc/focus_planner"):
        assert plan("--record", place) == 1
        out, err = capsys.readouterr()
        assert json.loads(out)["cameras"] == expected["cameras"]
        assert one_line(err).startswith("focus_planner: error: not recorded: run ")
        assert f" in {place}: " in err


def test_a_seed_that_no_message_can_hold_is_planned_with(ball: Path, capsys: Any) -> None:
    assert plan("--seed", str(2**64), "--record", "here") == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["seed"] == 2**64
    assert "not recorded: " in one_line(err)


# --- as a process ------------------------------------------------------------------------------


def without_ros(*words: str) -> subprocess.CompletedProcess[str]:
    return run_forked("testing.program_without_ros", *words)


@pytest.mark.processes
def test_ros_is_not_needed(ball: Path) -> None:
    done = without_ros("replay", "runs/good", "--set", "samples=250", "--record", "answers")
    assert (done.returncode, done.stderr) == (0, "")
    done = without_ros("replay", "answers", "runs/good", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert [run["outcome"] for run in json.loads(done.stdout)] == ["reproduced"] * 2


@pytest.mark.processes
def test_live_needs_ros_and_says_so(here: Path) -> None:
    done = without_ros("replay", "runs/good", "--live")
    assert (done.returncode, done.stdout) == (2, "")
    assert "--live: expected ROS 2 (rclpy) and focus_planner_msgs, got No module named " in (
        one_line(done.stderr)
    )


@pytest.mark.processes
def test_on_a_terminal_it_shows_where_it_is(here: Path) -> None:
    status, said = on_a_terminal(["replay", "runs/good", "runs/differs"])
    assert status == 1
    assert "1 of 2: " in said
    assert "2 of 2: " in said
    assert "1 reproduced, 1 differs" in said


@pytest.mark.processes
def test_it_can_be_told_to_be_quiet(here: Path) -> None:
    status, said = on_a_terminal(["replay", "runs/good", "runs/good", "--quiet"])
    assert status == 0
    assert "1 of 2: " not in said
    assert "2 reproduced" in said


@pytest.mark.processes
def test_ctrl_c_ends_it(here: Path) -> None:
    words = ["replay", "runs/good", "--set", "samples=500"]
    status, said = on_a_terminal(words, CTRL_C_AT_A_STEP)
    assert status == 130
    assert "Traceback" not in said
    assert "planned" not in said


@pytest.mark.processes
def test_what_ctrl_c_ended_is_left_partial(here: Path, capsys: Any) -> None:
    words = ["replay", "runs/good", "--set", "samples=500", "--record", "answers"]
    status, said = on_a_terminal(words, CTRL_C_AT_A_STEP)
    assert status == 130
    assert "Traceback" not in said
    (path,) = Path("answers").iterdir()
    assert path.suffix == ".partial"
    assert replay(str(path), "--set", "samples=200", "--set", "method=em") == 0
    assert isinstance(read_run(path).rigs()[0].read(read_run(path).beginning.settings.optics), Rig)
