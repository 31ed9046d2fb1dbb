# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Names and reasons that would steer a terminal, wherever commands print them."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.table import Table

from focus_planner.cli import main as cli
from focus_planner.cli.console import PlainConsole
from focus_planner.cli.recording import CommandRecorder
from focus_planner.cli.terminal import show_error, show_note
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.text import MAX_LINE
from focus_planner.io.rigs import save_rig
from testing.runs import record
from testing.terminal import on_a_terminal

HOSTILE = "\x1b]0;owned\x07\x9b2J\u202e[link=https://example.org][blink]:bomb:\x7f\udcff"
TOLD = r"\x1b]0;owned\x07\x9b2J\u202e[link=https://example.org][blink]:bomb:\x7f\udcff"
# A name that a file can have everywhere.
FILE = "\x1b]0;owned\x07\u202e[link=x][blink]:bomb:"
FILE_TOLD = r"\x1b]0;owned\x07\u202e[link=x][blink]:bomb:"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("show", [show_note, show_error])
def test_a_line_on_stderr_is_printable_and_cut(show: Any, capsys: Any) -> None:
    show(f"a {HOSTILE}\nb")
    show("x" * 5_000_000)
    out, err = capsys.readouterr()
    first, second = err.splitlines()
    assert out == ""
    assert first.endswith(f": a {TOLD} b")
    assert len(second) < MAX_LINE + 30


def printed(*what: Any, **how: Any) -> str:
    stream = io.StringIO()
    PlainConsole(stream, 200).print(*what, **how)
    return stream.getvalue()


def test_the_console_takes_strings_as_they_are() -> None:
    assert printed(HOSTILE, soft_wrap=True) == TOLD + "\n"
    assert printed(HOSTILE, style="bold", end="") == TOLD


def test_so_it_does_in_tables() -> None:
    table = Table(HOSTILE, title=HOSTILE)
    table.add_row(HOSTILE)
    text = printed(table)
    assert text.count(TOLD) == 3
    assert text.replace("\n", "").isprintable()


def test_what_is_typed_is_told_escaped(here: Path, capsys: Any) -> None:
    for words in (["plan", FILE, "--rig", FILE], ["replay", FILE], ["replay", "x", f"--{FILE}"]):
        assert cli.main(words) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert FILE_TOLD in line
        assert line.isprintable()


def test_why_nothing_was_recorded_is_told_escaped(capsys: Any) -> None:
    CommandRecorder(None)._fail(HOSTILE)
    assert TOLD in capsys.readouterr().err


def test_a_runs_name_is_shown_escaped(here: Path, capsys: Any) -> None:
    shutil.copytree(record(here / "runs"), here / FILE)
    assert cli.main(["replay", FILE]) == 0
    assert cli.main(["replay", FILE, FILE]) == 0
    assert cli.main(["replay", FILE, "--set", "samples=50"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith(f"{FILE_TOLD} reproduced\n")
    assert out.replace("\n", "").isprintable()
    assert err == ""


def test_json_is_exact_and_escaped_in_its_own_way(here: Path, capsys: Any) -> None:
    path = "\x7f\x9b\u202e\udcff"
    assert cli.main(["replay", "--json", path]) == 2
    out, _ = capsys.readouterr()
    assert out.isascii()
    assert out.replace("\n", "").isprintable()
    assert json.loads(out)[0]["path"] == path


@pytest.mark.processes
def test_progress_is_shown_escaped(here: Path) -> None:
    np.savetxt(f"{FILE}.xyz", np.random.default_rng(0).normal(size=(200, 3)) * 0.1 + [0, 0, 0.9])
    save_rig(cylinder_rig(1, 3, bottom=0.9, top=0.9), Path("rig.yaml"))
    words = ["plan", f"{FILE}.xyz", "--rig", "rig.yaml", "--samples", "50", "--method", "closest"]
    status, said = on_a_terminal(words)
    assert status == 0
    assert f"reading {FILE_TOLD}.xyz" in said
    assert "owned\x07" not in said
    assert "\u202e" not in said
