# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import io
import json
from pathlib import Path

import pytest
import trimesh

from focus_planner.cli import main as cli
from focus_planner.cli.console import PlainConsole
from focus_planner.cli.subject_table import print_subjects
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.io.plans import load_plan
from focus_planner.io.rigs import save_rig

RIG = cylinder_rig(2, 6, bottom=0.75, top=1.05)
SMALL = ("--samples", "200", "--fresh-samples", "200")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working directory with three balls and a rig around them."""
    monkeypatch.chdir(tmp_path)
    for name, radius in (("a", 0.3), ("b", 0.1), ("c", 0.2)):
        ball = trimesh.creation.icosphere(subdivisions=3, radius=radius)
        ball.apply_translation([0.0, 0.0, 0.9])
        ball.export(f"{name}.ply")
    save_rig(RIG, Path("rig.yaml"))
    return tmp_path


def plan(*options, surfaces=("a.ply", "b.ply", "c.ply")):
    return cli.main(["plan", *surfaces, "--rig", "rig.yaml", *SMALL, *options])


def refused(capsys, *options, surfaces=("a.ply", "b.ply", "c.ply")):
    """The one line that says why, without anything having been planned."""
    assert plan(*options, surfaces=surfaces) == 2
    _, err = capsys.readouterr()
    assert err.count("\n") == 1
    return err


def test_a_plan_for_several_tells_of_each(here):
    assert plan("-o", "plan.json", "--subject-weights", "1,2,1") == 0
    made = load_plan(Path("plan.json"))
    assert [each.surface for each in made.subjects] == ["a.ply", "b.ply", "c.ply"]
    assert [each.weight for each in made.subjects] == [1.0, 2.0, 1.0]
    data = json.loads(Path("plan.json").read_text(encoding="utf-8"))
    assert {"surface", "surface_area", "cost", "fresh_cost", "in_focus_area", "preset"} <= set(
        data["subjects"][0]
    )
    mean = sum(each.weight * each.cost for each in made.subjects) / 4
    assert made.cost == pytest.approx(mean)


def test_a_plan_for_one_has_no_subjects(here):
    assert plan("-o", "plan.json", surfaces=("a.ply",)) == 0
    assert json.loads(Path("plan.json").read_text(encoding="utf-8"))["subjects"] == []


def test_the_table_of_subjects_fits_a_terminal(here):
    assert plan("-o", "plan.json", "--subject-weights", "1,2,1") == 0
    made = load_plan(Path("plan.json"))
    stream = io.StringIO()
    print_subjects(made.subjects, PlainConsole(stream, 80))
    lines = stream.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].split() == ["subject", "weight", "cost", "fresh", "cost", "in", "focus"]
    marked = [line.split()[0] for line in lines if line.rstrip().endswith("worst")]
    assert marked == [made.worst.surface]
    (mean,) = (line for line in lines if line.startswith("mean, by weight"))
    assert f"{made.cost:.2f}" in mean
    assert f"{made.fresh_cost:.2f} ± {made.fresh_standard_error:.2f}" in mean


def test_the_worst_is_planned_for_if_that_is_asked_for(here):
    assert plan("-o", "mean.json") == 0
    assert plan("-o", "worst.json", "--worst") == 0
    mean, worst = (load_plan(Path(f"{name}.json")) for name in ("mean", "worst"))
    assert max(s.cost for s in worst.subjects) < max(s.cost for s in mean.subjects)
    assert worst.cost == max(s.cost for s in worst.subjects)
    assert worst.lower_bound <= worst.cost


def test_a_run_of_several_is_reproduced_and_looked_at(here, capsys):
    assert plan("-o", "plan.json", "--record", "runs", "--report", "now.html") == 0
    (run,) = Path("runs").iterdir()
    assert cli.main(["replay", str(run)]) == 0
    assert cli.main(["replay", str(run), "--set", "worst=true"]) == 0
    assert cli.main(["report", str(run), "-o", "then.html", "--no-pictures"]) == 0
    assert "a.ply" in Path("then.html").read_text(encoding="utf-8")
    words = ["report", str(run), "-o", "b.html", "--no-pictures", "--subject", "b.ply"]
    assert cli.main(words) == 0
    capsys.readouterr()
    assert cli.main(["masks", str(run), "-o", "masks"]) == 2
    assert "--subject: expected the one of the plan's subjects" in capsys.readouterr().err
    assert cli.main(["masks", str(run), "-o", "masks", "--subject", "c.ply"]) == 0
    capsys.readouterr()
    assert cli.main(["report", str(run), "--subject", "d.ply", "-o", "d.html"]) == 2
    assert "expected one of a.ply, b.ply, c.ply, got 'd.ply'" in capsys.readouterr().err


def test_a_plan_for_several_is_looked_at_with_one_of_its_files(here, capsys):
    assert plan("-o", "plan.json") == 0
    words = ["report", "plan.json", "--rig", "rig.yaml", "--no-pictures", "-o", "r.html"]
    assert cli.main([*words, "--surface", "b.ply"]) == 0
    trimesh.creation.icosphere(radius=0.2).export("d.ply")
    capsys.readouterr()
    assert cli.main([*words, "--surface", "d.ply"]) == 2
    assert "error: subject: expected one of a.ply" in capsys.readouterr().err


def test_presets_have_files_of_their_own(here):
    assert plan("-o", "plan.json", "-o", "sheet.csv", "--presets", "2", "--record", "runs") == 0
    plans = [load_plan(Path(f"plan_{number}.json")) for number in (1, 2)]
    told = {each.surface: each.preset for made in plans for each in made.subjects}
    assert sorted(told) == ["a.ply", "b.ply", "c.ply"]
    assert set(told.values()) == {1, 2}
    assert Path("sheet_1.csv").is_file()
    assert not Path("plan.json").exists()
    runs = sorted(Path("runs").iterdir())
    assert len(runs) == 2
    assert cli.main(["replay", *map(str, runs)]) == 0


def test_presets_on_stdout_are_a_list(here, capsys):
    assert plan("--presets", "2", "--quiet") == 0
    plans = json.loads(capsys.readouterr().out)
    assert [each["subjects"][0]["preset"] for each in plans] == [1, 2]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--subject-weights", "1,2"), "--subject-weights: expected a number for each of 3, got 2"),
        (("--subject-weights", "1,0,1"), "weight of a subject: expected"),
        (("--subject-weights", "1,a,1"), "expected numbers with commas between, got '1,a,1'"),
        (("--subject-weights", "1,2,1", "--worst"), "--subject-weights: expected a plan for the m"),
        (("--presets", "4"), "--presets: expected 1 to 3, one per SURFACE, got 4"),
        (("--presets", "2", "--worst"), "--presets: expected plans for the mean"),
        (("--importance", "rig.yaml"), "--importance: expected one SURFACE"),
        (("--subject", "d.ply", "--report", "r.html"), "--subject: expected one of a.ply, b.ply"),
        (("--subject", "a.ply"), "--subject: expected --picture or --report with it"),
    ],
)
def test_options_that_do_not_fit_several_are_refused(here, capsys, options, told):
    assert told in refused(capsys, *options)


@pytest.mark.parametrize(
    "option", [("--worst",), ("--subject", "a.ply"), ("--subject-weights", "2")]
)
def test_options_on_several_are_refused_for_one(here, capsys, option):
    error = refused(capsys, *option, surfaces=("a.ply",))
    assert f"{option[0]}: expected several SURFACEs with it, got one" in error


def test_a_file_is_one_subject_only(here, capsys):
    error = refused(capsys, surfaces=("a.ply", "a.ply"))
    assert "expected a file of its own for each subject, got a.ply twice" in error


def test_files_of_one_name_are_told_apart(here):
    Path("other").mkdir()
    Path("other/a.ply").write_bytes(Path("b.ply").read_bytes())
    assert plan("-o", "plan.json", surfaces=("a.ply", "other/a.ply")) == 0
    names = [each.surface for each in load_plan(Path("plan.json")).subjects]
    assert len(set(names)) == 2
    assert names[1] == "other/a.ply"


def test_errors_name_the_file_that_they_are_about(here, capsys):
    trimesh.creation.icosphere(radius=300.0).export("large.ply")
    error = refused(capsys, surfaces=("a.ply", "large.ply"))
    assert "error: large.ply: camera poses: expected" in error
