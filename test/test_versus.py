# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Two revisions in turns: what becomes of a revision's name, the processes, the tables."""

import subprocess
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from benchmarks import options, versus
from benchmarks.versus import revisions
from benchmarks.versus.process import EndedError, LackingError, Process
from benchmarks.versus.tables import in_a_line, ratio_table, stage_table
from benchmarks.versus.turns import Stage, Timings, take_turns
from focus_planner.core.validation import InputError
from focus_planner.io.bodies import bodies

HERE = Path(revisions.sys.executable)
FAILING = "raise RuntimeError('a kernel was refused')\n"


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """Of one commit, whose package cannot be imported."""
    root = tmp_path / "repository"
    (root / "focus_planner").mkdir(parents=True)
    (root / "focus_planner" / "__init__.py").write_text(FAILING)
    git = ["git", "-C", str(root), "-c", "user.name=a", "-c", "user.email=a@example.org"]
    for arguments in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "Begin"]):
        subprocess.run([*git, *arguments], check=True)
    monkeypatch.setattr(revisions, "ROOT", root)
    monkeypatch.setattr(revisions, "FOLDER", tmp_path / "kept")
    return root


def cells(table):
    """Return the texts of a table, row by row."""
    return list(zip(*(column._cells for column in table.columns), strict=True))


@pytest.mark.processes
@pytest.mark.parametrize("unknown", ["nonsense", "HEAD~1", "--all", "HEAD:focus_planner"])
def test_an_unknown_revision_is_told_how_to_get_it(repository, unknown):
    with pytest.raises(InputError, match=r"^REV: expected a revision of this repository, got"):
        revisions.commit_of(unknown)


@pytest.mark.processes
def test_a_commit_is_found_by_any_name(repository):
    commit = revisions.commit_of("HEAD")
    assert len(commit) == 40
    assert revisions.commit_of(commit[:7]) == commit


def test_no_revision_is_an_error_too():
    with pytest.raises(InputError, match=r"add REV=3ec12f4, say$"):
        revisions.commit_of("")


@pytest.mark.processes
def test_without_git_or_its_history_it_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(revisions, "ROOT", tmp_path)
    with pytest.raises(InputError, match=r"^REV: expected a git repository, got .*; clone it"):
        revisions.commit_of("HEAD")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"^git: expected a program, got none of that name"):
        revisions.commit_of("HEAD")


@pytest.mark.processes
def test_the_benchmark_says_what_is_wrong_and_fails(repository, monkeypatch, capsys):
    monkeypatch.setattr(options.argparse._sys, "argv", ["benchmarks", "versus", "--rev", "none"])
    options.options.cache_clear()
    try:
        assert versus.run(versus.Console(width=160)) is False
    finally:
        options.options.cache_clear()
    assert capsys.readouterr().out.startswith("versus: REV: expected a revision of this")


@pytest.mark.processes
def test_a_revision_that_works_with_no_python_is_told_why(repository, monkeypatch):
    monkeypatch.setattr(revisions, "_pythons", list)
    told = []
    with pytest.raises(InputError, match=r"that can plan here, got HEAD; it cannot in this env"):
        revisions.earlier("HEAD", bodies()[0], told.append)
    assert "compiling its kernels in this environment, once" in told[0]
    assert told[1].endswith("RuntimeError: a kernel was refused")
    kept = next((repository.parent / "kept").iterdir())
    assert (kept / "source" / "focus_planner" / "__init__.py").read_text() == FAILING
    assert not (kept / "python").exists()


@pytest.mark.processes
def test_a_revision_that_works_is_kept(repository, monkeypatch):
    monkeypatch.setattr(revisions, "_failure", lambda *_: None)
    found = revisions.earlier("HEAD", bodies()[0], lambda _: None)
    assert found.name == f"HEAD ({revisions.commit_of('HEAD')[:7]})"
    monkeypatch.setattr(revisions, "_failure", lambda *_: pytest.fail("it was tried again"))
    assert revisions.earlier("HEAD", bodies()[0], lambda _: None) == found


@pytest.mark.processes
def test_a_package_from_elsewhere_is_not_measured(tmp_path):
    with (
        closing(Process(HERE, tmp_path, bodies()[0])) as process,
        pytest.raises(EndedError, match=r"^ended with 1: focus_planner was imported from"),
    ):
        process.run("em", 100, 1)


@pytest.mark.processes
def test_processes_of_one_revision_find_the_same_and_live_on():
    root = revisions.today().root
    with (
        closing(Process(HERE, root, bodies()[0])) as one,
        closing(Process(HERE, root, bodies()[0], threads=1)) as other,
    ):
        for key in ("formulate", "em", "bound"):
            timings = take_turns([one, other], Stage(key, 200), 2)
            assert (timings.seconds > 0).all()
            assert (timings.results[:, 0] == timings.results[:, 1]).all()
            assert timings.results[0, 0] != timings.results[1, 0], "another seed, the same result"
        with pytest.raises(LackingError, match="KeyError: 'nonsense'"):
            one.run("nonsense", 1, 1)
        assert one.run("em", 200, 1)[1] == other.run("em", 200, 1)[1]


def test_times_faster_is_of_neighbouring_turns():
    # A machine twice as slow in every other turn.
    slow = np.array([1.0, 2.0, 1.0, 2.0, 1.0])
    timings = Timings(np.stack([3 * slow, slow], axis=1), np.zeros((5, 2)))
    assert timings.times_faster() == (3.0, 3.0, 3.0)
    assert timings.medians.tolist() == [3.0, 1.0]
    assert timings.least.tolist() == [3.0, 1.0]


def canned(then, now, result=7.0):
    seconds = np.array([[then, now], [1.5 * then, 1.5 * now], [2 * then, 2 * now]])
    return Timings(seconds, np.full((3, 2), result))


def test_a_row_tells_the_seconds_of_both_or_why_there_are_none():
    measured = {
        Stage("em", 1000): canned(0.4, 0.1, 281.5),
        Stage("tuples", 168): "LookupError: this revision has none",
    }
    lines = [in_a_line(*each) for each in measured.items()]
    assert lines == [
        "EM, 1,000: 0.6000 s, today 0.1500 s",
        "pairs of cameras, 168 cameras: LookupError: this revision has none",
    ]
    rows = cells(stage_table("3ec12f4", measured, "in turns"))
    seconds = ("0.6000", "0.4000", "0.1500", "0.1000", "4.00", "4.00 – 4.00")
    assert rows[0] == ("EM", "1,000", *seconds, "cost", "281.5", "281.5")
    assert rows[1][1:3] == ("168 cameras", "–")
    assert rows[1][8] == "LookupError: this revision has none"


def test_stages_of_a_revision_are_compared_with_each_other():
    measured = {
        Stage("bound", 1000): canned(2.0, 1.0),
        Stage("bound", 1000, threads=1): canned(2.6, 1.8),
        Stage("plan", 1000): canned(0.5, 0.25),
        Stage("command", 1000): canned(5.0, 2.0),
        Stage("tuples", 100): canned(1.0, 1.0),
        Stage("tuples", 10_000): canned(1000.0, 100.0),
    }
    rows = {row[0].partition(",")[0]: row[1:] for row in cells(ratio_table("v", measured))}
    assert list(rows.values()) == [
        ("1.50, 1.50", "1.00, 1.00"),
        ("1.30, 1.30", "1.80, 1.80"),
        ("10.00, 10.00", "8.00, 8.00"),
    ]
    measured[Stage("plan", 1000)] = "it cannot"
    assert len(cells(ratio_table("v", measured))) == 2
