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

from focus_planner import InputError, Rig
from focus_planner.core.solvers import Options, k_view
from focus_planner.evaluation.experiments import rings
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
    rows = run(rings.EXPERIMENT, by_name).rows
    assert len(rows) == 2 * 2 * 3
    for row in rows.itertuples():
        subject = by_name[row.subject]
        grid = None if row.pairs == "overlap" else subject.rig.grid
        problem = subject.problem(CONDITIONS)
        options = Options(scope=row.scope, grid=grid, rings=2 if row.pairs == "2-ring" else 1)
        focus = k_view.solve(problem, options).focus_distances
        assert row.cost == pytest.approx(reference.cost(reference.table(problem), focus))
        fresh = reference.table(subject.fresh_problem(CONDITIONS))
        assert row.fresh_cost == pytest.approx(reference.cost(fresh, focus))


def test_pairs_are_counted():
    # On 2 rows of 6 every camera has 3 neighbours, and 4 more are two edges apart.
    rows = run(rings.EXPERIMENT, subjects()).rows
    assert set(rows.loc[rows["pairs"] == "1-ring", "count"]) == {12 * 3 // 2}
    assert set(rows.loc[rows["pairs"] == "2-ring", "count"]) == {12 * 7 // 2}


def test_rigs_without_a_grid_are_refused():
    by_name = subjects()
    subject = by_name["ball"].with_rig(Rig(by_name["ball"].rig.cameras))
    with pytest.raises(InputError) as raised:
        rings.EXPERIMENT.measure([subject], {}, CONDITIONS)
    assert str(raised.value) == (
        "rings: expected rigs whose cameras stand on a grid, got a rig without a grid; give the"
        " rig's grid, or leave this experiment out"
    )


def test_same_for_any_threads():
    assert_same_for_any_threads(rings.EXPERIMENT)


def test_what_is_written():
    costs = {
        ("assigned", "1-ring"): 200.0,
        ("assigned", "2-ring"): 199.0,
        ("assigned", "overlap"): 202.0,
        ("all", "1-ring"): 190.0,
        ("all", "2-ring"): 190.0,
        ("all", "overlap"): 188.1,
    }
    counts = {"1-ring": 300, "2-ring": 800, "overlap": 400}
    rows = [
        {
            "subject": name,
            "scope": scope,
            "pairs": pairs,
            "count": counts[pairs],
            "cost": factor * cost,
            "fresh_cost": 250.0,
        }
        for name, factor in (("a", 1.0), ("b", 1.5))
        for (scope, pairs), cost in costs.items()
    ]
    taken = {f"{scope}_{pairs}_seconds": 0.5 for scope, pairs in costs}
    seconds = [{"subject": name, **taken} for name in ("a", "b")]
    text = written(rings.EXPERIMENT, made_up(rows, seconds))
    assert "(its edges; 300 pairs), within a 2-ring (up to two edges apart; 800)" in text
    assert "changes by −0.50 % from the 1-ring to the 2-ring (the paper: 0.4 %" in text
    assert "and by 1.00 % to pairs by overlap" in text
    assert "these changes are 0.00 % and −1.00 %" in text
    assert "| 2-view, 2-ring | 800 | 248.75 | −0.50 % | 250.00 | 0.5 |" in text


def test_what_is_written_of_one_subject():
    results = run(rings.EXPERIMENT, {"ball": subjects()["ball"]})
    text = written(rings.EXPERIMENT, results)
    assert "planned for 1 subject, on" in text
    assert np.isfinite(results.rows["cost"]).all()
