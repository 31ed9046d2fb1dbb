# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import itertools
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import InputError, PlanRequest, Scene, Subject, plan_focus, plan_presets
from testing.plans import RIG, SCENE, without_seconds
from testing.problems import sphere

REQUEST = PlanRequest(samples=200, fresh_samples=200, bound="none")
# Two sizes, two of each: whoever shares a plan is told by the size.
SUBJECTS = (
    Subject(SCENE, "large"),
    Subject(Scene(sphere(0.14)), "small"),
    Subject(Scene(sphere(0.56)), "as large"),
    Subject(Scene(sphere(0.15)), "as small"),
)


def least_cost(presets):
    """The least cost of plans for every way to share them, each made on its own."""
    best = np.inf
    for taken in itertools.product(range(presets), repeat=len(SUBJECTS)):
        groups = [
            [s for s, takes in zip(SUBJECTS, taken, strict=True) if takes == number]
            for number in range(presets)
        ]
        if all(groups):
            costs = [len(group) * plan_focus(group, RIG, REQUEST).cost for group in groups]
            best = min(best, sum(costs) / len(SUBJECTS))
    return best


def test_presets_are_shared_as_well_as_trying_every_way():
    made = plan_presets(SUBJECTS, RIG, 2, REQUEST)
    assert made.cost == pytest.approx(least_cost(2), rel=5e-3)
    assert made.cost < 0.99 * plan_focus(SUBJECTS, RIG, REQUEST).cost


@pytest.mark.parametrize("method", ["closest", "em", "k_view"])
def test_more_presets_are_never_worse(method):
    request = replace(REQUEST, method=method)
    costs = [plan_presets(SUBJECTS, RIG, count, request).cost for count in (1, 2, 3, 4)]
    assert all(more <= fewer + 1e-9 for fewer, more in itertools.pairwise(costs))
    assert costs[0] <= plan_focus(SUBJECTS, RIG, request).cost + 1e-9


def test_every_subject_takes_a_preset_that_names_it():
    made = plan_presets(SUBJECTS, RIG, 3, REQUEST)
    assert len(made.plans) == 3
    assert made.subjects == ("large", "small", "as large", "as small")
    assert set(made.taken) == {1, 2, 3}
    told = {each.surface: each.preset for plan in made.plans for each in plan.subjects}
    assert told == dict(zip(made.subjects, made.taken, strict=True))
    costs = {each.surface: each.cost for plan in made.plans for each in plan.subjects}
    assert made.cost == pytest.approx(np.mean(list(costs.values())))


def test_as_many_presets_as_subjects_of_one_kind_are_made_as_well():
    twins = [Subject(SCENE, "one"), Subject(SCENE, "other")]
    made = plan_presets(twins, RIG, 2, REQUEST)
    assert sorted(made.taken) == [1, 2]


def test_presets_repeat_bit_for_bit():
    first, second = (plan_presets(SUBJECTS, RIG, 2, REQUEST) for _ in range(2))
    assert first.taken == second.taken
    for one, other in zip(first.plans, second.plans, strict=True):
        assert without_seconds(one) == without_seconds(other)


@pytest.mark.parametrize(
    ("presets", "request_", "message"),
    [
        (0, REQUEST, "presets: expected a whole number of at least 1, got 0"),
        (5, REQUEST, "presets: expected at most 4, one per subject, got 5"),
        (2, replace(REQUEST, worst=True), "presets: expected plans for the mean .* got worst"),
    ],
)
def test_presets_that_cannot_be_made_are_refused(presets, request_, message):
    with pytest.raises(InputError, match=message):
        plan_presets(SUBJECTS, RIG, presets, request_)
