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

from focus_planner.core.solvers import Options, k_view
from focus_planner.evaluation.experiments import k
from testing import reference
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    made_up,
    run,
    subjects,
    written,
)


def test_rows_are_the_solvers_results():
    by_name = subjects()
    rows = run(k.EXPERIMENT, by_name).rows
    assert len(rows) == 2 * 2 * 2
    for row in rows.itertuples():
        subject = by_name[row.subject]
        grid = subject.rig.grid if row.scope == "assigned" else None
        problem = subject.problem(CONDITIONS)
        focus = k_view.solve(problem, Options(row.k, row.scope, grid)).focus_distances
        assert row.cost == pytest.approx(reference.cost(reference.table(problem), focus))
        fresh = reference.table(subject.fresh_problem(CONDITIONS))
        assert row.fresh_cost == pytest.approx(reference.cost(fresh, focus))


def test_same_for_any_threads():
    assert_same_for_any_threads(k.EXPERIMENT)


def test_what_is_written():
    costs = {("assigned", 2): 200.0, ("assigned", 3): 196.0, ("all", 2): 180, ("all", 3): 179.1}
    rows = [
        {"subject": name, "scope": scope, "k": count, "passes": 3, "cost": cost, "fresh_cost": 250}
        for name in ("a", "b")
        for (scope, count), cost in costs.items()
    ]
    times = {
        "assigned_pass_2_seconds": 0.01,
        "assigned_pass_3_seconds": 0.07,
        "all_pass_2_seconds": 0.02,
        "all_pass_3_seconds": 0.1,
    }
    stages = {key.replace("pass", "stage"): 4 * value for key, value in times.items()}
    seconds = [{"subject": name, **times, **stages, "task_seconds": 1} for name in ("a", "b")]
    text = written(k.EXPERIMENT, made_up(rows, seconds))
    assert "planned for 2 subjects, on 150 samples of each" in text
    assert "triples cost 2.00 % less than pairs, and a pass of them takes 7 times" in text
    assert "triples cost 0.50 % less than pairs, and a pass of them takes 5 times" in text
    assert "| 3-view | 196.00 | −2.00 % | 250.00 | 3.0 | 70.0 | 280.0 |" in text
    assert "| 2-view, all samples | 180.00 |  | 250.00 | 3.0 | 20.0 | 80.0 |" in text


def test_what_is_written_of_one_subject():
    results = run(k.EXPERIMENT, {"ball": subjects()["ball"]})
    assert "planned for 1 subject, on" in written(k.EXPERIMENT, results)
