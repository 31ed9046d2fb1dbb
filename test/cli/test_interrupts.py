# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Ctrl-C at any moment of any command: it ends with status 130, and says nothing."""

from __future__ import annotations

import ctypes
import itertools
import signal
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import trimesh

from focus_planner.cli import main as cli
from focus_planner.cli.interrupts import CtrlC
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.io.rigs import save_rig
from focus_planner.runtime.stop_signals import StopSignals
from testing.runs import record
from testing.terminal import CTRL_C_AT_A_KERNEL, on_a_terminal

PLAN = ["plan", "ball.ply", "--rig", "rig.yaml", "--samples", "200"]
FILES = ["--output", "plan.json", "--problem", "problem.npz", "--picture", "plan.png"]


@pytest.fixture(autouse=True)
def handled() -> Any:
    """Python's own handler, which a test that runs in the background has not got."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    ball.apply_translation([0.0, 0.0, 0.9])
    ball.export(folder / "ball.ply")
    save_rig(cylinder_rig(2, 6, bottom=0.75, top=1.05), folder / "rig.yaml")
    record(folder / "runs")
    return folder


@pytest.fixture
def here(made: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(made)
    yield made
    for name in FILES[1::2]:
        Path(name).unlink(missing_ok=True)


def press_ctrl_c() -> None:
    """Interrupt within a callback of a C library, where an exception would be printed and lost."""
    ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))()


def pressed_before(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with Ctrl-C before its first call; a second one would end the tests."""
    calls = itertools.count()

    def wrapper(*args: Any, **options: Any) -> Any:
        if next(calls) == 0:
            press_ctrl_c()
        return function(*args, **options)

    return wrapper


@pytest.mark.parametrize(
    ("words", "moment"),
    [
        (["parameters"], "focus_planner.cli.parameters.add"),
        (["parameters"], "focus_planner.parameters.file.parameters_to_yaml"),
        (["rig", "cylinder"], "focus_planner.core.rig.layouts.cylinder_rig"),
        (PLAN, "focus_planner.cli.plan.request_from_options"),
        (PLAN, "focus_planner.io.rigs.load_rig"),
        (PLAN, "focus_planner.io.surfaces.load_surface"),
        (PLAN, "focus_planner.core.planning.plan_focus.plan_focus"),
        (PLAN, "focus_planner.core.planning.many_subjects.formulate_problem"),
        ([*PLAN, *FILES], "focus_planner.io.plans.save_plan"),
        ([*PLAN, *FILES], "focus_planner.io.problems.save_problem"),
        ([*PLAN, *FILES], "focus_planner.io.picture.draw_plans"),
        (["replay", "runs"], "focus_planner.recording.run_reading.read_run"),
        (["replay", "runs"], "focus_planner.recording.replay.plan_run"),
        (["replay", "runs"], "focus_planner.recording.replay.differences"),
        (["replay", "runs", "--set", "k=3"], "focus_planner.recording.what_if.with_changes"),
    ],
)
def test_it_is_quiet_at_any_moment(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any, words: list[str], moment: str
) -> None:
    module, _, name = moment.rpartition(".")
    monkeypatch.setattr(moment, pressed_before(getattr(import_module(module), name)))
    assert cli.main(words) == 130
    out, err = capsys.readouterr()
    assert all(line.startswith("focus_planner: note: ") for line in err.splitlines())
    # What takes no time is printed all the same.
    assert out == "" or words[0] in {"parameters", "rig"}


def test_what_waits_is_interrupted_at_once(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    def wait(*_: Any, **__: Any) -> None:
        signal.raise_signal(signal.SIGINT)
        pytest.fail("it was not interrupted")

    stand_in = ModuleType("focus_planner.demo")
    vars(stand_in).update(run=wait)
    monkeypatch.setitem(sys.modules, "focus_planner.demo", stand_in)
    assert cli.main(["demo"]) == 130
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", ["node", "lens_adapter", "simulated_lens"])
def test_nodes_have_their_own_way_with_signals(
    monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    before = signal.getsignal(signal.SIGINT)

    def run(_: list[str], signals: StopSignals) -> int:
        press_ctrl_c()
        noted = signals.have_arrived
        signals.undo()
        return 7 if noted else 0

    stand_in = ModuleType(f"focus_planner.ros.{command}")
    vars(stand_in).update(main=run)
    monkeypatch.setitem(sys.modules, stand_in.__name__, stand_in)
    assert cli.main([command]) == 7
    assert signal.getsignal(signal.SIGINT) == before


def test_the_demo_computes_undisturbed(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    done: list[str] = []

    def run(_: Path, computing: Any, **__: Any) -> None:
        with computing():
            press_ctrl_c()
            done.append("drawn")
        done.append("shown")

    stand_in = ModuleType("focus_planner.demo")
    vars(stand_in).update(run=run)
    monkeypatch.setitem(sys.modules, "focus_planner.demo", stand_in)
    assert cli.main(["demo"]) == 130
    assert done == ["drawn"]
    assert capsys.readouterr() == ("", "")


def test_a_wait_does_not_begin_once_ctrl_c_was_typed() -> None:
    ctrl_c, waited = CtrlC(), []

    def command() -> None:
        with ctrl_c.deferred():
            signal.raise_signal(signal.SIGINT)
            with ctrl_c.immediate():
                waited.append(True)

    with pytest.raises(KeyboardInterrupt):
        command()
    assert not waited
    assert not ctrl_c.typed


def test_it_is_noted_until_it_is_checked() -> None:
    ctrl_c, seen = CtrlC(), []

    def command() -> None:
        with ctrl_c.deferred(), ctrl_c.notifying(lambda: seen.append("notified")):
            ctrl_c.check()
            signal.raise_signal(signal.SIGINT)
            seen.append(ctrl_c.typed)
            # Once more ends the process, whatever it is in.
            seen.append(signal.getsignal(signal.SIGINT))
            ctrl_c.check()
            seen.append("went on")

    with pytest.raises(KeyboardInterrupt):
        command()
    assert seen == ["notified", True, signal.SIG_DFL]


def test_a_command_in_the_background_of_a_shell_goes_on(capsys: Any) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        ctrl_c = CtrlC()
        with ctrl_c.deferred():
            signal.raise_signal(signal.SIGINT)
            ctrl_c.stop_handling()
            assert not ctrl_c.typed
            assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_commands_run_in_any_thread(capsys: Any) -> None:
    done: list[int] = []
    thread = threading.Thread(target=lambda: done.append(cli.main(["parameters"])))
    thread.start()
    thread.join()
    assert done == [0]


# --- as a process ------------------------------------------------------------------------------


@pytest.mark.processes
def test_ctrl_c_ends_a_long_plan_quietly(here: Path) -> None:
    status, shown = on_a_terminal(PLAN, CTRL_C_AT_A_KERNEL.format(times=1))
    assert status == 130
    assert "Ctrl-C again to stop now" in shown
    for word in ("Traceback", "Interrupt", "ignored", "cost"):
        assert word not in shown


@pytest.mark.processes
def test_ctrl_c_twice_ends_it_at_once(here: Path) -> None:
    status, shown = on_a_terminal(PLAN, CTRL_C_AT_A_KERNEL.format(times=2))
    assert status == -signal.SIGINT  # which a shell shows as 130
    # The cursor, which the progress hid, is there again.
    assert shown.rindex("\x1b[?25h") > shown.rindex("\x1b[?25l")
    assert "Traceback" not in shown
