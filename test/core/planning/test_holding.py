# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Lenses that stay where they are, beside a slow and obvious rule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Lens, PlanRequest, Scene, plan_focus
from focus_planner.core.planning.holding import Held, held_distances
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.problem.problem import mean_cost
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.lens_table import LensTable
from testing.problems import around, random_problem, torus

RIG = around(8, 1.0)
BEFORE = plan_focus(Scene(torus(0.4, 0.15)), RIG, PlanRequest(samples=400))
MOVED = Scene(replace(torus(0.4, 0.15), vertices=torus(0.4, 0.15).vertices + [0.01, 0.0, 0.0]))


def slowly_held(problem, focus, before, min_change):
    """The same, lens by lens, by the limits of the depth of field."""
    found = []
    for lens, now, was in zip(problem.lenses, focus, before, strict=True):
        h, f = lens.hyperfocal_distance, lens.focal_length
        near_dioptres = (h + was - f) / (h * was)
        far_dioptres = max((h - was + f) / (h * was), 0.0)
        depth = near_dioptres - far_dioptres
        found.append(was if abs(1 / now - 1 / was) <= min_change * depth else now)
    return np.array(found)


def a_problem(seed, lens=None, shots=1):
    problem = random_problem(np.random.default_rng(seed), cameras=12)
    if lens is not None:
        problem = replace(problem, lenses=(lens,) * problem.camera_count)
    return with_shots(problem, shots)


def distances(problem, seed):
    """Two distances of each camera, from nearly the same to far apart, some beyond hyperfocal."""
    random = np.random.default_rng(seed)
    before = np.exp(random.uniform(np.log(0.3), np.log(30.0), problem.camera_count))
    return before, before * np.exp(random.normal(scale=0.05, size=problem.camera_count))


def warm(problem, before):
    return WarmStart(problem.names, before, problem.samples.points, None)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("min_change", [0.01, 0.25, 1.0])
def test_lenses_stay_as_the_limits_of_their_depth_of_field_say(seed, min_change):
    problem = a_problem(seed, Lens())
    before, now = distances(problem, seed)
    found = held_distances(problem, now, Held(warm(problem, before), min_change))
    np.testing.assert_array_equal(found, slowly_held(problem, now, before, min_change))


def test_some_stay_and_some_move_in_that_test():
    problem = a_problem(0, Lens())
    before, now = distances(problem, 0)
    found = held_distances(problem, now, Held(warm(problem, before), 0.25))
    assert 0 < np.count_nonzero(found == before) < len(found)


@pytest.mark.parametrize("held", [Held(), Held(None, 0.5)])
def test_without_a_plan_before_all_move(held):
    problem = a_problem(1)
    focus = np.full(problem.camera_count, 0.7)
    assert held_distances(problem, focus, held) is focus


def test_new_cameras_move():
    problem = a_problem(2, Lens())
    before = np.full(problem.camera_count, 0.7)
    start = warm(problem, before)
    start = replace(start, names=("new", *start.names[1:]))
    found = held_distances(problem, before + 1e-6, Held(start, 0.5))
    assert found[0] == 0.7 + 1e-6
    assert (found[1:] == 0.7).all()


def test_other_numbers_of_shots_move_all():
    problem = a_problem(3, Lens(), shots=2)
    start = warm(a_problem(3, Lens()), np.full(12, 0.7))
    focus = np.full(problem.camera_count, 0.7 + 1e-6)
    np.testing.assert_array_equal(held_distances(problem, focus, Held(start, 0.5)), focus)


def test_shots_stay_ascending():
    problem = a_problem(4, Lens(), shots=2)
    before = np.tile([0.70, 0.71], 12)
    now = np.tile([0.715, 0.716], 12)  # the first moves beyond the second, which stays
    change = slowly_held(problem, now, before, 0.2)
    found = held_distances(problem, now, Held(warm(problem, before), 0.2))
    np.testing.assert_array_equal(found, np.sort(change.reshape(-1, 2), axis=1).ravel())


@pytest.mark.parametrize("now", [[-np.inf, 0.7], [0.7, -np.inf]])
def test_pictures_that_are_not_taken_stay_so(now):
    problem = a_problem(5, Lens(), shots=2)
    before = np.tile([0.7, -np.inf], 12)
    focus = np.sort(np.tile(now, 12).reshape(-1, 2), axis=1)[:, ::-1].ravel()
    found = held_distances(problem, focus, Held(warm(problem, before), 0.5))
    np.testing.assert_array_equal(found, focus)


@pytest.mark.parametrize(
    "lens",
    [
        Lens(min_focus=0.71),
        Lens(max_focus=0.69),
        Lens(focus_distances=(0.5, 0.71, 0.9)),
        Lens(table=LensTable("steps", False, (0.71, 2.0), (0.0, 100.0))),
    ],
)
def test_no_lens_stays_where_it_cannot_be_set_to(lens):
    problem = a_problem(6, lens)
    now = np.full(problem.camera_count, 0.71 if lens.max_focus > 0.7 else 0.69)
    held = Held(warm(problem, np.full(problem.camera_count, 0.7)), 1.0)
    np.testing.assert_array_equal(held_distances(problem, now, held), now)


# --- whole plans ---------------------------------------------------------------------------------


def planned(min_change, **request):
    request = PlanRequest(samples=400, **request)
    return plan_focus(MOVED, RIG, request, warm_start=BEFORE.warm_start, min_change=min_change)


def test_a_plan_is_told_of_where_its_lenses_are():
    moved, held = planned(0.0), planned(0.5)
    stay = held.focus_distances == BEFORE.focus_distances
    assert np.count_nonzero(stay) > np.count_nonzero(
        moved.focus_distances == BEFORE.focus_distances
    )
    costs, _ = held.problem.evaluate(held.focus_distances)
    assert held.cost == mean_cost(held.problem.samples.weights, costs)
    assert [note.code for note in held.notes if note.code == "held"] == ["held"]
    assert "at most 50 % of their depth of field" in held.notes[-1].text
    assert held.lower_bound <= held.cost


def test_all_lenses_stay_or_none_does():
    assert not any(note.code == "held" for note in planned(0.0).notes)
    for_all = planned(1e9)
    np.testing.assert_array_equal(for_all.focus_distances, BEFORE.focus_distances)


def test_a_proof_of_the_best_is_none_of_a_plan_in_which_lenses_stay():
    best = planned(0.0, method="optimal")
    held = planned(1e9, method="optimal")
    assert best.converged
    assert held.cost > best.cost
    assert not held.converged
    assert held.lower_bound == pytest.approx(best.lower_bound)
