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

from focus_planner import Scene
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.solvers import closest
from focus_planner.evaluation.experiments.geometry import EXPERIMENT
from focus_planner.evaluation.measuring.wrong_geometry import noisy, with_position_error
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    ellipsoids,
    made_up,
    run,
    written,
)

ERRORS = ("depth", "holes", "positions", "rotations", "moved", "leaning")
METHODS = ("closest", "average", "EM", "2-view, all samples")


@pytest.mark.parametrize("wrong", ["depth", "positions"])
def test_plans_on_what_is_wrong_are_judged_on_what_is_true(wrong):
    (subject,) = ellipsoids(count=1).values()
    rows = run(EXPERIMENT, {"body_0": subject}, wanted=lambda s: s["wrong"] == wrong).rows
    row = rows[(rows["size"] == 20) & (rows.repetition == 1) & (rows.method == "closest")].iloc[0]
    random = np.random.default_rng([3, 1, ERRORS.index(wrong)])
    scene, rig = subject.scene, subject.rig
    if wrong == "depth":
        scene = Scene(noisy(scene, 0.02, random))
    else:
        rig = with_position_error(rig, 0.02, random)
    asked = PlanRequest(samples=150, seed=4, fresh_samples=400)
    focus = closest.solve(formulate_problem(scene, rig, asked)).focus_distances
    true = replace(asked, seed=3)
    fresh = formulate_problem(subject.scene, subject.rig, true, fresh=True)
    costs, best = fresh.evaluate(focus)
    assert row.fresh_cost == pytest.approx(1000 * costs.mean())
    assert row.in_focus == pytest.approx(fresh.in_focus(focus, best).mean())


def test_every_error_is_measured_at_every_size():
    results = run(EXPERIMENT, ellipsoids(), replace(CONDITIONS, samples=60, judged=100))
    counts = results.rows.groupby("wrong").size()
    assert counts["nothing"] == 2 * 2 * 4  # subjects, repetitions, methods
    assert counts[list(ERRORS)].tolist() == [16 * sizes for sizes in (5, 4, 5, 5, 4, 4)]
    text = written(EXPERIMENT, results)
    assert "2 subjects" in text
    assert "subject leaning, at the top" in text


def test_rows_do_not_depend_on_threads():
    assert_same_for_any_threads(EXPERIMENT, lambda setting: setting["wrong"] == "holes")


def rows(losses, subjects=("a",)):
    """Rows in which 2-view loses so much at the least and at the largest size of each error."""
    sizes = {"depth": (1, 20), "moved": (5, 50)}
    for subject in subjects:
        for wrong, size, loss in [
            ("nothing", 0, 0.0),
            *((wrong, size, losses[i]) for wrong, of in sizes.items() for i, size in enumerate(of)),
        ]:
            for method, share in zip(METHODS, (0.5, 0.6, 0.7, 0.8 - loss), strict=True):
                yield {
                    "subject": subject,
                    "wrong": wrong,
                    "size": float(size),
                    "repetition": 0,
                    "method": method,
                    "fresh_cost": 300 + 100 * loss,
                    "in_focus": share,
                }


def test_what_is_written_are_the_losses():
    text = written(EXPERIMENT, made_up(rows((0.01, 0.25))))
    assert "plans for 1 subject were" in text
    assert "holds 80.0 % of the surface in focus at a cost of 300.0" in text
    assert "depth noise, 1.0 and 1.0 (σ = 1 mm) to 25.0 and 25.0 (σ = 20 mm)" in text
    assert "subject moved, 1.0 and 1.0 (5 mm) to 25.0 and 25.0 (50 mm)" in text
    assert "2-view on wrong geometry still holds more" in text
    assert "| subject moved | 50 mm | 50.0 % | 60.0 % | 70.0 % | 55.0 % |" in text


def test_it_is_told_where_autofocus_holds_more():
    text = written(EXPERIMENT, made_up(rows((0.0, 0.4), ("a", "b"))))
    assert "plans for 2 subjects were" in text
    assert (
        "It holds more than 2-view from depth noise of σ = 20 mm, subject moved of 50 mm on" in text
    )
