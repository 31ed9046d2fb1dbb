# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import pytest

from focus_planner.evaluation.experiment import Task
from focus_planner.evaluation.running.window import Window
from focus_planner.evaluation.running.work import Job


def jobs(*subjects, settings):
    return [
        Job(Task(group, {"setting": number}), f"{group}{number}")
        for group in subjects
        for number in range(settings)
    ]


def hand_out(window, workers):
    out = []
    while (job := window.next(workers)) is not None:
        out.append(job)
    return out


@pytest.mark.parametrize("workers", [1, 4, 64])
def test_few_subjects_are_worked_on_at_once_and_every_job_is_handed_out_once(workers):
    window = Window(jobs(*((f"s{number}",) for number in range(400)), settings=100))
    out, seen, most, held = [], [], 0, set()
    while not window.is_empty:
        new = hand_out(window, workers)
        seen += new
        out += new
        held |= {job.task.subjects[0] for job in new}
        most = max(most, len(held))
        assert len(out) <= 2 * workers + 2
        done, out = out[:2], out[2:]
        for job in done:
            held -= set(window.take_back(job))
    assert len({job.key for job in seen}) == len(seen) == 40_000
    assert most <= 2 * workers
    assert not held


def test_each_worker_has_a_subject_of_its_own_while_there_are_enough():
    window = Window(jobs(("a",), ("b",), ("c",), ("d",), settings=9))
    out = [job.task.subjects[0] for job in hand_out(window, 2)]
    assert out == ["a", "a", "b", "b", "c", "c"]


def test_workers_share_the_last_subjects():
    window = Window(jobs(("a",), ("b",), settings=50))
    out = [job.task.subjects[0] for job in hand_out(window, 9)]
    assert (out.count("a"), out.count("b")) == (10, 10)


def test_subjects_are_held_while_any_group_needs_them():
    window = Window(jobs(("a", "b"), ("b", "c"), settings=1))
    first, second = hand_out(window, 1)
    assert window.take_back(first) == ["a"]
    assert window.take_back(second) == ["b", "c"]
    assert window.is_empty


def test_nothing_more_is_handed_out_without_workers():
    window = Window(jobs(("a",), settings=9))
    assert len(hand_out(window, 0)) == 2
