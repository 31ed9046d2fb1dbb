# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from focus_planner import cylinder_rig, dome_rig
from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.experiments import cameras
from focus_planner.evaluation.measuring.cylinders import aspect_ratio, cylinder_like
from focus_planner.evaluation.measuring.methods import EM
from testing import reference
from testing.evaluations import CONDITIONS, RIG, run, subjects
from testing.problems import with_threads


def few(setting):
    return setting["cameras"] == 60 and setting["rows"] in {4, 5}


@pytest.mark.parametrize("count", [60, 120, 240])
def test_layouts_are_all_grids_of_sensible_ratios(count):
    found = {each["rows"] for each in cameras.layouts(count)}
    assert all(each["rows"] * each["columns"] == count for each in cameras.layouts(count))
    for rows in range(2, count + 1):
        whole = count % rows == 0
        sensible = whole and 0.2 <= aspect_ratio(rows, count // rows) <= 7
        assert (rows in found) == sensible


@pytest.mark.parametrize("rig", [dome_rig(), cylinder_rig(1, 12)], ids=["dome", "one row"])
def test_other_rigs_are_refused(rig):
    with pytest.raises(InputError, match="rig: expected a cylinder of equal cameras"):
        run(cameras.EXPERIMENT, subjects(rig), wanted=few)


def test_costs_are_those_before_the_other_cylinder():
    by_name = {"ball": subjects()["ball"]}
    rows = run(cameras.EXPERIMENT, by_name, wanted=few).rows
    rig, ratio = cylinder_like(RIG, 4, 15)
    subject = by_name["ball"].with_rig(rig)
    solution = EM.solve(subject.problem(CONDITIONS), rig)
    own = rows[(rows["rows"] == 4) & (rows["method"] == "EM")].iloc[0]
    focus = solution.focus_distances
    problem, fresh = subject.problem(CONDITIONS), subject.fresh_problem(CONDITIONS)
    assert len(focus) == 60
    assert own["aspect_ratio"] == ratio
    assert own["cost"] == pytest.approx(reference.cost(reference.table(problem), focus))
    assert own["fresh_cost"] == pytest.approx(reference.cost(reference.table(fresh), focus))


def test_rows_are_the_same_for_any_number_of_threads():
    first, second = (
        with_threads(n, lambda: run(cameras.EXPERIMENT, subjects(), wanted=few).rows)
        for n in (1, 2)
    )
    pd.testing.assert_frame_equal(first, second, check_exact=True)


def test_finds_the_minimum_of_a_parabola_in_the_logarithm():
    ratios = np.array([0.2, 0.5, 0.8, 1.3, 2.0, 4.0, 6.0])
    costs = 300 + 40 * (np.log(ratios) - np.log(1.4)) ** 2
    assert cameras.fitted_minimum(ratios, costs) == pytest.approx(1.4)
    assert cameras.fitted_minimum(ratios[-3:], costs[-3:]) != pytest.approx(1.4)


@pytest.mark.parametrize(
    ("ratios", "costs"),
    [([1, 2], [3.0, 3.0]), ([1, 2, 4], [3.0, 2.0, 0.5]), ([1, 2, 4], [3.0, 3.5, 3.0])],
    ids=["two points", "falling", "a maximum"],
)
def test_finds_none_where_there_is_none(ratios, costs):
    assert math.isnan(cameras.fitted_minimum(ratios, costs))


def made_up(counts=(60, 120, 240), names=("a", "b"), best=1.2, two_view=-5.0):
    rows = [
        {"subject": name, **setting, "method": method,
         "aspect_ratio": (ratio := aspect_ratio(setting["rows"], setting["columns"])),
         "cost": (cost := 600 - count + 50 * math.log(ratio / best) ** 2 + more + i),
         "fresh_cost": cost + 20}
        for i, name in enumerate(names)
        for count in counts
        for setting in cameras.layouts(count)
        for method, more in (("EM", 0.0), ("2-view", two_view))
    ]  # fmt: skip
    return Results(pd.DataFrame(rows), pd.DataFrame({"subject": names}), Conditions())


def test_tells_where_the_minima_are():
    text = cameras.EXPERIMENT.write_up(made_up()).text
    assert "planned for 2 subjects before cylinders of 60, 120 and 240 cameras" in text
    assert "minima at 1.20, on average at 1.20, or 0.83 taken as columns over rows" in text
    # Between the grids of 60 and of 240 cameras, on straight lines.
    assert "At 3:2 it costs 0.4 to 0.7 % more than at best." in text
    assert "2-view is uniformly lower than EM" in text
    assert "More cameras cost uniformly less" in text
    assert text.count("\n|") == 8
    assert "| 240 | EM | 8 × 30 | 1.46 | 362.4 | 382.4 | 1.20 |" in text


def test_tells_where_we_differ():
    text = cameras.EXPERIMENT.write_up(made_up(best=30.0, two_view=0.0)).text
    assert "No curve has its minimum within these ratios" in text
    assert "2-view is not uniformly lower than EM" in text
    results = made_up((60,), ("a",))
    text = cameras.EXPERIMENT.write_up(results).text
    assert "for 1 subject before cylinders of 60 cameras" in text


def test_an_explanation_is_offered_only_where_we_differ():
    told = [cameras.EXPERIMENT.write_up(made_up(best=ratio)).text for ratio in (0.7, 1.4)]
    assert ["that may be why" in text for text in told] == [True, False]


def test_fewer_cameras_that_are_better_are_told():
    results = made_up((60, 120))
    results.rows.loc[(results.rows["cameras"] == 60) & (results.rows["rows"] == 5), "cost"] = 1.0
    assert "More cameras cost not uniformly less" in cameras.EXPERIMENT.write_up(results).text


def test_draws_as_the_paper_does():
    figure = Figure()
    cameras.EXPERIMENT.write_up(made_up()).draw(figure)
    (axes,) = figure.axes
    labels = axes.get_legend_handles_labels()[1]
    assert labels == [f"{n} cameras, {m}" for n in (60, 120, 240) for m in ("2-view", "EM")]
    assert [line.get_marker() for line in axes.lines[:2]] == ["D", "o"]
    assert (np.diff(axes.lines[0].get_xdata()) > 0).all()
