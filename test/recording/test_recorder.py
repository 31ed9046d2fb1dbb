# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recording beside a planner: in time, and never at the plan's cost."""

from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import threading
import time

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from focus_planner.core.progress import Progress, never_stop
from focus_planner.core.surface.surface import PointCloud
from focus_planner.messages.typestore import PLAN, serialize
from focus_planner.messages.writing import plan_to_fields
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording import bag as bag_module
from focus_planner.recording import recorder as module
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import inputs_of
from testing.forked import run_forked
from testing.runs import PLANNER, RIG, TORUS, Log, beginning_with, record, solved
from testing.visuals import check_markers, cloud_columns

NO_SPACE = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
PATIENCE = 240.0
STEPS = [Progress("em", k, 700.0 - k) for k in range(4)]


@pytest.fixture
def log():
    return Log()


@pytest.fixture
def recorder(log):
    recorder = Recorder(log)
    yield recorder
    assert recorder.close(PATIENCE)


@pytest.fixture(scope="module")
def expected():
    return solved(beginning_with())


def begin(recorder, folder, beginning, **how):
    return recorder.begin(Recording(folder, **how), inputs_of(beginning, TORUS, RIG), beginning)


def waited(condition):
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def partial_of(folder, beginning):
    return folder / f"{beginning.run_id}.partial"


def same_plan(plan, other):
    return plan.cameras == other.cameras and plan.cost == other.cost


def raise_no_space(*_, **__):
    raise NO_SPACE


class FullDisk:
    """A file on a disk that takes no more."""

    def __init__(self, file):
        self._file = file

    def write(self, _):
        raise NO_SPACE

    def __getattr__(self, name):
        return getattr(self._file, name)


# --- in time -----------------------------------------------------------------------------------


def test_all_inputs_are_on_disk_before_anything_is_solved(recorder, log, tmp_path, monkeypatch):
    beginning = beginning_with()
    sync = BagWriter.sync

    def slow_sync(bag):
        time.sleep(0.5)
        sync(bag)

    monkeypatch.setattr(BagWriter, "sync", slow_sync)
    heard = []

    def on_progress(progress):
        if progress.stage not in ("fresh", "visibility", "cells", "solving") and not heard:
            heard.append(read_run(partial_of(tmp_path, beginning)))
        return True

    run = begin(recorder, tmp_path, beginning)
    plan = solved(beginning, on_progress=run.wrap_callback(on_progress))
    assert len(heard) == 1
    assert [m.payload for m in heard[0].inputs] == [
        m.payload for m in inputs_of(beginning, TORUS, RIG)
    ]
    assert heard[0].beginning.request == beginning.request
    assert heard[0].ending is None
    run.finish(True, "", plan, RIG).result(PATIENCE)
    assert run.path == tmp_path / beginning.run_id
    assert read_run(run.path).ending.plan.cameras == plan.cameras
    assert log.errors == []


def test_the_progress_of_a_long_run_is_written_while_it_goes(recorder, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_SECONDS_BETWEEN_WRITES", 0.05)
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    on_progress = run.wrap_callback(never_stop)
    for step in STEPS:
        assert on_progress(step)
        time.sleep(0.06)

    def on_disk():
        partial = partial_of(tmp_path, beginning)
        return read_run(partial).progress if list(partial.glob("*.mcap")) else ()

    waited(lambda: len(on_disk()) >= 3)
    written = on_disk()  # once: more is written meanwhile
    assert written == tuple(STEPS[: len(written)])
    run.finish(False, "stopped").result(PATIENCE)
    assert read_run(run.path).progress == tuple(STEPS)


def test_no_step_of_a_short_run_is_lost_or_waited_for(recorder, tmp_path):
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    told = []
    on_progress = run.wrap_callback(lambda progress: told.append(progress) or len(told) < 3)
    assert [on_progress(step) for step in STEPS] == [True, True, False, False]
    assert told == STEPS
    run.finish(False, "").result(PATIENCE)
    assert read_run(run.path).progress == tuple(STEPS)


def test_the_end_comes_after_the_answer(recorder, tmp_path, expected):
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    answered = threading.Event()
    recorder.do_later(lambda: answered.wait(PATIENCE), lambda _: None)
    done = run.finish(True, "told", expected, RIG, (5, 6))
    assert not done.done()
    assert run.path is None
    answered.set()
    done.result(PATIENCE)
    ending = read_run(run.path).ending
    assert (ending.success, ending.message, ending.stamp) == (True, "told", (5, 6))
    assert ending.stop_log == expected.stop_log
    assert [f.stage for f in ending.fingerprints][-1] == "costs"


def test_a_plan_that_is_kept_late_is_in_the_run(recorder, log, tmp_path, expected, monkeypatch):
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    kept = threading.Event()
    recorder.do_now(lambda: kept.wait(PATIENCE), lambda _: None)
    payload = serialize(PLAN, plan_to_fields(expected, "world", (5, 6), beginning.run_id))
    run.keep_plan(payload, published=False)  # waits for a moment only
    kept.set()
    run.finish(True, "", expected, RIG).result(PATIENCE)
    (message,) = [m for m in read_bag(run.path).messages if m.type_name == PLAN]
    assert (message.topic, message.payload) == (f"{PLANNER}/run/focus_plan", payload)
    assert read_run(run.path).ending.plan.cameras == expected.cameras
    assert log.errors == []


def test_a_plan_that_cannot_be_kept_costs_the_recording(recorder, log, tmp_path, expected):
    run = begin(recorder, tmp_path, beginning_with())
    recorder.do_now(lambda: None, lambda _: None).result(PATIENCE)
    run._bag.add = raise_no_space
    run.keep_plan(b"")
    run.finish(True, "", expected, RIG).result(PATIENCE)
    assert run.path is None
    (error,) = log.errors
    assert "No space left on device" in error
    assert "No space left on device" in run.failure


def test_a_run_may_begin_while_the_last_one_is_written(recorder, log, tmp_path, expected):
    runs = [begin(recorder, tmp_path, beginning_with()) for _ in range(3)]
    for run in runs:
        run.finish(True, "", expected, RIG)
    waited(lambda: all(run.path for run in runs))
    assert {path.name for path in tmp_path.iterdir()} == {run.path.name for run in runs}
    assert log.errors == []


def test_prepared_inputs_are_those_of_the_run(recorder, tmp_path):
    one, other = beginning_with(), beginning_with()
    inputs = inputs_of(one, TORUS, RIG)
    recorder.prepare(tmp_path, inputs[:1])
    recorder.prepare(tmp_path, inputs)
    recorder.prepare(tmp_path, inputs)
    for beginning, given in ((one, inputs), (other, inputs[:1])):
        run = recorder.begin(Recording(tmp_path), given, beginning)
        run.finish(False, "").result(PATIENCE)
        payloads = [m.payload for m in read_run(run.path).inputs]
        assert payloads == [m.payload for m in given]


@pytest.fixture
def large(monkeypatch):
    """Has all inputs count as large, to be written when they come."""
    monkeypatch.setattr("focus_planner.recording.recorder._LARGE", 0)


def hidden(folder):
    return sorted(path for path in folder.iterdir() if path.name.startswith("."))


def prepared(recorder, folder, inputs):
    """Prepare inputs; return the folder that they are written to."""
    recorder.prepare(folder, inputs)
    recorder.do_later(lambda: None, lambda _: None).result(PATIENCE)
    (there,) = hidden(folder)
    return there


def test_large_inputs_are_written_when_they_come_and_become_the_runs(large, recorder, tmp_path):
    beginning = beginning_with()
    inputs = inputs_of(beginning, TORUS, RIG)
    there = prepared(recorder, tmp_path, inputs)
    assert there.name.endswith(".partial")
    assert [m.payload for m in read_bag(there).messages] == [m.payload for m in inputs]
    (file,) = there.iterdir()
    inode = file.stat().st_ino
    run = recorder.begin(Recording(tmp_path), inputs, beginning)
    run.finish(False, "").result(PATIENCE)
    assert not there.exists()
    assert run.path.name == beginning.run_id
    assert (run.path / f"{beginning.run_id}_0.mcap").stat().st_ino == inode
    assert [m.payload for m in read_run(run.path).inputs] == [m.payload for m in inputs]
    # The next ones are ready again, and go when nobody wants them.
    recorder.do_later(lambda: None, lambda _: None).result(PATIENCE)
    assert len(hidden(tmp_path)) == 1
    assert recorder.close(PATIENCE)
    assert [path.name for path in tmp_path.iterdir()] == [beginning.run_id]


@pytest.mark.parametrize("why", ["other inputs", "another folder", "deleted"])
def test_what_was_prepared_for_another_run_is_not_used(large, recorder, tmp_path, why):
    beginning = beginning_with()
    inputs = inputs_of(beginning, TORUS, RIG)
    there = prepared(recorder, tmp_path, inputs[:1] if why == "other inputs" else inputs)
    if why == "deleted":
        shutil.rmtree(there)
    folder = tmp_path / "other" if why == "another folder" else tmp_path
    run = recorder.begin(Recording(folder), inputs, beginning)
    run.finish(False, "").result(PATIENCE)
    assert run.failure == ""
    assert not there.exists()
    assert [m.payload for m in read_run(run.path).inputs] == [m.payload for m in inputs]


def test_what_the_dead_prepared_is_deleted_and_what_the_living_did_is_not(large, log, tmp_path):
    inputs = inputs_of(beginning_with(), TORUS, RIG)
    living, dead = Recorder(log), Recorder(log)
    of_the_living = prepared(living, tmp_path, inputs)
    of_the_dead = tmp_path / f".{new_run_id()}.partial"
    shutil.copytree(of_the_living, of_the_dead)
    foreign = tmp_path / ".mine.partial"
    foreign.mkdir()
    dead.prepare(tmp_path, inputs)
    assert dead.close(PATIENCE)
    assert hidden(tmp_path) == sorted([of_the_living, foreign])
    assert living.close(PATIENCE)
    assert hidden(tmp_path) == [foreign]


def test_what_cannot_be_prepared_is_tried_again_by_the_run(large, recorder, log, tmp_path):
    beginning = beginning_with()
    inputs = inputs_of(beginning, TORUS, RIG)
    folder = tmp_path / "file"
    folder.write_text("")
    recorder.prepare(folder, inputs)
    recorder.do_later(lambda: None, lambda _: None).result(PATIENCE)
    assert log.errors == []
    folder.unlink()
    run = recorder.begin(Recording(folder), inputs, beginning)
    run.finish(False, "").result(PATIENCE)
    assert run.path == folder / beginning.run_id


def test_a_full_disk_leaves_nothing_that_was_prepared(large, recorder, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "no space")

    with monkeypatch.context() as patch:
        patch.setattr(BagWriter, "sync", full)
        recorder.prepare(tmp_path, inputs_of(beginning_with(), TORUS, RIG))
        recorder.do_later(lambda: None, lambda _: None).result(PATIENCE)
    assert list(tmp_path.iterdir()) == []


SHOWN = {"/focus_planner/markers", "/focus_planner/quality_cloud"}


def test_what_shows_the_plan_is_written_only_where_it_is_wanted(tmp_path):
    for markers in (False, True):
        path = record(tmp_path, markers=markers)
        topics = {message.topic for message in read_bag(path).messages}
        assert topics & SHOWN == (SHOWN if markers else set())


def test_foxglove_s_reader_reads_what_shows_the_plan(tmp_path):
    path = record(tmp_path, markers=True)
    with (path / f"{path.name}_0.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = {
            channel.topic: content
            for _, channel, _, content in reader.iter_decoded_messages(topics=[*SHOWN])
        }
    run = read_run(path)
    markers = found["/focus_planner/markers"].markers
    check_markers(markers, RIG.frame_id, run.ending.stamp)
    assert {marker.ns for marker in markers} >= {"chosen_cameras", "focal_planes", "names"}
    cloud = found["/focus_planner/quality_cloud"]
    assert cloud.header.frame_id == RIG.frame_id
    assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec) == run.ending.stamp
    costs = cloud_columns(cloud)["cost"]
    assert len(costs) == run.ending.plan.fresh_samples
    assert 1000 * costs.mean(dtype=float) == pytest.approx(run.ending.plan.fresh_cost)


def test_what_shows_the_plan_is_no_input_of_it(tmp_path):
    cloud = PointCloud(TORUS.vertices, TORUS.vertex_normals)
    paths = [record(tmp_path, surface=cloud, markers=markers) for markers in (False, True)]
    runs = [read_run(path) for path in paths]
    assert [len(run.inputs) for run in runs] == [2, 2]
    assert runs[0].ending.plan.cameras == runs[1].ending.plan.cameras
    assert differences(runs[1], plan_run(runs[1])) == []


def test_a_run_that_failed_has_no_plan_and_no_markers(recorder, tmp_path):
    run = begin(recorder, tmp_path, beginning_with(), markers=True)
    run.finish(False, "no plan").result(PATIENCE)
    topics = {message.topic for message in read_bag(run.path).messages}
    assert not topics & {*SHOWN, "/focus_planner/focus_plan"}


# --- what fails --------------------------------------------------------------------------------


def check_lost(run, log, reason):
    assert run.failure.endswith(f": {reason}")
    assert log.errors == [f"not recorded: {run.failure}"]
    assert run.path is None


def plan_with(run, beginning, expected):
    plan = solved(beginning, on_progress=run.wrap_callback(never_stop))
    assert same_plan(plan, expected)
    run.finish(True, plan.summary(), plan, RIG).result(PATIENCE)


@pytest.mark.parametrize("place", ["file/below", "/proc/focus_planner"])
def test_where_nothing_can_be_written_only_the_run_is_lost(
    recorder, log, tmp_path, expected, place
):
    (tmp_path / "file").write_text("no folder")
    folder = tmp_path / place
    beginning = beginning_with()
    run = begin(recorder, folder, beginning)
    plan_with(run, beginning, expected)
    reason = "Not a directory" if "file" in place else "No such file or directory"
    check_lost(run, log, reason)
    assert f"run {beginning.run_id} in {folder}: " in run.failure
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("suffix", ["", ".partial"])
def test_nothing_is_overwritten(recorder, log, tmp_path, expected, suffix):
    beginning = beginning_with()
    there = tmp_path / (beginning.run_id + suffix)
    there.mkdir()
    (there / "mine").write_text("mine")
    run = begin(recorder, tmp_path, beginning)
    plan_with(run, beginning, expected)
    assert "xists" in run.failure
    assert len(log.errors) == 1
    assert (there / "mine").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == [there.name]


def test_a_disk_that_is_full_at_the_beginning_costs_no_plan(
    recorder, log, tmp_path, expected, monkeypatch
):
    monkeypatch.setattr("focus_planner.recording.bag.os.fsync", raise_no_space)
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    plan_with(run, beginning, expected)
    check_lost(run, log, "No space left on device")
    assert left(recorder, tmp_path) == []


def test_a_disk_that_has_no_room_for_the_inputs_costs_no_plan(
    recorder, log, tmp_path, expected, monkeypatch
):
    beginning = beginning_with()
    create = bag_module.create_file
    monkeypatch.setattr(bag_module, "create_file", lambda *of: FullDisk(create(*of)))
    run = begin(recorder, tmp_path, beginning)
    plan_with(run, beginning, expected)
    check_lost(run, log, "No space left on device")


def test_a_disk_that_is_full_later_costs_no_plan(recorder, log, tmp_path, expected, monkeypatch):
    monkeypatch.setattr(module, "_SECONDS_BETWEEN_WRITES", 0.0)
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    run._on_disk.result(PATIENCE)
    monkeypatch.setattr("focus_planner.recording.bag._Stream.write", raise_no_space)
    on_progress = run.wrap_callback(never_stop)
    assert all(on_progress(step) for step in STEPS)
    waited(lambda: run.failure)
    plan_with(run, beginning, expected)
    check_lost(run, log, "No space left on device")
    assert left(recorder, tmp_path) == []


@pytest.mark.parametrize("where", ["bag._Stream.write", "bag.os.fsync", "bag.Path.rename"])
def test_a_disk_that_is_full_in_the_end_costs_no_plan(
    recorder, log, tmp_path, expected, monkeypatch, where
):
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    run._on_disk.result(PATIENCE)
    monkeypatch.setattr(f"focus_planner.recording.{where}", raise_no_space)
    plan_with(run, beginning, expected)
    check_lost(run, log, "No space left on device")
    assert left(recorder, tmp_path) == []


def left(recorder, folder):
    """What is in a folder once the recorder has done all that it was given to do."""
    recorder.do_later(lambda: None, lambda _: None).result(PATIENCE)
    return [path.name for path in folder.iterdir() if not path.name.startswith(".")]


def test_no_failed_run_costs_a_good_one(recorder, log, tmp_path, expected, monkeypatch):
    def run(**how):
        made = recorder.begin(Recording(tmp_path, max_runs=4), [], beginning_with())
        made.finish(True, "", expected, RIG).result(PATIENCE)
        return made

    good = [run() for _ in range(4)]
    with monkeypatch.context() as full:
        full.setattr("focus_planner.recording.bag.os.fsync", raise_no_space)
        lost = [run() for _ in range(6)]
    newest = run()
    assert sorted(left(recorder, tmp_path)) == sorted(r.path.name for r in (*good[1:], newest))
    assert len(log.errors) == len(lost)


def test_a_failed_run_is_kept_while_it_alone_holds_the_plan_in_force(
    recorder, log, tmp_path, expected, monkeypatch
):
    first, lost = beginning_with(), beginning_with()
    run = begin(recorder, tmp_path, first)
    keep(recorder, run, first, expected)
    run.finish(True, "", expected, RIG).result(PATIENCE)
    run = begin(recorder, tmp_path, lost)
    keep(recorder, run, lost, expected)
    with monkeypatch.context() as full:
        full.setattr("focus_planner.recording.bag.os.fsync", raise_no_space)
        run.finish(True, "", expected, RIG).result(PATIENCE)
    check_lost(run, log, "No space left on device")
    assert recorder.failure == run.failure
    assert partial_of(tmp_path, lost).name in left(recorder, tmp_path)
    assert last_plan(tmp_path, PLANNER).plan.message.plan_id == lost.run_id
    run = begin(recorder, tmp_path, beginning_with())
    assert recorder.failure != ""  # nothing is recorded yet
    keep(recorder, run, run._beginning, expected)
    run.finish(True, "", expected, RIG).result(PATIENCE)
    assert recorder.failure == ""
    assert sorted(left(recorder, tmp_path)) == sorted([first.run_id, run.path.name])


def keep(recorder, run, beginning, plan):
    """Keep a plan of a run, and wait until it is in the file."""
    run.keep_plan(serialize(PLAN, plan_to_fields(plan, "world", (5, 6), beginning.run_id)))
    run._plan_written.result(PATIENCE)


@pytest.mark.parametrize(
    ("access", "of_folders", "of_files"),
    [("owner", 0o700, 0o600), ("group", 0o750, 0o640), ("all", 0o755, 0o644)],
)
@pytest.mark.parametrize("umask", [0o000, 0o022, 0o077])
def test_runs_are_for_whom_they_are_meant_whatever_the_umask(
    recorder, large, tmp_path, access, of_folders, of_files, umask
):
    folder = tmp_path / "made" / "runs"
    beginning = beginning_with()
    inputs = inputs_of(beginning, TORUS, RIG)
    before = os.umask(umask)
    try:
        # Only the owner's until it is known for whom the run is.
        there = prepared(recorder, folder, inputs)
        assert mode_of(there) == 0o700
        assert {mode_of(file) for file in there.iterdir()} == {0o600}
        run = recorder.begin(Recording(folder, access=access), inputs, beginning)
        run.finish(False, "").result(PATIENCE)
    finally:
        os.umask(before)
    assert mode_of(run.path) == of_folders
    assert {mode_of(file) for file in run.path.iterdir()} == {of_files}
    run = recorder.begin(Recording(tmp_path / access, access=access), [], beginning_with())
    run.finish(False, "").result(PATIENCE)
    assert mode_of(tmp_path / access) == mode_of(run.path) == of_folders


def mode_of(path):
    return path.stat().st_mode & 0o777


def test_the_next_run_is_recorded_when_there_is_room_again(
    recorder, log, tmp_path, expected, monkeypatch
):
    with monkeypatch.context() as full:
        full.setattr("focus_planner.recording.bag.os.fsync", raise_no_space)
        lost = begin(recorder, tmp_path, beginning_with())
        lost.finish(True, "", expected, RIG).result(PATIENCE)
    run = begin(recorder, tmp_path, beginning_with())
    run.finish(True, "", expected, RIG).result(PATIENCE)
    assert run.failure == ""
    assert read_run(run.path).fault == ""
    check_lost(lost, log, "No space left on device")


def test_a_mistake_in_recording_costs_no_plan(recorder, log, tmp_path, expected, monkeypatch):
    def mistaken(*_):
        raise ValueError("oh no")

    monkeypatch.setattr("focus_planner.runtime.description.fingerprints", mistaken)
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    plan_with(run, beginning, expected)
    check_lost(run, log, "ValueError('oh no')")


def test_who_is_told_to_stop_does_not_wait_for_a_disk_that_hangs(recorder, tmp_path, monkeypatch):
    hanging = threading.Event()
    monkeypatch.setattr(BagWriter, "sync", lambda _: hanging.wait(PATIENCE))
    run = begin(recorder, tmp_path, beginning_with())
    asked = []
    on_progress = run.wrap_callback(lambda progress: asked.append(progress) or len(asked) < 3)
    assert not on_progress(Progress("solving", 0, float("nan")))
    assert len(asked) >= 3
    assert not run._on_disk.done()
    hanging.set()
    run.finish(False, "stopped").result(PATIENCE)


def test_who_is_not_told_to_stop_does_wait(recorder, tmp_path, monkeypatch):
    hanging = threading.Event()
    monkeypatch.setattr(BagWriter, "sync", lambda _: hanging.wait(PATIENCE))
    run = begin(recorder, tmp_path, beginning_with())
    asked = []

    def answering_at_last(progress):
        asked.append(progress)
        if len(asked) == 3:
            hanging.set()
        return True

    assert run.wrap_callback(answering_at_last)(Progress("solving", 0, float("nan")))
    assert len(asked) >= 3
    assert run._on_disk.done()
    run.finish(False, "no plan").result(PATIENCE)


def test_after_it_is_closed_nothing_begins(log, tmp_path, expected):
    recorder = Recorder(log)
    assert recorder.close(PATIENCE)
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    plan_with(run, beginning, expected)
    check_lost(run, log, "the planner is shutting down")
    assert list(tmp_path.iterdir()) == []
    recorder.prepare(tmp_path, [])
    assert recorder.close(PATIENCE)


def test_what_ends_after_it_is_closed_is_left_partial(log, tmp_path, expected):
    recorder = Recorder(log)
    beginning = beginning_with()
    run = begin(recorder, tmp_path, beginning)
    assert recorder.close(PATIENCE)
    plan_with(run, beginning, expected)
    check_lost(run, log, "the planner is shutting down")
    partial = read_run(partial_of(tmp_path, beginning))
    assert partial.ending is None
    assert len(partial.inputs) == 2


def test_close_waits_for_what_is_still_to_be_written(log, tmp_path, expected):
    recorder = Recorder(log)
    run = begin(recorder, tmp_path, beginning_with())
    run.finish(True, "", expected, RIG)
    assert not recorder.close(0.0)
    assert recorder.close(PATIENCE)
    assert read_run(run.path).fault == ""


# --- a disk that is really full ----------------------------------------------------------------

PROGRAM = """
import json, resource, signal, sys
from pathlib import Path
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording.recorder import Recorder
from testing.runs import *
log = Log()
beginning = beginning_with()
solved(beginning)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
recorder = Recorder(log)
run = recorder.begin(Recording(Path(sys.argv[1])), inputs_of(beginning, TORUS, RIG), beginning)
plan = solved(beginning, on_progress=run.wrap_callback(never_stop))
run.finish(True, plan.summary(), plan, RIG)
assert recorder.close(240)
print(json.dumps([plan.cost, run.failure, log.errors]))
"""


@pytest.mark.processes
@pytest.mark.parametrize("share", [0.2, 0.97])
def test_the_system_refuses_to_write_more(tmp_path, expected, share):
    assert hasattr(resource, "RLIMIT_FSIZE")
    (file,) = record(tmp_path / "whole").glob("*.mcap")
    limit = str(int(share * file.stat().st_size))
    folder = tmp_path / "cut"
    done = run_forked("testing.source", PROGRAM, str(folder), limit)
    assert (done.returncode, done.stderr) == (0, "")
    cost, failure, errors = json.loads(done.stdout)
    assert cost == expected.cost
    assert failure.endswith("File too large")
    assert errors == [f"not recorded: {failure}"]
    assert list(folder.iterdir()) == []
