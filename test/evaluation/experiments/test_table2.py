# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import re

import pytest

from focus_planner.core.solvers import Options, k_view
from focus_planner.evaluation.experiment import Conditions
from focus_planner.evaluation.experiments import table2
from testing import reference
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    made_up,
    run,
    subjects,
    written,
)

SETTINGS = [{"samples": 128, "sampling": sampling} for sampling in (0, 7)]


def test_counts_and_samplings():
    tasks = table2.EXPERIMENT.tasks(["a", "b"], CONDITIONS)
    assert len(tasks) == 2 * 12 * 10
    assert {task.setting["samples"] for task in tasks} == {2**e for e in range(7, 19)}
    assert len({(task.subjects, *task.setting.items()) for task in tasks}) == len(tasks)


@pytest.mark.parametrize("seed", [0, 4])
def test_plans_are_made_and_judged_on_samplings_of_their_own(seed):
    conditions = Conditions(judged=300, seed=seed)
    subject = subjects()["box"]
    rows = []
    for setting in SETTINGS:
        rows += table2.EXPERIMENT.measure([subject], setting, conditions).rows
    assert rows[0]["cost"] != rows[1]["cost"]
    fresh = subject.fresh_problem(conditions)
    for row, setting in zip(rows, SETTINGS, strict=True):
        planned = Conditions(128, seed=10 * seed + setting["sampling"])
        problem = subject.problem(planned)
        focus = k_view.solve(
            problem, Options(scope="assigned", grid=subject.rig.grid)
        ).focus_distances
        assert row["cost"] == pytest.approx(reference.cost(reference.table(problem), focus))
        assert row["fresh_cost"] == pytest.approx(reference.cost(reference.table(fresh), focus))


def test_same_for_any_threads():
    assert_same_for_any_threads(table2.EXPERIMENT, SETTINGS.__contains__)


def test_growth():
    assert table2.growth({n: 3 * n**1.5 for n in (1024, 2048, 8192)}) == pytest.approx(1.5)
    assert table2.growth({128: 7.0, 1024: 1.0, 4096: 16.0}) == pytest.approx(2)
    assert table2.growth({512: 1.0, 1024: 1.0}) is None


def test_what_is_written():
    deviations = {1024: 2.0, 2048: 1.0}
    rows = [
        {
            "subject": subject,
            "samples": samples,
            "sampling": sampling,
            "cost": level + sign * deviation / 2**0.5,  # of two, the deviation from their mean
            "fresh_cost": 1.1 * level * 1024 / samples + sign / 2**0.5,
        }
        for subject, level in (("a", 200), ("b", 300))
        for samples, deviation in deviations.items()
        for sampling, sign in enumerate((-1, 1))
    ]
    seconds = [
        {key: row[key] for key in ("subject", "samples", "sampling")}
        | {"pass_seconds": row["samples"] ** 2 / 2**22, "plan_seconds": 8.0}
        for row in rows
    ]
    text = written(table2.EXPERIMENT, made_up(rows, seconds))
    assert "for 2 subjects on 2 samplings each of 1,024 to 2,048 samples" in text
    assert "by σ = 2.0 (the paper: 1.1), and that of the same plans on the fresh samples" in text
    assert "differ, by 1.0. Over the paper's range the former σ is 1.5 times" in text
    assert "the latter 1.0 times" in text
    assert "cost 10.0 % more than on their own, and 100.0 % more than" in text
    assert "A pass over 2,048 samples takes 1 s (the paper: 17.9 s" in text
    assert "to the power 2.00; the paper's, in its range, to 1.78" in text
    assert "| 1,024 | 2.00 | 1.00 | 1.1 | 250.0 | 275.0 | 0.25 | 6.6 | 8 |" in text


def test_what_is_written_of_one_sampling():
    first = SETTINGS[:1].__contains__
    results = run(table2.EXPERIMENT, {"ball": subjects()["ball"]}, wanted=first)
    text = written(table2.EXPERIMENT, results)
    assert "for 1 subject on 1 sampling each of 128 samples" in text
    assert re.search(r"\| 128 \|  \|  \| 2.4 \| \d", text)
