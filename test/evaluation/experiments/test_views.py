# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import dataclasses

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.experiments import views
from focus_planner.evaluation.measuring.methods import TWO_VIEW_ALL
from testing import reference
from testing.evaluations import CONDITIONS, RIG, run, subjects
from testing.problems import with_threads


def test_areas_and_costs_are_those_of_fresh_samples():
    subject = subjects()["ball"]
    rows = run(views.EXPERIMENT, {"ball": subject}).rows.set_index("planned_for")
    problem = dataclasses.replace(subject.problem(CONDITIONS), views=2)
    focus = TWO_VIEW_ALL.solve(problem, RIG).focus_distances
    fresh = subject.fresh_problem(CONDITIONS)
    table = reference.table(fresh)
    sharp = [
        sum(seen.near <= focus[c] <= seen.far for c, seen in cameras.items())
        for cameras in table.seen
    ]
    area = fresh.samples.areas
    assert rows["surface_area"][2] == pytest.approx(area.sum())
    for q in (1, 2, 3, 5):
        expected = sum(area[p] for p, count in enumerate(sharp) if count >= q)
        assert rows[f"sharp_{q}"][2] == pytest.approx(expected)
        several = dataclasses.replace(table, views=q)
        assert rows[f"cost_{q}"][2] == pytest.approx(reference.cost(several, focus))
    assert rows["sharp_1"][2] > rows["sharp_2"][2] > 0


def test_a_plan_is_best_at_what_it_was_made_for_on_its_own_samples():
    costs = {}
    subject = subjects()["ball"]
    problem = subject.problem(CONDITIONS)
    for planned in (1, 3):
        focus = TWO_VIEW_ALL.solve(dataclasses.replace(problem, views=planned), RIG)
        for judged in (1, 3):
            judging = dataclasses.replace(problem, views=judged)
            costs[planned, judged] = judging.cost(focus.focus_distances)
    assert costs[1, 1] < costs[3, 1]
    assert costs[3, 3] < costs[1, 3]


def test_rows_are_the_same_for_any_number_of_threads():
    first, second = (
        with_threads(count, lambda: run(views.EXPERIMENT, subjects()).rows) for count in (1, 2)
    )
    pd.testing.assert_frame_equal(first, second, check_exact=True)


def made_up(names=("a", "b"), planned=(1, 2, 3, 5)):
    rows = [
        {"subject": name, "planned_for": q, "surface_area": 2.0}
        | {f"sharp_{k}": 1.8 - 0.2 * abs(k - q) + 0.1 * i for k in views.VIEWS}
        | {f"cost_{k}": 300.0 + 10 * k + abs(k - q) for k in views.VIEWS}
        for i, name in enumerate(names)
        for q in planned
    ]
    return Results(pd.DataFrame(rows), pd.DataFrame({"subject": names}), Conditions())


def test_tells_what_planning_for_several_views_brings():
    text = views.EXPERIMENT.write_up(made_up()).text
    assert "for 2 subjects on 1,000 samples of each" in text
    assert (
        "In at least 3 views 92.5 % of the surface is sharp if planned so, planned for one 72.5 %."
        in text
    )
    assert "92.5 % is sharp if planned for 1, and 52.5 % if planned for 5" in text
    assert "| q = 2 | 82.5 % | 92.5 % | 82.5 % | 62.5 % | 311.0 | 320.0 | 331.0 | 353.0 |" in text


def test_tells_it_of_one_subject_where_plans_are_missing():
    text = views.EXPERIMENT.write_up(made_up(("a",), (2, 3))).text
    assert "for 1 subject on" in text
    assert "In at least 2 views 90.0 % of the surface is sharp if planned so." in text


def test_draws_a_line_per_plan():
    figure = Figure()
    views.EXPERIMENT.write_up(made_up()).draw(figure)
    (axes,) = figure.axes
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [92.5, 82.5, 72.5, 52.5])
