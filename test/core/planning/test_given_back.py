# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""What a plan was made on is given back with it, not when garbage is next looked for.

A large plan's problems are some 200 MB, and Python may not look for garbage before many more plans.
"""

from __future__ import annotations

import gc
import weakref

import pytest

from focus_planner.core.planning import many_subjects, solving
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.scene import Scene
from testing.problems import box

RIG = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)


@pytest.fixture(params=["small", "large"])
def size(request, monkeypatch):
    """Have plans made as small ones are, and as large ones."""
    if request.param == "large":
        monkeypatch.setattr(solving, "_LARGE", 0)
        monkeypatch.setattr(many_subjects, "_SMALL", 0)


@pytest.fixture
def problems(monkeypatch):
    """Return what refers to every problem from now on, while Python looks for no garbage."""
    made, begin = [], Problem.__init__

    def noted(problem, *arguments, **named):
        begin(problem, *arguments, **named)
        made.append(weakref.ref(problem))

    monkeypatch.setattr(Problem, "__init__", noted)
    gc.disable()
    yield made
    gc.enable()


def are_gone(references):
    return all(each() is None for each in references)


def scene(size=0.3):
    return Scene(box((0.3, size, 0.3)))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("more", [{}, {"shots": 2}, {"images": 6}, {"time_budget": 60.0}])
def test_of_every_method(size, problems, method, more):
    request = PlanRequest(method, 300, **more)
    one = scene()
    kept = weakref.ref(one)
    plan_focus(one, RIG, request)
    del one
    assert are_gone([kept, *problems])
    assert len(problems) >= 2


@pytest.mark.parametrize("worst", [False, True])
def test_of_several_subjects(size, problems, worst):
    subjects = [Subject(scene(), "one"), Subject(scene(0.2), "two")]
    kept = [weakref.ref(each.scene) for each in subjects]
    plan_focus(subjects, RIG, PlanRequest(samples=300, worst=worst))
    del subjects
    assert are_gone([*kept, *problems])
    assert len(problems) >= 4


def test_of_one_that_was_stopped(size, problems):
    one = scene()
    kept = weakref.ref(one)
    plan_focus(one, RIG, PlanRequest(samples=300), on_progress=lambda p: p.stage != "k_view")
    del one
    assert are_gone([kept, *problems])
    assert len(problems) >= 2
