# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from dataclasses import replace

import pandas as pd
import pytest

from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import Measured, Task
from focus_planner.evaluation.results.results_file import ResultsFile
from focus_planner.evaluation.results.store import opened
from focus_planner.evaluation.running.here import Here
from focus_planner.evaluation.running.running import run
from focus_planner.evaluation.running.work import Job, Succeeded
from testing.experiments import CONDITIONS, LEVELS, PAIRS, TROUBLED, Box, boxes

SUBJECTS = boxes(3)


def evaluate(folder, experiment=LEVELS, sources=SUBJECTS, on_progress=lambda _: None):
    with opened(folder, CONDITIONS, sources) as store:
        return run(experiment, sources, CONDITIONS, store, Here(), on_progress)


def files(folder, name="levels"):
    return (folder / name / "results.csv"), (folder / name / "seconds.csv")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The results of an evaluation that nothing happened to."""
    folder = tmp_path_factory.mktemp("whole")
    evaluate(folder)
    return files(folder)[0].read_bytes()


class InterruptionError(Exception):
    pass


def interrupt(after):
    def tell(standing):
        if standing.done >= after:
            raise InterruptionError

    return tell


def test_results_are_read_as_they_were_measured(tmp_path):
    outcome = evaluate(tmp_path, PAIRS)
    rows = []
    for task in PAIRS.tasks([box.name for box in SUBJECTS], CONDITIONS):
        given = [box.unpack() for box in SUBJECTS if box.name in task.subjects]
        for row in PAIRS.measure(given, task.setting, CONDITIONS).rows:
            plain = {key: getattr(value, "item", lambda v=value: v)() for key, value in row.items()}
            rows.append({"subject": "+".join(task.subjects), **task.setting, **plain})
    results = outcome.file.results(CONDITIONS)
    pd.testing.assert_frame_equal(results.rows, pd.DataFrame(rows), check_exact=True)
    assert list(results.seconds) == ["subject", "level", "own_seconds", "task_seconds"]


def test_names_that_look_like_numbers_stay_names(tmp_path):
    outcome = evaluate(tmp_path, sources=[Box("007"), Box("1e3")])
    assert set(outcome.file.results(CONDITIONS).rows["subject"]) == {"007", "1e3"}


def test_keys_that_look_like_numbers_are_none(tmp_path):
    job = Job(Task(("box0",), {"level": 0}), "0012345678901234")
    file = ResultsFile(tmp_path / "levels", [job])
    file.add([(job, Succeeded(Measured([{"value": 1.0}]), 0.1))])
    assert ResultsFile(tmp_path / "levels", [job]).done == {"0012345678901234"}


def test_an_evaluation_resumes_where_it_stopped(tmp_path, whole):
    with pytest.raises(InterruptionError):
        evaluate(tmp_path, on_progress=interrupt(after=5))
    standings = []
    outcome = evaluate(tmp_path, on_progress=standings.append)
    assert (outcome.done, outcome.resumed, outcome.total) == (12, 5, 12)
    assert (standings[0].done, standings[0].resumed) == (5, 5)
    assert standings[-1].seconds_left == 0
    assert files(tmp_path)[0].read_bytes() == whole


def test_what_is_done_is_not_done_again(tmp_path, whole):
    evaluate(tmp_path)
    before = files(tmp_path)[1].read_bytes()
    never = replace(LEVELS, measure=lambda *_: pytest.fail("measured again"))
    assert evaluate(tmp_path, never).resumed == 12
    assert files(tmp_path)[1].read_bytes() == before


def test_more_subjects_come_to_the_others(tmp_path, whole):
    evaluate(tmp_path, sources=SUBJECTS[1:])
    assert evaluate(tmp_path).resumed == 8
    assert files(tmp_path)[0].read_bytes() == whole


@pytest.mark.parametrize("which", [0, 1])
def test_torn_files_are_mended(tmp_path, whole, which):
    """Wherever a process was killed while it wrote, only the tasks concerned are done again."""
    evaluate(tmp_path)
    path = files(tmp_path)[which]
    content = path.read_bytes()
    other = files(tmp_path)[1 - which].read_bytes()
    header = content.index(b"\n") + 1
    line = content.index(b"\n", header) + 1
    for end in {0, header - 3, header, header + 1, line - 1, line, line + 5, len(content) - 1}:
        path.write_bytes(content[:end])
        # Rows come first, so lines of seconds have theirs; a row without its line does not count.
        rows, seconds = (content[:end], b"") if which == 0 else (other, content[:end])
        files(tmp_path)[0].write_bytes(rows)
        files(tmp_path)[1].write_bytes(seconds)
        outcome = evaluate(tmp_path)
        assert outcome.resumed == max(0, seconds.count(b"\n") - 1)
        assert files(tmp_path)[0].read_bytes() == whole


def test_files_of_something_else_are_refused(tmp_path):
    evaluate(tmp_path)
    files(tmp_path)[0].write_text("name,age\nbody,3\n")
    with pytest.raises(InputError, match="results of this experiment, got columns name, age"):
        evaluate(tmp_path)


def test_failures_are_told_and_tried_again(tmp_path):
    survivable = replace(
        TROUBLED,
        tasks=lambda names, conditions: [
            task for task in TROUBLED.tasks(names, conditions) if task.setting["trouble"] != "kill"
        ],
    )
    outcome = evaluate(tmp_path, survivable, SUBJECTS[:1])
    assert outcome.done == 1
    assert outcome.failures == (
        (
            "box0 (trouble refuse)",
            "box0: expected something else, got this; try another",
        ),
        ("box0 (trouble raise)", "internal error: ZeroDivisionError: by nothing"),
    )
    listed = (tmp_path / "troubled" / "failed.csv").read_text().splitlines()
    assert listed[0] == "subject,trouble,reason"
    assert len(listed) == 3
    mended = replace(survivable, measure=lambda *_: LEVELS.measure(_[0], {}, _[2]))
    outcome = evaluate(tmp_path, mended, SUBJECTS[:1])
    assert (outcome.done, outcome.resumed, outcome.failures) == (3, 1, ())
    assert not (tmp_path / "troubled" / "failed.csv").exists()


@pytest.mark.parametrize(
    ("trouble", "reason"), [("lost", "a file, got none"), ("raise", "ZeroDivisionError")]
)
def test_a_subject_that_cannot_be_had_fails_its_tasks(tmp_path, trouble, reason):
    outcome = evaluate(tmp_path, sources=[Box("bad", trouble=trouble), Box("good")])
    assert (outcome.done, len(outcome.failures)) == (4, 4)
    assert all(name.startswith("bad") and reason in why for name, why in outcome.failures)


def test_other_columns_are_a_mistake_of_the_experiment(tmp_path):
    def measure(subjects, setting, conditions):
        return Measured([{f"value{setting['level']}": 1}])

    with pytest.raises(ValueError, match="value1"):
        evaluate(tmp_path, replace(LEVELS, measure=measure))


def test_measured_columns_are_not_called_as_the_setting(tmp_path):
    clash = replace(LEVELS, measure=lambda *_: Measured([{"level": 1}]))
    with pytest.raises(ValueError, match="called as the setting's"):
        evaluate(tmp_path, clash)


def test_a_disk_that_cannot_be_written_to_is_told(tmp_path, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        evaluate(tmp_path)
