# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans that allow for an error of the surface's depth."""

import numpy as np
import pytest

from focus_planner import (
    InputError,
    Lens,
    PlanRequest,
    plan_focus,
)
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.quality import estimate_quality
from testing import reference
from testing.plans import RIG, SCENE


def test_a_tolerance_shrinks_what_is_in_focus():
    plans = [
        plan_focus(SCENE, RIG, PlanRequest(samples=500, depth_tolerance=t))
        for t in (0.0, 0.005, 0.01, 0.02)
    ]
    assert [plan.depth_tolerance for plan in plans] == [0.0, 0.005, 0.01, 0.02]
    assert np.diff([plan.cost for plan in plans]).min() > 0
    in_focus = [sum(camera.in_focus_samples for camera in plan.cameras) for plan in plans]
    assert np.diff(in_focus).max() < 0
    # And of what one plan has in focus on fresh samples less counts.
    focus = plans[0].focus_distances
    fresh = [
        estimate_quality(formulate_problem(SCENE, RIG, request, fresh=True), focus)
        for request in (PlanRequest(depth_tolerance=t) for t in (0.0, 0.005, 0.01, 0.02))
    ]
    assert fresh[0].in_focus_area.value == plans[0].in_focus_area
    assert np.diff([quality.in_focus_area.value for quality in fresh]).max() < 0
    assert len({quality.covered_area for quality in fresh}) == 1
    # A plan made with it is in focus wherever the surface is within it: every sample's depth may
    # move as far.
    sure = plans[2]
    problem, focus = sure.problem, sure.focus_distances
    chosen = focus[problem.camera_index]
    counted = (problem.focus_near <= chosen) & (chosen <= problem.focus_far)
    for depth, s in zip(problem.depth[counted], chosen[counted], strict=True):
        assert reference.in_focus(depth - 0.01, s, Lens())
        assert reference.in_focus(depth + 0.01, s, Lens())


def test_a_tolerance_beyond_every_depth_of_field_is_an_error():
    with pytest.raises(InputError, match=r"depth_tolerance: expected .*, got 0.5, with which noth"):
        plan_focus(SCENE, RIG, PlanRequest(samples=300, depth_tolerance=0.5))
