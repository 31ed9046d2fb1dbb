# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is deleted, and what never is."""

from __future__ import annotations

import fcntl
import os
import signal
import socket
from pathlib import Path

import pytest

from focus_planner.core.planning.request import PlanRequest
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.retention import delete_leftovers, prune
from focus_planner.recording.run_writing import inputs_of
from testing import made_up_runs as made_up
from testing.forked import PIPE, ForkedProcess
from testing.runs import RIG, TORUS, Log, beginning_with, record


def name_of(number):
    return f"20250103T0000{number:02d}.123456Z-{0xABCDEF00 + 7919 * (99 - number):08x}"


def fake(folder, number, size=100, *, partial=False):
    """A folder named and filled as a run; a greater number is a newer one."""
    name = name_of(number)
    path = folder / (name + ".partial" * partial)
    path.mkdir(parents=True)
    magic = b"\x89MCAP0\r\n"
    (path / f"{name}_0.mcap").write_bytes(magic + bytes(size - 16) + magic)
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
    small, big, newest = (fake(tmp_path, n, size) for n, size in enumerate([20, 1000, 20]))
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
    assert prune(folder, 1, 0) == []
    assert (run.is_dir(), outside.stat().st_size) == (True, 100)


def test_runs_that_were_cut_off_do_not_count_and_are_limited_on_their_own(tmp_path):
    whole = [fake(tmp_path, n) for n in range(4)]
    dead = [fake(tmp_path, n, partial=True) for n in range(10, 25)]
    assert prune(tmp_path, 3, 0) == [whole[0], *reversed(dead[:-3])]
    assert left(tmp_path) == [run.name for run in (*whole[1:], *dead[-3:])]
    assert prune(tmp_path, 0, 10_000) == []


def test_runs_that_are_damaged_do_not_count(tmp_path):
    whole = [fake(tmp_path, n) for n in range(3)]
    for number in range(10, 22):
        run = fake(tmp_path, number)
        if number % 3 == 0:
            (run / "metadata.yaml").unlink()
        else:
            file = run / f"{run.name}_0.mcap"
            file.write_bytes(file.read_bytes()[: -5 if number % 3 == 1 else 0])
    prune(tmp_path, 3, 0)
    assert left(tmp_path)[:3] == [run.name for run in whole]
    assert len(left(tmp_path)) == 6


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
    dead = [fake(tmp_path, number, partial=True) for number in (3, 4, 5)]
    assert [run.name for run in prune(tmp_path, 1, 1)] == [name_of(0) + ".partial"]
    assert left(tmp_path) == sorted(run.name for run in (newest, *dead))


def test_one_that_is_written_does_not_count_yet(tmp_path):
    written = fake(tmp_path, 5, partial=True)
    (file,) = written.glob("*.mcap")
    with file.open("rb") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        newest = fake(tmp_path, 6)
        oldest = fake(tmp_path, 4)
        assert prune(tmp_path, 2, 0) == []
        assert prune(tmp_path, 1, 0) == [oldest]
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
        # That of the last plan is kept besides.
        kept = {paths[2], *paths[-2:]}
        assert left(folder) == sorted(path.name for path in kept)
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
    assert (folder / f".{old.name}.partial").is_dir()  # a leftover now, no run any more
    delete_leftovers(folder)
    assert left(folder) == [run.path.name]


# --- the plan in force -------------------------------------------------------------------------


@pytest.mark.parametrize("whole", [True, False])
def test_the_run_that_a_planner_would_restore_its_plan_from_is_kept(tmp_path, whole):
    with_plans = [recorded(tmp_path, number, whole=whole) for number in (1, 2)]
    of_another = recorded(tmp_path, 3, planner="/another", whole=whole)
    answered_only = recorded(tmp_path, 4, published=False, whole=whole)
    for number in range(10, 14):
        fake(tmp_path, number + 40, partial=not whole)
    prune(tmp_path, 1, 0)
    assert with_plans[1].exists()
    assert of_another.exists()
    assert not with_plans[0].exists()
    assert not answered_only.exists()
    assert last_plan(tmp_path, made_up.PLANNER).plan.run == with_plans[1]


def test_a_newer_plan_makes_it_a_run_like_others(tmp_path):
    old, newer = (recorded(tmp_path, number) for number in (1, 2))
    assert prune(tmp_path, 1, 0) == [old]
    assert left(tmp_path) == [newer.name]


def recorded(directory, number, **kind):
    """A real run with a plan, older than those that are fake."""
    return made_up.write_with_plan(directory, number, **kind)


# --- leftovers ---------------------------------------------------------------------------------


def test_beginnings_without_a_byte_are_deleted_unless_they_are_new(tmp_path):
    empty = fake(tmp_path, 1, partial=True)
    (file,) = empty.iterdir()
    file.write_bytes(b"")
    old, new = (tmp_path / f"{name_of(number)}.partial" for number in (2, 3))
    for folder in (old, new):
        folder.mkdir()
    os.utime(old, (1.7e9, 1.7e9))
    begun, whole = fake(tmp_path, 4, partial=True), fake(tmp_path, 5)
    delete_leftovers(tmp_path)
    assert left(tmp_path) == [new.name, begun.name, whole.name]


def made_foreign(folder):
    """What is no run, under names of runs and of leftovers."""
    made = []
    for number, suffix in enumerate(("", ".partial")):
        for dot in ("", "."):
            made.append(folder / f"{dot}{name_of(30 + number)}{suffix}")
            os.mkfifo(made[-1])
    for number, partial in ((40, False), (41, True)):
        run = fake(folder, number, partial=partial)
        (file,) = run.glob("*.mcap")
        file.unlink()
        os.mkfifo(file)
        made.append(run)
    with socket.socket(socket.AF_UNIX) as server:
        made.append(folder / f"{name_of(50)}.partial")
        at = os.open(folder, os.O_RDONLY)  # a socket's name is short
        server.bind(f"/proc/self/fd/{at}/{made[-1].name}")
        os.close(at)
    made.append(folder / name_of(51))
    made[-1].symlink_to("/proc")
    made.append(folder / name_of(52))
    (made[-1] / "folder").mkdir(parents=True)
    return made


def test_what_is_foreign_stops_neither_retention_nor_recording(tmp_path, monkeypatch):
    monkeypatch.setattr("focus_planner.recording.recorder._LARGE", 0)
    runs = [fake(tmp_path, number) for number in range(4)]
    foreign = made_foreign(tmp_path)
    log = Log()
    recorder = Recorder(log)
    beginning = beginning_with()
    run = recorder.begin(
        Recording(tmp_path, max_runs=2), inputs_of(beginning, TORUS, RIG), beginning
    )
    run.finish(False, "no plan").result(240)
    assert recorder.close(240)
    assert log.errors == []
    assert set(tmp_path.iterdir()) == {runs[-1], run.path, *foreign}


def test_one_that_cannot_be_deleted_does_not_keep_others_from_it(tmp_path, monkeypatch):
    runs = [fake(tmp_path, number) for number in range(4)]
    rename = Path.rename

    def refusing(path, to):
        if path == runs[2]:
            raise PermissionError(1, "Operation not permitted", str(path))
        return rename(path, to)

    monkeypatch.setattr(Path, "rename", refusing)
    with pytest.raises(PermissionError):
        prune(tmp_path, 1, 0)
    assert left(tmp_path) == [runs[2].name, runs[3].name]
