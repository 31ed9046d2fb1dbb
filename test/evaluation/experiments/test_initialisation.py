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
from focus_planner.evaluation.experiments import initialisation
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    made_up,
    run,
    subjects,
    written,
)
from testing.problems import random_problem

SOLVERS = {
    "EM": (em.solve, "all", False),
    "2-view": (k_view.solve, "assigned", True),
    "2-view, all samples": (k_view.solve, "all", False),
}


def test_starts():
    problem = random_problem(0, 40, 5, visible=np.arange(5) < np.full((40, 1), 4))
    found = {(name, draw): start for name, draw, start in initialisation.starts(problem, 3)}
    assert len(found) == 4 + 5
    weights = problem.samples.weights[problem.sample_index]
    for c in range(4):
        seen = problem.camera_index == c
        depth = problem.depth[seen]
        assert found["closest", 0][c] == depth.min()
        assert found["farthest", 0][c] == depth.max()
        assert found["average", 0][c] == pytest.approx(np.average(depth, weights=weights[seen]))
        assert found["hyperfocal", 0][c] == 10.0
        drawn = [found["random", draw][c] for draw in range(5)]
        assert depth.min() < min(drawn) < max(drawn) < depth.max()
        assert len(set(drawn)) == 5
    assert np.isnan([found[key][4] for key in found if key[0] != "hyperfocal"]).all()
    other = {(name, draw): start for name, draw, start in initialisation.starts(problem, 4)}
    assert (other["random", 0][:4] != found["random", 0][:4]).all()


def test_rows_are_the_solvers_results():
    by_name = subjects()
    rows = run(initialisation.EXPERIMENT, by_name).rows
    assert len(rows) == 2 * 9 * 3
    for subject in by_name.values():
        problem = subject.problem(CONDITIONS)
        for name, draw, start in initialisation.starts(problem, CONDITIONS.seed):
            for method, (solve, scope, on_grid) in SOLVERS.items():
                grid = subject.rig.grid if on_grid else None
                cost = solve(problem, Options(scope=scope, grid=grid, start=start)).cost
                here = (rows.subject == subject.name) & (rows.method == method)
                assert rows[here & (rows.start == name) & (rows.draw == draw)].cost.item() == cost


def test_same_for_any_threads():
    assert_same_for_any_threads(initialisation.EXPERIMENT)


def test_what_is_written():
    starts = ["closest", "average", "farthest", "hyperfocal", "random", "random"]
    costs = {
        "EM": [190, 210, 200, 200, 195, 205],
        "2-view": [198, 202, 200, 200, 199, 201],
        "2-view, all samples": [100] * 6,
    }
    rows = [
        {"subject": subject, "start": start, "draw": int(i == 5), "method": method, "cost": c * s}
        for subject, s in (("a", 1.0), ("b", 2.0))
        for method, values in costs.items()
        for i, (start, c) in enumerate(zip(starts, values, strict=True))
    ]
    text = written(initialisation.EXPERIMENT, made_up(rows))
    assert "planned for 2 subjects" in text
    assert "from 2 draws of random depths" in text
    assert "differs by 10.00 % for EM, by 2.00 % for 2-view, and by 0.00 % where" in text
    assert "| closest | −5.00 % | −1.00 % | 0.00 % |" in text
    assert "| random | 0.00 % | 0.00 % | 0.00 % |" in text
    assert "| best to worst | 10.00 % | 2.00 % | 0.00 % |" in text


def test_what_is_written_of_one_subject():
    results = run(initialisation.EXPERIMENT, {"box": subjects()["box"]})
    assert "planned for 1 subject, on" in written(initialisation.EXPERIMENT, results)
