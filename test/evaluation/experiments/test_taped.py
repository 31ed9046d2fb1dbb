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

from focus_planner import InputError, plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.evaluation.experiments.taped import EXPERIMENT
from testing.evaluations import (
    CONDITIONS,
    RIG,
    assert_same_for_any_threads,
    ellipsoids,
    made_up,
    run,
    written,
)


@pytest.mark.parametrize(
    ("count", "judged", "folds"), [(2, 1, 2), (3, 1, 3), (5, 1, 4), (6, 2, 3), (12, 4, 3)]
)
def test_folds_judge_on_subjects_that_no_plan_was_made_for(count, judged, folds):
    names = [f"subject_{number}" for number in range(count)]
    tasks = EXPERIMENT.tasks(names, CONDITIONS)
    assert len(tasks) == folds
    unseen = []
    for task in tasks:
        assert task.setting["judged"] == judged
        assert len(set(task.subjects)) == len(task.subjects) == count
        unseen += task.subjects[:judged]
    assert len(set(unseen)) == len(unseen) == folds * judged


def test_tasks_take_no_more_subjects_of_four_hundred():
    tasks = EXPERIMENT.tasks([str(number) for number in range(400)], CONDITIONS)
    assert [len(set(task.subjects)) for task in tasks] == [16] * 4
    assert len({name for task in tasks for name in task.subjects[:4]}) == 16
    assert tasks == EXPERIMENT.tasks([str(number) for number in range(400)], CONDITIONS)


def test_a_plan_for_several_is_what_plan_focus_makes_for_them():
    subjects = ellipsoids(count=4)
    results = run(EXPERIMENT, subjects, wanted=lambda setting: setting["fold"] == 0)
    task = EXPERIMENT.tasks(list(subjects), CONDITIONS)[0]
    first, *others = (subjects[name] for name in task.subjects)
    request = PlanRequest(
        method="k_view",
        samples=CONDITIONS.samples,
        seed=CONDITIONS.seed,
        fresh_samples=2,
        bound="none",
    )
    plan = plan_focus([each.scene for each in others[:2]], first.rig, request)
    fresh = first.fresh_problem(CONDITIONS)
    costs, best = fresh.evaluate(plan.focus_distances)
    rows = results.rows
    row = rows[(rows.plan == "one plan") & (rows.planned_on == 2)].iloc[0]
    assert row.unseen == first.name
    assert row.fresh_cost == pytest.approx(1000 * costs.mean())
    assert row.in_focus == pytest.approx(fresh.in_focus(plan.focus_distances, best).mean())


def test_of_presets_the_best_counts():
    subjects = ellipsoids(count=6)
    results = run(EXPERIMENT, subjects)
    rows = results.rows.set_index(["plan", "planned_on", "unseen"]).fresh_cost.sort_index()
    assert set(results.rows.plan) == {
        "autofocus", "a plan of its own", "one plan", "best of 2", "best of 3",
    }  # fmt: skip
    assert rows.index.is_unique
    assert (rows["a plan of its own", 0] <= rows["autofocus", 0]).all()
    text = written(EXPERIMENT, results)
    assert "judged on 6 subjects that they were not made for (3 folds" in text
    assert "with 2 and" in text


def test_two_subjects_are_enough():
    results = run(EXPERIMENT, ellipsoids())
    assert set(results.rows.planned_on) == {0, 1}
    text = written(EXPERIMENT, results)
    assert "One plan made for 1 subject holds" in text
    assert "(2 folds" in text


def test_rows_do_not_depend_on_threads():
    assert_same_for_any_threads(EXPERIMENT)


def test_a_single_subject_is_refused():
    with pytest.raises(InputError, match=r"subjects: expected at least 2.*got 1; give more"):
        EXPERIMENT.tasks(["alone"], CONDITIONS)


def test_subjects_before_different_rigs_are_refused():
    one, other = ellipsoids().values()
    rig = RIG
    other = other.with_rig(replace(rig, cameras=rig.cameras[:6], grid=None))
    with pytest.raises(InputError, match=r"rigs.*the same one.*body_1 before another than body_0"):
        EXPERIMENT.measure([one, other], {"fold": 0, "judged": 1}, CONDITIONS)


def rows(sizes, presets=()):
    held = {("autofocus", 0): 0.5, ("a plan of its own", 0): 0.9}
    held |= {("one plan", size): 0.6 + 0.01 * size for size in sizes}
    held |= {(f"best of {number}", sizes[-1]): 0.8 + 0.01 * number for number in presets}
    for (plan, planned_on), share in held.items():
        for number in range(2):
            yield {
                "subject": "all",
                "fold": 0,
                "judged": 2,
                "plan": plan,
                "planned_on": planned_on,
                "unseen": f"subject_{number}",
                "fresh_cost": 1000 * (1 - share),
                "in_focus": share + np.array([-0.01, 0.01])[number],
            }


def test_what_is_written_are_the_means():
    text = written(EXPERIMENT, made_up(rows((1, 2, 4), (2, 3))))
    assert "for up to 4 subjects together" in text
    assert "judged on 2 subjects that they were not made for (1 fold," in text
    assert (
        "One plan made for 4 subjects holds 64.0 % of an unseen subject in focus, autofocus on"
        " each 50.0 %, a plan of its own 90.0 %; costs are 360.0, 500.0 and 100.0." in text
    )
    assert "Made for a single subject, a plan holds 61.0 % of others." in text
    assert "it is 82.0 % with 2 and 83.0 % with 3." in text
    assert "| best of 3 | 4 | 83.0 % | 170.0 |" in text


def test_without_presets_none_are_mentioned():
    text = written(EXPERIMENT, made_up(rows((1,))))
    assert "best of" not in text
    assert "several plans" not in text
    assert "Made for a single subject" not in text
