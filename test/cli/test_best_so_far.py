# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Ctrl-C while ``focus_planner plan`` solves: the best plan so far, in all that was asked for."""

from __future__ import annotations

import io
import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from focus_planner.cli import main as cli
from focus_planner.cli import plan
from focus_planner.cli.best_so_far import CUT_SHORT, BestSoFar
from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.progress import STOPPING
from focus_planner.cli.progress_line import ProgressLine
from focus_planner.core.planning import solving
from focus_planner.core.progress import Progress, ProgressCallback
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.io.rigs import save_rig
from focus_planner.recording.run_reading import read_run
from testing.terminal import on_a_terminal

PLAN = ["plan", "ball.ply", "--rig", "rig.yaml", "--samples", "2000", "--fresh-samples", "500"]


@pytest.fixture(autouse=True)
def handled() -> Any:
    """Python's own handler, which a test that runs in the background has not got."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler
    assert not ctrl_c.typed
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    ball.apply_translation([0.0, 0.0, 0.9])
    ball.export("ball.ply")
    save_rig(cylinder_rig(2, 6, bottom=0.75, top=1.05), Path("rig.yaml"))
    return tmp_path


@pytest.fixture
def pressed_at(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that has Ctrl-C typed at the first step of a stage."""
    show_progress = plan.show_progress

    def press(stage: str) -> list[str]:
        asked: list[str] = []

        def shown(*how: Any) -> ProgressCallback:
            on_progress = show_progress(*how)

            def step(progress: Progress) -> bool:
                if progress.stage == stage and stage not in asked:
                    signal.raise_signal(signal.SIGINT)
                asked.append(progress.stage)
                return on_progress(progress)

            return step

        monkeypatch.setattr(plan, "show_progress", shown)
        return asked

    return press


@pytest.mark.parametrize("method", ["k_view", "optimal"])
def test_the_best_plan_so_far_is_in_all_outputs(
    here: Path, pressed_at: Any, capsys: Any, method: str
) -> None:
    outputs = "-o plan.json -o sheet.csv --problem problem.npz --picture plan.png --record runs"
    report = "--report report.html --no-pictures"
    asked = pressed_at("em" if method == "k_view" else "prices")
    assert cli.main([*PLAN, "--method", method, *outputs.split(), *report.split()]) == 130
    out, err = capsys.readouterr()
    assert out == ""
    assert f"focus_planner: note: {CUT_SHORT}\n" in err
    assert asked[-1] in {"em", "prices"}
    made = json.loads(Path("plan.json").read_text())
    assert not made["converged"]
    assert made["samples"] == 2000
    bound = made["lower_bound"]
    assert bound is None if method == "k_view" else bound < made["cost"]
    problem = np.load("problem.npz")
    assert len(problem["points"]) == 2000
    for name in ("sheet.csv", "plan.png", "report.html"):
        assert Path(name).stat().st_size > 100
    assert "Its search was ended early" in Path("report.html").read_text() or method == "optimal"


def test_the_run_ends_like_a_cancelled_goal_and_is_reproduced(
    here: Path, pressed_at: Any, capsys: Any
) -> None:
    pressed_at("em")
    assert cli.main([*PLAN, "-o", "plan.json", "--record", "runs"]) == 130
    (folder,) = (each for each in Path("runs").iterdir() if each.suffix != ".partial")
    ending = read_run(folder).ending
    assert ending is not None
    assert ending.success
    assert ending.message.startswith(f"{CUT_SHORT}; k_view, cost ")
    assert "ended before it converged" in ending.message
    assert ending.stop_log.stopped
    capsys.readouterr()
    assert cli.main(["replay", str(folder)]) == 0
    assert f"{folder.name} reproduced" in capsys.readouterr().out


def test_the_plan_goes_to_stdout_too(here: Path, pressed_at: Any, capsys: Any) -> None:
    pressed_at("em")
    assert cli.main([*PLAN, "--quiet"]) == 130
    out, err = capsys.readouterr()
    assert not json.loads(out)["converged"]
    assert err == ""


@pytest.mark.parametrize("stage", ["visibility", "cells"])
def test_before_the_solver_begins_there_is_nothing_to_write(
    here: Path, pressed_at: Any, capsys: Any, stage: str
) -> None:
    pressed_at(stage)
    assert cli.main([*PLAN, "-o", "plan.json"]) == 130
    assert capsys.readouterr() == ("", "")
    assert not Path("plan.json").exists()


def test_a_plan_that_was_made_by_then_is_whole(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    plan_of = solving.plan_of

    def late(*what: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return plan_of(*what)

    monkeypatch.setattr(solving, "plan_of", late)
    assert cli.main([*PLAN, "-o", "plan.json"]) == 130
    assert json.loads(Path("plan.json").read_text())["converged"]
    assert "note: Ctrl-C came when the plan was made: it is whole\n" in capsys.readouterr().err


def test_what_ctrl_c_will_do_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    line = ProgressLine(stream, width=100)

    def shown() -> str:
        stream.truncate(0)
        line._live.console.print(line)
        return stream.getvalue()

    best = BestSoFar(line, lambda _: not ctrl_c.typed)
    with ctrl_c.deferred(), ctrl_c.notifying(line.stopping):
        best(Progress("cells", 1, float("nan")))
        line._is_stopping = True
        assert STOPPING in shown()
        line.go_on()
        best(Progress("solving", 0, float("nan")))
        signal.raise_signal(signal.SIGINT)
        assert "stopping with the best plan so far; Ctrl-C again to stop now" in shown()
        assert not best(Progress("em", 1, 300.0))
        assert best.end() == CUT_SHORT
        line("writing")
        assert "writing" in shown()
        assert "stopping" not in shown()


@pytest.mark.processes
def test_on_a_terminal_it_tells_what_it_does(here: Path) -> None:
    program = """
import os, signal, sys, time
from focus_planner.cli import progress

show_progress = progress.show_progress

def interrupted(*how):
    on_progress = show_progress(*how)
    def step(done):
        if done.stage == "em" and done.iteration == 1:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.3)  # for the line to be drawn
        return on_progress(done)
    return step

progress.show_progress = interrupted
from focus_planner.cli.main import main
sys.exit(main())
"""
    status, shown = on_a_terminal([*PLAN, "-o", "plan.json"], program)
    assert status == 130
    assert "stopping with the best plan so far; Ctrl-C again to stop now" in shown
    assert "stopped early by Ctrl-C" in shown
    assert f"note: {CUT_SHORT}" in shown
    assert "Traceback" not in shown
    assert Path("plan.json").is_file()
