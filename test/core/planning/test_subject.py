# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A plan and what it was made for: other methods' plans, and samples to judge by."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subject import PlannedSubject, requested
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from testing.plans import RIG, SCENE, without_seconds

REQUEST = PlanRequest("em", 120, 3, shots=2, depth_tolerance=0.002, fresh_samples=80, bound="tight")
MODEL = CostModel(focus_weight=0.2)


def subject_of(request: PlanRequest, scene: Scene = SCENE) -> PlannedSubject:
    return PlannedSubject(scene, RIG, request, plan_focus(scene, RIG, request, MODEL), MODEL)


def cloud() -> Scene:
    samples = SCENE.sample(700, 3)
    return Scene(PointCloud(samples.points, samples.normals))


def test_another_method_is_asked_the_same() -> None:
    subject = subject_of(REQUEST)
    hurried = replace(subject, request=replace(REQUEST, time_budget=1e-9))
    expected = plan_focus(SCENE, RIG, replace(REQUEST, method="average", bound="none"), MODEL)
    for each in (subject, hurried):
        assert without_seconds(each.with_method("average")) == without_seconds(expected)


@pytest.mark.parametrize("samples", [120, 0], ids=["told", "by standard error"])
def test_fresh_samples_are_as_many_as_asked_for_and_none_was_planned_on(samples: int) -> None:
    subject = subject_of(replace(REQUEST, samples=samples, standard_error=8.0))
    fresh = subject.fresh_problem(500)
    assert fresh.sample_count == 500
    assert (fresh.shots, fresh.focus_weight) == (2, 0.2)
    assert np.ptp(fresh.samples.areas) == 0
    planned = {tuple(point) for point in subject.plan.problem.samples.points}
    assert not planned & {tuple(point) for point in fresh.samples.points}


@pytest.mark.parametrize("scene", [SCENE, cloud()], ids=lambda scene: type(scene.surface).__name__)
def test_a_plan_tells_most_of_its_request(scene: Scene) -> None:
    asked = replace(REQUEST, samples=0) if scene is not SCENE else REQUEST
    told = requested(subject_of(asked, scene).plan, scene)
    assert told == replace(asked, bound="quick")
    assert told.time_budget == math.inf


def test_a_plan_of_no_known_method_has_no_request() -> None:
    plan = replace(subject_of(REQUEST).plan, method="later")
    with pytest.raises(InputError, match="method: expected one of closest"):
        requested(plan, SCENE)
