# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner evaluate``: what it prints, writes and refuses; going on where it was stopped."""

from __future__ import annotations

import json
import re
import shutil
import sys

import pytest

from focus_planner.cli import main as cli
from focus_planner.cli.interrupts import ctrl_c
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.evaluation import experiments as evaluation_experiments
from focus_planner.evaluation.experiments import EXPERIMENTS
from focus_planner.evaluation.running import here
from focus_planner.io.rigs import save_rig
from testing.data_sets import person

SMALL = ("--samples", "60", "--judged", "100", "--workers", "1")


@pytest.fixture
def data(tmp_path):
    """Return a folder of two subjects, with y up, in millimetres."""
    folder = tmp_path / "scans"
    folder.mkdir()
    for name in ("anna", "bert"):
        person(1600 if name == "anna" else 1700, "y").export(folder / f"{name}.ply")
    return folder


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.yaml"
    save_rig(cylinder_rig(3, 6), path)
    return path


def evaluate(*words):
    return cli.main(["evaluate", *map(str, words)])


def refusal(capsys, *words):
    """Return the one line that says what is wrong."""
    assert evaluate(*words) == 2
    out, err = capsys.readouterr()
    assert not out
    assert err.count("\n") == 1, err
    return err.removeprefix("focus_planner: error: ")


def test_two_scans_from_the_command_line(data, rig, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("scans", "--rig", "rig.yaml", "--place", "centred", "--experiment", "table1", *SMALL)
    assert evaluate(*words, "-o", "results", "--about", "Made up.") == 0
    out, err = capsys.readouterr()
    assert out.startswith("# Methods\n\nEvery method planned for 2 subjects, on 60 samples of each")
    assert out.endswith("The page: results/evaluation.md\n")
    notes = [line.removeprefix("focus_planner: note: ") for line in err.splitlines()]
    assert [note.split(";")[0] for note in notes] == [
        "taken as millimetres: in metres it has no room between the cameras",
        "taken with y up: so the cameras see most",
        "put in the middle of the cameras, at (0, 0), its lowest point at z = 0",
    ]
    files = {
        path.relative_to(tmp_path / "results").as_posix()
        for path in (tmp_path / "results").rglob("*")
        if path.is_file() and not path.name.startswith(".")
    }
    assert files == {
        *("evaluation.json", "evaluation.md", "setup.json"),
        *("table1/results.csv", "table1/seconds.csv", "table1/paragraph.md", "table1/table1.png"),
    }
    page = (tmp_path / "results/evaluation.md").read_text()
    assert "Made up.\n" in page
    assert "**Rig**: `rig.yaml`, 18 cameras" in page
    repeat = (
        r"focus_planner evaluate scans --experiment \w+ --output results --samples 60 --judged 100"
        r" --rig rig\.yaml --place centred"
    )
    assert re.search(rf"```text\n{repeat}\n```", page)
    # Again: nothing is measured, and nothing changes.
    monkeypatch.setattr(here, "measured", None)
    before = (tmp_path / "results/table1/results.csv").read_bytes()
    assert evaluate(*words, "-o", "results", "--quiet") == 0
    assert capsys.readouterr().out == ""
    assert (tmp_path / "results/table1/results.csv").read_bytes() == before


def test_a_task_that_fails_is_told_and_tried_again(data, rig, tmp_path, capsys, monkeypatch):
    words = (data, "--rig", rig, "--place", "centred", "--experiment", "table1", *SMALL)
    words = (*words, "-o", tmp_path / "results", "--quiet")
    measured = here.measured

    def failing(measure, setting, conditions, subjects):
        if subjects[0].name == "bert":
            return here.Failed("no light")
        return measured(measure, setting, conditions, subjects)

    monkeypatch.setattr(here, "measured", failing)
    assert evaluate(*words) == 1
    assert capsys.readouterr().err == "focus_planner: error: table1, bert: no light\n"
    page = tmp_path / "results/evaluation.md"
    assert "**1 task failed and is missing above**" in page.read_text()
    assert "planned for 1 subject" in page.read_text()
    monkeypatch.setattr(here, "measured", measured)
    assert evaluate(*words) == 0
    assert "failed" not in page.read_text()


def test_experiments_that_take_more_subjects_are_left_out_or_refused(
    data, rig, tmp_path, capsys, monkeypatch
):
    experiments = {name: EXPERIMENTS[name] for name in ("convergence", "taped")}
    monkeypatch.setattr(evaluation_experiments, "EXPERIMENTS", experiments)
    words = (data / "anna.ply", "--rig", rig, "--place", "centred", *SMALL, "-o", tmp_path / "out")
    assert evaluate(*words, "--experiment", "all") == 0
    out, err = capsys.readouterr()
    assert "note: taped is left out; subjects: expected at least 2" in err
    assert "# Convergence" in out
    assert evaluate(*words, "--experiment", "taped") == 2
    assert (
        capsys.readouterr()
        .err.splitlines()[-1]
        .startswith("focus_planner: error: subjects: expected at least 2")
    )


def test_ctrl_c_keeps_what_is_done(data, rig, tmp_path, monkeypatch):
    words = (data, "--rig", rig, "--place", "centred", "--experiment", "table1", *SMALL)
    measured = here.measured

    def interrupted(*what):
        ctrl_c.typed = True
        return measured(*what)

    monkeypatch.setattr(here, "measured", interrupted)
    assert evaluate(*words, "-o", tmp_path / "results", "--quiet") == 130
    lines = (tmp_path / "results/table1/seconds.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in lines] == ["subject", "anna"]


def test_the_help_lists_the_experiments(capsys):
    assert evaluate("--help") == 0
    out = capsys.readouterr().out
    for experiment in EXPERIMENTS.values():
        assert f"{experiment.title} ({experiment.paper or 'not in the paper'})" in out


def test_what_cannot_be_done_is_refused_in_a_line(data, tmp_path, capsys):
    place = ("-o", tmp_path / "results")
    one = ("--experiment", "table1")
    assert "--experiment: expected one of all, table1" in refusal(
        capsys, data, "--experiment", "tabel1", *place
    )
    for option in ("--samples", "--judged", "--subjects"):
        assert refusal(capsys, data, *one, *place, option, 0).startswith(f"{option}: expected")
    assert "--seed: expected" in refusal(capsys, data, *one, *place, "--seed=-1")
    assert "ends in .md" in refusal(capsys, data, *one, *place, "--page", tmp_path / "a.html")
    assert "no such folder" in refusal(capsys, tmp_path / "missing", *one, *place)
    assert "one of them, got both" in refusal(
        capsys, data, *one, *place, "--workers", 2, "--scheduler", "here:8786"
    )
    assert not (tmp_path / "results").exists()


def test_other_conditions_need_another_folder(data, rig, tmp_path, capsys):
    place = tmp_path / "results"
    place.mkdir()
    noted = {
        "conditions": {"samples": 60, "judged": 100, "seed": 1},
        "subjects": {},
        "software": {"focus_planner": "?"},
    }
    (place / "evaluation.json").write_text(json.dumps(noted))
    words = (data, "--rig", rig, "--place", "centred", "--experiment", "table1", *SMALL)
    words = (*words, "-o", place, "--quiet")
    assert "give another --output" in refusal(capsys, *words)


@pytest.mark.parametrize("package", ["distributed", "matplotlib", "pandas"])
def test_what_is_missing_is_told_before_the_work(data, tmp_path, capsys, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    told = refusal(capsys, data, "--experiment", "table1", "-o", tmp_path / "results")
    assert told.startswith(f"evaluate needs the Python package {package}: install it")
    shutil.rmtree(data)
