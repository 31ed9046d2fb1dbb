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

from dataclasses import replace

import pytest

from focus_planner import demo
from focus_planner.core.planning.request import METHODS
from focus_planner.core.validation import InputError
from focus_planner.io.plans import load_plan
from focus_planner.io.rigs import load_rig
from focus_planner.recording.run_reading import read_run
from testing.ros.planner_process import PATIENCE


@pytest.fixture
def usual_speed(monkeypatch):
    """Has the table show the seconds of an idle machine: longer numbers would wrap its lines."""
    compare = demo._compare

    def quickly(results):
        plans = {method: replace(r.plan, solve_seconds=0.5) for method, r in results.items()}
        return compare({method: demo._Result(plan, 0.5) for method, plan in plans.items()})

    monkeypatch.setattr(demo, "_compare", quickly)


@pytest.mark.parametrize(
    ("name", "got"),
    [("a file", "a file"), ("a file/below", "Not a directory"), ("a" * 300, "File name too long")],
)
def test_a_folder_that_cannot_be_is_told_before_the_node_starts(tmp_path, monkeypatch, name, got):
    (tmp_path / "a file").write_text("")
    monkeypatch.setattr(demo, "_run_node", None)
    with pytest.raises(InputError, match=f"expected a folder, got {got}"):
        demo.run(tmp_path / name)


@pytest.mark.parametrize(
    "name", ["report.html", "plans.png", "plan.json", "sheet.html", "rig.yaml"]
)
def test_what_no_demonstration_wrote_is_not_replaced(tmp_path, monkeypatch, name):
    monkeypatch.setattr(demo, "_run_node", None)
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=f"{name} that is no demonstration's; name another with -"):
        demo.run(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "mine"


def test_runs_of_every_demonstration_have_a_folder_of_their_own(tmp_path):
    made = [demo._new_runs(tmp_path) for _ in range(3)]
    assert [path.name for path in made] == ["runs", "runs_2", "runs_3"]
    assert sorted(demo._earlier_runs(tmp_path, made[1])) == [made[0], made[2]]


def test_what_is_being_done_is_told_without_a_terminal_too(capsys):
    console = demo.Console(force_terminal=False)
    with demo._status(console) as tell:
        tell("planning with em, 3 of 5")
    assert capsys.readouterr().out == "planning with em, 3 of 5 ...\n"


@pytest.mark.processes
def test_the_demonstration(tmp_path, capsys, monkeypatch, usual_speed):
    drawn, reported, opened = {}, {}, []
    # Drawing is tested where it is at home, and takes longer than all else here.
    monkeypatch.setattr(demo, "_SECONDS_TO_START", PATIENCE)
    monkeypatch.setattr(demo, "_SECONDS_TO_STOP", PATIENCE)
    monkeypatch.setattr(demo, "draw_plans", lambda scene, rig, plans, path: drawn.update(plans))
    write = demo.write_report
    monkeypatch.setattr(
        demo, "write_report", lambda content, path: reported.update({path: content})
    )
    monkeypatch.setattr(demo, "open_report", opened.append)
    monkeypatch.setattr(demo, "camera_pictures", lambda rig: None)  # as slow as drawing
    earlier = tmp_path / "new" / "runs" / "a run"
    earlier.mkdir(parents=True)
    (tmp_path / "new" / "runs_of_mine").mkdir()
    (tmp_path / "new" / "node.log").write_text("of an earlier demonstration")
    (tmp_path / "new" / "rig.yaml").write_text("of an earlier demonstration")
    assert demo.run(tmp_path / "new", show=True) == 0
    assert earlier.is_dir()
    shown = capsys.readouterr().out
    assert "closest (autofocus)" in shown
    assert "optimal (proven)" in shown
    assert max(map(len, shown[: shown.index("cost: 0")].splitlines())) <= 80
    plan = load_plan(tmp_path / "new" / "plan.json")
    assert list(drawn.values())[-1].cameras == plan.cameras
    assert len(load_rig(tmp_path / "new" / "rig.yaml")) == len(plan.cameras) == 168
    assert plan.cost < drawn["closest (autofocus)"].cost
    assert f"{plan.fresh_cost:.1f} ± {plan.fresh_standard_error:.1f}" in shown
    runs = [read_run(run) for run in sorted((tmp_path / "new" / "runs_2").iterdir())]
    assert "runs_2; those of 1 earlier demonstration are kept beside them\n" in shown
    assert [run.ending.plan.method for run in runs] == list(METHODS)
    assert [run.ending.plan for run in runs if run.ending.plan.method == plan.method] == [plan]
    ((path, report),) = reported.items()
    assert opened == [path] == [tmp_path / "new" / "report.html"]
    assert f"The report:  {path}" in shown
    assert report.title == "Focus plan for arms_out.ply"
    assert report.plans[0].plan == plan
    assert [each.plan for each in report.plans[1 : len(METHODS)]] == [
        run.ending.plan for run in runs if run.ending.plan.method != plan.method
    ]
    assert len(report.steps) > 5
    assert dict(report.facts)["recorded run"] in {run.beginning.run_id for run in runs}
    fresh = {row.title: (row.fresh_cost, row.standard_error) for row in report.costs}
    for each in report.plans:
        told = each.plan.fresh_cost, each.plan.fresh_standard_error
        assert fresh[each.title] == pytest.approx(told, rel=1e-9)
    write(report, path)
    assert path.stat().st_size < 6_000_000
    page = (tmp_path / "new" / "sheet.html").read_text(encoding="utf-8")
    for camera in plan.cameras:
        assert f"{100 * camera.focus_distance:.0f}" in shown
        assert camera.name in page
        assert f"{camera.from_sensor:.3f}" in page
    least, most = plan.sensor_offsets
    assert 0.05 < least < most < 0.07
    assert f"{100 * least:.1f} to {100 * most:.1f} more" in " ".join(shown.split())


@pytest.mark.processes
def test_a_node_that_fails_is_told(tmp_path, capsys, monkeypatch):
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\necho it broke >&2\nexit 3\n")
    broken.chmod(0o700)
    monkeypatch.setattr(demo.sys, "executable", str(broken))
    assert demo.run(tmp_path) == 1
    shown = capsys.readouterr().out
    assert "the node did not start; its log is" in shown
    assert "it broke" in shown


@pytest.mark.parametrize("width", [80, 200])
def test_the_distances_fit_the_terminal(width):
    rig = demo.cylinder_rig()
    cameras = [
        demo.CameraFocus(c.name, demo.CameraStatus.SEES_NOTHING, 9.99, 0.1, 2.0, 0, 0, ())
        for c in rig.cameras
    ]
    lines = demo._distances(rig, cameras, width).plain.splitlines()
    assert max(map(len, lines)) <= width
    assert sum(line.count("x999") for line in lines) == len(rig)
