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
import pandas as pd
import pytest
from matplotlib.figure import Figure

from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.experiments import fresh
from focus_planner.evaluation.measuring.methods import AVERAGE, TWO_VIEW_ALL
from testing import reference
from testing.evaluations import CONDITIONS, run, subjects
from testing.problems import with_threads


def small(setting):
    return setting["samples"] <= 512


def test_costs_are_those_of_the_samples_planned_on_and_of_others():
    by_name = subjects()
    rows = run(fresh.EXPERIMENT, by_name, wanted=small).rows
    assert set(rows["samples"]) == {256, 512}
    problem = by_name["box"].problem(Conditions(256, 400, 3))
    focus = TWO_VIEW_ALL.solve(problem, by_name["box"].rig).focus_distances
    others = by_name["box"].fresh_problem(CONDITIONS)
    assert others.sample_count == 400
    row = (
        rows[(rows["subject"] == "box") & (rows["samples"] == 256)]
        .set_index("method")
        .loc[TWO_VIEW_ALL.name]
    )
    assert row["cost"] == pytest.approx(reference.cost(reference.table(problem), focus))
    assert row["fresh_cost"] == pytest.approx(reference.cost(reference.table(others), focus))
    planned = {tuple(point) for point in problem.samples.points}
    assert planned.isdisjoint(tuple(point) for point in others.samples.points)


def test_plans_overfit_few_samples():
    conditions = Conditions(150, 4000, 3)
    rows = run(fresh.EXPERIMENT, subjects(), conditions, wanted=small).rows
    mean = rows.groupby("method")[["cost", "fresh_cost"]].mean()
    assert mean["fresh_cost"][TWO_VIEW_ALL.name] > mean["cost"][TWO_VIEW_ALL.name]
    assert mean["fresh_cost"][TWO_VIEW_ALL.name] < mean["fresh_cost"][AVERAGE.name]


def test_rows_are_the_same_for_any_number_of_threads():
    first, second = (
        with_threads(n, lambda: run(fresh.EXPERIMENT, subjects(), wanted=small).rows)
        for n in (1, 2)
    )
    pd.testing.assert_frame_equal(first, second, check_exact=True)


def made_up(counts=(512, 1024, 2048), names=("a", "b")):
    of_method = {"closest": 400.0, "average": 350.0, "EM": 300.0, "2-view": 290.0,
                 "2-view, all samples": 280.0}  # fmt: skip
    rows = [
        {"subject": name, "samples": n, "method": method, "cost": cost + i,
         "fresh_cost": (cost + i) * (1 + 16 / n)}
        for i, name in enumerate(names)
        for n in counts
        for method, cost in of_method.items()
    ]  # fmt: skip
    return Results(pd.DataFrame(rows), pd.DataFrame({"subject": names}), Conditions())


def test_tells_how_much_plans_overfit():
    text = fresh.EXPERIMENT.write_up(made_up()).text
    assert "planned on 512 to 2,048 samples of 2 subjects" in text
    assert "made on 1,024, about as many as the paper takes, it costs 1.6 % more" in text
    assert "goes from 289.3 to 282.7" in text
    assert "It takes 2,048 samples for 2-view on all samples to cost at most 1 % more" in text
    assert "| 512 | 300.5 | 309.9 | 290.5 | 299.6 | 280.5 | 289.3 | 413.0 | 361.5 |" in text


def test_tells_it_of_a_single_subject_and_of_too_few_samples():
    text = fresh.EXPERIMENT.write_up(made_up((256, 512), ("a",))).text
    assert "of 1 subject;" in text
    assert "paper" not in text
    assert "However many there were, it cost over 1 % more" in text


def test_draws_a_pair_of_lines_per_method():
    figure = Figure()
    fresh.EXPERIMENT.write_up(made_up()).draw(figure)
    (axes,) = figure.axes
    assert len(axes.lines) == 6
    np.testing.assert_allclose(axes.lines[1].get_ydata(), 300.5)
