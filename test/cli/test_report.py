# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner report``, ``plan --report`` and ``replay --report``."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from focus_planner.cli import main as cli
from focus_planner.cli.interrupts import ctrl_c
from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.validation import InputError
from focus_planner.io.plans import load_plan
from focus_planner.io.rigs import save_rig
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import inputs_of
from focus_planner.report import making, thumbnails
from focus_planner.report.content import ReportContent
from testing.problems import sphere
from testing.runs import REQUEST, TORUS, beginning_with, record, record_failure, solved
from testing.runs import RIG as RUN_RIG

RIG = cylinder_rig(2, 6, bottom=0.75, top=1.05)
FEW = ("--samples", "200", "--fresh-samples", "200", "--bound", "none")


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[ReportContent]:
    """What the pages written meanwhile say."""
    contents: list[ReportContent] = []

    def page(content: ReportContent) -> str:
        contents.append(content)
        return content.verdict

    monkeypatch.setattr(making, "report_page", page)
    monkeypatch.setattr(thumbnails, "thumbnails", lambda *_: iter(()))  # slow, and tested at home
    return contents


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recorded run."""
    return Path(record(tmp_path_factory.mktemp("runs")))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with a ball, a rig around it, and a plan for both."""
    monkeypatch.chdir(tmp_path)
    write_ball(Path("ball.obj"))
    save_rig(RIG, Path("rig.yaml"))
    return tmp_path


def write_ball(path: Path, radius: float = 0.3) -> None:
    ball: Mesh = sphere(radius, (0.0, 0.0, 0.9), subdivisions=3)
    vertices = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in ball.vertices.tolist()]
    faces = [f"f {a} {b} {c}\n" for a, b, c in (ball.triangles + 1).tolist()]
    path.write_text("".join(vertices + faces))


def plan(*options: str) -> int:
    return cli.main(["plan", "ball.obj", "--rig", "rig.yaml", *FEW, *options])


def report(*words: str) -> int:
    return cli.main(["report", *words])


def error_of(capsys: Any, status: int) -> str:
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.startswith("focus_planner: error: ")
    assert err.count("\n") == 1
    return str(err)


# --- report RUN --------------------------------------------------------------------------------


def test_a_run_is_reported(run: Path, here: Path, told: list[ReportContent], capsys: Any) -> None:
    assert report(str(run)) == 0
    (content,) = told
    out, err = capsys.readouterr()
    assert (out, err) == (f"{content.verdict}\nThe report: report.html\n", "")
    assert Path("report.html").read_text() == content.verdict
    recorded = read_run(run)
    assert recorded.ending is not None
    assert [each.plan.method for each in content.plans] == ["em", "closest", "average"]
    assert content.plans[0].plan == recorded.ending.plan
    (row,) = (row for row in content.costs if row.reported)
    assert row.fresh_cost == content.plans[0].plan.fresh_cost
    assert len(content.surface.points) == 16_384
    assert [(step.stage, step.iteration) for step in content.steps] == [
        (step.stage, step.iteration) for step in recorded.progress
    ]
    seconds = [step.elapsed for step in content.steps if step.elapsed is not None]
    assert len(seconds) == len(content.steps)
    assert min(seconds) >= 0
    assert seconds == sorted(seconds)
    facts = dict(content.facts)
    assert facts["recorded run"] == recorded.beginning.run_id
    assert facts["surface"].startswith("/focus_planner/mesh, ")
    assert content.title == "Focus plan for 8 cameras"
    parameters = dict(content.parameters)
    assert (parameters["method"], parameters["samples"], parameters["time_budget"]) == (
        *("em", 300),
        "none",
    )
    assert dict(content.software)["numpy"] == recorded.beginning.software["numpy"]


def test_methods_samples_and_name_are_chosen(
    run: Path, here: Path, told: list[ReportContent], capsys: Any
) -> None:
    compare = ("--compare", "k_view", "--compare", "closest")
    assert report(str(run), *compare, "--samples", "300", "-o", "a page.HTML", "--quiet") == 0
    assert capsys.readouterr() == ("", "")
    (content,) = told
    assert [each.plan.method for each in content.plans] == ["em", "k_view", "closest"]
    assert len(content.surface.points) == 300
    assert Path("a page.HTML").exists()


def test_what_a_run_was_set_to_is_told(here: Path, told: list[ReportContent]) -> None:
    values = {"cost__focus_weight": 0.25, "max_points": 12345, "record_max_runs": 7}
    path = record(here / "runs", replace(REQUEST, time_budget=60.0), **values)
    assert report(str(path), "--samples", "100") == 0
    (content,) = told
    parameters = dict(content.parameters)
    assert parameters["cost.focus_weight"] == content.surface.focus_weight == 0.25
    assert parameters["time_budget"] == 60.0
    assert not {"max_points", "record_max_runs", "cost.axis_deviation_weight"} & set(parameters)


# --- report PLAN.JSON --------------------------------------------------------------------------


def test_a_plan_is_reported_with_its_files(here: Path, told: list[ReportContent]) -> None:
    assert plan("--output", "plan.json", "--shots", "2") == 0
    files = ("--surface", "ball.obj", "--rig", "rig.yaml")
    assert report("plan.json", *files, "--samples", "100") == 0
    (content,) = told
    assert content.plans[0].plan == load_plan(Path("plan.json"))
    assert content.notes == content.plans[0].plan.notes
    assert (content.title, content.steps) == ("Focus plan for ball.obj", ())
    assert dict(content.parameters) == {
        "method": "k_view",
        "samples": 200,
        "seed": 0,
        "shots": 2,
        "views": 1,
        "images": "none",
        "depth_tolerance": 0.0,
        "max_mm_per_pixel": "none",
        "fresh_samples": 200,
    }
    assert [name for name, _ in content.software] == ["report made with"]


def test_a_plan_is_reported_with_its_importance(here: Path, told: list[ReportContent]) -> None:
    heights = [line.split()[3] for line in Path("ball.obj").read_text().splitlines() if "v" in line]
    Path("high.txt").write_text("".join(f"{int(float(z) > 0.9)}\n" for z in heights))
    importance = ("--importance", "high.txt")
    files = ("--surface", "ball.obj", "--rig", "rig.yaml", "--samples", "300")
    assert plan("--output", "plan.json", *importance) == 0
    assert report("plan.json", *files, *importance) == 0
    assert report("plan.json", *files) == 0
    with_it, without = told
    assert with_it.surface.importance is not None
    assert {0.0, 1.0} < set(with_it.surface.importance.tolist())
    assert [note.code for note in with_it.notes] == [n.code for n in with_it.plans[0].plan.notes]
    assert "has no importance and was not planned for" in with_it.verdict
    assert without.notes[0].code == "other_inputs"


def test_a_run_keeps_its_importance_with_the_colours_of_a_file(
    here: Path, told: list[ReportContent], capsys: Any
) -> None:
    heights = [line.split()[3] for line in Path("ball.obj").read_text().splitlines() if "v" in line]
    Path("high.txt").write_text("".join(f"{int(float(z) > 0.9)}\n" for z in heights))
    assert plan("--record", "runs", "--importance", "high.txt", "--quiet") == 0
    (path,) = map(str, Path("runs").iterdir())
    assert report(path, "--surface", "ball.obj", "--samples", "100") == 0
    assert told[0].surface.importance is not None
    capsys.readouterr()
    error = error_of(capsys, report(path, "--importance", "high.txt"))
    assert "--importance: expected a plan.json to use it with" in error


def test_a_plan_of_another_surface_is_doubted(
    here: Path, told: list[ReportContent], capsys: Any
) -> None:
    assert plan("--output", "plan.json") == 0
    write_ball(Path("other.obj"), 0.33)
    capsys.readouterr()
    assert report("plan.json", "--surface", "other.obj", "--rig", "rig.yaml") == 0
    (content,) = told
    assert content.notes[0].code == "other_inputs"
    assert "probably not the plan's" in capsys.readouterr().out


# --- what is refused before anything is planned ------------------------------------------------


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("plan.json -o report.pdf", "report.pdf: expected a name that ends in .html for the"),
        (
            "plan.json -o report",
            "report: expected a name that ends in .html for the report, got no ending",
        ),
        ("plan.json -o none/r.html", "none/r.html: expected a file in a folder that exists"),
        ("plan.json -o folder.html", "folder.html: expected a file to write, got a folder"),
        ("plan.json -o link.html", "link.html: expected an output file that is not an input"),
        ("plan.json --samples 99", "--samples: expected a whole number of at least 100, got 99"),
        ("plan.json --samples 300000", "--samples: expected a whole number of at least 100, at m"),
        ("plan.json --samples x", "argument --samples: invalid int value: 'x'"),
        (
            "plan.json --compare best",
            "--compare: expected one of closest, average, em, greedy, k_view",
        ),
        ("plan.json", "--surface: expected the surface that plan.json was made for, got none"),
        ("none", "none: expected a recorded run, got no such folder or file"),
        ("none.json --surface ball.obj --rig rig.yaml", "none.json: expected a plan.json, got no"),
        ("plan.json --surface ball.obj --rig rig.yaml --compare k_view", "--compare: expected met"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch, words: str, error: str
) -> None:
    assert plan("--output", "plan.json") == 0
    Path("folder.html").mkdir()
    Path("link.html").symlink_to("ball.obj")
    before = sorted(here.iterdir())
    capsys.readouterr()
    monkeypatch.setattr(PlannedSubject, "with_method", None)
    if "link" in words:
        words += " --surface ball.obj --rig rig.yaml"
    assert error in error_of(capsys, report(*words.split()))
    assert sorted(here.iterdir()) == before


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ("--report plan.pdf", "plan.pdf: expected a name that ends in .html"),
        ("--report none/r.html", "none/r.html: expected a file in a folder that exists"),
        ("--report s.html --output s.html", "--report: expected different files, got the same"),
        ("--report -", "--report: expected a name, got -, which stands for stdout"),
        ("--report ball.html", "ball.html: expected an output file that is not an input as well"),
    ],
)
def test_plan_refuses_a_report_that_cannot_be(
    here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch, options: str, error: str
) -> None:
    Path("ball.html").symlink_to("ball.obj")
    monkeypatch.setattr("focus_planner.core.planning.plan_focus.plan_focus", None)
    assert error in error_of(capsys, plan(*options.split()))


# --- plan --report -----------------------------------------------------------------------------


def test_plan_writes_a_report_beside_the_plan(
    here: Path, told: list[ReportContent], capsys: Any
) -> None:
    assert plan("--report", "report.html", "--method", "em") == 0
    (content,) = told
    data = json.loads(capsys.readouterr().out)
    own = content.plans[0].plan
    assert (data["method"], data["cost"]) == ("em", own.cost)
    assert [each.plan.method for each in content.plans[1:]] == ["closest", "average"]
    assert isinstance(own, SolvedPlan)
    assert content.steps[-1].cost is not None
    elapsed = [step.elapsed for step in content.steps]
    assert elapsed == sorted(elapsed, key=lambda seconds: seconds or 0.0)
    assert dict(content.facts)["surface"] == "ball.obj, 1,280 triangles, 1.13 m²"
    assert dict(content.parameters)["bound"] == "none"
    assert "numpy" in dict(content.software)


@pytest.mark.parametrize(("options", "shown"), [((), 12), (("--no-pictures",), 0)])
def test_plan_makes_pictures_unless_they_are_not_wanted(
    here: Path,
    told: list[ReportContent],
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[str, ...],
    shown: int,
) -> None:
    pictured(monkeypatch)
    assert plan("--report", "report.html", *options) == 0
    assert len(told[0].plans[0].pictures) == shown


def test_pictures_belong_to_a_report(here: Path, capsys: Any) -> None:
    error = "--pictures: expected --report with it"
    assert error in error_of(capsys, plan("--no-pictures"))
    assert error in error_of(capsys, cli.main(["replay", "none", "--pictures"]))


# --- replay --report ---------------------------------------------------------------------------


def replay(*words: str) -> int:
    return cli.main(["replay", *words])


def test_a_replay_is_reported(
    run: Path, here: Path, told: list[ReportContent], capsys: Any
) -> None:
    assert replay(str(run), "--report", "r.html") == 0
    (content,) = told
    assert "reproduced" in capsys.readouterr().out
    recorded = read_run(run)
    assert [each.title for each in content.plans] == ["em", "closest (autofocus)", "average"]
    assert len(content.steps) == len(recorded.progress)
    assert dict(content.facts)["recorded run"] == recorded.beginning.run_id


def test_a_what_if_is_shown_beside_the_recorded_plan(
    run: Path, here: Path, told: list[ReportContent], capsys: Any
) -> None:
    options = ("--set", "hyperfocal_distance=20", "--set", "shots=2", "--report", "r.html")
    assert replay(str(run), *options, "--json") == 0
    (values,) = json.loads(capsys.readouterr().out)
    (content,) = told
    titles = [each.title for each in content.plans]
    assert titles == ["em", "em, as recorded", "closest (autofocus)", "average"]
    new, old = content.plans[:2]
    assert new.plan.cost == values["now"]["cost"]
    assert old.plan.cost == values["recorded"]["cost"]
    assert {camera.lens.hyperfocal_distance for camera in content.rig.cameras} == {20.0}
    facts = dict(content.facts)
    assert facts["changed"] == "hyperfocal_distance=20, shots=2"
    assert new.in_focus.mean() > old.in_focus.mean()
    (row,) = (row for row in content.costs if row.title == "em, as recorded")
    # The surface, its samples and the model are the same.
    assert row.fresh_cost == old.plan.fresh_cost


def test_what_a_what_if_assumes_is_told(run: Path, here: Path, told: list[ReportContent]) -> None:
    assert replay(str(run), "--set", "f_number=8", "--report", "r.html") == 0
    changed = dict(told[0].facts)["changed"]
    assert changed.startswith("f_number=8; nothing tells the circle of confusion of ")


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("run run --report r.html", "--report: expected a single run to report on, got 2 runs"),
        ("run --report r.txt", "r.txt: expected a name that ends in .html for the report"),
        ("run --report none/r.html", "none/r.html: expected a file in a folder that exists"),
        ("run --report r.html --live", "--live: expected neither --set, --record nor --report"),
    ],
)
def test_replay_refuses_a_report_that_cannot_be(
    run: Path, here: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch, words: str, error: str
) -> None:
    shutil.copytree(run, "run")
    monkeypatch.setattr("focus_planner.recording.replay.plan_run", None)
    assert error in error_of(capsys, replay(*words.split()))


def test_a_run_without_a_plan_has_no_report(here: Path, capsys: Any) -> None:
    beginning = beginning_with(replace(REQUEST, depth_tolerance=9.0))
    with pytest.raises(InputError) as refused:
        solved(beginning)
    inputs = inputs_of(beginning, TORUS, RUN_RIG)
    path = str(record_failure(here / "runs", beginning, inputs, str(refused.value)))
    assert "a run with a plan, got one without: depth_tolerance" in error_of(capsys, report(path))
    assert replay(path, "--report", "r.html") == 2
    assert "--report: expected a run with a plan, got one without" in capsys.readouterr().err
    assert not Path("r.html").exists()


# --- pictures ----------------------------------------------------------------------------------


def pictured(monkeypatch: pytest.MonkeyPatch) -> None:
    def make(subject: PlannedSubject, plan: Any, side: int, on_progress: Any) -> Any:
        for number, camera in enumerate(subject.rig.cameras):
            on_progress(number / len(subject.rig))
            yield f"{plan.method}, {camera.name}, {side}".encode()

    monkeypatch.setattr(thumbnails, "thumbnails", make)


@pytest.mark.parametrize(
    ("options", "shown"), [((), 8), (("--pictures",), 8), (("--no-pictures",), 0)]
)
def test_pictures_are_shown_unless_they_are_not_wanted(
    run: Path,
    here: Path,
    told: list[ReportContent],
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[str, ...],
    shown: int,
) -> None:
    pictured(monkeypatch)
    assert report(str(run), "--samples", "100", *options) == 0
    (content,) = told
    assert [len(each.pictures) for each in content.plans] == [shown, shown, 0]
    assert ("pictures" in dict(content.facts)) == bool(shown)
    if shown:
        assert content.plans[1].pictures[2].startswith(b"closest, c2, ")


def test_without_pillow_there_are_none(
    run: Path, here: Path, told: list[ReportContent], monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    for name in list(sys.modules):
        if name.startswith(("PIL", "focus_planner.preview", "focus_planner.report.thumbnails")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert report(str(run), "--samples", "100") == 0
    err = capsys.readouterr().err
    assert err.startswith("focus_planner: note: the report shows no pictures of what cameras will")
    assert "focus_planner[picture]" in err
    assert told[0].plans[0].pictures == ()
    assert "Pillow" in error_of(capsys, report("none", "--pictures"))


# --- stopping ----------------------------------------------------------------------------------


def test_ctrl_c_leaves_no_half_report(
    run: Path, here: Path, monkeypatch: pytest.MonkeyPatch, told: list[ReportContent]
) -> None:
    with_method = PlannedSubject.with_method

    def typed(subject: PlannedSubject, method: str, on_progress: Any) -> SolvedPlan:
        ctrl_c.typed = True
        return with_method(subject, method, on_progress)

    monkeypatch.setattr(PlannedSubject, "with_method", typed)
    assert report(str(run)) == 130
    assert told == []
    assert list(here.glob("*.html*")) == []


# --- from Python -------------------------------------------------------------------------------


def test_a_report_is_saved_from_python(here: Path, told: list[ReportContent]) -> None:
    from focus_planner import (  # noqa: PLC0415 - as a user does
        PlanRequest,
        Scene,
        load_surface,
        plan_focus,
        save_report,
    )

    scene = Scene(load_surface("ball.obj"))
    asked = PlanRequest(samples=200, fresh_samples=200, k=3)
    made = plan_focus(scene, RIG, asked)
    save_report(made, scene, RIG, Path("r.html"), samples=100, surface="ball.obj")
    save_report(made, scene, RIG, Path("r.html"), request=asked, compare=["em"], samples=100)
    first, second = told
    assert [each.plan.method for each in first.plans] == ["k_view", "closest", "average", "em"]
    assert [each.plan.method for each in second.plans] == ["k_view", "em"]
    assert first.title == "Focus plan for ball.obj"
    assert first.notes == made.notes
    with pytest.raises(InputError, match="compare: expected one of"):
        save_report(made, scene, RIG, Path("r.html"), compare=["best"])
    with pytest.raises(InputError, match="expected a name that ends in"):
        save_report(made, scene, RIG, Path("r.pdf"))
    save_report(made, Scene(sphere(0.33, (0.0, 0.0, 0.9), 3)), RIG, Path("r.html"), samples=100)
    assert told[-1].notes[0].code == "other_inputs"
