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
from focus_planner.evaluation.experiments import optimum
from focus_planner.evaluation.measuring.methods import EM
from focus_planner.evaluation.subject import judge
from testing import reference
from testing.evaluations import CONDITIONS, run, subjects
from testing.problems import with_threads


def test_no_method_is_below_the_optimum_which_highs_confirms():
    by_name = subjects()
    rows = run(optimum.EXPERIMENT, by_name).rows
    assert rows["proven"].all()
    for name, subject in by_name.items():
        problem = subject.problem(CONDITIONS)
        best, _ = reference.optimum(reference.table(problem))
        own = rows[rows["subject"] == name].set_index("method")
        assert (own["cost"] >= best - 1e-9).all()
        assert (own["lower_bound"] <= best + 1e-9).all()
        assert own["cost"]["optimal"] <= best * (1 + 1.01e-4)
        assert own["cost"]["closest"] > 1.02 * best
        em = EM.solve(problem, subject.rig)
        assert own["cost"]["EM"] == em.cost
        fresh = judge(subject.fresh_problem(CONDITIONS), em.focus_distances)
        assert own["fresh_cost"]["EM"] == fresh.cost.value


def test_gives_up_after_so_many_steps_wherever_it_runs():
    problem = subjects()["box"].problem(CONDITIONS)
    stopped = optimum.prove(problem, 2)
    assert not stopped.converged
    assert stopped.lower_bound < optimum.prove(problem).lower_bound


def test_rows_are_the_same_for_any_number_of_threads():
    first, second = (
        with_threads(count, lambda: run(optimum.EXPERIMENT, subjects()).rows) for count in (1, 2)
    )
    pd.testing.assert_frame_equal(first, second, check_exact=True)


def made_up(*, proven=(True, True)):
    names = [f"s{i}" for i in range(len(proven))]
    costs = {"EM": 102.0, "2-view": 101.0, "2-view, all samples": 100.5, "optimal": 100.01}
    rows = [
        {"subject": name, "method": method, "cost": cost + 2 * i * (method == "EM"),
         "lower_bound": 100.0 if ok else 99.0, "proven": ok, "fresh_cost": cost + 9}
        for i, (name, ok) in enumerate(zip(names, proven, strict=True))
        for method, cost in costs.items()
    ]  # fmt: skip
    seconds = [{"subject": name} | {f"{m}_seconds": 0.5 for m in costs} for name in names]
    return Results(pd.DataFrame(rows), pd.DataFrame(seconds), Conditions())


def test_tells_means_and_the_worst():
    text = optimum.EXPERIMENT.write_up(made_up()).text
    assert "for 2 subjects, and proven to cost at most 0.01 % more than any other for all" in text
    assert "EM costs 3.00 %, 2-view 1.00 %, 2-view on all samples 0.50 %" in text
    assert "the best plan costs 109.0, 2-view on all samples 109.5" in text
    assert "| EM | 103.00 | 3.000 % | 4.000 % | 111.00 | 0.50 |" in text
    assert "others" not in text.replace("than any other", "")


@pytest.mark.parametrize(
    ("proven", "told"),
    [
        ((True,), "for 1 subject, and proven to cost at most 0.01 % more than any other for it."),
        ((True, False), "for 1 of them. For the others a gap of at most 1.02 % is left."),
        ((False,), "for none of them. A gap of at most 1.02 % is left."),
    ],
)
def test_tells_what_was_not_proven(proven, told):
    assert told in optimum.EXPERIMENT.write_up(made_up(proven=proven)).text


def test_draws_every_method_where_it_stands():
    figure = Figure()
    optimum.EXPERIMENT.write_up(made_up()).draw(figure)
    (axes,) = figure.axes
    assert axes.get_yticklabels()[0].get_text() == "EM"
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [2, 4])
