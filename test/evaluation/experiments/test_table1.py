# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Table 1: its rows against slow oracles, and what is written of them."""

import numpy as np
import pytest

from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.evaluation.experiments import table1
from focus_planner.evaluation.measuring.methods import CLOSEST, EM, TWO_VIEW_ALL
from testing import reference
from testing.evaluations import (
    CONDITIONS,
    RIG,
    assert_same_for_any_threads,
    made_up,
    run,
    subjects,
    written,
)

NAMES = ("closest", "average", "EM", "2-view", "2-view, all samples", "w₃ = 0")


def test_costs_and_areas_are_those_of_the_plans():
    subject = subjects()["ball"]
    rows = run(table1.EXPERIMENT, {"ball": subject}).rows.set_index("method")
    assert tuple(rows.index) == NAMES
    problem, fresh = subject.problem(CONDITIONS), subject.fresh_problem(CONDITIONS)
    for method in (CLOSEST, EM, TWO_VIEW_ALL):
        focus = method.solve(problem, RIG).focus_distances
        row = rows.loc[method.name]
        assert row.cost == pytest.approx(reference.cost(reference.table(problem), focus))
        focus = fill_missing_distances(fresh, focus)
        costs, best = fresh.evaluate(focus)
        held = fresh.in_focus(focus, best)
        assert row.fresh_cost == pytest.approx(1000 * costs.mean())
        assert row.in_focus_area == pytest.approx(fresh.samples.areas[held].sum())


def test_the_bound_is_what_all_in_focus_would_cost():
    subject = subjects()["box"]
    problem = subject.problem(CONDITIONS)
    least = [1.0] * problem.sample_count
    for sample, base in zip(problem.sample_index, problem.base_cost, strict=True):
        least[sample] = min(least[sample], base)
    assert table1.sharp_everywhere(problem) == pytest.approx(1000 * np.mean(least))
    rows = run(table1.EXPERIMENT, {"box": subject}).rows.set_index("method")
    assert rows.cost["w₃ = 0"] == pytest.approx(1000 * np.mean(least))
    assert rows.cost["w₃ = 0"] <= rows.cost.min()
    assert rows.in_focus_area["w₃ = 0"] >= rows.in_focus_area.max()


def results(two_view=(190.0, 250.0), names=("a", "b")):
    costs = ((390.0, 410.0), (340.0, 360.0), (240.0, 260.0), two_view, (200, 210), (180, 190))
    areas = (1.0, 1.2, 1.5, 1.55, 1.56, 1.7)
    return made_up(
        {
            "subject": name,
            "method": method,
            "cost": cost[number],
            "fresh_cost": cost[number] + 10,
            "in_focus_area": area,
        }
        for number, name in enumerate(names)
        for method, cost, area in zip(NAMES, costs, areas, strict=True)
    )


def test_what_is_written_are_means_beside_the_papers():
    text = written(table1.EXPERIMENT, results())
    assert "Every method planned for 2 subjects, on 150 samples of each" in text
    assert "2-view costs 12.0 % less than EM (the paper: 5 % less)" in text
    assert "and 37.1 % less than the better baseline" in text
    assert (
        "EM holds 3,000 cm² more in focus than the better baseline, 2-view 3,500 cm² more" in text
    )
    assert "| 2-view | 220.0 | 255.2 | 30.0 | 14.5 | 13.6 % | 0.0 % | 230.0 | 1.550 |" in text
    assert "| w₃ = 0 | 185.0 | 232.15 | 5.0 |  |  |  | 195.0 | 1.700 |" in text


def test_a_method_that_costs_more_is_said_to():
    text = written(table1.EXPERIMENT, results(two_view=(255.0, 265.0), names=("a",)))
    assert "Every method planned for 1 subject," in text
    assert "2-view costs 6.2 % more than EM" in text


def test_rows_are_the_same_for_any_number_of_threads():
    assert_same_for_any_threads(table1.EXPERIMENT)
