# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a plan may take, and what is said of one that takes more."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from testing.problems import sphere

RIG = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
SCENE = Scene(sphere(0.3))
REQUEST = PlanRequest(method="em", samples=1000, fresh_samples=1000)


def refusal(limits, request=REQUEST, scene=SCENE):
    with pytest.raises(InputError) as refused:
        plan_focus(scene, RIG, request, limits=limits)
    return str(refused.value)


def test_a_problem_that_is_too_large_is_refused_with_what_would_fit():
    told = refusal(ResourceLimits(max_problem_size=11_999))
    assert told == (
        "samples: expected at most 999 for 12 cameras (parameter max_problem_size, 11,999), got"
        " 1,000; take fewer, or raise the parameter"
    )
    plan_focus(SCENE, RIG, REQUEST, limits=ResourceLimits(max_problem_size=12_000))


def test_shots_count():
    told = refusal(ResourceLimits(max_problem_size=12_000), replace(REQUEST, shots=3))
    assert "at most 333 for 3 shots of 12 cameras" in told


def test_fresh_samples_count():
    told = refusal(ResourceLimits(max_problem_size=12_000), replace(REQUEST, fresh_samples=1001))
    assert told.startswith("fresh_samples: expected at most 1,000 for 12 cameras")


def test_a_clouds_own_points_count():
    cloud = Scene(PointCloud(sphere(0.3, subdivisions=3).vertices))
    told = refusal(ResourceLimits(max_problem_size=12), replace(REQUEST, samples=0), cloud)
    assert re.search(r"at most 1 for 12 cameras .*, got [\d,]{3,}; take fewer", told)


@pytest.mark.parametrize("method", ["closest", "em", "k_view", "optimal"])
@pytest.mark.parametrize("shots", [1, 4])
def test_what_would_take_too_much_memory_is_refused_and_what_would_fit_fits(method, shots):
    request = replace(REQUEST, method=method, shots=shots)
    limits = ResourceLimits(max_memory=100_000 * shots)
    told = refusal(limits, request)
    fits = int(re.search(r"samples: expected at most ([\d,]+) for", told)[1].replace(",", ""))
    assert f"for method {method} and" in told
    assert "(parameter max_memory, " in told
    assert 0 < fits < request.samples
    assert plan_focus(SCENE, RIG, replace(request, samples=fits), limits=limits).samples == fits
    more = replace(request, samples=int(1.3 * fits))
    assert "max_memory" in refusal(limits, more)


def test_memory_is_estimated_before_rays_are_cast_for_all_samples():
    asked = []
    with pytest.raises(InputError, match="max_memory"):
        plan_focus(
            SCENE,
            RIG,
            REQUEST,
            None,
            lambda progress: asked.append(progress.stage) or True,
            limits=ResourceLimits(max_memory=10_000),
        )
    assert set(asked) <= {"fresh"}


def test_without_limits_anything_goes():
    problem = formulate_problem(SCENE, RIG, REQUEST)
    ResourceLimits().check_size(REQUEST, 10**12, 10**6)
    ResourceLimits().check_memory(REQUEST, problem, 10**15)
