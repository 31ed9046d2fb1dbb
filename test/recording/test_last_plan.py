# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which plan is in force again after a planner was killed."""

from __future__ import annotations

import shutil
import signal

import pytest

from focus_planner.core.validation import InputError
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.naming import METADATA, PARTIAL
from focus_planner.recording.run_writing import plan_message
from testing import made_up_runs as made_up
from testing import runs
from testing.forked import run_forked
from testing.made_up_runs import PLANNER, plan_payload, run_id
from testing.made_up_runs import write_with_plan as write


def last(directory, planner=PLANNER):
    """The number of the last plan, None if there is none."""
    found = last_plan(directory, planner).plan
    return None if found is None else int(found.message.cost)


def skipped(directory):
    """The runs that were skipped, by number, and why."""
    return {each.run.name: each.why for each in last_plan(directory, PLANNER).skipped}


def test_there_is_none_where_nothing_was_recorded(tmp_path):
    assert last(tmp_path / "not there") is None
    assert last(tmp_path) is None
    (tmp_path / "a file").write_text("hello")
    (tmp_path / "a folder").mkdir()
    (tmp_path / run_id(1)).mkdir()
    assert last(tmp_path) is None
    assert last(tmp_path / "a file") is None


def test_it_is_the_newest(tmp_path):
    for number in (2, 3, 1):
        write(tmp_path, number)
    found = last_plan(tmp_path, PLANNER).plan
    assert found.run == tmp_path / run_id(3)
    assert found.message.plan_id == run_id(3)


def test_it_is_all_that_was_recorded_by_the_recorder(tmp_path):
    path = runs.record(tmp_path)
    found = last_plan(tmp_path, runs.PLANNER).plan
    assert found.run == path
    plan = plan_from_message(found.message)
    assert plan.cameras == runs.solved(runs.beginning_with()).cameras


def test_a_run_that_was_cut_off_after_its_plan_was_published_counts(tmp_path):
    write(tmp_path, 1)
    partial = write(tmp_path, 2, whole=False)
    assert last_plan(tmp_path, PLANNER).plan.run == partial
    assert last(tmp_path) == 2


def test_a_run_without_a_plan_does_not_count(tmp_path):
    write(tmp_path, 1)
    write(tmp_path, 2, plan=False)
    write(tmp_path, 3, plan=False, whole=False)
    assert last(tmp_path) == 1


@pytest.mark.parametrize("whole", [True, False])
def test_a_plan_that_was_only_answered_does_not_count(tmp_path, whole):
    write(tmp_path, 1)
    write(tmp_path, 2, published=False, whole=whole)
    assert last(tmp_path) == 1


@pytest.mark.parametrize("planner", ["/made/upper", "/up", "/made"])
def test_another_planners_runs_do_not_count(tmp_path, planner):
    write(tmp_path, 1)
    write(tmp_path, 2, planner=planner)
    write(tmp_path, 3, planner=planner, whole=False)
    assert last(tmp_path) == 1
    assert last(tmp_path, planner) == 3
    assert last(tmp_path, "/nobody") is None


def no_metadata(run):
    (run / METADATA).write_text("] not YAML [")


def other_metadata(run):
    (run / METADATA).write_text("rosbag2_bagfile_information: 5\n")


def empty(run):
    file = run / f"{run.name}_0.mcap"
    file.write_bytes(b"")


def noise(run):
    file = run / f"{run.name}_0.mcap"
    file.write_bytes(b"\x89MCAP0\r\n" + bytes(range(256)) * 9)


def flipped(run):
    """Without the summary it is read from its front; there the plan's chunk is damaged."""
    file = run / f"{run.name}_0.mcap"
    data = bytearray(file.read_bytes())
    for at in range(200, len(data), 97):
        data[at] ^= 0xFF
    file.write_bytes(data)


def a_folder(run):
    file = run / f"{run.name}_0.mcap"
    file.unlink()
    file.mkdir()


@pytest.mark.parametrize("damage", [empty, noise, flipped, a_folder, no_metadata, other_metadata])
def test_before_a_damaged_run_comes_the_one_before(tmp_path, damage):
    write(tmp_path, 1)
    damage(write(tmp_path, 2))
    assert last(tmp_path) == 1


def test_without_its_metadata_a_run_counts_still(tmp_path):
    write(tmp_path, 1)
    (write(tmp_path, 2) / METADATA).unlink()
    assert last(tmp_path) == 2


def test_a_run_that_was_cut_off_before_its_plan_is_nothing_to_tell_of(tmp_path):
    write(tmp_path, 1)
    write(tmp_path, 2, plan=False, whole=False)
    assert skipped(tmp_path) == {}


def test_a_plan_that_cannot_be_put_in_force_here_is_skipped(tmp_path):
    for number in (1, 2):
        write(tmp_path, number)

    def check(message):
        if message.plan_id == run_id(2):
            raise InputError("namespace", "a shorter one", "a long one")

    search = last_plan(tmp_path, PLANNER, check)
    assert search.plan.run.name == run_id(1)
    (other,) = search.skipped
    assert (other.run.name, other.why) == (
        run_id(2),
        "namespace: expected a shorter one, got a long one",
    )


def test_a_plan_that_is_no_message_is_passed_over(tmp_path):
    write(tmp_path, 1)
    begun = made_up.beginning(2)
    bag = BagWriter()
    bag.open(tmp_path / run_id(2))
    bag.add(plan_message(begun, plan_payload(2)[:30], published=True))
    bag.close()
    assert last(tmp_path) == 1


def test_a_run_cut_anywhere_has_its_plan_or_is_passed_over(tmp_path):
    write(tmp_path, 1)
    partial = write(tmp_path, 2, whole=False)
    file = next(partial.glob("*.mcap"))
    data = file.read_bytes()
    found = []
    for length in [*range(0, len(data), 211), len(data)]:
        file.write_bytes(data[:length])
        found.append(last(tmp_path))
    assert set(found) == {1, 2}
    assert found == sorted(found)


def test_a_link_is_no_run(tmp_path):
    write(tmp_path, 1)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / run_id(2)).symlink_to(write(elsewhere, 2))
    assert last(tmp_path) == 1


def test_of_very_many_runs_without_a_plan_not_all_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr("focus_planner.recording.last_plan._MAX_RUNS", 2)
    write(tmp_path, 1)
    for number in (2, 3):
        write(tmp_path, number, plan=False)
    assert last(tmp_path) is None
    shutil.rmtree(tmp_path / run_id(3))
    assert last(tmp_path) == 1


# --- what is killed ----------------------------------------------------------------------------


@pytest.mark.processes
@pytest.mark.parametrize("published", [True, False])
def test_killed_once_the_plan_is_kept_it_is_found(tmp_path, published):
    write(tmp_path, 1)
    victim = run_forked("testing.killed_keeper", str(tmp_path), str(int(published)))
    assert victim.returncode == -signal.SIGKILL
    assert victim.stdout == ""
    assert len(list(tmp_path.glob(f"*{PARTIAL}"))) == 1
    assert last(tmp_path) == (2 if published else 1)
