# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import InputError, dome_rig
from focus_planner.core import kernels
from focus_planner.evaluation.experiments.removal import EXPERIMENT, missed
from focus_planner.evaluation.measuring.methods import TWO_VIEW_ALL
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    ellipsoids,
    made_up,
    run,
    written,
)
from testing.problems import random_problem


def without(problem, focus, camera):
    """The cost and the area in focus when a camera takes no picture."""
    left = np.where(np.arange(problem.camera_count) == camera, kernels.UNTAKEN, focus)
    costs, best = problem.evaluate(left)
    weights, areas = problem.samples.weights, problem.samples.areas
    cost = 1000 * (weights * costs).sum() / weights.sum()
    return cost, (areas * problem.in_focus(left, best)).sum()


@pytest.mark.parametrize("seed", range(4))
def test_cameras_are_missed_by_as_much_as_their_failure_costs(seed):
    problem = random_problem(seed)
    focus = np.random.default_rng(seed).uniform(0.4, 1.5, problem.camera_count)
    dearer, blurred = missed(problem, focus)
    cost, held = without(problem, focus, -1)
    for c in range(problem.camera_count):
        cost_left, held_left = without(problem, focus, c)
        assert dearer[c] == pytest.approx(cost_left - cost, abs=1e-9)
        assert blurred[c] == pytest.approx(held - held_left, abs=1e-12)


def test_the_least_missed_camera_goes_first():
    (subject,) = ellipsoids(count=1).values()
    rows = run(
        EXPERIMENT, {"body_0": subject}, wanted=lambda s: s["removed"] == "least missed"
    ).rows
    problem, fresh = subject.problem(CONDITIONS), subject.fresh_problem(CONDITIONS)
    focus = TWO_VIEW_ALL.solve(problem, subject.rig).focus_distances
    taken = focus.copy()
    for _ in range(2):  # an eighth of twelve cameras, rounded
        costs = [
            np.inf if taken[c] == kernels.UNTAKEN else without(problem, taken, c)[0]
            for c in range(len(focus))
        ]
        taken[np.argmin(costs)] = kernels.UNTAKEN
    row = rows[(rows.share == 0.875) & (rows.plan == "not replanned")].iloc[0]
    assert row.cameras == 10
    assert row.fresh_cost == pytest.approx(fresh.cost(taken))
    planned = rows[rows.plan == "replanned"]
    assert planned.cameras.tolist() == [12, 10, 9, 8, 6, 4, 3]
    assert planned.fresh_cost.iloc[0] == pytest.approx(fresh.cost(focus))


def test_failures_of_each_camera_are_measured_and_written():
    results = run(EXPERIMENT, ellipsoids())
    alone = results.rows[results.rows.removed == "each alone"]
    assert (alone.groupby("subject").size() == 1 + 12 + 12).all()
    unnoticed = alone[(alone.plan == "not replanned") & (alone.camera != "")]
    assert sorted(set(zip(unnoticed["row"], unnoticed["column"], strict=True))) == [
        (row, column) for row in range(2) for column in range(6)
    ]
    text = written(EXPERIMENT, results)
    assert "From the rigs of 2 subjects" in text
    assert "With 6 of 12 cameras" in text
    assert "Of the 2 rows of the grid" in text


def test_rigs_without_a_grid_are_taken_as_well():
    rig = dome_rig(8, radius=0.7)
    assert rig.grid is None
    results = run(EXPERIMENT, ellipsoids(rig, count=1), replace(CONDITIONS, samples=60))
    assert (results.rows["row"] == -1).all()
    text = written(EXPERIMENT, results)
    assert "From the rigs of 1 subject " in text
    assert "rows of the grid" not in text


def test_rows_do_not_depend_on_threads():
    assert_same_for_any_threads(EXPERIMENT)


def test_a_rig_of_few_cameras_is_refused():
    (subject,) = ellipsoids(count=1).values()
    few = replace(subject.rig, cameras=subject.rig.cameras[:3], grid=None)
    with pytest.raises(InputError, match=r"rig of body_0.*at least 4 cameras.*3.*leave out"):
        EXPERIMENT.measure([subject.with_rig(few)], {"removed": "at random"}, CONDITIONS)


def rows():
    shares = (1.0, 0.875, 0.75, 0.625, 0.5, 0.375, 0.25)
    plans = {"replanned": 0.0, "not replanned": 0.1, "autofocus": 0.4}
    blank = {"subject": "a", "camera": "", "row": -1, "column": -1}
    for removed, worse in (("least missed", 0.0), ("at random", 0.05)):
        for share in shares:
            for plan, loss in plans.items():
                held = 0.9 - loss - (1 - share) * 0.2 - worse * (share < 1)
                more = {"fresh_cost": 1000 * (1 - held), "in_focus": held}
                place = {"removed": removed, "plan": plan, "share": share}
                yield blank | place | {"cameras": round(8 * share)} | more
    alone = blank | {"removed": "each alone", "share": 0.0, "cameras": 7}
    yield alone | {"plan": "not replanned", "fresh_cost": 100.0, "in_focus": 0.9}
    for c in range(8):
        camera = {"camera": f"cam_{c}", "row": c // 4, "column": c % 4}
        costs = {"fresh_cost": 100.0 + c, "in_focus": 0.9 - 0.01 * c}
        yield alone | camera | costs | {"plan": "not replanned"}
        yield alone | camera | costs | {"plan": "replanned", "fresh_cost": 100.0 + c / 2}


def test_what_is_written_are_the_means():
    text = written(EXPERIMENT, made_up(rows()))
    assert "With 4 of 8 cameras 80.0 % of the surface is in focus in place of 90.0 %" in text
    assert "with as many drawn at random 75.0 % and 250.0" in text
    assert "2 planned cameras hold 75.0 %, all of them on autofocus 50.0 %." in text
    assert "raises the cost by 3.50 on average and blurs 3.50 % of the surface" in text
    assert "at worst by 7.0 and 7.00 % (cam_7, a)" in text
    assert "failures cost 3.50 unnoticed and 1.75 once the rest" in text
    assert "cameras of row 2 are missed most (5.50 each), those of row 1 least (1.50)" in text
