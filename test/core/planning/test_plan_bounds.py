# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lower bounds that come with plans."""

import pytest

from focus_planner import (
    PlanRequest,
    Scene,
    cylinder_rig,
    plan_focus,
)
from focus_planner.core.planning.request import METHODS
from testing.problems import (
    body,
)

each_method = pytest.mark.parametrize("method", METHODS)


@each_method
def test_every_plan_may_have_a_bound(method):
    scene, rig = Scene(body("arms_out")), cylinder_rig(4, 9)
    optimum = plan_focus(scene, rig, PlanRequest("optimal", 500))
    assert optimum.converged
    plans = {
        bound: plan_focus(scene, rig, PlanRequest(method, 500, bound=bound))
        for bound in ("none", "quick", "tight")
    }
    assert len({plan.cameras for plan in plans.values()}) == 1
    if method != "optimal":
        assert plans["none"].lower_bound is plans["none"].gap is plans["none"].prices is None
        assert plans["quick"].lower_bound < plans["tight"].lower_bound
        del plans["none"]
    for plan in plans.values():
        assert 0.99 * optimum.cost < plan.lower_bound <= optimum.cost <= plan.cost
        assert plan.gap == (plan.cost - plan.lower_bound) / plan.cost
        assert plan.prices.shape == (500,)
        assert plan.converged
    assert plans["tight"].lower_bound > 0.997 * optimum.cost


def test_a_gap_is_near_enough():
    scene, rig = Scene(body("arms_out")), cylinder_rig(4, 9)
    steps = []
    for gap in (1e-6, 1e-3, 0.05, 1.0):
        heard = []
        request = PlanRequest("optimal", 500, gap=gap)
        plan = plan_focus(
            scene, rig, request, on_progress=lambda p, heard=heard: not heard.append(p)
        )
        assert plan.converged
        assert plan.gap <= gap + 1e-9
        steps.append(len(heard))
        loose = plan_focus(scene, rig, PlanRequest("em", 500, bound="tight", gap=gap))
        assert loose.lower_bound <= plan.cost
    assert steps == sorted(steps, reverse=True)
    assert steps[0] > steps[-1]


def test_bounds_of_poor_plans_aim_at_a_good_one():
    # Aiming at the plan's own cost, 40 % above the best, as many steps end 3 % lower.
    scene, rig = Scene(body("arms_out")), cylinder_rig()
    poor, good = (plan_focus(scene, rig, PlanRequest(m, 1000)) for m in ("closest", "em"))
    assert poor.cost > 1.2 * good.cost
    assert poor.lower_bound == pytest.approx(good.lower_bound, rel=0.005)
