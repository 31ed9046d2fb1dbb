# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner.core.solvers import Options, em, k_view
from focus_planner.evaluation.experiments import convergence
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    made_up,
    run,
    subjects,
    written,
)


def test_costs_fall_from_pass_to_pass_to_what_the_solvers_find():
    by_name = subjects()
    rows = run(convergence.EXPERIMENT, by_name).rows
    for (name, method), found in rows.groupby(["subject", "method"]):
        assert list(found["passes"]) == list(range(len(found)))
        assert (np.diff(found["cost"]) <= 0).all()
        problem, grid = by_name[name].problem(CONDITIONS), by_name[name].rig.grid
        planned = {
            "EM": em.solve(problem),
            "2-view": k_view.solve(problem, Options(scope="assigned", grid=grid)),
            "2-view, all samples": k_view.solve(problem),
        }[method]
        # Each camera is centred at the end, which may find a sample a little more.
        assert planned.cost <= found["cost"].iloc[-1] + 1e-6
        assert planned.cost == pytest.approx(found["cost"].iloc[-1], rel=0.01)


def test_same_for_any_threads():
    assert_same_for_any_threads(convergence.EXPERIMENT)


def test_what_is_written():
    costs = {
        ("a", "EM"): [300, 202, 200, 200],
        ("b", "EM"): [600, 404, 402, 400, 400],
        ("a", "2-view"): [110, 100, 100],
        ("b", "2-view"): [110, 100, 100],
        ("a", "2-view, all samples"): [100, 100],
        ("b", "2-view, all samples"): [101, 100, 100],
    }
    rows = [
        {"subject": subject, "method": method, "passes": passes, "cost": float(cost)}
        for (subject, method), values in costs.items()
        for passes, cost in enumerate(values)
    ]
    text = written(convergence.EXPERIMENT, made_up(rows))
    assert "The cost after every pass for 2 subjects, on 150 samples of each" in text
    assert "EM is at its end after 2 to 3 passes, and 1.00 % above it after the first" in text
    assert "2-view is at its end after 1 pass, and 0.00 % above it after the first" in text
    assert "2-view, all samples is at its end after 0 to 1 passes" in text
    assert "| 0 | 50.000 % | 10.000 % | 0.500 % |" in text
    assert text.rstrip().endswith("| 2 | 0.250 % | 0.000 % | 0.000 % |")


def test_what_is_written_of_one_subject():
    results = run(convergence.EXPERIMENT, {"ball": subjects()["ball"]})
    assert "pass for 1 subject, on" in written(convergence.EXPERIMENT, results)
