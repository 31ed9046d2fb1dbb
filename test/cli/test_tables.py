# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tables at the width of any terminal: no two rows look the same, nothing is lost."""

from __future__ import annotations

import io
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from focus_planner.cli import replay_output
from focus_planner.cli.console import PlainConsole
from focus_planner.cli.replayed import DIFFERS, PLANNED, REFUSED, REPRODUCED, ReplayedRun
from focus_planner.cli.tables import add_named_rows, console_for, new_table, path_names, told_apart
from focus_planner.recording.replay import Difference
from focus_planner.recording.run_reading import read_run

# As new_run_id() makes them: of one minute, of one day, of two days.
IDS = [
    "20261127T130511.123456Z-ab12cd34",
    "20261127T130511.987654Z-ab12cd35",
    "20261127T141200.000001Z-00000000",
    "20261126T141200.000001Z-00000001",
    "short",
    "20261127T130511.123456Z-ab12cd34.partial",
]


@pytest.mark.parametrize("room", [12, 13, 16, 23, 24, 31, 32, 40, 80])
def test_names_are_told_apart_in_little_room(room: int) -> None:
    for count in range(1, len(IDS) + 1):
        for names in itertools.combinations(IDS, count):
            told = told_apart(names, room)
            assert len(set(told)) == len(names)
            assert all(len(name) <= room for name in told)
            for name, short in zip(names, told, strict=True):
                assert (short == name) is (len(name) <= room)


def test_of_what_begins_alike_the_ends_are_shown() -> None:
    assert told_apart(IDS[:2], 24) == ["…130511.123456Z-ab12cd34", "…130511.987654Z-ab12cd35"]


def test_names_that_cannot_be_short_are_whole() -> None:
    names = [f"{'a' * 30}{middle}{'b' * 30}" for middle in "xyz"]
    assert told_apart(names, 20) == names
    twice = [IDS[0], IDS[0], IDS[1]]
    assert told_apart(twice, 20)[0] == told_apart(twice, 20)[1]


def test_files_of_one_name_are_called_by_their_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    paths = [
        Path("a/x/run"),
        Path("b/x/run"),
        Path("b/y/run"),
        Path("other"),
        Path(),
        Path("other"),
    ]
    expected = ["a/x/run", "b/x/run", "y/run", "other", tmp_path.name, "other"]
    assert path_names(paths) == expected
    assert path_names([Path("run"), Path("run")]) == ["run", "run"]


def printed(names: list[str], width: int) -> list[str]:
    stream = io.StringIO()
    console = PlainConsole(stream, width)
    table = new_table("run", "outcome", "cost", right=(2,))
    add_named_rows(table, [(name, ("reproduced", "412.34 → 398.76")) for name in names], console)
    console.print(table)
    return stream.getvalue().splitlines()


@pytest.mark.parametrize("width", [60, 80])
def test_rows_fit_and_are_told_apart(width: int) -> None:
    lines = printed(IDS, width)
    assert all(len(line) <= width for line in lines)
    assert len(lines) == 2 + len(IDS)
    assert len(set(lines)) == len(lines)


def test_what_is_still_too_wide_goes_on_in_another_line() -> None:
    lines = printed(IDS, 30)
    assert all(len(line) <= 30 for line in lines)
    whole = "".join(line[20:].strip() for line in lines)
    assert whole.count("398.76") == len(IDS)


def test_what_is_not_for_a_terminal_is_whole(tmp_path: Path) -> None:
    with (tmp_path / "out").open("w") as stream:
        assert console_for(stream).width >= 10_000


# --- what replay prints ------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run() -> Any:
    return read_run(Path("bags/mesh_k_view"))


@pytest.mark.parametrize("width", [60, 80])
def test_a_list_of_runs_fits(run: Any, monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(
        "focus_planner.cli.tables.console_for", lambda _: PlainConsole(stream, width)
    )
    plan = run.ending.plan
    other = replace(plan, method="optimal", samples=65536, fresh_cost=398.76)
    again = replace(run, ending=replace(run.ending, plan=other, fingerprints=()))
    replays = [
        ReplayedRun(Path(IDS[0]), PLANNED, run=run, now=other, again=again),
        ReplayedRun(Path(IDS[1]), REPRODUCED, run=run, now=plan),
        ReplayedRun(
            Path(IDS[2]), DIFFERS, run=run, now=plan, differences=[Difference("plan", "x")]
        ),
        ReplayedRun(Path(IDS[3]), REFUSED, "why"),
    ]
    replay_output.show(replays)
    lines = stream.getvalue().splitlines()
    # Sentences that begin with spaces are lines of any length.
    assert all(len(line) <= width for line in lines if not line.startswith("  "))
    table = lines[next(i for i, line in enumerate(lines) if line.startswith("run")) :]
    tails = [name[-6:] for name in IDS[:4]]
    for tail in tails:
        assert sum(tail in line for line in table) == 1
    assert "…" not in "".join(line[30:] for line in table)
    told = " ".join("".join(lines).split())
    assert "The costs are on different samples and do not compare." in told.replace("  ", " ")
