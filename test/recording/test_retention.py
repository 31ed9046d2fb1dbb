"""What is deleted, and what never is."""

from __future__ import annotations

import fcntl
import os
import signal

import pytest

from focus_planner.core.planning.request import PlanRequest
from focus_planner.parameters.planner import Recording
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.retention import prune
from focus_planner.recording.run import inputs_of
from testing.forked import PIPE, ForkedProcess
from testing.runs import RIG, TORUS, Log, beginning_with, record


def name_of(number):
    return f"20250101T0000{number:02d}.123456Z-{0xABCDEF00 + 7919 * (99 - number):08x}"


def fake(folder, number, size=100, *, partial=False):
    """A folder named and filled as a run; a greater number is a newer one."""
    name = name_of(number)
    path = folder / (name + ".partial" * partial)
    path.mkdir(parents=True)
    (path / f"{name}_0.mcap").write_bytes(bytes(size))
    if not partial:
        (path / "metadata.yaml").write_bytes(b"")
    return path


def left(folder):
    return sorted(path.name for path in folder.iterdir())


def test_names_are_as_runs_have_them():
    assert len(new_run_id()) == len(name_of(3))


def test_without_a_limit_nothing_is_deleted(tmp_path):
    for number in range(5):
        fake(tmp_path, number)
    assert prune(tmp_path, 0, 0) == []
    assert len(left(tmp_path)) == 5


@pytest.mark.parametrize("kept", [1, 2, 4, 5, 9])
def test_so_many_of_the_newest_are_kept(tmp_path, kept):
    runs = [fake(tmp_path, number) for number in (3, 0, 4, 1, 2)]
    newest_first = sorted(runs, reverse=True)
    assert prune(tmp_path, kept, 0) == newest_first[kept:]
    assert left(tmp_path) == sorted(run.name for run in newest_first[:kept])
    assert prune(tmp_path, kept, 0) == []


@pytest.mark.parametrize(("size", "kept"), [(1, 1), (299, 2), (300, 3), (399, 3), (500, 5)])
def test_so_many_bytes_of_the_newest_are_kept(tmp_path, size, kept):
    runs = [fake(tmp_path, number) for number in range(5)]
    prune(tmp_path, 0, size)
    assert left(tmp_path) == [run.name for run in runs[-kept:]]


def test_a_big_one_goes_and_the_small_ones_before_it_stay_where_they_fit(tmp_path):
    small, big, newest = (fake(tmp_path, n, size) for n, size in enumerate([10, 1000, 10]))
    assert prune(tmp_path, 0, 100) == [big]
    assert small.exists()
    assert newest.exists()


def test_both_limits_hold(tmp_path):
    runs = [fake(tmp_path, number) for number in range(5)]
    assert set(prune(tmp_path, 2, 1000)) == set(runs[:3])
    assert prune(tmp_path, 2, 150) == [runs[3]]


def test_the_newest_is_never_deleted(tmp_path):
    newest = fake(tmp_path, 9, 10_000)
    assert prune(tmp_path, 1, 1) == []
    fake(tmp_path, 3)
    prune(tmp_path, 1, 1)
    assert left(tmp_path) == [newest.name]


def test_the_newest_whole_one_is_never_deleted_for_one_that_is_not_whole_yet(tmp_path):
    older, newest = fake(tmp_path, 7), fake(tmp_path, 8)
    partial = fake(tmp_path, 9, partial=True)
    assert prune(tmp_path, 1, 1) == [older]
    assert left(tmp_path) == [newest.name, partial.name]


def test_nothing_that_is_not_a_run_counts_or_is_deleted(tmp_path):
    folder = tmp_path / "runs"
    foreign = [
        folder / "notes",
        folder / "my_favourite_run",
        folder / (name_of(0) + "-copy"),
        folder / ("x" + name_of(1)),
        folder / (name_of(2) + ".old"),
    ]
    for path in foreign:
        path.mkdir(parents=True)
        (path / "metadata.yaml").write_bytes(bytes(1000))
    # A file with a run's name; a run that holds something else as well; one under another name.
    (folder / name_of(3)).write_bytes(bytes(1000))
    with_notes = fake(folder, 4)
    (with_notes / "notes.txt").write_text("keep")
    renamed = fake(folder, 5)
    renamed.rename(folder / name_of(6))
    # Links, even to runs.
    elsewhere = fake(tmp_path / "elsewhere", 7)
    (folder / elsewhere.name).symlink_to(elsewhere)
    before = left(folder)
    run, newest = fake(folder, 10), fake(folder, 11)
    assert prune(folder, 2, 0) == []
    assert prune(folder, 1, 100) == [run]
    assert left(folder) == sorted([*before, newest.name])
    assert len(list(elsewhere.iterdir())) == 2


def test_what_a_link_in_a_run_points_to_stays(tmp_path):
    outside = tmp_path / "outside.mcap"
    outside.write_bytes(bytes(100))
    folder = tmp_path / "runs"
    run = fake(folder, 1)
    (file,) = run.glob("*.mcap")
    file.unlink()
    file.symlink_to(outside)
    fake(folder, 2)
    assert prune(folder, 1, 0) == [run]
    assert outside.stat().st_size == 100


def test_partial_ones_of_the_dead_are_deleted_like_others(tmp_path):
    dead, old, newer, newest = (fake(tmp_path, n, partial=n in (0, 2)) for n in range(4))
    assert prune(tmp_path, 2, 0) == [old, dead]
    assert left(tmp_path) == [newer.name, newest.name]


WRITER = """
import sys
from pathlib import Path
from focus_planner.recording.bag import BagWriter
bag = BagWriter()
bag.open(Path(sys.argv[1]))
print("open", flush=True)
sys.stdin.read()
"""


@pytest.mark.processes
def test_one_that_another_process_writes_is_not_deleted(tmp_path):
    path = str(tmp_path / name_of(0))
    other = ForkedProcess("testing.source", WRITER, path, stdin=PIPE, stdout=PIPE)
    with other.stdin, other.stdout:
        assert other.stdout.readline() == "open\n"
        middle, newest = fake(tmp_path, 1), fake(tmp_path, 2)
        assert prune(tmp_path, 1, 1) == [middle]
        assert left(tmp_path) == [name_of(0) + ".partial", newest.name]
        other.kill()
        assert other.wait(240) == -signal.SIGKILL
    assert [run.name for run in prune(tmp_path, 1, 1)] == [name_of(0) + ".partial"]
    assert left(tmp_path) == [newest.name]


def test_one_that_is_written_counts(tmp_path):
    written = fake(tmp_path, 5, partial=True)
    (file,) = written.glob("*.mcap")
    with file.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        newest = fake(tmp_path, 6)
        oldest = fake(tmp_path, 4)
        assert prune(tmp_path, 2, 0) == [oldest]
    assert left(tmp_path) == [written.name, newest.name]


def test_every_finished_run_deletes_what_is_too_much(tmp_path):
    folder = tmp_path / "runs"
    request = PlanRequest("closest", 50, fresh_samples=50, bound="none")
    paths = [record(folder, request) for _ in range(3)]
    log = Log()
    recorder = Recorder(log)
    for _ in range(2):
        beginning = beginning_with(request)
        run = recorder.begin(
            Recording(folder, max_runs=2), inputs_of(beginning, TORUS, RIG), beginning
        )
        run.finish(False, "no plan").result(240)
        paths.append(run.path)
        assert left(folder) == sorted(path.name for path in paths[-2:])
    assert recorder.close(240)
    assert log.errors == []


def test_what_cannot_be_deleted_is_told_and_costs_nothing(tmp_path, monkeypatch):
    folder = tmp_path / "runs"
    old = fake(folder, 1)
    log = Log()
    recorder = Recorder(log)
    beginning = beginning_with()
    run = recorder.begin(Recording(folder, max_runs=1), [], beginning)
    with monkeypatch.context() as patch:

        def refuse(*_, **__):
            raise PermissionError(1, "Operation not permitted", str(old))

        patch.setattr("focus_planner.recording.retention.shutil.rmtree", refuse)
        run.finish(False, "no plan").result(240)
    assert recorder.close(240)
    (told,) = log.errors
    assert told.startswith(f"old runs in {folder} cannot be deleted: ")
    assert "Operation not permitted" in told
    assert run.failure == ""
    assert run.path.is_dir()
    assert os.path.lexists(old)
