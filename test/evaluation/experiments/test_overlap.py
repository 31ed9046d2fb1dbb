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

from focus_planner.core.solvers.solution import cells_at, distances_of_cells
from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.experiments import overlap
from focus_planner.evaluation.measuring.methods import EM
from testing import reference
from testing.evaluations import CONDITIONS, run, subjects
from testing.problems import random_problem, with_threads


def test_overlap_is_what_both_see_of_what_either_sees():
    problem = random_problem(1, 20, 5, share=0.3)
    problem.focus_near[problem.camera_index == 4] = np.inf  # it can focus on nothing
    pairs, shares = overlap.overlaps(problem)
    seen = [set(problem.sample_index[problem.camera_index == c].tolist()) for c in range(4)]
    expected = {
        (a, b): len(seen[a] & seen[b]) / len(seen[a] | seen[b])
        for a in range(4)
        for b in range(a + 1, 4)
        if seen[a] & seen[b]
    }
    assert {tuple(p) for p in pairs.tolist()} == set(expected)
    for pair, share in zip(pairs.tolist(), shares, strict=True):
        assert share == pytest.approx(expected[tuple(pair)])


def test_gains_are_those_of_pairs_that_move_alone_from_the_plan_of_em():
    by_name = {"box": subjects()["box"]}
    rows = run(overlap.EXPERIMENT, by_name).rows
    problem = by_name["box"].problem(CONDITIONS)
    focus = EM.solve(problem, by_name["box"].rig).focus_distances
    focus = distances_of_cells(problem, cells_at(problem, focus))
    index = {name: c for c, name in enumerate(problem.names)}
    table = reference.table(problem)
    before = reference.cost(table, focus)
    assert len(rows) == len(overlap.overlaps(problem)[0])
    assert (rows["gain"] >= rows["gain_assigned"] - 1e-9).all()
    some = rows.sort_values("gain").iloc[[0, len(rows) // 2, -1]]
    assert some["gain"].iloc[-1] > 0.1
    for _, row in some.iterrows():
        members = [index[row["camera_a"]], index[row["camera_b"]]]
        best, _ = reference.best_step(table, focus, members, "all")
        assert row["gain"] == pytest.approx(before - best, abs=1e-8)


def test_draws_no_more_pairs_than_it_says(monkeypatch):
    by_name = subjects()
    every = run(overlap.EXPERIMENT, by_name).rows
    monkeypatch.setattr(overlap, "_PAIRS", 7)
    some = run(overlap.EXPERIMENT, by_name).rows
    assert (some.groupby("subject").size() == 7).all()
    assert len(some.merge(every)) == 14


def test_rows_are_the_same_for_any_number_of_threads():
    first, second = (
        with_threads(count, lambda: run(overlap.EXPERIMENT, subjects()).rows) for count in (1, 2)
    )
    pd.testing.assert_frame_equal(first, second, check_exact=True)


def made_up(names=("a", "b"), gains=(0.0, 0.0, 0.2, 0.4)):
    rows = [
        {"subject": name, "camera_a": "x", "camera_b": "y", "overlap": share, "gain": 0.1,
         "gain_assigned": gain}
        for name in names
        for share, gain in zip((0.05, 0.1, 0.3, 0.9), gains, strict=True)
    ]  # fmt: skip
    return Results(pd.DataFrame(rows), pd.DataFrame({"subject": names}), Conditions())


def test_tells_the_correlation():
    text = overlap.EXPERIMENT.write_up(made_up()).text
    assert "8 pairs of cameras" in text
    assert "before 2 subjects, drawn" in text
    assert "above 50 % 100.0 % gain, of those with up to 10 % 0.0 %." in text
    # Ranks 1, 2, 3, 4 beside 1.5, 1.5, 3, 4.
    rho = np.corrcoef([1, 2, 3, 4], [1.5, 1.5, 3, 4])[0, 1]
    assert f"50.0 % of the pairs gain, and Spearman's ρ is {rho:.2f}." in text
    assert "100.0 % gain, and a correlation cannot be told: it may" in text
    assert "| 0–10 % | 4 | 0.0000 | 0.0 % | 0.1000 | 100.0 % |" in text
    assert "| 50–100 % | 2 | 0.4000 | 100.0 % | 0.1000 | 100.0 % |" in text
    assert "| 10–25 %" not in text


def test_a_negative_correlation_has_a_minus():
    text = overlap.EXPERIMENT.write_up(made_up(("a",), (0.4, 0.3, 0.2, 0.1))).text
    assert "before 1 subject," in text
    assert "ρ is −1.00" in text


def test_says_nothing_of_overlaps_that_there_are_none_of():
    results = made_up(("a",))
    results.rows["overlap"] = [0.2, 0.3, 0.4, 0.45]
    assert "Of those with an overlap" not in overlap.EXPERIMENT.write_up(results).text


def test_draws_a_dot_per_pair_and_step():
    figure = Figure()
    overlap.EXPERIMENT.write_up(made_up()).draw(figure)
    left, right = figure.axes
    np.testing.assert_allclose(left.lines[0].get_ydata(), [0, 0, 0.2, 0.4] * 2)
    np.testing.assert_allclose(right.lines[0].get_xdata(), [5, 10, 30, 90] * 2)
