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
from focus_planner.core.problem.problem import with_depth_tolerance
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


def test_the_note_tells_what_is_in_focus_with_the_tolerance_and_without():
    request = PlanRequest(samples=500, depth_tolerance=0.0125)
    plan = plan_focus(SCENE, RIG, request)
    (note,) = (note for note in plan.notes if note.code == "tolerance")
    # By definition, pair by pair, of the fresh samples that the plan is judged on.
    shares = []
    for tolerance in (0.0125, 0.0):
        problem = formulate_problem(
            SCENE, RIG, PlanRequest(samples=500, depth_tolerance=tolerance), fresh=True
        )
        held = 0.0
        for sample, area in enumerate(problem.samples.areas):
            pairs = range(*problem.sample_offsets[sample : sample + 2])
            chosen = [
                (
                    problem.base_cost[p] + (0.0 if sharp else problem.focus_weight),
                    problem.camera_index[p],
                    sharp,
                )
                for p in pairs
                for s in [plan.focus_distances[problem.camera_index[p]]]
                for sharp in [reference.holds(problem.depth[p], s, Lens(), tolerance)]
            ]
            held += area * (bool(chosen) and min(chosen)[2])
        shares.append(held / problem.samples.areas.sum())
    assert shares[0] < shares[1]
    assert note.text.startswith(
        f"12.5 mm are allowed for errors of depth: {shares[0]:.1%} of the surface stays in focus"
        f" with them, {shares[1]:.1%} is in focus if depths are as planned; allowing for more than"
        " about half of their standard error costs more coverage than it saves"
    )
    assert plan.summary().endswith("see its notes: tolerance")
    without = plan_focus(SCENE, RIG, PlanRequest(samples=500))
    assert "tolerance" not in {each.code for each in without.notes}


@pytest.mark.parametrize("tolerance", [0.0, 0.003, 0.02])
def test_another_tolerance_makes_the_problem_that_is_formulated_with_it(tolerance):
    given, other = (
        formulate_problem(SCENE, RIG, PlanRequest(samples=300, shots=2, depth_tolerance=t))
        for t in (0.01, tolerance)
    )
    changed = with_depth_tolerance(given, tolerance)
    np.testing.assert_array_equal(changed.focus_near, other.focus_near)
    np.testing.assert_array_equal(changed.focus_far, other.focus_far)
    assert (changed.shots, len(changed.depth)) == (other.shots, len(other.depth))


def test_a_tolerance_beyond_every_depth_of_field_is_an_error():
    with pytest.raises(InputError, match=r"depth_tolerance: expected .*, got 0.5, with which noth"):
        plan_focus(SCENE, RIG, PlanRequest(samples=300, depth_tolerance=0.5))
